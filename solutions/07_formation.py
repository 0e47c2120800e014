# %% [markdown]
# # Lab 7 · A formation in a frame of its own
#
# *About 100 minutes. Needs your `GroupEKF` of lab 6: save that notebook first.*
#
# Three robots drive in a triangle through an empty hall, and turn two corners. None of them knows where it is in the hall: all they have is the common frame that your filter of lab 6 keeps. It is F. E. Schneider's and D. Wildermuth's (*the paper*'s) figure 7.
#
# **By the end you can**
# - steer robots in a formation by forces, in the frame that they built themselves;
# - say why a formation needs no more than relative poses;
# - say what a cloud of particles adds to a Kalman filter, and what it costs.
#
# **You will write** `force`.

# %% [markdown]
# ## Symbols
#
# | symbol | in the code | shape | unit | what it is |
# |---|---|---|---|---|
# | $me$ | `me` | (2,) | m | where a follower believes to be, in the common frame |
# | $slot$ | `slot` | (2,) | m | where it should be: a place that goes along with the leader |
# | $v_{slot}$ | `velocity` | (2,) | m/s | how the slot moves |
# | $f$ | – | (2,) | m/s | the velocity that the follower should have |
# | $\rho$ | `rho` | number | m | distance to another robot |
# | $k_a, k_r, \rho_0$ | `k_a`, `k_r`, `rho_0` | numbers | 1/s, m⁴/s, m | how strongly the slot pulls, how strongly others push, and from where on |

# %% id="setup" tags=["setup"]
import time

import matplotlib.pyplot as plt
import numpy as np

from labkit import check, load_answer, replay
from labkit.team import TeamNoise, frame_errors, near, play, scenarios, started
from labkit.team.formation import CROSSING, WAY, run, triangle
from labkit.team.particles import TeamParticles
from labkit.team.plots import draw_errors, draw_formation

GroupEKF = load_answer("06_observers", "GroupEKF")  # your filter of lab 6
noise = TeamNoise()

# %% [markdown]
# ## 1. A formation
#
# A leader and two followers, in a triangle: each follower has a *slot* 1.1 m behind the leader and 0.9 m to its side. No robot knows where it is in the hall; they use your filter's frame only (figure 7). A follower at `me` is driven by forces (a *potential field*):
#
# $$ f = v_{slot} + k_a\,(slot - me) + \sum_{others\ with\ \rho < \rho_0} k_r \left(\frac1\rho - \frac1{\rho_0}\right) \frac{1}{\rho^2}\, e, \qquad e = \frac{me - other}{\rho}, $$
#
# with ρ the distance to the other robot: along with the slot, towards it, and away from who comes nearer than $\rho_0$. (It is called a force by tradition; here it is the velocity that the follower should have.)
#
# ### Exercise 1 · `force(me, slot, velocity, others)`
# Return $f$ (2,), with $k_a$ = 0.9, $k_r$ = 0.5, $\rho_0$ = 1.4 m: a little less than the 1.42 m from the leader to a slot. `others` is (m, 2).


# %% id="answer-force" tags=["answer"]
def force(me, slot, velocity, others, k_a=0.9, k_r=0.5, rho_0=1.4):
    """Wanted velocity (2,) [m/s] of a follower at me (2,), whose slot (2,) moves."""
    ### BEGIN SOLUTION
    F = velocity + k_a * (slot - me)
    for other in others:
        rho = np.linalg.norm(me - other)
        if rho < rho_0:
            F = F + k_r * (1 / rho - 1 / rho_0) / rho**2 * (me - other) / rho
    return F
    ### END SOLUTION


# %% id="check-force" tags=["check"] points=2 title="force"
check("team-force", force)


# %%
def formation(seed, push=None, **options):
    """A run of the triangle through two corners, controlled by what the filter believes."""
    team = triangle(rng=seed, **options)
    kf = GroupEKF(*near(team.poses, seed), noise, inflate=10.0)
    return run(team, kf, push or force, WAY)


one = formation(1)
fig, axes = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
draw_formation(
    axes[0],
    one,
    [0, 40, 90, 130, 200, len(one.log)],
    "figure 7: a triangle through two corners",
)
axes[0].legend(fontsize=8, frameon=False)
slots_missed = {"largest distance from a slot": one.error}
draw_errors(axes[1], one.log.times, slots_missed, limit=60, of="followers")
plt.show()
again = one.recoveries().round(1)
print(f"formed after {one.formed:.1f} s, after the corners again in {again} s")
print(f"between: {100 * one.rms:.1f} cm; never nearer than {one.least:.2f} m to each other")

# %% [markdown]
# The followers' loops at the corners are no mistake: when the leader turns, the inner slot swings backwards, and a robot on wheels has to turn round to follow it. (The filter is told ten times the white noise here: all robots drive all the time, and what is systematic in their odometry adds up.)
#
# Where does repulsion matter? Let each follower start on the other's side, with the push and without.


# %%
def blind(me, slot, velocity, others):
    return force(me, slot, velocity, others, k_r=0.0)


for name, push in (("with repulsion", force), ("without", blind)):
    one = formation(1, push, start=CROSSING)
    print(f"{name:14s} formed after {one.formed:4.1f} s, nearest {one.least:.2f} m")

# %% [markdown]
# The push keeps them apart, and costs time.
#
# In motion: circles are the slots, crosses what the filter believes, laid on the truth. Compare its ellipses (3σ) with the distances that it tells.

# %%
play(formation(1))

# %% [markdown]
# ### Question C
# The formation holds to a few centimetres, although the 3σ ellipses say that each robot may be off by half a metre in the hall. Why does that not matter here? And what would happen with odometry alone?

# %% [markdown] id="answer-formation" tags=["answer"] points=2 title="Question C: the formation"
# ### BEGIN SOLUTION
# Slots are relative to the leader, and so are the errors that count: all poses share the error of the frame, and in a difference of two it drops out. The readings between the robots keep the *relative* poses at centimetres for ever.
#
# With odometry alone each robot has its own drift; the relative poses get worse with every metre, and after some corners the followers are half a metre off their slots, or hit the leader.
# ### END SOLUTION

# %% [markdown] id="rubric-formation" tags=["hidden"]
# **Question C, 2 points.**
# - 1 point: only relative poses matter; the common error drops out.
# - 1 point: odometry alone: drifts differ, the relative error grows without end.

# %% [markdown]
# ## 2. Particles
#
# Figure 8 of the paper tries a particle filter. The kit's `TeamParticles` guesses the pose of robot 0 many times, and for each guess has a small EKF for each observer. The left picture shows what it believes of two observers after a few seconds:
# each cloud is long across the line of sight and thin along it: an observer may stand anywhere on an arc round robot 0, for its own heading is uncertain too, but the laser knows how far away it is.
#
# **Before you run it:** will it be more accurate than your filter? How much will it cost?

# %% tags=["nbval-ignore-output"]
log = scenarios.cross(rng=1)
kf = started(GroupEKF, log, 1)
pf = TeamParticles(300, kf.x, kf.P, noise, rng=1)
unsure = kf.P + np.diag([0, 0, 0, *2 * [0.5, 0.5, 0.03]])  # of the observers only
early = TeamParticles(300, kf.x, unsure, noise, rng=1)
for u, seen in list(zip(log.controls, log.measurements()))[:20]:
    early.predict(u)
    early.update(seen)

fig, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
for i, color in ((1, "#D55E00"), (2, "#009E73")):
    axes[0].plot(*early.draws(i)[:, :2].T, ".", ms=3, color=color, label=f"observer {i}")
axes[0].plot(*early.particles[:, :2].T, ".", ms=3, color="#0072B2", label="robot 0")
axes[0].set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
axes[0].set_title("figure 8: after 4 s", fontsize=11)
axes[0].legend(fontsize=8, frameon=False)
errors = {}
for name, one in (("your filter", kf), ("300 particles", pf)):
    start = time.perf_counter()
    errors[name] = frame_errors(replay(one, log).x, log.truth).ego
    cost = 1e3 * (time.perf_counter() - start) / len(log)
    print(f"{name:14s} {100 * errors[name].mean():.1f} cm (ego), {cost:.2f} ms a step")
draw_errors(axes[1], log.times, errors, limit=10)
plt.show()

# %% [markdown]
# The same accuracy for three times the cost: here everything is as good as Gaussian, and a cloud has nothing to add. It would where the start is open to doubt.

# %% [markdown] tags=["hidden"]
# ## Graded checks
#
# They stand only in this copy. When a class is graded, each runs with numbers drawn for each student.

# %% id="setup-exam" tags=["setup", "hidden"]
from labkit.instructor.exam.exam import Exam

exam = Exam("07_formation")
check = exam.check

# %% id="grade-force" tags=["hidden"] points=2 title="force: near and far from others"
rng = exam.rng()
exam.same(
    force,
    [(*rng.uniform(-1, 1, (3, 2)), rng.uniform(-1, 1, (k, 2))) for k in (0, 1, 2, 3, 4, 4)],
    "other places",
)
print("passed")

# %% [markdown]
# ## Summary
#
# - A formation lives in the common frame; that is enough.
#
# Save, and run `labkit check notebooks/07_formation.ipynb` in a terminal before you hand it in.
#
# ## References
# - F. E. Schneider, D. Wildermuth, on the use of relative positions in the navigation of groups of robots (in Russian), 2005: section 2.2 and figures 7 and 8.

# %% [markdown]
# # Lab 7 · A formation in a frame of its own
#
# *About 130 minutes. Needs your `GroupEKF` of lab 6: save that notebook first.*
#
# Three robots drive in a triangle through an empty hall and turn two corners. None of them knows where it is in the hall: all they have is the common frame that your filter of lab 6 keeps. It is figure 7 of *the paper* (F. E. Schneider and D. Wildermuth). Then you try what the paper left for later: shapes in which robots hide
# each other, robots that do not see each other for a long time, and filters with more than one guess.
#
# **By the end you can**
# - steer robots in a formation by forces, in the frame that they built themselves;
# - say why a formation needs no more than relative poses;
# - say what a joint filter does where one robot hides another;
# - keep several guesses at once, and say when that is worth its cost.
#
# **You will write** `slot_velocity`, `force`, `steer` and `weigh`.

# %% [markdown]
# ## Symbols
#
# | symbol | in the code | shape | unit | what it is |
# |---|---|---|---|---|
# | $me$ | `me` | (2,) | m | where a follower believes to be, in the common frame |
# | $slot$ | `slot` | (2,) | m | where it should be: a place that goes along with the leader |
# | $r$ | `arm` | (2,) | m | from the leader to the slot, in the common frame |
# | $v_L$, $\omega$ | `velocity`, `rate` | (2,), number | m/s, rad/s | velocity of the leader, and how fast the formation turns |
# | $v_{slot}$ | – | (2,) | m/s | velocity of the slot |
# | $f$ | – | (2,) | m/s | the velocity that the follower should have |
# | $\rho$, $e$ | `rho` | number, (2,) | m, – | distance to another robot, and the direction from there to me |
# | $k_a, k_r, \rho_0$ | `k_a`, `k_r`, `rho_0` | numbers | 1/s, m⁴/s, m | how strongly the slot pulls, how strongly others push, and from which distance on |
# | $w$ | `w` | (k,) | – | how probable each of k guesses is; their sum is 1 |
# | $m$ | `misfits` | (k,) | – | sum of the $d^2$ of lab 6 of all readings of a step (each counts 13.8 at most), for each guess |
#
# What a symbol means in other labs: [all symbols](../notebooks/glossary.md).

# %% id="setup" tags=["setup"]
import copy
import time

import matplotlib.pyplot as plt
import numpy as np

from labkit import check, load_answer, replay, reveal, wrap
from labkit.geometry import relative
from labkit.team import TeamNoise, frame_errors, near, play, scenarios, started
from labkit.team.bank import mirrored, run_bank
from labkit.team.formation import ABREAST, COLUMN, CROSSING, TRIANGLE, WAY, Rules, run, three
from labkit.team.particles import TeamParticles
from labkit.team.plots import draw_errors, draw_formation, draw_particles

GroupEKF = load_answer("06_observers", "GroupEKF")  # your filter of lab 6
noise = TeamNoise()

# %% [markdown]
# ## 1. A slot moves
#
# Each follower has a *slot*: a place 1.1 m behind the leader and 0.9 m to its side, say. When the leader drives straight ahead, the slot goes along. When the formation turns, the slot also swings around the leader, as the end of a clock's hand does:
#
# $$ v_{slot} = v_L + \omega \begin{bmatrix} -r_y \\ r_x \end{bmatrix} . $$
#
# ### Exercise 1 · `slot_velocity(arm, velocity, rate)`
# Return $v_{slot}$ (2,). *Example:* the leader stands and the formation turns to the left with 0.5 rad/s: a slot at `arm = (-1, 0)`, behind a leader that looks along x, moves with `(0, -0.5)`.
#
# **Before you go on:** the leader turns to the *right* on the spot. Which of two slots behind it swings backwards, the left one or the right one?


# %% id="answer-velocity" tags=["answer"]
def slot_velocity(arm, velocity, rate):
    """Velocity (2,) [m/s] of a slot at arm (2,); its leader has velocity (2,)."""
    ### BEGIN SOLUTION
    return velocity + rate * np.array([-arm[1], arm[0]])
    ### END SOLUTION


# %% id="check-velocity" tags=["check"] points=2 title="slot_velocity"
check("team-velocity", slot_velocity)

# %% [markdown]
# ## 2. Forces
#
# A follower at `me` is driven by forces (a *potential field*, as in the paper):
#
# $$ f = v_{slot} + k_a\,(slot - me) + \sum_{others\ with\ \rho < \rho_0} k_r \left(\frac1\rho - \frac1{\rho_0}\right) \frac{1}{\rho^2}\, e, \qquad e = \frac{me - other}{\rho}, $$
#
# with ρ the distance to the other robot: along with the slot, towards it, and away from who comes nearer than $\rho_0$. (It is called a force by tradition; here it is the velocity that the follower should have.)
#
# ### Exercise 2 · `force(me, slot, velocity, others)`
# Return $f$ (2,); `velocity` is that of the slot, `others` is (m, 2). The constants are given: $\rho_0$ = 1.4 m is a little less than the 1.42 m from the leader to a slot.
#
# *Example:* a follower in its slot that stands, with another robot 1 m ahead of it along x, gets `(-0.143, 0)`: it is pushed back.


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

# %% [markdown]
# ### Exercise 3 · `steer(pose, velocity)`
# A robot on wheels cannot go sideways. Let *off* be the wrapped angle from its heading to the direction of the wanted velocity, and *speed* the length of that velocity. Return the command, an array (forward velocity, turn rate):
# - forward: the smaller one of *speed* and 0.5 m/s, times cos(*off*), but 0 instead of anything backwards;
# - turn rate: 2 · *off*, but not beyond ±1.2 rad/s;
# - if *speed* is less than 0.01 m/s, the robot stands: both are 0.
#
# *Example:* a robot with heading 0 that should go with `(0, 0.3)` gets `(0, 1.2)`: it turns first.


# %% id="answer-steer" tags=["answer"]
def steer(pose, velocity):
    """Command (m/s, rad/s) of a robot at pose (3,) that should have velocity (2,)."""
    ### BEGIN SOLUTION
    speed = np.hypot(*velocity)
    if speed < 0.01:
        return np.zeros(2)
    off = wrap(np.arctan2(velocity[1], velocity[0]) - pose[2])
    return np.array([min(speed, 0.5) * max(np.cos(off), 0.0), np.clip(2 * off, -1.2, 1.2)])
    ### END SOLUTION


# %% id="check-steer" tags=["check"] points=2 title="steer"
check("team-steer", steer)

# %% [markdown]
# ## 3. Figure 7
#
# Now all together: your filter tells where everybody is, your three functions drive the followers. The leader drives to its way points, turns on the spot, and waits when a follower is far from its slot. The triangle *stands* when both followers are within 15 cm of their slots. *Between* is the root mean square distance of both from their slots, without the 9 s after the triangle first stands and after each corner (there the right picture has its peaks).

# %%
mine = Rules(slot_velocity, force, steer)


def drive(seed, rules=mine, shape=TRIANGLE, way=WAY, **options):
    """A run, by default through two corners, controlled by what your filter believes."""
    team = three(rng=seed, **options)
    kf = GroupEKF(*near(team.poses, seed), noise, inflate=10.0)
    return run(team, kf, rules, way, shape)


# %%
one = drive(1)
fig, axes = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
steps = [0, 40, 90, 130, 200, len(one.log)]
draw_formation(axes[0], one, steps, "figure 7: a triangle through two corners")
missed = {"largest distance from a slot": one.error}
draw_errors(axes[1], one.log.times, missed, limit=60, of="followers")
plt.show()
again = one.recoveries().round(1)
print(f"stands after {one.formed:.1f} s, after the corners again in {again} s")
print(f"between: {100 * one.rms:.1f} cm; never nearer than {one.least:.2f} m to each other")

# %% [markdown]
# The loops at the corners are no mistake: when the leader turns to the right, the slot on the right swings backwards, and a robot on wheels has to turn round to follow it; the other slot swings wide. (The filter is told ten times the white noise here: all robots drive all the time, and what is systematic in their odometry adds up.)
#
# In the paper's figure 7 a the leader first moves to the left, although its goal lies the other way. Perhaps the others push it: the last two lines below tell what `force` makes of a leader with two robots in front of it. (In our runs a slot farther away than 30 cm pulls no harder than one at 30 cm; so the goal of the last lines is 30 cm away.)
#
# **Before you run the next cell:** each follower starts on the other's side, so that they have to cross. What does the push change? (a) Nothing: they miss each other anyway. (b) It keeps them farther apart, and costs time. (c) It keeps them farther apart, and saves time. (Robots that come nearer than half a metre would touch; the simulation lets them pass.)

# %% id="guess-push" tags=["guess"]
guess = "b"


def blind(me, slot, velocity, others):
    return force(me, slot, velocity, others, k_r=0.0)


for name, push in (("with repulsion", force), ("without", blind)):
    one = drive(1, Rules(slot_velocity, push, steer), start=CROSSING)
    print(f"{name:14s} stands after {one.formed:4.1f} s, nearest {one.least:.2f} m")
reveal("push", guess)
leader, goal, two = np.zeros(2), np.array([0.3, 0.0]), np.array([[0.8, 0.4], [0.8, -0.5]])
print(f"a leader's goal pulls with {force(leader, goal, leader, two[:0]).round(2)} m/s,")
print(
    f"two robots in front of it push with {force(leader, leader, leader, two).round(2)} m/s"
)

# %% [markdown]
# In motion: circles are the slots, crosses what the filter believes, laid on the truth. Compare its ellipses (3σ) with the largest distance from a slot, which stands below the picture.

# %%
play(drive(1))

# %% [markdown]
# ### Question C
# The formation holds to a few centimetres, although the 3σ ellipses say at the end that each robot may be off by half a metre in the common frame. Why does that not matter here? And what would happen with odometry alone? (Try it: `kf.update = lambda seen: None`, before the last line of `drive`, leaves the filter nothing else. A time that is `nan` says: that never happened.)

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
# ## 4. Other shapes
#
# The paper leaves shapes in which robots hide each other for later. In a *column* all drive in a line, and the leader hides behind follower 1 from follower 2. *Abreast* they drive side by side; their scanners look ahead, 90° to each side, so a neighbour stands at the edge of what can be seen.
#
# **Before you run the next cell:** 12 m straight ahead, the median of eight runs. In the column, follower 2 hardly ever sees the leader, behind which it should stay. How far from its slot will follower 2 be? (a) As far as without any view of the others: it goes by its odometry. (b) A few centimetres: what 2 sees of 1 and what 1 sees of the leader add up in the joint filter. (c) As far as in the triangle, to the millimetre.

# %% id="guess-column" tags=["guess"]
guess = "b"
none_of_1 = {"sees": [(1, 0), (2, 0)]}  # (i, j): robot i may see robot j; (2, 1) is missing
shapes = {
    "triangle": (TRIANGLE, {}),
    "column": (COLUMN, {}),
    "abreast": (ABREAST, {}),
    "column, nobody looks at 1": (COLUMN, none_of_1),
}
for name, (shape, options) in shapes.items():
    runs = [drive(k, mine, shape, [(12.0, 0.0)], **options) for k in range(8)]
    far = 100 * np.median([one.each_rms[1] for one in runs])
    sight = 100 * np.mean([one.sight(2, 0) for one in runs])
    print(f"{name:25s} 2 sees 0 in {sight:3.0f} % of all steps, {far:4.1f} cm from its slot")
reveal("column", guess)

# %%
fig, axes = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
for ax, name, shape in zip(axes, ("column", "abreast"), (COLUMN, ABREAST)):
    draw_formation(ax, drive(1, shape=shape), [0, 60, 130, 220, 900], name)
plt.show()

# %% [markdown]
# A joint filter passes on what it knows: that is what its large covariance is for. Take away what follower 2 sees of follower 1, and it drives by its odometry for most of the way. Abreast the error is larger than in the column, too: who is a little ahead does not see who has dropped back, so that they see each other in a part of all steps only. (At a corner the slots of a column swing far out, and the followers after them.)
#
# ## 5. Robots that part for long
#
# The paper names one more difficulty of a Kalman filter: robots that do not see each other for a long time. Back to lab 6's rectangle: robot 0 drives its rounds, and for ten minutes nobody sees anybody.
#
# **Before you run the next cell:** how long will your filter need, once they see each other again? (a) It never finds back: the readings are beyond the gate. (b) About a minute: it has ten to make up for. (c) A second or so: the filter knows how little it knows, and believes the readings at once.

# %% id="guess-parted" tags=["guess"]
guess = "c"
for seed in (1, 2, 5):
    apart, again = scenarios.parted(10, rng=seed)
    kf = started(GroupEKF, apart, seed)
    replay(kf, apart)
    ego = 100 * frame_errors(replay(kf, again).x, again.truth).ego
    print(f"after ten minutes {ego[0]:3.0f} cm, a second later {ego[6]:3.1f} cm (ego)")
reveal("parted", guess)

# %% [markdown]
# (In two of thirty such runs it took longer; here is why.) Odometry that turns by 1 % too far does so in each corner. That adds up, and the filter does not know: it reckons with chance only, which partly cancels. After twenty minutes robot 0 can be turned by much more than the filter thinks possible. Then the readings are honest, and yet beyond the gate: they are left out, and the filter goes on by odometry alone. The warnings below say just that. The cure: open the gate.

# %%
for seed in (4, 8):
    apart, again = scenarios.parted(20, rng=seed)
    kf = started(GroupEKF, apart, seed)
    replay(kf, apart)
    off = abs(wrap(kf.x[0, 2] - again.truth[0, 0, 2]))
    off, sigma = np.rad2deg([off, np.sqrt(kf.P[2, 2])])
    print(f"twenty minutes: the heading is {off:.0f}° off, believed to {sigma:.0f}° (1σ);")
    for gate in (kf.gate, np.inf):
        one = copy.deepcopy(kf)
        one.gate = gate
        ego = 100 * frame_errors(replay(one, again).x, again.truth).ego
        print(f"   gate {gate}: half a minute later {ego[-1]:.0f} cm (ego)")

# %% [markdown]
# One of the two finds back by itself, the other one does not. With the gate open all thirty runs that we tried did. (No reading is false here. Where some are, the gate should be open only until the honest ones fit again.)
#
# ## 6. More than one guess
#
# A Kalman filter believes one thing, more or less surely. Sometimes there are *several* things to believe: an observer may stand on the left or on the right (lab 6's two circles). The paper hopes for a filter that can do that. The simplest one is a *bank*: a filter for each guess, and a *weight* for each, which says how
# probable it is. A step in which a filter's readings have the misfit $m$ (the sum of their $d^2$) makes its guess less probable by the factor $e^{-m/2}$:
#
# $$ w_k \leftarrow \frac{w_k\, e^{-m_k/2}}{\sum_l w_l\, e^{-m_l/2}} . $$
#
# (In full, the factor also holds $1/\sqrt{\det S}$; it is much alike for all guesses, and we leave it out.)
#
# ### Exercise 4 · `weigh(w, misfits)`
# Return the new weights (k,). They sum up to 1 whatever comes: where all misfits are thousands, each $e^{-m/2}$ is too small for a computer, which takes it for 0. Only the *differences* of the misfits matter, so subtract the smallest one first.
#
# *Example:* `weigh([0.5, 0.5], [0, 2])` is `[0.731, 0.269]`, and so is `weigh([0.5, 0.5], [5000, 5002])`.


# %% id="answer-weigh" tags=["answer"]
def weigh(w, misfits):
    """Weights (k,) of guesses after a step, from those before (k,) and their misfits (k,)."""
    ### BEGIN SOLUTION
    w = np.asarray(w) * np.exp(-(np.asarray(misfits) - np.min(misfits)) / 2)
    return w / np.sum(w)
    ### END SOLUTION


# %% id="check-weigh" tags=["check"] points=2 title="weigh"
check("team-weigh", weigh)

# %% [markdown]
# Left or right? Observer 1 has seen robot 0 once. Two filters start: one has observer 1 where it is, the other on the opposite side of the way, where range and bearing would be the same. (Observer 2 is right in both. It does not see observer 1, so it cannot tell.) Robot 0 drives straight ahead; the laser tells bearings to 0.75°, and another sensor to 20° only.

# %%
fig, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
sure = np.diag(np.array([1e-6] * 3 + 2 * [0.3, 0.3, 0.15]) ** 2)
for degrees, style in ((0.75, "-"), (20, "--")):
    told = TeamNoise(bearing=np.deg2rad(degrees))
    log = scenarios.cross(rng=1, steps=60, noise=told)
    here = relative(log.truth[0], log.truth[0, :1])
    there = np.array([here[0], mirrored(here[1]), here[2]])
    weights, _ = run_bank([GroupEKF(x0, sure, told) for x0 in (here, there)], log, weigh)
    ax.plot(log.times, weights[:, 0], style, label=f"bearings to {degrees}°")
ax.set(xlabel="time [s]", ylabel="weight of the true side", ylim=(0, 1.05))
ax.legend(frameon=False)
plt.show()

# %% [markdown]
# ## 7. Particles
#
# Figure 8 of the paper tries a particle filter, which is a bank with hundreds of guesses. The kit's `TeamParticles` guesses the pose of robot 0 many times, and for each guess has a small EKF for each observer. The left picture will show what it believes of two observers after a few seconds:
# each cloud is long across the line of sight and thin along it: an observer may stand anywhere on an arc round robot 0 (so short a piece of it that it looks straight), for its own heading is uncertain too, but the laser knows how far away it is.
#
# **Before you run the next cell:** 300 particles on the cross of lab 6. How accurate will they be? (a) Much better than your filter: 300 guesses know more than one. (b) Worse by far: 300 are few for nine numbers. (c) About as good, for a higher cost.

# %% id="guess-cloud" tags=["guess", "nbval-ignore-output"]
guess = "c"
log = scenarios.cross(rng=1)
kf = started(GroupEKF, log, 1)
pf = TeamParticles(300, kf.x, kf.P, noise, rng=1)
fig, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
draw_particles(axes[0], log, kf, "figure 8: after 4 s")
errors = {}
for name, one in (("your filter", kf), ("300 particles", pf)):
    start = time.perf_counter()
    errors[name] = frame_errors(replay(one, log).x, log.truth).ego
    cost = 1e3 * (time.perf_counter() - start) / len(log)
    print(f"{name:14s} {100 * errors[name].mean():.1f} cm (ego), {cost:.2f} ms a step")
draw_errors(axes[1], log.times, errors, limit=10)
plt.show()
reveal("cloud", guess)

# %% [markdown]
# ### Question D
# One filter, two guesses, or three hundred particles: when would you take which? Think of what the belief looks like, and of what each one costs.

# %% [markdown] id="answer-guesses" tags=["answer"] points=2 title="Question D: guesses"
# ### BEGIN SOLUTION
# One filter where the belief is one hill, nearly Gaussian: a known start, robots that see each other often. A few filters where there are a few separate possibilities (left or right): their cost is so many times that of one. Particles where the belief has a shape that nobody can list beforehand; their cost is the
# highest, and grows fast with the numbers that have to be guessed.
# ### END SOLUTION

# %% [markdown] id="rubric-guesses" tags=["hidden"]
# **Question D, 2 points.**
# - 1 point: several guesses only where the belief has several hills, or is far from Gaussian (or: one tangent does not serve).
# - 1 point: cost: so many times one filter; particles most of all.

# %% [markdown] tags=["hidden"]
# ## Graded checks
#
# They stand only in this copy. When a class is graded, each runs with numbers drawn for each student.

# %% id="setup-exam" tags=["setup", "hidden"]
from labkit.instructor.exam.exam import Exam

exam = Exam("07_formation")
check = exam.check

# %% id="grade-velocity" tags=["hidden"] points=2 title="slot_velocity: other arms"
rng = exam.rng()
exam.same(
    slot_velocity,
    [(rng.uniform(-2, 2, 2), rng.uniform(-1, 1, 2), rng.uniform(0.2, 1)) for _ in range(6)],
    "other arms",
)
print("passed")

# %% id="grade-force" tags=["hidden"] points=2 title="force: near and far from others"
rng = exam.rng()
exam.same(
    force,
    [(*rng.uniform(-1, 1, (3, 2)), rng.uniform(-1, 1, (k, 2))) for k in (0, 1, 2, 3, 4, 4)],
    "other places",
)
print("passed")

# %% id="grade-steer" tags=["hidden"] points=2 title="steer: ahead, behind, across ±180°"
rng = exam.rng()
exam.same(
    steer,
    [
        (
            np.array([*rng.uniform(-1, 1, 2), turn]),
            length * np.array([np.cos(way), np.sin(way)]),
        )
        for turn, way, length in [
            (2.9, -2.9 + rng.uniform(-0.2, 0.2), 0.3),
            (0.4, 0.6 + rng.uniform(-0.1, 0.1), rng.uniform(0.6, 0.9)),
            (-0.5, 0.1 + rng.uniform(-0.1, 0.1), rng.uniform(0.2, 0.4)),
            (0.2, 3.0 + rng.uniform(-0.1, 0.1), 0.3),
            (1.0, -0.6 + rng.uniform(-0.1, 0.1), 0.4),
            (0.3, rng.uniform(-3, 3), 0.004),
        ]
    ],
    "other velocities",
)
print("passed")

# %% id="grade-weigh" tags=["hidden"] points=2 title="weigh: good and bad guesses"
rng = exam.rng()
exam.same(
    weigh,
    [
        (rng.dirichlet(np.ones(k)), least + rng.uniform(0, 6, k))
        for k, least in ((2, 0), (3, 4), (5, 20), (4, 5000))
    ],
    "other guesses",
)
print("passed")

# %% [markdown]
# ## Summary
#
# - A formation lives in the common frame; that is enough.
# - What one robot cannot see, another one sees for it: a joint filter passes it on.
# - A filter that knows how little it knows finds back at once. One that is too sure shuts out the truth with its own gate.
# - Several guesses, each with a filter and a weight, are the first step to particles.
#
# **Next:** lab 8 has open explorations, each on its own.
#
# Save, and run `labkit check notebooks/07_formation.ipynb` in a terminal before you hand it in.
#
# ## References
# - F. E. Schneider, D. Wildermuth, on the use of relative positions in the navigation of groups of robots (in Russian), 2005: section 2.2 and figures 7 and 8.
# - A. Howard, M. J. Mataric, G. S. Sukhatme, "Putting the 'I' in 'Team': an ego-centric approach to cooperative localization", ICRA 2003 (the paper's reference 9).

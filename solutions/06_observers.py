# %% [markdown]
# # Lab 6 · Observers: a common frame without a map
#
# *About 160 minutes; 120 if you have your lab 4 beside you. Needs nothing from your earlier notebooks.*
#
# An empty hall: no landmarks, no beacons, no map. But there are several robots, each with a laser scanner, and they see *each other*. F. E. Schneider and D. Wildermuth (*the paper*, from here on) let such robots find out
# where they stand relative to one another, and keep that up while all of them move. You build it, step by step: the common frame here, a formation that drives in it in lab 7.
#
# **By the end you can**
# - find out where an observer stands from what it saw of a robot that drove by;
# - write an EKF for the poses of a whole team, in which every robot can move;
# - say what *relative* means: which part of the answer nobody in the hall can know.
#
# **You will write** `circular_mean`, `two_circles`, `h`, `jacobians` and the classes `PaperEKF` and `GroupEKF`.

# %% [markdown]
# ## Symbols
#
# | symbol | in the code | shape | unit | what it is |
# |---|---|---|---|---|
# | $x_i = (x, y, \theta)$ | `kf.x[i]` | (3,) | m, m, rad | pose of robot i in the common frame |
# | $P$ | `kf.P` | (3n, 3n) | m², rad² | covariance of all n poses together |
# | $u_i$ | `u[i]` | (3,) | m, m, rad | odometry of robot i in this step: ahead, to the left, turned, in its *own* frame |
# | $\rho, \alpha$ | `z` | (2,) | m, rad | range and bearing at which an observer sees a target; the bearing counts from its own heading (as in lab 4) |
# | $o, p$ | `o`, `p` | (3,) | m, m, rad | pose of the observer, pose of the target |
# | $h$ | `h(o, p)` | (2,) | m, rad | the range and bearing that are expected |
# | $\nu$ | `nu` | (2,) | m, rad | innovation: what was seen less what was expected, the bearing wrapped |
# | $H$ | `H` | (2, 3n) | –, 1/m, rad/m | derivative of one reading by all poses |
# | $R$ | – | (2, 2) | m², rad² | covariance of the noise of one reading |
# | $S$, $K$ | `S`, `K` | (2, 2), (3n, 2) | – | covariance of the innovation, gain |
# | $d^2$ | `self.d2` | list | – | $\nu^\top S^{-1} \nu$ of each reading: how far it is off, in standard deviations, squared |
# | $Q_i$ | – | (3, 3) | m², rad² | covariance of the odometry of robot i in one step, in its own frame |
#
# What a symbol means in other labs: [all symbols](../notebooks/glossary.md).
#
# A *reading* is a triple `(i, j, z)`: robot i saw robot j at `z`.

# %% id="setup" tags=["setup"]
from functools import partial

import matplotlib.pyplot as plt
import numpy as np

from labkit import check, replay, reveal, wrap
from labkit.geometry import transform
from labkit.metrics import nees_per_dimension
from labkit.team import TeamNoise, dead_reckoned, explore, frame_errors, initial_pose
from labkit.team import median_of_pairs, of_logs, own_start, scenarios, start_errors, started
from labkit.team.plots import draw_errors, draw_paths, draw_plan, draw_posts, draw_readings
from labkit.team.sketches import sketch_circles, sketch_errors

noise = TeamNoise()  # a laser: 5 cm, 0.75°, and the robot's middle is uncertain by 5 cm

# %% [markdown]
# ## 1. The hall
#
# The hall measures 18 by 15 metres (the paper's figure 2). Robot 0 drives a cross; robots 1 and 2 stand and watch. Five times a second each of them sees it and measures range and bearing. Each robot knows its own odometry, which slips a little, and all tell each other what they see.
#
# How good will your answers be? No robot here knows where the hall is, so an error has to be told with care. The three lower pictures have one estimate (blue) of three robots (grey), and the error of robot 0 (orange) in three ways:
# - *gauge*: the difference as it is, in the frame in which the estimate began (in our figures robot 0 is *given* its true start, so that all can be drawn in the hall);
# - *aligned*: what is left of it after the whole estimate, all robots and all steps, was laid on the truth by one turn and one shift; a robot that is lost spoils this for all;
# - *ego*: how wrongly an observer has robot 0 in its *own* frame (the mean over the observers).
#
# The upper right picture, the paper's figure 1, belongs to the next section.

# %%
log = scenarios.cross(rng=1)
fig, axes = plt.subplots(1, 2, figsize=(11, 4.8), layout="constrained")
draw_plan(axes[0], log, "figure 2: the hall")
sketch_circles(axes[1], "figure 1: one range, one circle")
plt.show()
print("in the first step", *[(i, j, z.round(3)) for i, j, z in log.measurements()[0]])
fig, axes = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained")
sketch_errors(axes)
plt.show()

# %% [markdown]
# ## 2. Where does the observer stand?
#
# Robot 0 takes its own start as the origin; where it is from there, its odometry tells. At $p_1$ observer o sees it at the range $\rho_1$; later, at $p_2$, at $\rho_2$. So o is on two circles, and they may meet in two points, one on either side of the way:
#
# $$ b = |p_2 - p_1|, \qquad a = \frac{\rho_1^2 - \rho_2^2 + b^2}{2b}, \qquad c^2 = \rho_1^2 - a^2, \qquad o = p_1 + a\,e \pm c\,e_\perp, $$
#
# with $e$ the direction from $p_1$ to $p_2$ and $e_\perp$ that direction turned by 90° to the left. Which of the two? Seen from the left one, the robot passes from right to left and the bearing grows; from the right one it is the other way: the
# *difference* of the two bearings tells. And the heading of o is the direction in which it should see the robot, less the bearing at which it does, averaged over both sightings.
#
# **Before you go on:** what is the mean of the headings 179° and −179°?
#
# ### Exercise 1 · `circular_mean(angles)`
# Return the mean direction [rad]: the angle of the sum of the vectors (cos, sin). (Of 179° and −179° it is 180°; half of their sum is 0°, the opposite direction.)


# %% id="answer-mean" tags=["answer"]
def circular_mean(angles):
    """Mean direction [rad] of an array of angles."""
    ### BEGIN SOLUTION
    return np.arctan2(np.sum(np.sin(angles)), np.sum(np.cos(angles)))
    ### END SOLUTION


# %% id="check-mean" tags=["check"] points=1 title="circular_mean"
check("team-mean", circular_mean)

# %% [markdown]
# ### Exercise 2 · `two_circles(p1, z1, p2, z2, sigma)`
# Return the observer's pose as an array (3,), or `UNKNOWN`, three times not-a-number, if the pair of sightings tells too little. `p1`, `p2` are (2,), `z1`, `z2` are (range, bearing), `sigma` [rad] is the standard deviation of a bearing. Return `UNKNOWN`
# - if the way $b$ is shorter than 1 m;
# - if the circles do not meet ($c^2 \le 0$): with noise it happens;
# - if the bearings differ by no more than $3\sqrt2\,\sigma$, three standard deviations of a *difference* of two bearings: then nobody can tell left from right;
# - if the difference that the chosen point predicts is more than $3\sqrt2\,\sigma$ off.
#
# *Example:* `p1 = (0, 0)`, `p2 = (2, 0)`, seen at `(1.414, 0.785)` and `(1.414, -0.785)`: the observer is at (1, −1) with heading π/2.
#
# <details><summary>Hint</summary>
#
# For each of the two points o you know the two directions in which it should see the robot. How much do they differ? Compare that with how much the two bearings differ. All differences are wrapped.
# </details>

# %% id="answer-circles" tags=["answer"]
UNKNOWN = np.full(3, np.nan)


def two_circles(p1, z1, p2, z2, sigma):
    """Pose (3,) of who saw a robot at p1 (2,) as z1 and at p2 (2,) as z2, or UNKNOWN."""
    ### BEGIN SOLUTION
    b = np.linalg.norm(p2 - p1)
    if b < 1:
        return UNKNOWN
    a = (z1[0] ** 2 - z2[0] ** 2 + b**2) / (2 * b)
    c2 = z1[0] ** 2 - a**2
    measured = wrap(z2[1] - z1[1])
    if c2 <= 0 or abs(measured) <= 3 * np.sqrt(2) * sigma:
        return UNKNOWN
    e = (p2 - p1) / b
    across = np.array([-e[1], e[0]])
    found = []
    for side in (1, -1):
        o = p1 + a * e + side * np.sqrt(c2) * across
        to = np.array([np.arctan2(*(p1 - o)[::-1]), np.arctan2(*(p2 - o)[::-1])])
        off = abs(wrap(wrap(to[1] - to[0]) - measured))
        found.append((off, o, circular_mean(to - np.array([z1[1], z2[1]]))))
    off, o, heading = min(found, key=lambda one: one[0])
    return np.array([o[0], o[1], heading]) if off <= 3 * np.sqrt(2) * sigma else UNKNOWN
    ### END SOLUTION


# %% id="check-circles" tags=["check"] points=3 title="two_circles"
check("team-circles", two_circles)

# %% [markdown]
# One pair is a rough guess. The paper collects at least 25 of them; how it makes one out of these, it does not say. Here we take the median of what all pairs of the first 3.3 m say. The kit has another way, `initial_pose`: lay *all* readings of the observer, points in its own frame, on the track of
# the robot, by the turn and the shift with the least squares.
#
# **Before you run the next cell:** which one places the observers better, over thirty runs? (a) The median of the pairs: it does not care about a few bad ones. (b) Both alike: they use the same readings. (c) The alignment, about twice as well.

# %% id="guess-start" tags=["guess"]
guess = "c"
ways = {
    "two circles": partial(median_of_pairs, two_circles, circular_mean),
    "alignment": lambda *seen: initial_pose(*seen)[0],
}
for name, way in ways.items():
    share, far, turned = start_errors(way, runs=30)
    print(f"{name:12s} {100 * share:.0f} % found, {100 * far:.0f} cm,", end=" ")
    print(f"{np.rad2deg(turned):.1f}° (root mean square)")
reveal("first-guess", guess)

# %% [markdown]
# ### Question A
# All estimates of one observer, say 25, come from the same few metres of odometry. Why would it be wrong to divide their covariance by 25, as for a mean of independent measurements?

# %% [markdown] id="answer-start" tags=["answer"] points=2 title="Question A: 25 estimates"
# ### BEGIN SOLUTION
# If the odometry is 2 % too long, or has turned by a degree, it is so in all 25: they share that error, and averaging does not reduce it. Only the part that is fresh in each reading is divided by 25.
# ### END SOLUTION

# %% [markdown] id="rubric-start" tags=["hidden"]
# **Question A, 2 points.**
# - 1 point: the estimates share the error of the odometry (or: are not independent).
# - 1 point: only what is fresh in each shrinks with their number.

# %% [markdown]
# ## 3. The paper's filter
#
# The paper puts the moving robot and all observers into one state and lets an EKF correct them together. A reading $(i, j, z)$ compares two of the poses,
#
# $$ h(o, p) = \begin{bmatrix} \sqrt{(p_x - o_x)^2 + (p_y - o_y)^2} \\ \operatorname{atan2}(p_y - o_y,\; p_x - o_x) - o_\theta \end{bmatrix}, $$
#
# so its Jacobian has two blocks: one in the observer's three columns, one in the target's. (Eq. 5 of the paper has arctan of the quotient; as in lab 3 it must be atan2.)
#
# ### Exercise 3 · `h(o, p)` and `jacobians(o, p)`
# `h` returns [range, bearing], the bearing wrapped. `jacobians` returns `H_o, H_p`, the derivatives of `h` by the three numbers of the observer and of the target, both (2, 3).
#
# *Example:* from `o = (0, 0, 0.5)`, a target at `p = (2, 0, 1)` is seen at `[2, -0.5]`, and `H_p = [[1, 0, 0], [0, 0.5, 0]]`.
#
# <details><summary>Hint</summary>
#
# Lab 3 has half of it: there the robot moved, here the target does, so what becomes of the signs? And what does an observer see if it only turns to the left?
# </details>


# %% id="answer-jacobians" tags=["answer"]
def h(o, p):
    """Range [m] and bearing [rad], an array (2,), at which o (3,) sees p (3,)."""
    ### BEGIN SOLUTION
    dx, dy = p[:2] - o[:2]
    return np.array([np.hypot(dx, dy), wrap(np.arctan2(dy, dx) - o[2])])
    ### END SOLUTION


def jacobians(o, p):
    """(H_o, H_p): derivatives (2, 3) of h(o, p) by the observer's and the target's pose."""
    ### BEGIN SOLUTION
    dx, dy = p[0] - o[0], p[1] - o[1]
    rho2 = dx**2 + dy**2
    rho = np.sqrt(rho2)
    H_p = np.array([[dx / rho, dy / rho, 0], [-dy / rho2, dx / rho2, 0]])
    H_o = np.array([[-dx / rho, -dy / rho, 0], [dy / rho2, -dx / rho2, -1]])
    return H_o, H_p
    ### END SOLUTION


# %% id="check-h" tags=["check"] points=1 title="h"
check("team-h", h)

# %% id="check-jacobians" tags=["check"] points=2 title="jacobians"
check("team-jacobians", jacobians)

# %% [markdown]
# ### Exercise 4 · the class `PaperEKF`
# Three parts, with a check for each: write one, run its check, write the next.
#
# **Predict**, as the paper has it (its eq. 3): only robot 0 moves. Its step is known in its own frame and has to be turned into the common one; the heading that this takes comes from its odometry, for the paper keeps a *position* of robot 0 only. With $u_0$ = (ahead, left, turned), and headings wrapped,
#
# $$ \begin{bmatrix} p_x \\ p_y \end{bmatrix} \leftarrow \begin{bmatrix} p_x \\ p_y \end{bmatrix} + \operatorname{Rot}(\theta_0) \begin{bmatrix} \text{ahead} \\ \text{left} \end{bmatrix}, \qquad
#    \theta_0 \leftarrow \theta_0 + \text{turned}, \qquad P_{xy} \leftarrow P_{xy} + \operatorname{Rot}(\theta_0)\, Q_{xy}\, \operatorname{Rot}(\theta_0)^\top, $$
#
# where $\operatorname{Rot}(\theta_0)$, 2 × 2, turns by the heading *before* the step, $P_{xy}$ is the upper left 2 × 2 of $P$, and $Q_{xy}$ has on its diagonal `self.inflate` times the squares of the first two numbers of `self.noise.of_step(u[0])`, which gives the standard deviations of (ahead, left, turned). (`inflate` is 4: four times
# as much as the white noise alone, for odometry has systematic errors too.)
#
# **One reading** corrects all 3n numbers, robot 0's heading as well. (In a run no correction reaches that one, without any code of yours: its variance begins near zero, and predict adds none.) $H$ (2, 3n) is zero but for two blocks; $R$ has the squares of `self.noise.range` and `self.noise.of_bearing(rho)` on its diagonal, `rho` being the *expected* range; $S = HPH^\top + R$ and $d^2 = \nu^\top S^{-1} \nu$. Then $K = PH^\top S^{-1}$, $x \leftarrow x + K\nu$ (headings wrapped),
# $P \leftarrow P - KSK^\top$.
#
# **All readings of a step**, one after the other, each at the estimate that the one before has left. Keep all $d^2$ of this step in the list `self.d2`. The *gate*: a reading with a $d^2$ of `self.gate` or more corrects nothing. (It is 13.8: of a thousand honest readings of two numbers, 999 stay below.)
#
# <details><summary>Hint</summary>
#
# Robot i has the rows and columns `3 * i` to `3 * i + 3`. `K @ nu` has 3n numbers: `.reshape(-1, 3)` makes poses of them.
# </details>


# %% id="answer-ekf" tags=["answer"]
class PaperEKF:
    """The paper's extended Kalman filter: robot 0 drives, the others stand and watch."""

    def __init__(self, x0, P0, noise, gate=13.8, inflate=4.0):
        self.x = np.array(x0, dtype=float)  # (n, 3) estimated poses
        self.P = np.array(P0, dtype=float)  # (3n, 3n) their covariance
        self.noise = noise  # a TeamNoise
        self.gate, self.inflate = gate, inflate
        self.d2 = []  # of each reading of the last update

    def predict(self, u):
        """Move robot 0 by its odometry: the first row of u (n, 3)."""
        ### BEGIN SOLUTION
        theta = self.x[0, 2]
        turn = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
        self.x[0, :2] += turn @ u[0, :2]
        self.x[0, 2] = wrap(theta + u[0, 2])
        slips = self.inflate * self.noise.of_step(u[0])[:2] ** 2
        self.P[:2, :2] += turn @ np.diag(slips) @ turn.T
        ### END SOLUTION

    def update(self, seen):
        """Correct all poses with the readings (i, j, z) of this step: a list, maybe empty."""
        ### BEGIN SOLUTION
        self.d2 = []
        for i, j, z in seen:
            expected = h(self.x[i], self.x[j])
            nu = z - expected
            nu[1] = wrap(nu[1])
            H = np.zeros((2, self.x.size))
            here, there = slice(3 * i, 3 * i + 3), slice(3 * j, 3 * j + 3)
            H[:, here], H[:, there] = jacobians(self.x[i], self.x[j])
            sigma = np.array([self.noise.range, self.noise.of_bearing(expected[0])])
            S = H @ self.P @ H.T + np.diag(sigma**2)
            self.d2.append(nu @ np.linalg.solve(S, nu))
            if self.d2[-1] < self.gate:
                K = np.linalg.solve(S, H @ self.P).T
                self.x = self.x + (K @ nu).reshape(-1, 3)
                self.x[:, 2] = wrap(self.x[:, 2])
                self.P = self.P - K @ S @ K.T
        ### END SOLUTION


# %% id="check-predict" tags=["check"] points=1 title="PaperEKF: predict"
check("team-predict", PaperEKF)

# %% id="check-reading" tags=["check"] points=1 title="PaperEKF: one reading"
check("team-reading", PaperEKF)

# %% id="check-paper" tags=["check"] points=1 title="PaperEKF: all readings of a step, and the gate"
check("team-paper", PaperEKF)

# %% [markdown]
# A filter has to start somewhere. Robot 0 begins at its true start. Section 2 places the others with 11 cm and 1° at best; `started` draws an error of 13 cm in x, in y, and 1°, so that the runs begin at once.
#
# Figure 3 of the paper: the cross. There the odometry is up to 20 cm away from the filter's estimate at the left tip of the cross and 15 cm at the upper and the right one, and when the robot is back in the centre, the difference is gone.
#
# **Before you run the next cell:** what brings odometry back? (a) Its heading is off: most of what that does on the way out, it undoes on the way back. (b) The filter corrects the odometry at the centre. (c) The wheels slip backwards as much as forwards.

# %% id="guess-tips" tags=["guess"]
guess = "a"
log = scenarios.cross(rng=5)
history, odometry = replay(started(PaperEKF, log, 5), log), dead_reckoned(log)
fig, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
draw_paths(axes[0], log.truth, history.x, "figure 3", loc="upper left", odometry=odometry)
both = {"filter": history.x, "odometry": odometry}
errors = {name: frame_errors(x, log.truth).aligned for name, x in both.items()}
draw_errors(axes[1], log.times, errors, of="robot 0, aligned,")
plt.show()
apart = 100 * np.linalg.norm((odometry - history.x)[:, 0, :2], axis=1)
steps = scenarios.passed(log, scenarios.CROSS)
for name, k, back in zip(("left", "upper", "right", "lower"), steps[::2], steps[1::2]):
    print(f"{name} tip: {apart[k]:.0f} cm apart, then in the centre {apart[back]:.0f} cm")
print("aligned, in the mean:", *(f"{100 * e.mean():.1f} cm {n}," for n, e in errors.items()))
reveal("tips", guess)

# %% [markdown]
# The difference is less in the centre, though not gone, and the first arm is an exception: at its tip odometry's heading is still good, the turn there spoils it, and the way back runs with another error than the way out. From arm to arm the difference at the tip grows, for odometry's heading gets worse with each turn on the spot.
#
# In the mean the filter is far better. (Odometry is clearly ahead only at the very end, when it comes back once more. And the observers in the picture stand beside their true places: the whole frame has turned a little, which is the story of section 6.) But does the filter know how good it is? The NEES of lab 2, divided by the number of dimensions, should be about 1.

# %%
history = replay(started(PaperEKF, log, 5), log)
all_but_heading = np.delete(np.arange(3 * log.n), 2)  # the paper has no heading of robot 0
value = nees_per_dimension(history, log, all_but_heading).mean()
turned = np.rad2deg(np.abs(wrap((dead_reckoned(log) - log.truth)[:, 0, 2])).max())
print(f"NEES per dimension {value:.0f}; the heading is off by up to {turned:.0f}°")

# %% [markdown]
# It is far too sure of itself: the heading that it takes from odometry is wrong, and the filter has no number in which to doubt it.
#
# ## 4. Everybody moves
#
# Two repairs. Robot 0 gets a heading in the state, like all others, so that readings can correct it. And *every* robot moves by its own odometry, as in lab 4.
#
# ### Exercise 5 · the class `GroupEKF`
# The update stays as it is, it is inherited. With $\delta_i = W_i u_i$ the step of robot i, turned into the common frame,
#
# $$ x_i' = x_i + \delta_i, \quad F_i = \begin{bmatrix} 1 & 0 & -\delta_y \\ 0 & 1 & \delta_x \\ 0 & 0 & 1 \end{bmatrix}, \quad W_i = \begin{bmatrix} \cos\theta_i & -\sin\theta_i & 0 \\ \sin\theta_i & \cos\theta_i & 0 \\ 0 & 0 & 1 \end{bmatrix}, \quad
#    P \leftarrow F P F^\top + W Q W^\top, $$
#
# where $F$, $W$, $Q$ (3n, 3n) have the blocks of the robots on their diagonals and zeros elsewhere, and $Q_i$ has `self.inflate` times the squares of `self.noise.of_step(u[i])` on its diagonal. Wrap the headings.
#
# <details><summary>Hint</summary>
#
# `F = np.eye(3 * n)`, and then for each robot `F[own, own] = ...` with `own` the slice of its three rows. What is added to $P$ can be filled block by block as well: each block is $W_i Q_i W_i^\top$.
# </details>


# %% id="answer-moving" tags=["answer"]
class GroupEKF(PaperEKF):
    """Extended Kalman filter for the poses of n robots that see each other and all move."""

    def predict(self, u):
        """Move every robot by its odometry: u (n, 3)."""
        ### BEGIN SOLUTION
        n = len(u)
        F, slips = np.eye(3 * n), np.zeros((3 * n, 3 * n))
        for i, sigma in enumerate(self.noise.of_step(u)):
            own = slice(3 * i, 3 * i + 3)
            cos, sin = np.cos(self.x[i, 2]), np.sin(self.x[i, 2])
            W = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
            dx, dy, _ = W @ u[i]
            F[own, own] = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]]
            slips[own, own] = W @ np.diag(self.inflate * sigma**2) @ W.T
            self.x[i] += [dx, dy, u[i, 2]]
        self.x[:, 2] = wrap(self.x[:, 2])
        self.P = F @ self.P @ F.T + slips
        ### END SOLUTION


# %% id="check-ekf" tags=["check"] points=3 title="GroupEKF: predict"
check("team-ekf", GroupEKF)

# %% [markdown]
# Figure 6 of the paper: four observers, and after a while two of them set off. The paper's prediction (eq. 3) leaves them where they are; it reports that the estimate stays consistent all the same.
#
# **Before you run the next cell:** what will a filter make of it that takes moving observers for standing ones, as eq. 3 does? (a) Not much: the readings correct the observers as they go. (b) It follows them with a delay of a few steps. (c) Their readings contradict it, the gate leaves them out, and it loses both.

# %% id="guess-set-off" tags=["guess"]
guess = "c"
log = scenarios.moving(rng=2)
filters = {"only robot 0 moves": PaperEKF, "with each one's odometry": GroupEKF}
fig, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
for ax, (name, KF) in zip(axes, filters.items()):
    x = replay(started(KF, log, 2), log).x
    draw_paths(ax, log.truth, x, f"figure 6: {name}")
    ax.set(xlim=(-6.6, 6.6), ylim=(-5, 5))
    errors = frame_errors(x, log.truth)
    off = np.linalg.norm((x - log.truth)[-1, 1:, :2], axis=1).round(1)
    print(f"{name}: robot 0 {100 * errors.gauge.mean():.1f} cm (gauge),", end=" ")
    print(f"{100 * errors.aligned.mean():.1f} cm (aligned); robots 1 to 4 end {off} m off")
plt.show()
reveal("set-off", guess)

# %% [markdown]
# With eq. 3 as it is printed, robot 0 itself stays where it is (gauge), held by the two observers that stand. Perhaps the paper looked at that. But the team is torn: robots 1 and 3 are lost by metres, and an alignment of *all* robots has to split that difference. With each robot's own odometry the filter does what the paper reports.
#
# ## 5. Four observers, false readings
#
# Figure 4: four observers, a rectangle, three laps; while robot 0 is in one quadrant of the hall, three of ten readings are false. The paper compares its estimate with that of a robot that builds a map while it drives (SLAM). Here the map is a gift: there are posts in the corners of the hall, and where they stand is known. Your filter can do that too: a post is a
# member of the team that never moves and is known to the micrometre.
#
# **Before you run the next cell:** what if nothing is ever left out, false or not? (a) A little worse: among thousands of readings the false ones average out. (b) Ten times worse or more: a few wild readings, believed, tear the team apart. (c) Better: the gate throws away good readings too.

# %% id="guess-false-readings" tags=["guess"]
guess = "b"
log = scenarios.rectangle(rng=3, posts=True)
team = of_logs(log.logs[:5], range(5))
poses = {}
for name, gate in {"gate 13.8": 13.8, "no gate": np.inf}.items():
    poses[name] = replay(started(GroupEKF, team, 3, gate=gate), team).x
    errors = frame_errors(poses[name], team.truth)
    print(f"{name}: in the mean {100 * errors.aligned.mean():.1f} cm (aligned),", end=" ")
    print(f"{100 * errors.gauge.mean():.1f} cm (gauge)")
reveal("false-readings", guess)

# %%
with_posts = of_logs([log.logs[i] for i in (0, 5, 6, 7, 8)], (0, 5, 6, 7, 8))
on_map = GroupEKF(with_posts.truth[0], 1e-12 * np.eye(15), noise)
reference = replay(on_map, with_posts).x[:, :1]
far = np.linalg.norm((reference - team.truth[:, :1])[..., :2], axis=2).mean()
print(f"with a map: in the mean {100 * far:.1f} cm (gauge)")
fig, axes = plt.subplots(1, 3, figsize=(12, 4.2), layout="constrained")
draw_paths(axes[0], team.truth[:, :1], title="figure 4 a", odometry=dead_reckoned(team))
draw_paths(axes[1], reference, poses["gate 13.8"], "figure 4 b", true="with a map")
draw_posts(axes[1])
axes[2].fill([-4, 0, 0, -4], [-3, -3, 0, 0], "0.9", label="robot 0 in here: 3 of 10 false")
draw_readings(axes[2], team, team.truth, "figure 4 c: what was reported")
for ax in axes:
    ax.set(xlim=(-9.5, 9.5), ylim=(-8, 11))
    ax.legend(fontsize=7, framealpha=1, loc="upper center", ncol=2, markerscale=2)
plt.show()

# %% [markdown]
# The gate leaves out what is false and keeps the rest. And a map would add little for the team: in their own frame (aligned), robots that watch each other do about as well as posts in the corners, so that in figure 4 b one line lies on the other. (What a map does add is the place in the *hall*: compare the two gauge errors.)
#
# The paper explains two bumps in its figure 4 b by wrong starts: the place of one observer was wrong at first and was corrected later; and where several observers had the *same* wrong start, nothing was corrected: the path moved instead. Here only robots nearer than 6.5 m are seen, the filter is told that the starts are good to 5 cm, and some of them are 40 cm off.
#
# **Before you run the next cell:** all four observers start 40 cm too far up. What will happen? (a) As with one: the readings correct them. (b) A good part of the error stays, and the path of robot 0 goes up with them. (c) The gate leaves all of their readings out.

# %% id="guess-shared" tags=["guess"]
guess = "b"
log = scenarios.rectangle(rng=1, laps=1, probability=0, reach=6.5)
sure = np.diag(np.concatenate([[1e-12] * 3, np.tile([0.05, 0.05, 0.01], 4) ** 2]))
for who in ([2], [1, 2, 3, 4]):
    x0 = log.truth[0].copy()
    x0[who, 1] += 0.4
    gap = replay(GroupEKF(x0, sure, noise), log).x - log.truth
    off = 100 * np.linalg.norm(gap[..., :2], axis=2)
    print(
        f"{len(who)} of 4 wrong by 40 cm: at the end {off[-1, who].mean():.0f} cm,", end=" "
    )
    print(f"and robot 0 on its way {off[:, 0].mean():.0f} cm")
reveal("shared-start", guess)

# %% [markdown]
# And the whole chain without a look at the truth: the alignment of section 2 on the first 3.3 m, then your filter. You will see a first error much below the 11 cm of section 2: what is wrong with an observer's place and what is wrong with its heading come from one track, and leave robot 0 nearly where the observer sees it.
#
# Then try the sliders ("the frame has turned by" is the turn that lays the estimate on the truth): what is the smallest gate that still works? How honest is the filter (NEES) with `inflate` 1, that is with white noise only?
#
# <details><summary>What we found</summary>
#
# Below a gate of about 4 honest readings are thrown away too, and the filter gets worse; near 1 it starves, and is far too sure of itself. With `inflate` 1 it depends on the run (try several): where the odometry slips in one way all the time, the NEES is two or three.
# </details>

# %%
kf, rest = own_start(GroupEKF, scenarios.cross(rng=1))
first, last = 100 * frame_errors(replay(kf, rest).x, rest.truth).ego[[0, -1]]
print(f"the whole chain: {first:.1f} cm at first, {last:.1f} cm at last (ego)")
explore(partial(started, GroupEKF))

# %% [markdown]
# ## 6. What *relative* means
#
# Figure 5 of the paper: all poses fit each other, and yet all are turned by about 2° counter-clockwise about a point at the lower edge of the picture. Here is one run of your filter, as it is and turned by 2° about (0, −4).

# %%
log = scenarios.rectangle(rng=3)
x, angle, about = replay(started(GroupEKF, log, 3), log).x, np.deg2rad(2), np.array([0, -4])
both = {"as it is": x, "turned by 2°": transform(x, angle, about - transform(about, angle))}
errors = {name: frame_errors(poses, log.truth) for name, poses in both.items()}
fig, axes = plt.subplots(1, 3, figsize=(12, 4.0), layout="constrained")
draw_paths(axes[0], log.truth, both["turned by 2°"], "figure 5: turned by 2°")
for kind, ax, limit in (("gauge", axes[1], 40), ("aligned", None, 0), ("ego", axes[2], 10)):
    of_kind = {name: getattr(one, kind) for name, one in errors.items()}
    if ax:
        draw_errors(ax, log.times, of_kind, limit, of=f"robot 0, {kind},")
    print(f"{kind}:", *(f"{name} {100 * e.mean():.1f} cm," for name, e in of_kind.items()))
plt.show()

# %% [markdown]
# ### Question B
# Turned by 2°, robot 0 has an error in gauge that is five times as large, but its two other errors have not changed at all. Could any robot in the hall notice the turn? For which tasks does it matter, for which not?

# %% [markdown] id="answer-relative" tags=["answer"] points=2 title="Question B: relative"
# ### BEGIN SOLUTION
# No: every reading depends only on differences of positions and on directions relative to a robot's heading; turn and shift *all* poses together and each expected reading stays as it was. Three numbers (x, y and the angle of the whole) are unobservable, and the filter
# keeps them only because it started somewhere.
#
# It matters as soon as the outside does: driving to a door, a map, a second group. It does not for all that robots do among themselves: keeping a formation, avoiding each other, meeting.
# ### END SOLUTION

# %% [markdown] id="rubric-relative" tags=["hidden"]
# **Question B, 2 points.**
# - 1 point: nobody can notice: readings depend on relative poses only (a turn and a shift of all are unobservable).
# - 1 point: matters for tasks in the world, not within the group.

# %% [markdown] tags=["hidden"]
# ## Graded checks
#
# They stand only in this copy. When a class is graded, each runs with numbers drawn for each student.

# %% id="setup-exam" tags=["setup", "hidden"]
from labkit.instructor.exam.exam import Exam
from labkit.team import Route, Team

exam = Exam("06_observers")
check = exam.check


def anywhere(rng):
    return np.array([*rng.uniform(-5, 5, 2), rng.uniform(-3.1, 3.1)])


def beginning(rng, team):
    """What a filter is told at the start, as `exam.same_run` takes it: x0, P0, a noise without systematic slips."""
    sigma = np.tile([*rng.uniform(0.05, 0.2, 2), rng.uniform(0.01, 0.03)], (team.n, 1))
    sigma[0] = 1e-3
    x0 = team.poses + sigma * rng.standard_normal(sigma.shape)
    x0[:, 2] = wrap(x0[:, 2])
    return {"x0": x0, "P0": np.diag(sigma.ravel() ** 2), "noise": team.noise}


def told_noise(rng):
    drawn = {"range": rng.uniform(0.03, 0.1), "bearing": rng.uniform(0.01, 0.03)}
    return TeamNoise(scale=0, turn_scale=0, drift=0, walk=rng.uniform(0.01, 0.04), **drawn)


def watched(rng, steps, **more):
    """Robot 0 drives round a rectangle, three others stand and watch: a log, and what a filter is told."""
    poses = [(3, 2, np.pi), (-5, -4, 0.7), (5.5, -4, 2.4), (0.5, 5, -1.6)]
    poses = np.array(poses) + rng.uniform(-0.3, 0.3, (4, 3)) * [1, 1, 0.2]
    seen = [(1, 0), (2, 0), (3, 0)]
    team = Team(poses, told_noise(rng), sees=seen, rng=rng, **more)
    told = beginning(rng, team)
    ways = {0: rng.permutation(scenarios.RECTANGLE).tolist()}
    return team.record(Route(ways), steps), told


def together(rng, n, steps=90, **more):
    """n robots that all drive and see each other: a log, and what a filter is told."""
    around = 2 * np.pi * np.arange(n) / n + rng.uniform(0, 6)
    poses = np.column_stack([5 * np.cos(around), 5 * np.sin(around), wrap(around + np.pi)])
    team = Team(poses, told_noise(rng), fov=2 * np.pi, rng=rng, **more)
    told = beginning(rng, team)
    commands = np.column_stack([rng.uniform(0.1, 0.3, n), rng.uniform(0.2, 0.5, n)])
    return team.record(lambda team: commands, steps), told


# %% id="grade-mean" tags=["hidden"] points=1 title="circular_mean: other angles, across ±180°"
rng = exam.rng()
exam.same(
    circular_mean,
    [(c + rng.normal(0, 0.5, 7),) for c in rng.uniform(-3.1, 3.1, 8)]
    + [(np.pi + rng.normal(0, 0.3, 9),)],
    "other angles",
)
print("passed")

# %% id="grade-circles" tags=["hidden"] points=2 title="two_circles: observers on all sides"
rng = exam.rng()
pairs = []
for _ in range(12):
    o, P1 = anywhere(rng), rng.uniform(-2, 2, 2)
    P2 = P1 + rng.uniform(1.5, 3) * np.array([np.cos(o[2]), np.sin(o[2])])
    z1, z2 = (exam.right("h")[0](o, np.array([*P, 0])) for P in (P1, P2))
    pairs.append((P1, z1, P2, z2, 0.01))
for k, apart in enumerate([*rng.uniform(0.5, 1, 4), *rng.uniform(0.033, 0.041, 3)]):  # west
    o, r = anywhere(rng), rng.uniform(2, 3)
    o[2] *= k < 5  # west is behind it, too
    way = np.pi + apart * np.array([-0.5, 0.5])
    P1, P2 = o[:2] + np.column_stack([np.cos(way), np.sin(way)]) * [[r], [r + 1.5]]
    z1, z2 = (exam.right("h")[0](o, np.array([*P, 0])) for P in (P1, P2))
    pairs.append((P1, z1, P2, z2, 0.01))
exam.same(two_circles, pairs, "other observers", turns=2)
print("passed")

# %% id="grade-h" tags=["hidden"] points=1 title="h: in all directions"
rng = exam.rng()
exam.same(h, [(anywhere(rng), anywhere(rng)) for _ in range(12)], "other poses")
print("passed")

# %% id="grade-jacobians" tags=["hidden"] points=2 title="jacobians: in all directions"
rng = exam.rng()
exam.same(jacobians, [(anywhere(rng), anywhere(rng)) for _ in range(12)], "other poses")
print("passed")

# %% id="grade-paper" tags=["hidden"] points=2 title="PaperEKF: another run, false readings among them"
rng = exam.rng()
log, told = watched(rng, steps=120, spurious=(-9, -9, 18, 18, 0.15))
exam.same_run(PaperEKF, log, "with standing observers", **told, inflate=rng.uniform(1, 6))
print("passed")

# %% id="grade-moving" tags=["hidden"] points=3 title="GroupEKF: all robots drive and see each other"
log, told = together(exam.rng(), 3)
exam.same_run(GroupEKF, log, "where all robots drive", **told)
print("passed")

# %% id="grade-large" tags=["hidden"] points=1 title="GroupEKF: six robots, another gate"
rng = exam.rng()
log, told = together(rng, 6, steps=40)
exam.same_run(GroupEKF, log, "with six robots", **told, gate=rng.uniform(4, 8))
print("passed")

# %% id="grade-dark" tags=["hidden"] points=1 title="GroupEKF: twelve seconds without any reading"
log, told = together(exam.rng(), 3, dark=(20, 80))
exam.same_run(GroupEKF, log, "without readings for a while", **told)
print("passed")

# %% id="grade-honest" tags=["hidden"] points=2 title="GroupEKF: honest over several runs (NEES)"
values = []
for k in range(6):
    log, told = watched(exam.rng(f"run {k}"), steps=150)
    mine = exam.same_run(GroupEKF, log, "over several runs", **told, inflate=1.0)
    values.append(nees_per_dimension(mine, log)[10:].mean())
if not 0.3 < np.mean(values) < 2.0:
    exam.fail(
        f"The NEES per dimension is {np.mean(values):.2f} over six runs: about 1 is honest."
    )
print("passed")

# %% [markdown]
# ## Summary
#
# - Robots that see each other need no map to know where they are relative to one another.
# - A turn and a shift of everything is unobservable: tell errors in a way that it does not change, aligned or ego.
# - Whoever moves needs its odometry in the prediction, observers as well.
#
# **Next:** in lab 7 three robots hold a triangle with your filter.
#
# Save, and run `labkit check notebooks/06_observers.ipynb` in a terminal before you hand it in.
#
# ## Errata and references
# - Slips of the paper, put right here: eq. (5) needs atan2; the two circles of section 1.1 do not always meet; the prediction (3) leaves out that observers move, and that a step is known in the robot's own frame only, so that its heading belongs into the state.
# - F. E. Schneider, D. Wildermuth, on the use of relative positions in the navigation of groups of robots (in Russian), 2005: sections 1 (algorithm) and 2 (experiments).
# - K. Arun, T. Huang, S. Blostein, "Least-squares fitting of two 3-D point sets", IEEE PAMI 9(5), 1987.

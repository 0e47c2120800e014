# %% [markdown]
# # Lab 4 · The legged robot: lost, found, kidnapped
#
# *About three hours; a good place for a break is after section 5. Needs nothing from your earlier notebooks.*
#
# A four-legged robot plays football. It slips, it sees the field through a keyhole, other robots stand in the way, and now and then the referee picks it up and
# puts it down elsewhere. Four people in Madrid (F. Martín, V. Matellán, P. Barrera, J. M. Cañas; *the paper*, from here on) wrote down how their robots of 2006 found themselves all the same: a **fuzzy grid** that can start from
# nothing, and an **extended Kalman filter** that is quick and precise, taking turns. You build both halves, and then find out whether what the paper says is true.
#
# **By the end you can**
# - write an EKF for a robot that turns, with odometry, a variable number of sightings and a gate;
# - explain how a fuzzy grid finds a robot that could be anywhere;
# - say when a filter should stop believing itself, and why its covariance alone cannot tell;
# - compare localizers fairly, also with Monte Carlo localization, over many runs;
# - run the same filter on real robots.
#
# **You will write** `motion`, `motion_jacobians`, `jacobian`, `stack`, the class `EKF`, `membership`, `fuse_range`, `lost_by_spread`, `lost`, and, if you like, `restart`.

# %% [markdown]
# ## Symbols
#
# | symbol | in the code | shape | unit | what it is |
# |---|---|---|---|---|
# | $s = (x, y, \theta)$ | `kf.xk_k` | (3,) | m, m, rad | estimated pose, world frame; θ from the x axis, counter-clockwise |
# | $P$ | `kf.Pk_k` | (3, 3) | m², rad² | its covariance |
# | $u = (u^x, u^y, u^\theta)$ | `u` | (3,) | m, m, rad | odometry of one step: ahead, to the left, turned, in the *robot's* frame |
# | $Q$ | `Q` | (3, 3) | m², rad² | covariance of the odometry of one step |
# | $\rho, \alpha$ | `y[0].p` | (2,) | m, rad | range and bearing of a landmark (lab 3 called them $r, \beta$); the bearing counts from the robot's *heading* |
# | | `y[0].complete` | bool | | was the whole landmark in the picture? |
# | $\nu$ | `nu` | (2p,) | m, rad | innovation of the p landmarks in view |
# | $d^2$ | `kf.d2` | list | – | $\nu_i^\top S_i^{-1} \nu_i$ of each landmark: the square of how many standard deviations it is off |
#
# The paper's equations carry their numbers here, so that you can look them up.

# %% id="setup" tags=["setup"]
from functools import partial

import matplotlib.pyplot as plt
import numpy as np

from labkit import check, make_filter, metrics, mrclam, progress, replay, wrap
from labkit.geometry import compose
from labkit.legged import FIELD, PRESETS, FuzzyGrid, Hybrid, LeggedRobot, Memory, Noise
from labkit.legged import ParticleFilter, Triangulation
from labkit.legged import (
    explore,
    play,
    plot_experiment,
    plot_race,
    poses_around,
    race,
    show_beliefs,
)
from labkit.legged import show_walk, table

# %% [markdown]
# ## 1. The field and the robot
#
# Two goals and four beacons, each with a name and colours of its own: that is all the robot can recognise. Its camera sees 57° at a time and pans from side to side. `record` lets
# the robot walk and keeps everything in a log, as in the labs before. A step lasts 0.1 s. Step by step: what the legs report (odometry), what the camera saw, and (for us only) the truth.

# %%
log = LeggedRobot("real", rng=2).record(steps=300)
show_walk(log)
for k in range(8):
    seen = log.measurements()[k] or ["nothing"]
    print(f"step {k}: odometry {log.controls[k].round(3)}, sees", *seen)

# %% [markdown]
# `"real"` names a set of noise figures, a `Noise`: the paper's simulator has knobs for odometry, range and bearing, and ours has a few more. `"paper"` is as kind as the paper's own experiments, `"real"` adds
# what they left out (robots in the way, false alarms, a *bias* that stays the same for a whole run), and `"harsh"` is a bad day. A filter does not know the biases; `told()` is what it
# may be told instead: more noise. Noise of odometry and ranges is a *fraction* (0.1 is 10 %), that of bearings is in rad (0.0349 is 2°), `slip` and `spin` are in m and rad; `help(Noise)` has the rest.

# %%
for name, noise in PRESETS.items():
    print(f"{name:6s} has  {noise}\n       told {noise.told()}")

# %% [markdown]
# ## 2. Walking
#
# The odometry is in the robot's own frame: "3 cm ahead, 1 cm to the left". Where that leads in the world depends on the heading (eqs 3–5, without noise):
#
# $$ x' = x + u^x\cos\theta - u^y\sin\theta, \qquad y' = y + u^x\sin\theta + u^y\cos\theta, \qquad \theta' = \theta + u^\theta . $$
#
# That is not linear in $\theta$. As in lab 3, a tangent stands in: two Jacobians, of the new pose by the old pose ($A$, eq. 9) and by the odometry ($W$, eq. 10). The second is
# needed because the noise sits *in the odometry*, so in the robot's frame.
#
# **Before you go on:** if the robot's heading is slightly wrong and it walks straight ahead, in which direction does its position go wrong?
#
# ### Exercise 1 · `motion(x, u)` and `motion_jacobians(x, u)`
# `motion` returns the new pose (3,), with the heading wrapped into (−π, π]; `motion_jacobians` returns `A, W`, both (3, 3), at the *old* heading.
# *Example:* from `(1, 0, π/2)` the odometry `(0.5, 0.1, 0)` leads to `(0.9, 0.5, π/2)`.
#
# <details><summary>Hint</summary>
#
# $A$ is the identity but for two entries in its last column: the derivatives of $x'$ and $y'$ by $\theta$. Remember that the derivative of cos is −sin. $W$ is
# a rotation matrix with a 1 for the heading.
# </details>


# %% id="answer-motion" tags=["answer"]
def motion(x, u):
    """Pose (3,) after the odometry u (3,) of one step from the pose x (3,)."""
    ### BEGIN SOLUTION
    c, s = np.cos(x[2]), np.sin(x[2])
    dx, dy = c * u[0] - s * u[1], s * u[0] + c * u[1]
    return np.array([x[0] + dx, x[1] + dy, wrap(x[2] + u[2])])
    ### END SOLUTION


def motion_jacobians(x, u):
    """(A, W): derivatives (3, 3) of motion(x, u) by x and by u."""
    ### BEGIN SOLUTION
    c, s = np.cos(x[2]), np.sin(x[2])
    A = np.array([[1, 0, -s * u[0] - c * u[1]], [0, 1, c * u[0] - s * u[1]], [0, 0, 1]])
    W = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return A, W
    ### END SOLUTION


# %% id="check-motion" tags=["check"] points=1 title="motion"
check("legged-motion", motion)

# %% id="check-motion-jacobians" tags=["check"] points=2 title="motion_jacobians"
check("legged-motion-jacobians", motion_jacobians)

# %% [markdown]
# So with a slightly wrong heading, a robot that walks straight ahead goes wrong *sideways*: for $\theta = 0$, the last column of $A$ is $(0, u^x, 1)$.
#
# ## 3. Seeing
#
# You wrote most of `h` in lab 3: the range and the bearing of a landmark, expected from a pose. What is new: the bearing counts from where the robot faces, so the heading is subtracted. It is given in the next cell.
#
# This time the paper does not differentiate by hand: it lets the computer move the pose a little to either side and look how the measurement changes (eq. 18),
#
# $$ H_{[i,j]} \approx \frac{h_i(s + \Delta e_j) - h_i(s - \Delta e_j)}{2\Delta}, $$
#
# where $e_j$ is 1 in component $j$ and 0 elsewhere: *one* component moves at a time. (The paper's formula can be read as if all did.) It works for any `h`, and no sign can be forgotten. One trap is left:
# the difference of two bearings.
#
# ### Exercise 2 · `jacobian(x, landmark, step)`
# Return the (2, 3) matrix. *Example:* from `(0, 0, 0)` a landmark at `(2, 0)` gives `[[-1, 0, 0], [0, -0.5, -1]]`.
#
# <details><summary>Hint</summary>
#
# Start from `H = np.empty((2, 3))`, loop over `j`, make a vector `e = np.zeros(3)` with `e[j] = step`, and fill the column `H[:, j]`. Near ±180° two bearings that are
# 0.002° apart look 360° apart: `wrap` the difference before you divide.
# </details>


# %% id="answer-jacobian" tags=["answer"]
def h(x, landmark):
    """Given: expected range [m] and bearing [rad] (2,) of a landmark from the pose x (3,)."""
    dx, dy = landmark - x[:2]
    return np.array([np.hypot(dx, dy), wrap(np.arctan2(dy, dx) - x[2])])


def jacobian(x, landmark, step=1e-5):
    """Derivatives (2, 3) of h: rows range, bearing; columns x, y, heading."""
    ### BEGIN SOLUTION
    H = np.empty((2, 3))
    for j in range(3):
        e = np.zeros(3)
        e[j] = step
        change = h(x + e, landmark) - h(x - e, landmark)
        change[1] = wrap(change[1])
        H[:, j] = change / (2 * step)
    return H
    ### END SOLUTION


# %% id="check-jacobian" tags=["check"] points=2 title="jacobian"
check("legged-jacobian", jacobian)

# %% [markdown]
# How good is the numeric derivative? The exact one is that of lab 3, with $d$ the vector from the robot to the landmark: $(-d_x, -d_y)/\rho$ for the range, $(d_y, -d_x)/\rho^2$ for the bearing, and a third column for the heading: 0 and −1.

# %%
rng = np.random.default_rng(0)
largest = 0.0
for _ in range(1000):
    x, landmark = rng.uniform(-3, 3, 3), FIELD.map[rng.integers(6)]
    dx, dy = landmark - x[:2]
    r = np.hypot(dx, dy)
    exact = np.array([[-dx / r, -dy / r, 0], [dy / r**2, -dx / r**2, -1]])
    largest = max(largest, abs(jacobian(x, landmark) - exact).max())
agree = bool(largest < 1e-4)
print("numeric and exact Jacobian agree to 1e-4:", agree, "" if agree else "(look at wrap)")

# %% [markdown]
# ### What is a sighting worth?
#
# The number of landmarks in view changes from picture to picture, and so do the sizes of $\nu$, $H$ and $R$. And sightings are not equally good. The range error grows with the range (and
# is worse for a goal, which is wide, than for a beacon): $\sigma_\rho = $ `noise.of_range(lm)` $\cdot\,\rho\, + $ `noise.range_floor`. The bearing is good to 2° if the landmark is wholly in the picture, and to 18° if it is cut off: `noise.bearing`
# and `noise.bearing_partial`.
#
# Which $\rho$ goes into $\sigma_\rho$? Take the *expected* one. If you took the measured one, a range that came out too short would also be trusted more, and the filter would be dragged
# toward the landmarks.
#
# ### Exercise 3 · `stack(y, m, x, noise)`
# For p sightings `y` (at least one), the map `m` and the pose `x`, return
# - `nu` (2p,), what was seen minus what is expected, bearings wrapped: $\rho_1, \alpha_1, \rho_2, \alpha_2 \dots$ (eq. 11),
# - `H` (2p, 3), the Jacobians below one another,
# - `R` (2p, 2p), diagonal, with the *squares* of the standard deviations above.
#
# <details><summary>Hint</summary>
#
# Loop over `y`. `known = m[m.index(lm)]` is the landmark's place on the map, `expected = h(x, known)`. Collect three lists, then `np.concatenate`, `np.vstack`, and `np.diag` of the
# squared sigmas.
# </details>


# %% id="answer-stack" tags=["answer"]
def stack(y, m, x, noise):
    """(nu (2p,), H (2p, 3), R (2p, 2p)) of p sightings y, expected from the pose x (3,)."""
    ### BEGIN SOLUTION
    nu, H, sigmas = [], [], []
    for lm in y:
        known = m[m.index(lm)]
        expected = h(x, known)
        off = lm.p - expected
        nu.append([off[0], wrap(off[1])])
        H.append(jacobian(x, known))
        sigmas.append(noise.of_range(lm) * expected[0] + noise.range_floor)
        sigmas.append(noise.bearing if lm.complete else noise.bearing_partial)
    return np.concatenate(nu), np.vstack(H), np.diag(np.square(sigmas))
    ### END SOLUTION


# %% id="check-stack" tags=["check"] points=2 title="stack"
check("legged-stack", stack)

# %% [markdown]
# ## 4. The filter
#
# **Predict** (eqs 6, 7): the pose moves, and $P \leftarrow A P A^\top + W Q W^\top$. The paper's $Q$ (eq. 8) is $0.1\,|u|$ on the diagonal. That mixes up variances with standard deviations, it is zero
# when the robot stands, and a robot that walks straight ahead never slips aside. Let us say instead that each component has the standard deviation
#
# $$ \sigma_i = \texttt{noise.odometry}\cdot|u_i| + \text{floor}_i, \qquad \text{floor} = (\texttt{noise.slip}, \texttt{noise.slip}, \texttt{noise.spin}), \qquad Q = \operatorname{diag}(\sigma_1^2, \sigma_2^2, \sigma_3^2) . $$
#
# **Update** (eqs 12–14), with `stack`. First the *gate*: a false alarm should not be believed. For each landmark take its own 2 × 2 block of $S = HPH^\top + R$ and its two numbers
# of $\nu$, and compute $d^2 = \nu_i^\top S_i^{-1}\nu_i$. An honest sighting has $d^2 < 13.8$ in 999 of 1000 cases (chi-square with two degrees of freedom). The others are left out. What remains corrects the pose:
#
# $$ K = P H^\top S^{-1}, \qquad s \leftarrow s + K\nu, \qquad P \leftarrow (I - KH)\,P\,(I - KH)^\top + K R K^\top . $$
#
# The last is the *Joseph form*: the same as $(I - KH)P$ on paper (eq. 13), but it stays symmetric and positive whatever the rounding. At the end the heading is wrapped.
#
# ### Exercise 4 · the class `EKF`
# Write `predict` and `update`. Keep in `self.d2` the list of $d^2$ of *all* landmarks of this update, also of those that the gate leaves out (empty, if nothing was in view): you will
# need it in section 7. With nothing inside the gate, the estimate stays as it is.
#
# <details><summary>Hint 1: the gate</summary>
#
# `[nu[i : i + 2] @ np.linalg.solve(S[i : i + 2, i : i + 2], nu[i : i + 2]) for i in range(0, len(nu), 2)]` is the list of d².
# </details>
# <details><summary>Hint 2: leaving some out</summary>
#
# Make an array of booleans, True for the landmarks inside the gate; `np.repeat(inside, 2)` has two entries for each, as `nu` has. With that as `keep`: `nu[keep]`, `H[keep]`, and for a
# square matrix `R[np.ix_(keep, keep)]`; the same for `S`.
# </details>


# %% id="answer-ekf" tags=["answer"]
class EKF:
    """Extended Kalman filter for the pose of a robot that sees ranges and bearings."""

    def __init__(self, x0, P0, m, noise, gate=13.8):
        self.xk_k = np.array(x0, dtype=float)  # (3,) estimate of the pose [m, m, rad]
        self.Pk_k = np.array(P0, dtype=float)  # (3, 3) its covariance
        self.map = m  # the Map
        self.noise = noise  # the Noise that it is told
        self.gate = gate  # sightings with a larger d2 are left out
        self.d2 = []  # of each landmark of the last update

    def predict(self, u):
        """Move the estimate by the odometry u (3,) of one step."""
        ### BEGIN SOLUTION
        A, W = motion_jacobians(self.xk_k, u)
        floor = np.array([self.noise.slip, self.noise.slip, self.noise.spin])
        Q = np.diag((self.noise.odometry * np.abs(u) + floor) ** 2)
        self.xk_k = motion(self.xk_k, u)
        self.Pk_k = A @ self.Pk_k @ A.T + W @ Q @ W.T
        ### END SOLUTION

    def update(self, y):
        """Correct the estimate with the landmarks in view: a list, maybe empty."""
        ### BEGIN SOLUTION
        self.d2 = []
        if not y:
            return
        nu, H, R = stack(y, self.map, self.xk_k, self.noise)
        S = H @ self.Pk_k @ H.T + R
        for i in range(0, len(nu), 2):
            block = slice(i, i + 2)
            self.d2.append(nu[block] @ np.linalg.solve(S[block, block], nu[block]))
        keep = np.repeat(np.array(self.d2) < self.gate, 2)
        if not keep.any():
            return
        nu, H, R, S = nu[keep], H[keep], R[np.ix_(keep, keep)], S[np.ix_(keep, keep)]
        K = np.linalg.solve(S, H @ self.Pk_k).T
        self.xk_k = self.xk_k + K @ nu
        self.xk_k[2] = wrap(self.xk_k[2])
        I_KH = np.eye(3) - K @ H
        self.Pk_k = I_KH @ self.Pk_k @ I_KH.T + K @ R @ K.T
        ### END SOLUTION


# %% id="check-ekf" tags=["check"] points=4 title="EKF: single steps and a short walk"
check("legged-ekf", EKF)

# %% [markdown]
# Let it run. It starts where the robot really is, give or take 10 cm and 6°: for now nobody asks how it got there.

# %%
START = np.diag([0.1, 0.1, 0.1]) ** 2


def from_truth(log, gate=13.8):
    """History of your EKF over a log, started at the true pose."""
    kf = make_filter(
        partial(EKF, gate=gate), log, x0=log.truth[0], P0=START, noise=log.noise.told()
    )
    return replay(kf, log)


history = from_truth(log)
show_walk(log, history)
print(metrics.summary(history, log))

# %% [markdown]
# Is it honest? With noise that is exactly as it was told (no biases, nothing hidden, no false alarms), the NEES should have a mean of 3, the number of components.

# %%
plain = Noise(
    odometry=0.1, range_beacon=0.05, range_goal=0.05, bearing=0.035, bearing_partial=0.1
)
values = []
for seed in range(50):
    run = LeggedRobot(plain, rng=seed).record(150)
    first = run.truth[0] + np.random.default_rng(seed).normal(0, 0.1, 3)
    kf = make_filter(EKF, run, x0=first, P0=START, noise=plain)
    values.append(metrics.nees(replay(kf, run), run))
low, high = metrics.chi2_bounds(3, runs=50)
mean = np.mean(values, axis=0)
inside = 100 * np.mean((low < mean) & (mean < high))
print(f"mean NEES {mean.mean():.1f}; {inside:.0f} % of the steps inside the 95 % bounds")

# %% [markdown]
# ### The gate
# Two filters on the same walks, one without a gate. **Before you run it:** under `real` one picture in a hundred has a false alarm, under `harsh` five. How much can that matter?

# %%
walks = {
    name: [LeggedRobot(name, rng=seed).record(300) for seed in range(30)] for name in PRESETS
}


def mean_error(logs, gate):
    """Mean distance [cm] between estimate and truth over several walks."""
    errors = [metrics.distances(from_truth(one, gate), one) for one in logs]
    return 100 * np.mean(errors)


print("mean error [cm]    no gate    gate 13.8")
for name, logs in walks.items():
    print(f"{name:6s} {mean_error(logs, np.inf):18.1f} {mean_error(logs, 13.8):12.1f}")

# %% [markdown]
# ## 5. The paper's three experiments
#
# Figures 6, 7 and 8 of the paper show three walks. Its authors write that the error of (x, y) exceeds 7 cm at no moment, and that the heading is never off by more than 60°. Here are three walks of 40 s under the noise of their
# simulator; the dashed lines are the two claims.

# %%
fig, axes = plt.subplots(2, 3, figsize=(11, 5), layout="constrained", sharex=True)
for i, seed in enumerate([6, 7, 8]):
    run = LeggedRobot("paper", rng=seed).record(400)
    plot_experiment(axes[:, i], run, from_truth(run))
    axes[0, i].set_title(f"experiment {i + 1}", fontsize=11)
    axes[0, i].set_xlabel("")
plt.show()

# %% [markdown]
# Three walks prove little. How often do the two claims hold over thirty walks of 30 s, and with more noise?

# %%
print("           share of walks with               not exceeded in 95 %")
print("           position < 7 cm   heading < 60°   of the steps")
for name, logs in walks.items():
    errors = [metrics.errors(from_truth(one), one) for one in logs]
    far = 100 * np.array([np.hypot(*e[:, :2].T) for e in errors])
    turned = np.rad2deg([abs(e[:, 2]) for e in errors])
    near = 100 * np.mean(far.max(axis=1) < 7)
    straight = 100 * np.mean(turned.max(axis=1) < 60)
    usual = np.percentile(far, 95), np.percentile(turned, 95)
    print(f"{name:6s} {near:13.0f} % {straight:15.0f} % {usual[0]:12.1f} cm, {usual[1]:.1f}°")

# %% [markdown]
# ### Question A
# "The error never exceeds 7 cm." Which figure would you print instead, if you were to write the paper? And why is the claim about 60° of little use to a robot that wants to shoot at a goal?

# %% [markdown] id="answer-claims" tags=["answer"] points=2 title="Question A: the claims"
# ### BEGIN SOLUTION
# A maximum over three walks says little: it grows with the number of walks, with their length, and with the noise. Under the paper's own noise the position stays below 7 cm in all thirty walks,
# under `real` in one of thirty, under `harsh` in none. Better: the mean (1.5 cm, 5 cm) and the error that is not exceeded in 95 % of the steps, over how many walks, and under which noise.
#
# The heading stays below 60° always; the claim is so weak that even a poor filter fulfils it. Here its error is about 1° under `real`. At 2 m from the goal 60° are 3.5 m beside it.
# ### END SOLUTION

# %% [markdown] id="rubric-claims" tags=["hidden"]
# **Question A, 2 points.**
# - 1 point: a maximum depends on how many walks and which noise; a mean or a percentile over many walks instead, with the noise named.
# - 1 point: 60° is far too weak a claim (metres beside the goal), or the true error is far smaller.

# %% [markdown]
# ## 6. Kidnapped
#
# Half-way through, the referee carries the robot to another place. **Before you run it:** what will your filter do? What will its covariance do?

# %%
carried = LeggedRobot("real", rng=1).record(300, kidnap=150)
history = from_truth(carried)
show_walk(carried, history)
spread = np.sqrt(history.P[:, 0, 0] + history.P[:, 1, 1])
error = metrics.distances(history, carried)
for k in (149, 160, 200, 300):
    print(f"step {k}: error {error[k]:5.2f} m, the filter believes in {spread[k]:.2f} m")

# %% [markdown]
# The gate that kept false alarms out now keeps *everything* out. (Without it the filter would be dragged across the field, now right, now wrong.) And the filter is content: $P$ is computed from the Jacobians and the noise;
# no measured number ever enters it.
#
# So somebody has to find the robot again without any idea of where it is. That is not a job for a Gaussian.
#
# ## 7. The fuzzy grid
#
# (New letters for this section only, as in the paper: $h$ is a *height* here, $s$ half a *support*, $b$ a lower bound that the paper calls *bias*.)
#
# Cut the field into cells of 10 cm. Each cell keeps how *possible* it is that the robot is there: a number from 0 to 1. And since a robot in that cell would have to face somewhere, each cell also keeps *one fuzzy
# heading*, a trapezoid (figure 3): certain in its **core** around θ, impossible beyond its **support**, in between something in between; never below a **bias** $b$, since any sighting may be false.
#
# $$ \mu(\varphi) = b + (h - b)\cdot\operatorname{clip}\!\left(\frac{s - |\varphi - \theta|}{s - c},\, 0,\, 1\right) $$
#
# with half the core $c$, half the support $s$ and the height $h$. (The paper calls the width Δ and the flank α; core and support say the same and are easier to compute with.)
#
# ### Exercise 5 · `membership(phi, theta, c, s, h, b)`
# Return μ at the angle(s) `phi`, a number or an array. The difference of two angles is wrapped: 179° and −179° are neighbours. *Example:* with θ = 0.2, c = 0.3, s = 0.9, h = 0.8 and b = 0.1, φ = 0.75 has μ = 0.508.
#
# <details><summary>Hint</summary>
#
# `np.clip(value, 0, 1)` cuts off at both ends.
# </details>


# %% id="answer-membership" tags=["answer"]
def membership(phi, theta, c, s, h, b):
    """How possible the heading phi [rad] (number or array) is in a trapezoid."""
    ### BEGIN SOLUTION
    away = np.abs(wrap(phi - theta))
    return b + (h - b) * np.clip((s - away) / (s - c), 0, 1)
    ### END SOLUTION


# %% id="check-membership" tags=["check"] points=1 title="membership"
check("legged-membership", membership)

# %%
phi = np.linspace(-np.pi, np.pi, 721)
fig, ax = plt.subplots(figsize=(7, 2.6), layout="constrained")
for label, style, shape in [
    ("sure of the heading", "-", (0.5, 0.1, 0.4, 1, 0.1)),
    ("hardly sure, across ±180°", "--", (3.0, 0.8, 1.6, 0.7, 0.1)),
]:
    ax.plot(np.rad2deg(phi), membership(phi, *shape), style, label=label)
ax.set(
    xlabel="heading φ [°]",
    ylabel="μ",
    ylim=(0, 1.05),
    xlim=(-180, 180),
    xticks=range(-180, 181, 60),
)
ax.legend(frameon=False)
plt.show()

# %% [markdown]
# ### Seeing, for a grid
#
# A landmark is seen at the range $r$. Each cell compares: its own distance $d$ to the landmark is off by $e = |d - r|$. As far as the error is explained by noise and by the size of the cell, the cell stays fully possible; then its possibility falls, over another 2σ, down to $b$, never to zero, for a sighting may be false:
#
# $$ S = \operatorname{clip}\!\left(1 - 0.9\,\frac{e - (\sigma + 0.3\,\text{cell})}{2\sigma},\; b,\; 1\right) . $$
#
# To **fuse** is to multiply: what the grid believed, times $S$. Then all is divided by the largest value, and no cell is left below a `floor` (0.01), or it could never come back.
#
# ### Exercise 6 · `fuse_range(possible, distance, r, sigma, cell, b, floor)`
# `possible` and `distance` are arrays of one shape, a value for each cell. Return the new array. No loop is needed. (0.3 and 0.9 are choices, nothing deeper; σ = `sigma`.) *Example:* two cells,
# `possible = [1, 1]`, `distance = [2.0, 2.4]`, r = 2, σ = 0.1, cell = 0.1, b = 0.2, floor = 0.01: the result is `[1, 0.2]`.
#
# <details><summary>Hint</summary>
#
# Four lines: `e`, `S`, the product, and `np.maximum(product / product.max(), floor)`.
# </details>


# %% id="answer-fuse" tags=["answer"]
def fuse_range(possible, distance, r, sigma, cell=0.1, b=0.2, floor=0.01):
    """The grid after a landmark, `distance` [m] from each cell, was seen at range r [m]."""
    ### BEGIN SOLUTION
    e = np.abs(distance - r)
    S = np.clip(1 - 0.9 * (e - (sigma + 0.3 * cell)) / (2 * sigma), b, 1)
    product = possible * S
    return np.maximum(product / product.max(), floor)
    ### END SOLUTION


# %% id="check-fuse" tags=["check"] points=2 title="fuse_range"
check("legged-fusion", fuse_range)

# %% [markdown]
# Three ranges, one after the other, to the landmark that is a star; the cross is the robot: circles that cross. The kit's `FuzzyGrid` does the same and fuses the headings too: where a cell lies decides which heading fits to a bearing. Its figure is that of the
# paper (figure 4): the greener, the more possible; the black wedges are the headings of the best cells, the wider, the less sure.

# %%
x, y = np.meshgrid(np.arange(-2.85, 2.9, 0.1), np.arange(-1.95, 2, 0.1))
possible = np.ones(x.shape)
pose = np.array([-0.8, 0.6, 0.0])
fig, axes = plt.subplots(1, 3, figsize=(11, 2.7), layout="constrained")
for ax, landmark in zip(axes, [FIELD.map[0], FIELD.map[4], FIELD.map[3]]):
    r = h(pose, landmark)[0]
    possible = fuse_range(
        possible, np.hypot(landmark.p[0] - x, landmark.p[1] - y), r, 0.1 * r
    )
    ax.pcolormesh(x, y, possible, cmap="Greens", vmin=0, vmax=1)
    ax.plot(*landmark.p, "k*", ms=12)
    ax.plot(*pose[:2], "+", color="#0072B2", ms=12, mew=2)
    ax.set(
        aspect="equal",
        title=f"{landmark.id}, {r:.1f} m away",
        xlabel="x [m]",
        xlim=(-3, 3),
        ylim=(-2.2, 2.2),
    )
axes[0].set_ylabel("y [m]")
plt.show()

# %%
run = LeggedRobot("real", rng=12).record(60)
show_beliefs(FuzzyGrid(run.noise.told()), run, steps=[0, 1, 4, 10, 20, 60])

# %% [markdown]
# To walk, a grid is shifted. A step of 2.5 cm is less than a cell; so steps are collected until a whole cell has come together, then the grid is blurred a little (a possible cell lends to its neighbours) and each
# cell is moved *along its own heading*. Cells that disagree about the heading part company. That is why one heading for the whole grid would not do.
#
# Grid, EKF and particles on one walk; press play. At 8 s the robot is kidnapped. (Particles are section 9's; the EKF knows the start, the others do not.)

# %%
run = LeggedRobot("real", rng=5).record(150, kidnap=80)
told = run.noise.told()
play(
    {
        "fuzzy grid": FuzzyGrid(told),
        "your EKF": make_filter(EKF, run, x0=run.truth[0], P0=START, noise=told),
        "500 particles": ParticleFilter(500, told, rng=1),
    },
    run,
)

# %% [markdown]
# ## 8. Taking turns
#
# The grid starts from nothing and survives kidnappings, but it is coarse and costs time. The EKF is quick and precise, and helpless when lost. The paper lets them take turns: the grid works until it is sure enough (here: what it saw lately fits some cell to more than 60 %, and the
# cells that are at least 0.7 times as possible as the best span less than a metre, both in three pictures in a row); then the EKF takes over, from the mean and the covariance of those cells. And back?
#
# > *If the matrix P reflects too much uncertainty, the grid takes over again* (our words, section 5 of the paper).
#
# ### Exercise 7a · `lost_by_spread(P)`
# True if the position's standard deviation $\sqrt{P_{xx} + P_{yy}}$ is above 0.5 m or that of the heading above 1 rad.


# %% id="answer-spread" tags=["answer"]
def lost_by_spread(P, position=0.5, heading=1.0):
    """Whether the covariance P (3, 3) of a pose is too wide: the paper's rule."""
    ### BEGIN SOLUTION
    return bool(np.sqrt(P[0, 0] + P[1, 1]) > position or np.sqrt(P[2, 2]) > heading)
    ### END SOLUTION


# %% id="check-spread" tags=["check"] points=1 title="lost_by_spread"
check("legged-spread", lost_by_spread)


# %%
def follower(log):
    """What a Hybrid needs to start your EKF: a function of x0 and P0."""
    return lambda x0, P0: make_filter(EKF, log, x0=x0, P0=P0, noise=log.noise.told())


def hybrid(log, rule, background=0):
    """Grid and EKF taking turns; rule(P, d2) says when the EKF gives up."""
    return Hybrid(FuzzyGrid(log.noise.told()), follower(log), rule, background)


def paper_rule(P, d2):
    return lost_by_spread(P)


kidnapped = [LeggedRobot("real", rng=seed).record(300, kidnap=150) for seed in range(20)]
(result,) = race({"the paper's rule": lambda log: hybrid(log, paper_rule)}, kidnapped)
found = np.isfinite(result.recovered())
print(f"{found.sum()} of {len(found)} kidnapped robots were found again")

# %% [markdown]
# The rule sounds right and does not work: after a kidnapping $P$ stays small. With the gate it even stays small for a very long time, for the EKF walks on by odometry, and some sighting happens to fit now and then.
#
# What does change? The filter is *surprised*: sighting after sighting has an impossible $d^2$. One alone may be a false alarm; most of the last eight cannot be.
#
# ### Exercise 7b · `lost(P, d2, bound, share)`
# `d2` (array) holds the $d^2$ of the last sightings, at most eight, the oldest first. Return True if the paper's rule says so, *or* if there are eight and at least the `share` of them is above `bound`.
#
# <details><summary>Hint</summary>
#
# `np.mean(d2 > bound)` is the share of the surprises. With fewer than eight sightings wait: after the switch the list starts empty.
# </details>


# %% id="answer-lost" tags=["answer"]
def lost(P, d2, bound=13.8, share=0.6):
    """Whether to give up, with covariance P (3, 3) and the last squared distances d2."""
    ### BEGIN SOLUTION
    surprised = len(d2) >= 8 and np.mean(np.asarray(d2) > bound) >= share
    return bool(lost_by_spread(P) or surprised)
    ### END SOLUTION


# %% id="check-lost" tags=["check"] points=2 title="lost"
check("legged-lost", lost)

# %%
(result,) = race({"your rule": lambda log: hybrid(log, lost)}, kidnapped)
steps = result.recovered()
print(f"{np.isfinite(steps).sum()} of {len(steps)} kidnapped robots were found again,")
print(f"half of them within {np.nanmedian(steps) / 10:.1f} s")

# %% [markdown]
# Try when to switch. The walk stays the same; only your code runs again. This robot has a bad day: switch to `real` and `paper` as well, and look at a few walks.

# %%
explore(EKF, lost)

# %% [markdown]
# One walk proves little. The same over twenty walks, under `harsh` noise:


# %% tags=["nbval-ignore-output"]
def ungated(log):
    """The hybrid, with an EKF that believes every sighting."""
    told, KF = log.noise.told(), partial(EKF, gate=np.inf)
    follow = lambda x0, P0: make_filter(KF, log, x0=x0, P0=P0, noise=told)
    return Hybrid(FuzzyGrid(told), follow, lost)


harsh = [LeggedRobot("harsh", rng=seed).record(300, kidnap=150) for seed in range(20)]
variants = {
    f"share {share}": lambda log, share=share: hybrid(log, partial(lost, share=share))
    for share in (0.6, 0.2, 1.0)
}
print(table(race({**variants, "no gate": ungated}, harsh, progress)))

# %% [markdown]
# ### Question B
# What does a share of 0.2 do, what one of 1.0, before and after the kidnapping? And why does a filter without a gate, which believes all that it sees, not do as well?

# %% [markdown] id="answer-switch" tags=["answer"] points=3 title="Question B: when to switch"
# ### BEGIN SOLUTION
# With a share of 0.2 two false alarms or unlucky sightings among eight suffice, and the grid takes over although nothing has happened: worse accuracy and more computing. In exchange a kidnapping is noticed sooner. With 1.0 all eight have to be surprises:
# after a kidnapping one sighting that happens to fit is enough to stay lost, so the switch comes late or, in some runs, never.
#
# Without the gate the filter is dragged towards each sighting, right or wrong: each false alarm pulls it away for a while, and it is sure of itself there. The gate and the rule belong together: the gate protects from single lies, the rule notices when the liar is the filter itself.
# ### END SOLUTION

# %% [markdown] id="rubric-switch" tags=["hidden"]
# **Question B, 3 points.**
# - 1 point: a small share switches on false alarms, without need.
# - 1 point: a large share switches late or never.
# - 1 point: without the gate single false alarms drag the filter, and recovery is a matter of luck.

# %% [markdown]
# ## 9. The rivals
#
# In the paper's table 1, of sixteen teams at the RoboCup 2004 ten used **Monte Carlo localization**, two an EKF, two both, two plain **triangulation**. The kit has them:
#
# - `ParticleFilter(n, noise)`: n guesses (*particles*) walk along with the odometry; those that explain the sightings are copied, the others die. When nothing fits any more, new ones are drawn from poses that explain a present sighting.
# - `Triangulation()`: lays the landmarks of the last two seconds on the map. It has no filter at all.
# - `Hybrid` takes any of them in place of the grid: Monte Carlo and your EKF. With `background=3` the grid goes on working at every third step while the EKF leads.
#
# One function runs them all over the same walks. Each walk starts from nothing (the EKF alone has to know its start) and has a kidnapping at 15 s.
#
# **Before you run it:** which one will track best? Which one recovers soonest? Which is cheapest?


# %% tags=["nbval-ignore-output"]
def particles(log, n):
    return ParticleFilter(n, log.noise.told(), rng=0)


contestants = {
    "EKF alone": lambda log: follower(log)(log.truth[0], START),
    "fuzzy grid alone": lambda log: FuzzyGrid(log.noise.told()),
    "MCL, 500": lambda log: particles(log, 500),
    "MCL, 2000": lambda log: particles(log, 2000),
    "triangulation": lambda log: Triangulation(),
    "MCL + EKF": lambda log: Hybrid(particles(log, 500), follower(log), lost),
    "grid + EKF": lambda log: hybrid(log, lost),
    "grid (backgr.) + EKF": lambda log: hybrid(log, lost, background=3),
}
results = race(contestants, kidnapped, progress)
print(table(results))
fig, axes = plt.subplots(1, 3, figsize=(11, 4.3), layout="constrained")
plot_race(axes, results)
plt.show()

# %% [markdown]
# ### Question C
# Which would you put on the robot, which has to think about football too? Give the two figures of the table that decide it for you, and one that speaks against your choice.

# %% [markdown] id="answer-rivals" tags=["answer"] points=2 title="Question C: which localizer"
# ### BEGIN SOLUTION
# Grid + EKF: it tracks as well as the EKF alone (about 5 cm, where the grid has 12 and 2000 particles have 8), finds every kidnapped robot, and costs little more than the EKF, a third of the grid. Against it: after a kidnapping it takes about a
# second longer than the grid alone, for the grid starts from nothing; with the grid in the background it is quicker, at three times the cost of the EKF. Monte Carlo with 500 particles and an EKF is a good choice as well.
# ### END SOLUTION

# %% [markdown] id="rubric-rivals" tags=["hidden"]
# **Question C, 2 points.**
# - 1 point: a choice with two figures of the table for it (accuracy, recovery, cost).
# - 1 point: a figure that speaks against it.

# %% [markdown]
# ## 10. Better than taking turns? (an open exercise)
#
# The paper ends with two ideas for the future: *an optimal combination of both*, and *particle filters to restart the Kalman filter*. Here is a chance to try. When the EKF gives up, the sightings that
# surprised it are not lost: together they say where the robot is. So keep the last ten of them (the kit's `Memory` does, for next to nothing), and when you are lost, look for the pose that explains them.
#
# `restart(past)` gets, for n remembered sightings: `past.places` (n, 2) of the landmarks, `past.seen` (n, 2) range and bearing, `past.sigma` (n, 2) their standard deviations, `past.since` (n, 3) the motion from
# that sighting to now, and `past.before` (n, 3) the motion back. It returns `(x0, P0)`, or `None` as long as it is not sure. The kit gives you `poses_around(place, r, bearing, directions)`, the poses (k, 3) from which a landmark is seen so, and `compose(poses, u)`, the poses after the motions u.
#
# ### Exercise 8 · `restart(past)`
# One recipe:
# 1. *Candidates:* poses on the rings of the last four sightings, moved to now. For sighting i and an array of directions (of the robot as seen from the landmark) that is `compose(poses_around(past.places[i], *past.seen[i], directions), past.since[i])`.
# 2. *Cost* of a candidate: where would it have been at each sighting (`compose(pose, past.before)`), and how many σ is what was seen then off? The sum of min(d², 13.8), so that a lie costs no more than that.
# 3. *Draw* 200 of them anew, with weights exp(−cost/2), flattened in the first rounds; jitter them, by 30 cm and 0.3 rad at first, by half of that in the next round, and so on, four rounds in all.
# 4. The weighted mean and covariance of the last round are x0 and P0. Return them if at least four sightings, and most of them, fit (d² < 9), and if P0 is narrow. The kit takes over only from a P0 with σ below a metre.
#
# There is no check for this; the race is the judge. A median of 1 s or less after a kidnapping is good; if yours is above 1.5 s, look for a mistake. (`background=1` lets the memory collect at every step, `frames=1` believes its first answer.)
#
# <details><summary>Hint</summary>
#
# All candidates and all sightings at once: with `many = poses[:, None]`, which has the shape (candidates, 1, 3), `compose(many, past.before)` has the shape (candidates, sightings, 3).
# </details>


# %% id="answer-restart" tags=["answer"]
def restart(past, rounds=4, n=200):
    """(x0 (3,), P0 (3, 3)) of the pose that explains what is remembered, or None."""
    ### BEGIN SOLUTION
    if len(past) < 4:
        return None
    rng = np.random.default_rng(len(past))
    around = np.linspace(-np.pi, np.pi, 48, endpoint=False)
    latest = list(zip(past.places, past.seen, past.since))[-4:]
    poses = np.vstack(
        [compose(poses_around(place, *seen, around), since) for place, seen, since in latest]
    )
    poses = poses[(np.abs(poses[:, :2]) < FIELD.half).all(axis=1)]
    if not len(poses):
        return None
    for k in range(rounds):
        then = compose(
            poses[:, None], past.before
        )  # where each of these would have been at each sighting
        dx, dy = np.moveaxis(past.places - then[..., :2], -1, 0)
        off = wrap(np.arctan2(dy, dx) - then[..., 2] - past.seen[:, 1])
        d2 = ((np.hypot(dx, dy) - past.seen[:, 0]) / past.sigma[:, 0]) ** 2 + (
            off / past.sigma[:, 1]
        ) ** 2
        cost = np.minimum(d2, 13.8).sum(axis=1)
        w = np.exp(
            -(cost - cost.min()) / 2 / 4.0 ** (rounds - 1 - k)
        )  # at first many are worth a look
        w = w / w.sum()
        if k < rounds - 1:
            pick = np.searchsorted(np.cumsum(w), (rng.random() + np.arange(n)) / n)
            poses = poses[
                np.minimum(pick, len(poses) - 1)
            ] + 0.3 / 2**k * rng.standard_normal((n, 3))
    fits = d2[cost.argmin()] < 9.2
    if fits.sum() < 4 or fits.mean() < 0.6:
        return None
    x0 = np.array(
        [
            w @ poses[:, 0],
            w @ poses[:, 1],
            np.arctan2(w @ np.sin(poses[:, 2]), w @ np.cos(poses[:, 2])),
        ]
    )
    e = poses - x0
    e[:, 2] = wrap(e[:, 2])
    P0 = (w * e.T) @ e + 0.05**2 * np.eye(3)
    return (x0, P0) if np.sqrt(P0[0, 0] + P0[1, 1]) < 0.35 and P0[2, 2] < 0.35**2 else None
    ### END SOLUTION


# %% tags=["nbval-ignore-output"]
def remembering(log):
    memory = Memory(restart, log.noise.told())
    return Hybrid(memory, follower(log), lost, background=1, frames=1)


names = ("EKF alone", "grid + EKF", "grid (backgr.) + EKF")
chosen = {name: contestants[name] for name in names}
print(table(race({**chosen, "memory + EKF": remembering}, kidnapped, progress)))

# %% [markdown]
# ## 11. Real robots
#
# The same filter, on the robots of lab 3's last section (UTIAS MRCLAM set 7; `labkit data` says how to get it, and without it a small simulated set stands in). No compass now: your filter estimates the heading itself. Wheels do not slip aside in
# proportion to anything, so the noise is told as floors: for each step of 0.1 s, and for each sighting, whatever its range.


# %% tags=["nbval-ignore-output"]
def wheels(slip, spin, range_floor, bearing):
    """A Noise: slip [m] and spin [rad] in a second, range_floor [m], bearing [rad]."""
    root = np.sqrt(0.1)  # what comes together in a step of 0.1 s
    return Noise(
        slip=root * slip, spin=root * spin, range_floor=range_floor, bearing=bearing
    )  # all landmarks are complete here, so that there is no bearing_partial


NARROW = wheels(0.012, 0.05, range_floor=0.15, bearing=0.02)
WIDE = wheels(0.03, 0.10, range_floor=0.60, bearing=0.06)


def on_real_robot(log, noise):
    """History of your filter over a real log, started at the true pose; gate at 9.2."""
    first = np.diag([0.1, 0.1, 0.05]) ** 2
    KF = partial(EKF, gate=9.2)
    return replay(make_filter(KF, log, x0=log.truth[0], P0=first, noise=noise), log)


head = "position RMSE [m] / heading [°] (mean NEES)"
print(f"{head:44s} wheels only  narrow noise         wide noise")
for robot in range(1, 6):
    real = mrclam.with_odometry(mrclam.load(robot))
    dead = [real.truth[0]]
    for u in real.controls:
        dead.append(motion(dead[-1], u))
    off = np.linalg.norm((dead - real.truth)[:, :2], axis=1)
    row = f"{real.name:44s} {np.sqrt(np.nanmean(off**2)):8.2f}"
    for noise in (NARROW, WIDE):
        run = on_real_robot(real, noise)
        turned = np.rad2deg(metrics.heading_rmse(run, real))
        honest = np.nanmean(metrics.nees(run, real))
        row += f"   {metrics.rmse(run, real):6.3f} / {turned:4.1f} ({honest:4.1f})"
    print(row)

# %% [markdown]
# On the real data you should see 1.9 to 4.3 m for the wheels alone and 13 to 21 cm for your filter with the wide noise, with a NEES of 1.4 to 2.7, close to 3 and on the safe side. With the narrow noise (what a single sighting is worth: 15 cm and 1°) all five are overconfident,
# with a NEES of 13 to 55, and two of them get lost for a while.
#
# Why is the honest figure for one sighting not the right one to tell? Look at the range errors of one robot, one reading after the other, against white noise of the same size:

# %% tags=["nbval-ignore-output"]
real = mrclam.load(1)
ids, counts = np.unique(real.seen_id, return_counts=True)
often = real.seen_id == ids[counts.argmax()]
error, step = mrclam.range_errors(real)[often], real.seen_step[often]
usual = abs(error) < 1  # without misread barcodes, and without the gaps of the truth
error, step = error[usual], step[usual]
soon = np.diff(step) <= 5  # the next reading comes within half a second
alike = np.corrcoef(error[:-1][soon], error[1:][soon])[0, 1]
print(f"{real.name}, landmark {ids[counts.argmax()]}: range error σ = {error.std():.2f} m")
print(f"correlation of one reading's error with that of the next: {alike:.2f}")

fig, axes = plt.subplots(1, 2, figsize=(10, 2.8), layout="constrained", sharey=True)
white = np.random.default_rng(0).normal(0, error.std(), 200)
axes[0].plot(error[:200], ".-", lw=0.6, ms=3)
axes[1].plot(white, ".-", lw=0.6, ms=3)
axes[0].set(xlabel="reading", ylabel="range error [m]", title="readings of one landmark")
axes[1].set(xlabel="reading", title="white noise of the same size")
plt.show()

# %% [markdown]
# ### Question D
# What does the left picture have that the right one has not? Explain with it why telling a *larger* noise makes the filter *better*, and what it costs. What would you do instead, with more time?

# %% [markdown] id="answer-real" tags=["answer"] points=2 title="Question D: correlated errors"
# ### BEGIN SOLUTION
# On the left the errors come in runs: a range that is 20 cm too long is so again in the next readings (correlation above 0.9 with the real data). A Kalman filter takes each reading for an independent opinion; ten of the same error, counted as ten,
# make it sure of something wrong; then it refuses what is right at the gate. A larger R counts the ten as about one. The cost: when readings *are* fresh, say of a new landmark, the filter learns from them too slowly.
#
# Instead: use only one reading in a second of each landmark, or estimate the error of each landmark's range as part of the state (it changes slowly, so it can be learned), or calibrate the camera.
# ### END SOLUTION

# %% [markdown] id="rubric-real" tags=["hidden"]
# **Question D, 2 points.**
# - 1 point: neighbouring errors are alike (correlated), so readings are not independent and the filter counts them too often.
# - 1 point: the price of a larger R, or a sensible remedy (thinning, a bias in the state, calibration).

# %% [markdown] tags=["hidden"]
# ## Graded checks
#
# They stand only in this copy. When a class is graded, each runs with numbers drawn for each student.

# %% id="setup-exam" tags=["setup", "hidden"]
from labkit.instructor.exam.exam import Exam

exam = Exam("04_legged_robot")
check = exam.check
START = np.diag([0.1, 0.1, 0.1]) ** 2
plain = Noise(
    odometry=0.1, range_beacon=0.05, range_goal=0.05, bearing=0.035, bearing_partial=0.1
)  # as in section 4


def poses(rng, n=12):
    return [np.array([*rng.uniform(-2.5, 2.5, 2), rng.uniform(-3.1, 3.1)]) for _ in range(n)]


def walk(rng, noise, steps=80, **more):
    """A walk, and what a filter is told of it: options for `exam.same_run`."""
    record = LeggedRobot(noise, rng=rng).record(steps, **more)
    x0 = record.truth[0] + rng.normal(0, 0.05, 3)
    return record, {"x0": x0, "P0": START, "noise": record.noise.told()}


# %% id="figure" tags=["hidden"]
public = LeggedRobot("real", rng=2).record(200)
exam.figure(EKF, public, x0=public.truth[0], P0=START, noise=public.noise.told())

# %% id="grade-motion" tags=["hidden"] points=1 title="motion: in all directions"
rng = exam.rng()
calls = [(x, rng.uniform(-1, 1, 3)) for x in poses(rng)]
calls += [
    (np.array([5.0, -5.0, s * 3.1]), np.array([*rng.uniform(0, 1, 2), s])) for s in (-1, 1)
]
exam.same(motion, calls, "other poses")
print("passed")

# %% id="grade-motion-jacobians" tags=["hidden"] points=2 title="motion_jacobians: in all directions"
rng = exam.rng()
exam.same(motion_jacobians, [(x, rng.uniform(-1, 1, 3)) for x in poses(rng)], "other poses")
print("passed")

# %% id="grade-jacobian" tags=["hidden"] points=2 title="jacobian: all headings, also across ±180°"
rng = exam.rng()
west = [
    (np.array([x, y, np.pi - 1e-7]), FIELD.map[0])
    for x, y in rng.uniform(-2, 2, (3, 2)) * [1, 0]
]
near = [
    (np.array([*(lm.p + 0.2 * np.array([np.cos(a), np.sin(a)])), a]), lm)
    for lm, a in zip(FIELD.map, rng.uniform(-3.1, 3.1, len(FIELD.map)))
]
exam.same(
    jacobian,
    [(x, lm) for x in poses(rng, 6) for lm in FIELD.map] + west + near,
    "other places",
)
print("passed")

# %% id="grade-predict" tags=["hidden"] points=2 title="EKF: walking blind"
rng = exam.rng()
blind = Noise(
    odometry=rng.uniform(0.1, 0.3),
    slip=rng.uniform(0.002, 0.01),
    spin=rng.uniform(0.002, 0.02),
    occlusion=1.0,
    bearing=0.03,
    bearing_partial=0.3,
)
record, told = walk(rng, blind)
exam.same_run(EKF, record, "without any landmark", **told)
print("passed")

# %% id="grade-walk" tags=["hidden"] points=2 title="EKF: another walk"
rng = exam.rng()
record, told = walk(rng, "paper", 120)
exam.same_run(EKF, record, "on another walk", **told, gate=rng.uniform(3, 6))
print("passed")

# %% id="grade-noise" tags=["hidden"] points=2 title="EKF: other noise, goals unlike beacons, cut-off landmarks"
rng = exam.rng()
other = Noise(
    odometry=0.15,
    range_beacon=rng.uniform(0.03, 0.06),
    range_goal=rng.uniform(0.1, 0.2),
    range_floor=rng.uniform(0.02, 0.05),
    bearing=rng.uniform(0.02, 0.04),
    bearing_partial=rng.uniform(0.2, 0.3),
)
record, told = walk(rng, other, 120)
exam.same_run(EKF, record, "with other noise", **told, gate=rng.uniform(3, 6))
print("passed")

# %% id="grade-gate" tags=["hidden"] points=2 title="EKF: a kidnapping behind the gate"
rng = exam.rng()
record, told = walk(rng, "paper", 120, kidnap=60)
exam.same_run(
    EKF,
    record,
    "after a kidnapping, when the gate refuses nearly everything",
    **told,
    gate=rng.uniform(3, 6),
)
print("passed")

# %% id="grade-honest" tags=["hidden"] points=2 title="EKF: honest over a long walk (NEES)"
rng = exam.rng()
record, told = walk(rng, plain, 300)
told["gate"] = rng.uniform(6, 9)
mine = exam.same_run(EKF, record, "over a long walk", **told)
right = [exam.history(one, record, **told) for one in exam.right("EKF")]
mean, *due = [metrics.nees(one, record)[40:].mean() for one in [mine, *right]]
if min(abs(mean / one - 1) for one in due) > 0.05:
    exam.fail(
        f"Over a long walk your mean NEES is {mean:.2g}; a right filter has {due[0]:.2g}."
    )
print("passed")

# %% id="grade-membership" tags=["hidden"] points=1 title="membership: other trapezoids"
rng = exam.rng()
shapes = [
    (
        rng.uniform(-3.1, 3.1, 9),
        rng.uniform(-3.1, 3.1),
        c,
        c + rng.uniform(0.1, 1),
        rng.uniform(0.5, 1),
        rng.uniform(0, 0.3),
    )
    for c in rng.uniform(0, 1, 30)
]
exam.same(membership, shapes, "other trapezoids")
print("passed")

# %% id="grade-fuse" tags=["hidden"] points=2 title="fuse_range: other grids"
rng = exam.rng()
grids = [
    (
        rng.uniform(0.01, 1, (7, 5)),
        rng.uniform(0.2, 5, (7, 5)),
        rng.uniform(0.5, 4),
        s,
        0.1 + s,
        s,
        s / 3,
    )
    for s in rng.uniform(0.05, 0.3, 6)
]
exam.same(fuse_range, grids, "other grids")
print("passed")

# %% id="grade-lost" tags=["hidden"] points=2 title="lost: other covariances and surprises"
rng = exam.rng()
cases = [
    (
        np.diag(rng.uniform(0.0, 0.3, 2).tolist() + [rng.uniform(0, 1.8)]),
        rng.choice([2.0, 50.0], n),
        13.8,
        share,
    )
    for n in (0, 3, 7, 8, 8, 8, 8)
    for share in (0.4, 0.6, 0.9)
]
cases += [
    (np.diag([0.01, 0.01, 0.01]), rng.permutation([50.0] * k + [2.0] * (8 - k)), bound, 0.6)
    for k in range(9)
    for bound in (13.8, 60.0)
]
cases += [(np.diag([0.01, 0.01, 0.01]), np.full(n, 50.0), 13.8, 0.6) for n in (1, 3, 7)]
exam.same(lost, cases, "other cases")
print("passed")

# %% [markdown]
# ## Summary
#
# - A robot that turns has its heading in the state; odometry and its noise live in the robot's frame and are turned into the world's.
# - Sightings differ in worth, and some are lies: tell the filter the first in R, and keep the second out with a gate.
# - A Kalman filter follows; it does not find. A grid or particles find, and cost more.
# - The covariance does not see the measurements. Only the innovations tell that a filter is lost.
# - Compare over many runs, and print a percentile rather than a "never".
#
# Save, and run `labkit check notebooks/04_legged_robot.ipynb` in a terminal before you hand it in.
#
# **Next:** so far there was a map. In lab 5 there is none: robots that see each other build a frame of their own.
#
# ## Errata and references
# - Slips of the paper, put right here: the initial covariance $P_0 = I_3$ says ±1 m and ±57° at once, which fits no start; $Q$ of eq. (8) is linear in $|u|$ where a variance is not, mixes units in its last entry, and vanishes for a standing robot; eqs (3)–(5) start from $s^-$, where the
#   *posterior* of the step before is meant; eq. (17) counts landmarks and rows with the same index; and differences of angles are not wrapped.
# - F. Martín, V. Matellán, P. Barrera, J. M. Cañas, "Localización basada en lógica difusa y filtros de Kalman para robots con patas": sections 3 (grid), 4 (EKF), 5 (switching), 6 (experiments).
# - P. Buschka, A. Saffiotti, Z. Wasik, "Fuzzy landmark-based localization for a legged robot", IROS 2000; D. Herrero-Pérez, H. Martínez-Barberá, A. Saffiotti, "Fuzzy self-localization using natural features in the four-legged league", RoboCup 2004.
# - S. Thrun, W. Burgard, D. Fox, *Probabilistic Robotics*, MIT Press 2005, chapters 7 and 8; S. Lenser, M. Veloso, "Sensor resetting localization for poorly modelled mobile robots", ICRA 2000.
# - K. Leung, Y. Halpern, T. Barfoot, H. Liu, "The UTIAS multi-robot cooperative localization and mapping dataset", IJRR 30(8), 2011.

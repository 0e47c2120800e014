# %% [markdown]
# # Lab 3 · Distances and angles: the extended Kalman filter
#
# *About 110 minutes. From lab 1 it uses your `KF`, filled in and saved, and its five lines of the update; from lab 2 the NEES and the NIS.*
#
# Hardly any sensor reports "1.2 m to the right and 0.8 m ahead". A laser or a camera reports a **range** (how far) and a **bearing** (in which
# direction). Now the measurement is no longer a linear function of the position, and the Kalman filter needs one more idea: a straight line in
# place of the curve. With it, the same twenty lines localize a real robot, as you will see at the end.
#
# **By the end you can**
# - predict a range and a bearing, and differentiate them;
# - subtract angles without falling over the edge at ±180°;
# - say where the straight line is a good stand-in for the curve, and where it is not;
# - run your filter on the recorded data of a real robot.
#
# **You will write** `h`, `jacobian` and the class `KF`, and answer questions Q6 and Q7.

# %% [markdown]
# ## Symbols
#
# | symbol | in the code | shape | unit | what it is |
# |---|---|---|---|---|
# | $\hat x$, $P$ | `kf.xk_k`, `kf.Pk_k` | (2,), (2, 2) | m, m² | estimated position, world frame, and its covariance |
# | $d = (d_x, d_y)$ | `landmark - x` | (2,) | m | vector from the robot to a landmark |
# | $r$ | `y[0].p[0]` | number | m | range |
# | $\beta$ | `y[0].p[1]` | number | rad | bearing, from the world's x axis, counter-clockwise, in (−π, π] |
# | $h(x)$ | `h(x, landmark)` | (2,) | m, rad | the range and bearing that are expected |
# | $H_i$ | `jacobian(x, landmark)` | (2, 2) | –, rad/m | derivative of $h$ by the position, for the i-th landmark in view |
# | $H$ | `H` | (2p, 2) | –, rad/m | the $H_i$ of the $p$ landmarks in view, one above the other |
# | $R$ | `kf.R` | (2, 2) | m², rad² | covariance of one landmark's range and bearing |
# | $\sigma_r, \sigma_\beta$ | – | numbers | m, rad | their standard deviations, the roots of $R$'s diagonal |
# | $\nu$ | `innovation` | (2p,) | m, rad | what was seen less what was expected, bearings wrapped |
#
# What a symbol means in other labs: [all symbols](../notebooks/glossary.md).

# %% id="setup" tags=["setup"]
import matplotlib.pyplot as plt
import numpy as np

from labkit import EnvPlot, Landmark, Map, Robot, check, explore, load_answer, make_filter
from labkit import metrics, mrclam, random_map, replay, reveal, simulate, wrap
from labkit.history import by_filterpy
from labkit.plots import MapPanel, ScenePanel, limits, show_run
from labkit.tangents import show_tangent

CartesianKF = load_answer("01_cartesian_ekf", "KF")  # your filter of lab 1, to compare with

# %% [markdown]
# ## 1. What should I see from here?
#
# With the vector $d = x_l - \hat x$ from the robot to the landmark,
#
# $$ h(\hat x) = \begin{bmatrix} r \\ \beta \end{bmatrix}
#     = \begin{bmatrix} \sqrt{d_x^2 + d_y^2} \\ \operatorname{atan2}(d_y, d_x) \end{bmatrix} . $$
#
# > **Erratum.** The handout writes $\arctan(d_y/d_x)$. That cannot tell ahead from behind: $(1, 1)$ and $(-1, -1)$ have the same quotient. Use `atan2`,
# > in numpy `np.arctan2(dy, dx)`, which looks at both signs.
#
# ### Exercise 1 · `h(x, landmark)`
# Return an array `[range, bearing]`; `landmark - x` is $d$. (Do not use the name `h` for anything else in this notebook.) *Example:* from `x = (1, 1)` a landmark at `(1, 3)` is 2 m away at π/2.
#
# <details><summary>Hint</summary>
#
# `landmark - x` is an array of two numbers; `np.hypot(dx, dy)` is the square root of the sum of their squares.
# </details>


# %% id="answer-h" tags=["answer"]
def h(x, landmark):
    """What a robot at x (2,) should measure of a landmark: [range [m], bearing [rad]]."""
    ### BEGIN SOLUTION
    dx, dy = landmark - x
    return np.array([np.hypot(dx, dy), np.arctan2(dy, dx)])
    ### END SOLUTION


# %% id="check-h" tags=["check"] points=1 title="h"
check("range-bearing-h", h)

# %% [markdown]
# ## 2. A straight line in place of the curve
#
# The update of lab 1 needs $H$, the derivative of the expected measurement by the position. For Cartesian measurements it was $-I$ everywhere. Now it
# depends on where the robot is: near the estimate, $h$ is replaced by its tangent. That is all that "extended" means. The table of derivatives
# is called the **Jacobian**:
#
# $$ H_i = \begin{bmatrix} \partial r/\partial x & \partial r/\partial y \\ \partial \beta/\partial x & \partial \beta/\partial y \end{bmatrix} . $$
#
# Two sanity checks before you differentiate. If the robot walks straight to the landmark, how does the range change, metre by metre? If it walks
# sideways past it, is the change of bearing larger near the landmark or far from it?
#
# ### Exercise 2 · `jacobian(x, landmark)`
# Return the (2, 2) array. *Example:* from `x = (0, 0)`, a landmark at `(2, 0)` has `[[-1, 0], [0, -0.5]]`.
#
# <details><summary>Hint</summary>
#
# $d_x = x_l - x$, so $\partial d_x / \partial x = -1$ and $\partial d_y / \partial x = 0$. And the derivative of $\operatorname{atan2}(d_y, d_x)$ is
# $(d_x\,\partial d_y - d_y\,\partial d_x)/(d_x^2 + d_y^2)$, where $\partial$ stands for the derivative by $x$ in the first column, by $y$ in the second.
# </details>
# <details><summary>Hint: how to test it yourself</summary>
#
# Move `x` by a tiny step, 1e-6 in one direction, and see how `h` changes: (new − old) / 1e-6 is a column of $H$, nearly.
# </details>


# %% id="answer-jacobian" tags=["answer"]
def jacobian(x, landmark):
    """Derivatives (2, 2) of h: row 1 of the range, row 2 of the bearing; columns x and y."""
    ### BEGIN SOLUTION
    dx, dy = landmark - x
    r = np.hypot(dx, dy)
    return np.array([[-dx / r, -dy / r], [dy / r**2, -dx / r**2]])
    ### END SOLUTION


# %% id="check-jacobian" tags=["check"] points=2 title="jacobian"
check("range-bearing-jacobian", jacobian)

# %% [markdown]
# What does a filter do with a tangent? It believes that the robot is *about* here, give or take σ, and asks which ranges it should see. The picture does
# that for a robot on the x axis and a landmark 1 m above it, at (0, 1). Left: the true range as the robot moves along, and its tangent, with *your*
# two functions. Right: which ranges come out if the belief is pushed through the one and through the other.
#
# **Before you run it:** the belief is narrow first (σ = 0.2 m), then wide (σ = 1.5 m). What does the tangent promise for the wide one?
# - (a) The same ranges as the curve: it touches it at the estimate.
# - (b) Ranges that are all too long.
# - (c) Also ranges that are impossible here, below 1 m and even below 0.

# %% id="guess-tangent" tags=["guess"]
guess = "c"
for sigma in (0.2, 1.5):
    show_tangent(h, jacobian, np.array([0.0, 1.0]), at=1.0, sigma=sigma)
reveal("tangent", guess)

# %% [markdown]
# So the straight line is good where the belief is narrow compared to the range. Keep the two pictures in mind: they explain all that goes wrong below.
#
# ## 3. The edge at 180°
#
# A landmark is due west. The filter expects it at +179°, the robot sees it at −179°.
#
# **Before you run it:** what should the innovation, *seen less expected*, be?
# - (a) −358°
# - (b) 2°
# - (c) −2°

# %% id="guess-west" tags=["guess"]
guess = "b"
expected, seen = np.deg2rad(179), np.deg2rad(-179)
print(f"plain difference   {np.rad2deg(seen - expected):7.1f}°")
print(f"wrapped difference {np.rad2deg(wrap(seen - expected)):7.1f}°")
reveal("due-west", guess)

# %% [markdown]
# A filter that believes in −358° jumps across the map. So every *difference* of bearings is wrapped into (−π, π], with `wrap` from the kit. Ranges are
# not: 4 m is not an angle.
#
# ## 4. The filter
#
# Prediction is as in lab 1. The update has the same five lines, with three changes: the expected measurement is $h(\hat x)$, its bearing innovation
# is wrapped, and $H$ stacks one Jacobian for each landmark, taken at the *estimate* (where else? the truth is not known).
#
# $$ \nu = \begin{bmatrix} y_1 - h_1(\hat x) \\ \vdots \\ y_p - h_p(\hat x) \end{bmatrix}, \qquad
#    H = \begin{bmatrix} H_1 \\ \vdots \\ H_p \end{bmatrix} \; (2p \times 2) $$
#
# ### Exercise 3 · the class `KF`
# Write `predict` and `update`. As before, `self.Q` and `self.R` are those of one step, and `y` may be empty. You may start from your lab 1 class (`stack` and `repeat_R` stayed in lab 1: copy
# `repeat_R`, and put `h` and `jacobian` in the place of `stack`). Landmarks
# are found on the map by `==` or `self.map.index(lm)`: the real robot at the end has landmarks named 6 to 20.
#
# *Example.* With `x = (0, 0)`, `P = I`, `self.R = I` and one landmark at `(2, 0)`, measured as `[1.8, 0]`, the update leads to `x = (0.1, 0)` and
# `P = diag(0.5, 0.8)`.
#
# <details><summary>Hint 1: in which order?</summary>
#
# Find the map's landmark for each measured one and keep them in a list, in the order of `y`. Then stack innovations (`np.concatenate`) and
# Jacobians (`np.vstack`) from that same list.
# </details>
# <details><summary>Hint 2: wrapping every second number</summary>
#
# In the stacked innovation, bearings stand at positions 1, 3, 5 …: `innovation[1::2] = wrap(innovation[1::2])`.
# </details>


# %% id="answer-kf" tags=["answer"]
class KF:
    """Extended Kalman filter for the position of a robot that sees ranges and bearings."""

    def __init__(self, x0, P0, Q, R, m, dt=0.25):
        self.xk_k = np.array(x0, dtype=float)  # (2,) estimate of the position [m]
        self.Pk_k = np.array(P0, dtype=float)  # (2, 2) its covariance [m^2]
        self.Q = np.array(Q) * dt  # (2, 2) motion noise of one step [m^2]
        self.R = np.array(R) / dt  # (2, 2) noise of one landmark: diag([m^2], [rad^2])
        self.map = m  # the Map
        self.dt = dt  # length of a step [s]

    def predict(self, u):
        """Move the estimate by the commanded velocity u (2,) [m/s] for one step."""
        ### BEGIN SOLUTION
        self.xk_k = self.xk_k + self.dt * u
        self.Pk_k = self.Pk_k + self.Q
        ### END SOLUTION

    def update(self, y):
        """Correct the estimate with the landmarks in view: a list, maybe empty."""
        ### BEGIN SOLUTION
        if not y:
            return
        p = len(y)
        known = [self.map[self.map.index(lm)] for lm in y]
        innovation = np.concatenate([lm.p - h(self.xk_k, k) for lm, k in zip(y, known)])
        innovation[1::2] = wrap(innovation[1::2])
        H = np.vstack([jacobian(self.xk_k, k) for k in known])
        S = H @ self.Pk_k @ H.T + np.kron(np.eye(p), self.R)
        K = np.linalg.solve(S, H @ self.Pk_k).T
        self.xk_k = self.xk_k + K @ innovation
        self.Pk_k = self.Pk_k - K @ S @ K.T
        ### END SOLUTION


# %% id="check-kf" tags=["check"] points=4 title="KF: single steps and a short drive"
check("range-bearing-kf", KF)

# %% [markdown]
# ## 5. Let it run, and compare
#
# `type="rb"` gives the robot a range-bearing sensor. In one step its range errs by $\sigma_r$ = 0.4 m and its bearing by $\sigma_\beta$ = 10°. (So a landmark that is
# nearer than 0.25 m is often "seen" at a *negative* range. No real sensor reports that; we leave it so that the noise is what the filter was told.)

# %%
Q = np.diag([0.25**2, 0.25**2])  # motion noise, per second [m^2/s]
R_xy = np.diag([0.2**2, 0.2**2])  # of one landmark, times one second [m^2 s]
R_rb = np.diag([0.2**2, np.deg2rad(5) ** 2])  # [m^2 s, rad^2 s]
m = random_map(25, rng=1)

r = Robot((2, -2), Q, R_rb, type="rb", rng=1)
kf = KF((0, 0), 3 * np.eye(2), Q, R_rb, m)
e = EnvPlot()
e.plotSim(r, m, kf, pause=True)
for k in range(40):
    u = r.action()
    kf.predict(u)
    y = r.measure(m)
    kf.update(y)
    e.plotSim(r, m, kf)

# %% [markdown]
# What does *one* landmark tell at range $r$? Along the line of sight the position, give or take $\sigma_r$. Across it, the bearing: an angle of $\sigma_\beta$ (in
# rad) seen over a distance $r$ is an arc of length $r\,\sigma_\beta$. At which range is the one as long as the other?
#
# Now a fair comparison: *one* drive, seen once by the Cartesian sensor and once by the range-bearing sensor (`log.seen_by`), with your two filters. There
# are eight landmarks, so that mostly one or two are in view.
#
# **Before you run it:** with the Cartesian sensor the ellipses are circles. And with range and bearing, near a single landmark?
# - (a) Long along the line of sight, short across it.
# - (b) Short along the line of sight, long across it.
# - (c) Circles too, as $R$ is diagonal.

# %% id="guess-shape" tags=["guess"]
guess = "a"
log = simulate(Robot((2, -2), Q, R_xy, rng=1), random_map(8, rng=1))
polar = log.seen_by("rb", R_rb, rng=1)

runs = [
    ("Cartesian", log, replay(make_filter(CartesianKF, log), log)),
    ("range and bearing", polar, replay(make_filter(KF, polar), polar)),
]
fig, axes = plt.subplots(1, 2, figsize=(10, 5), layout="constrained")
for ax, (name, seen, history) in zip(axes, runs):
    MapPanel(ax, limits(log), title=name).show(seen, history, ellipses=40)
    print(f"{name}:\n   {metrics.summary(history, seen)}")
plt.show()
reveal("shape", guess)

# %%
history = replay(make_filter(KF, polar), polar)
short, long = np.sqrt(np.linalg.eigvalsh(history.P[1:])).T
print(f"range and bearing: long axis over short axis up to {np.max(long / short):.2f}")
print("after the first update the estimate is", history.x[1].round(1), end=" ")
print("and the robot at", polar.truth[1].round(1))
print(f"NEES {metrics.nees(history, polar)[1]:.0f}, where 2 is expected")

# %% [markdown]
# The first update of the range-bearing filter is a leap to a wrong place, and the filter is sure of it. It is the wide belief of section 2: at the start σ is
# 1.7 m, as long as the ranges, so the tangent at (0, 0) is a poor stand-in for the curve. Each further look takes its tangent nearer to the truth,
# and it recovers: the map above has the ellipses.
#
# ### Question Q6
# What differs from the Cartesian filter? Use the sliders below to look at several random maps, with few landmarks and with many. Along which direction is the ellipse short, and why does
# its shape change along the path, when $R$ is always the same?

# %%
explore(KF, sensor="rb", sliders=("Q", "R", "landmarks"), landmarks=8, seed=1)

# %% [markdown] id="answer-q6" tags=["answer"] points=2 title="Question Q6"
# ### BEGIN SOLUTION
# The accuracy is about the same here (RMSE 0.34 m against 0.33 m), but the Cartesian ellipses are circles and these are not; they change size and
# direction along the path, since $H$ depends on where the robot is, and $P \leftarrow P - KSK^\top$ takes that over.
#
# One landmark at range $r$ measures the position along the line of sight with $\sigma_r$ = 0.4 m, and across it with $r\,\sigma_\beta$, where
# $\sigma_\beta$ = 10° = 0.17 rad. Near a landmark the ellipse is short *across* the line of sight: at 0.5 m only 0.09 m. At 2.3 m both are equal and it
# is a circle. Several landmarks in different directions average this out, so with many landmarks it looks rounder.
# ### END SOLUTION

# %% [markdown] id="rubric-q6" tags=["hidden"]
# **Q6, 2 points.**
# - 1 point: the ellipses change size and direction along the path, since H depends on the position.
# - 1 point: short along the line of sight or across it, depending on range (sigma_r against r sigma_beta).

# %% [markdown]
# ## 6. One landmark, and a close pass
#
# The robot is told to drive up along x = 2, past a single landmark; it slips to its other side. Here is your filter far from it and near it. The long axis
# of the ellipse tells the direction in which the filter is unsure.

# %%
one = Map([Landmark((2.3, 0.0), "lighthouse")])
lone = simulate(Robot((2, -2), Q, R_rb, type="rb", rng=2), one, steps=32)
history = replay(make_filter(KF, lone, x0=(2, -2), P0=0.1**2 * np.eye(2)), lone)
distance = np.linalg.norm(one[0] - lone.truth, axis=1)
axis = 3 * np.sqrt(np.linalg.eigvalsh(history.P))

fig, axes = plt.subplots(1, 3, figsize=(11.5, 4.2), layout="constrained")
for ax, k in zip(axes, [4, 12, int(distance.argmin())]):
    ScenePanel(ax, (0.6, 4.0, -2.4, 1.6)).show_step(lone, history, k)
    if ax is not axes[-1]:
        ax.get_legend().remove()
    short, long = axis[k]
    ax.set_title(f"range {distance[k]:.2f} m: 3σ half axes {long:.2f}, {short:.2f} m", size=9)
plt.show()

# %% [markdown]
# ### Question Q7, first part
# Take five landmarks (slider below, or `random_map(5)`). What happens when the robot sees no landmark? And when it sees just one, and passes close to it?
# Explain the shape of the ellipse in the three pictures.

# %% [markdown] id="answer-q7" tags=["answer"] points=2 title="Question Q7, first part"
# ### BEGIN SOLUTION
# With nothing in view the ellipse grows at each step and becomes rounder, as in lab 2: only `predict` acts, and it adds the same in all directions.
#
# One landmark gives both numbers, so the filter never gets lost as long as it sees one. Along the line of sight it knows the position to $\sigma_r$, whatever the distance;
# across it, to $r\,\sigma_\beta$. So while the robot comes closer the ellipse becomes a sliver which points at the landmark, and it turns as the robot passes by.
# ### END SOLUTION

# %%
explore(KF, sensor="rb", sliders=("R", "landmarks", "range"), landmarks=5, seed=2)

# %% [markdown] id="rubric-q7" tags=["hidden"]
# **Q7, first part, 2 points.**
# - 1 point: nothing in view: P grows and becomes rounder.
# - 1 point: one landmark: along the line of sight known to sigma_r, across it to r sigma_beta, so a sliver that points at a near landmark.

# %% [markdown]
# What does closeness cost? Near the landmark, a small step changes the bearing a lot: the curve bends, and the tangent leaves it. So let us ask many runs how
# honest your filter is, depending on how near the nearest landmark is. The noise is exactly what the filter was told. (For two numbers, an honest
# NEES has mean 2 and median 1.39.)
#
# **Before you run it:** where will the mean NEES be above 2?
# - (a) Nowhere: Q and R are right.
# - (b) Where the nearest landmark is far away: little is seen there.
# - (c) Where it is near: there the curve bends.

# %% id="guess-near" tags=["guess"]
guess = "c"
near, values = [], []
for seed in range(60):
    run = simulate(Robot((2, -2), Q, R_rb, type="rb", rng=seed), random_map(25, rng=seed))
    history = replay(make_filter(KF, run), run)
    late = slice(20, None)  # without the first 5 s, in which it forgets the wrong start
    near.append(np.linalg.norm(run.map.positions - run.truth[late, None], axis=2).min(axis=1))
    values.append(metrics.nees(history, run)[late])
near, values = np.concatenate(near), np.concatenate(values)

print("nearest landmark [m]    steps   mean NEES   median")
for low, high in [(0, 0.25), (0.25, 0.5), (0.5, 1), (1, 2.5)]:
    here = values[(low <= near) & (near < high)]
    mean, median = here.mean(), np.median(here)
    print(f"{low:8.2f} to {high:4.2f} {len(here):15d} {mean:10.1f} {median:9.1f}")
reveal("near-landmark", guess)

# %% [markdown]
# ### Question Q7, second part
# Explain the first rows of the table. What could one do about them: another `R` for near landmarks? Leaving them out? Another place for the tangent?

# %% [markdown] id="answer-q7-near" tags=["answer"] points=2 title="Question Q7, second part"
# ### BEGIN SOLUTION
# In the close pass the filter becomes overconfident although $Q$ and $R$ are right: the mean NEES is above 40 below 25 cm. The bearing row of $H$ is $1/r$, taken at the
# *estimated* position. When the error of the position is as large as the range, the true bearing can be anywhere, while the tangent claims a precise
# relation; the filter shrinks $P$ for information that is not there, and it takes some time to recover. Beyond half a metre the median is near 1.4: there the tangent is good.
# What helps: a larger bearing variance for near landmarks, leaving out a landmark that is nearer than a few σ of the position, or iterating the update with $H$
# taken at the improved estimate.
# ### END SOLUTION

# %% [markdown] id="rubric-q7-near" tags=["hidden"]
# **Q7, second part, 2 points.**
# - 1 point: near the landmark the tangent is bad, so the filter is overconfident although Q and R are right.
# - 1 point: a sensible remedy with its reason.

# %% [markdown]
# ## 7. Against a library
#
# `filterpy` is a well-known Python library of filters. Given your `h` and `jacobian`, its extended Kalman filter must agree with yours.

# %%
mine = replay(make_filter(KF, polar), polar)
other = by_filterpy(polar, h, jacobian, like=make_filter(KF, polar))
largest = max(abs(mine.x - other.x).max(), abs(mine.P - other.P).max())
print("the two agree to 1e-9:", bool(largest < 1e-9))

# %% [markdown]
# ## 8. Your filter on a real robot
#
# The UTIAS MRCLAM data were recorded with five small wheeled robots among 15 numbered landmarks; a camera on each reads the landmarks' barcodes and measures range and
# bearing, and a motion capture system knows the truth. Set 7 lasts 15 minutes.
#
# **To get it:** download *MRCLAM_Dataset7.zip* from the UTIAS site (asrl.utias.utoronto.ca/datasets/mrclam), open a terminal and type
# `labkit data MRCLAM_Dataset7.zip`. It is checked and put into the folder `data/MRCLAM_Dataset7` of this kit (the variable `LABKIT_DATA` can name another
# folder). Without it, this section runs on a simulated log in the same format, with the same troubles in a milder form; the title of the figure says which
# one you see.
#
# Your filter estimates two numbers and not the heading. So the kit hands it the heading as from a compass, with 2° of noise, and turns the wheel velocity and the
# bearings into the world frame: `with_compass`. What comes out is a log like any other, ten steps a second.

# %% tags=["nbval-ignore-output"]
log = mrclam.with_compass(mrclam.load(robot=1), rng=0)
print(log.name, *log.notes, sep="\n   ")

Q_real = 0.05**2 * np.eye(2)  # wheels slip by 5 cm in one second
R_real = np.diag([0.6**2, 0.15**2]) * log.dt  # σ = 0.6 m and 0.15 rad; KF divides by dt
R_narrow = np.diag([0.15**2, 0.05**2]) * log.dt  # as the sensor's data sheet would have it


def on_real_robot(log, R):
    """History of your filter, started at the true position with σ = 0.1 m."""
    kf = make_filter(KF, log, Q_real, R, x0=log.truth[0], P0=0.1**2 * np.eye(2))
    return replay(kf, log)


history = on_real_robot(log, R_real)
show_run(log, history, title=log.name)
print(metrics.summary(history, log))

# %% [markdown]
# All five robots: dead reckoning only, then your filter with the wide `R` and with the narrow one, in which σ is what a single range really errs by.
#
# **Before you run it:** which errs less, and how honest are they?
# - (a) The narrow `R` errs less and is honest: it is the true one.
# - (b) The narrow `R` errs less, but it is overconfident.
# - (c) The wide `R` errs less, and the narrow one is the more overconfident.

# %% id="guess-real" tags=["guess", "nbval-ignore-output"]
guess = "c"
print("position RMSE [m] (mean NEES)    dead reckoning     wide R         narrow R")
for robot in range(1, 6):
    log = mrclam.with_compass(mrclam.load(robot), rng=0)
    dead = log.truth[0] + np.vstack([[0, 0], np.cumsum(log.dt * log.controls, axis=0)])
    off = np.linalg.norm(dead - log.truth, axis=1)
    row = f"{log.name:34s}{np.sqrt(np.nanmean(off**2)):8.2f}     "
    for R in (R_real, R_narrow):
        history = on_real_robot(log, R)
        rmse, mean_nees = metrics.rmse(history, log), np.nanmean(metrics.nees(history, log))
        row += f"{rmse:10.3f} ({mean_nees:.1f})"
    print(row)
reveal("real", guess)

# %% [markdown]
# On the real set 7 you should see about 0.14, 0.11, 0.28, 0.16 and 0.28 m for the wide `R`, against 0.4 to 1.1 m of dead reckoning. With the narrow `R` all five
# are overconfident, and robots 3 and 5 badly so (0.6 and 0.4 m, NEES about 28 and 19). On the simulated log the wide `R` errs by 0.08 to 0.11 m, dead reckoning by
# 0.3 to 0.5 m, and the narrow `R` has a NEES of 2.4 to 3.3. It is noise mismatch, as in lab 2, and two things are behind it.
#
# - The range error is not *white*: a range that is 20 cm too long is 20 cm too long in the next reading as well (the correlation of two readings in a row is
#   above 0.9, in both logs). Ten readings in a row are not ten independent opinions, but the filter counts them as such. A wider `R` is the answer; on the simulated log it is even too wide
#   (NEES 0.5 to 0.8, underconfident), which is the safe side.
# - A few barcodes are misread, three by robot 3, in both logs. The filter then believes in a landmark on the wrong side of the hall. The next cell finds them
#   without knowing the truth. (On the real set they are at 370 s; what follows at 379 s are good readings, which a filter that is 2 m off cannot believe.)
#
# ### Question
# Look at the NIS that the next cell prints. What would you do with a measurement whose NIS is 300 when 2 is expected? What is the risk of your rule?

# %% tags=["nbval-ignore-output"]
log = mrclam.with_compass(mrclam.load(robot=3), rng=0)
value, dof = metrics.nis(on_real_robot(log, R_real), log)
worst = np.argsort(np.nan_to_num(value))[::-1][:6]
print(log.name)
for k in worst:
    when = log.times[k + 1]
    print(f"   {when:6.1f} s: NIS {value[k]:6.1f}, with {dof[k]} numbers measured")

# %% [markdown] id="answer-gate" tags=["answer"] points=2 title="Question on misread measurements"
# ### BEGIN SOLUTION
# Leave it out: a *gate* compares the NIS of each landmark with a chi-square bound (9.21 holds 99 % for two numbers) before it is used. That removes the misread
# barcodes, and robots 3 and 5 become as good as the others. The risk: when the filter itself is wrong, say after the robot was carried away, every *good* measurement
# looks impossible, the gate closes, and the filter stays lost and sure of itself. Lab 4 is about that.
# ### END SOLUTION

# %% [markdown]
# The sliders work on a recorded run of a robot too; the factor is on the variance, and the third panel is the NIS. Pretend that you have no truth. You make `R` smaller until the NIS per measured number is 1, as lab 2 taught. **Before you run it:** what is the mean NEES then?
# - (a) About 2: both measure how honest the filter is.
# - (b) Well below 2.
# - (c) Well above 2.

# %% id="guess-nis-real" tags=["guess", "nbval-ignore-output"]
guess = "c"
log = mrclam.with_compass(mrclam.load(robot=1, start=200, duration=120), rng=0)
print("factor of the wide R   NIS per number   mean NEES")
for factor in (1, 0.3, 0.1, 0.03):
    history = on_real_robot(log, factor * R_real)
    mean_nis, mean_nees = (
        metrics.mean_nis(history, log),
        np.nanmean(metrics.nees(history, log)),
    )
    print(f"{factor:10g}{mean_nis:24.2f}{mean_nees:14.1f}")
reveal("nis-real", guess)
explore(KF, log, kind="nis", Q=Q_real, R=R_real, x0=log.truth[0], P0=0.1**2 * np.eye(2))

# %% [markdown] id="rubric-gate" tags=["hidden"]
# **Misread measurements, 2 points.**
# - 1 point: leave it out when its NIS is beyond a chi-square bound (2 degrees of freedom).
# - 1 point: the risk: when the filter itself is wrong, good measurements are refused too.

# %% [markdown] tags=["hidden"]
# ## Graded checks
#
# They stand only in this copy. When a class is graded, each runs with numbers drawn for each student.

# %% id="setup-exam" tags=["setup", "hidden"]
import dataclasses

from labkit.instructor.exam.exam import Exam

exam = Exam("03_range_bearing_ekf")
check = exam.check
Q, R_rb = (
    np.diag([0.25**2, 0.25**2]),
    np.diag([0.2**2, np.deg2rad(5) ** 2]),
)  # as in section 5


def places(rng):
    """Positions and landmarks near them and far away, in all directions."""
    spots = [(x, size) for x in rng.normal(size=(12, 2)) for size in (0.2, 9)]
    return [(x, Landmark(x + size * rng.normal(size=2), 0)) for x, size in spots]


def drive(rng, landmarks=30, Q=Q, R=R_rb, start=None, steps=160, range=2.5):
    """A run without close passes, which would make of a rounding error a difference that can be seen."""
    world = random_map(landmarks, rng=rng) if isinstance(landmarks, int) else landmarks
    start = rng.uniform(-2, 2, 2) if start is None else start
    run = simulate(Robot(start, Q, R, type="rb", range=range, rng=rng), world, steps)
    apart = world.positions - run.truth[:, None]
    near = np.linalg.norm(apart, axis=2).min(axis=0, initial=9)
    far = Map([lm for lm, distance in zip(world, near) if distance > 0.6])
    return dataclasses.replace(run, map=far).seen_by("rb", R, range, rng)


# %% id="figure" tags=["hidden"]
public = simulate(Robot((2, -2), Q, R_rb, type="rb", rng=1), random_map(25, rng=1))
exam.figure(KF, public)

# %% id="grade-h" tags=["hidden"] points=1 title="h: in all directions, near and far"
exam.same(h, places(exam.rng()), "other places")
print("passed")

# %% id="grade-jacobian" tags=["hidden"] points=2 title="jacobian: in all directions, near and far"
exam.same(jacobian, places(exam.rng()), "other places")
print("passed")

# %% id="grade-other-map" tags=["hidden"] points=2 title="KF: a drive on another map"
exam.same_run(KF, drive(exam.rng(), 20, steps=160), "on another map")
print("passed")

# %% id="grade-other-noise" tags=["hidden"] points=2 title="KF: other noise, other time step"
rng = exam.rng()
a = rng.uniform(0.5, 0.8) * rng.choice([-1, 1])  # never without correlation
other = np.diag([0.1, np.deg2rad(rng.uniform(1, 3))]) ** 2
noisy = drive(rng, Q=0.1 * np.array([[1, a], [a, 1]]), R=other, steps=120)
noisy = dataclasses.replace(noisy, times=rng.uniform(0.3, 0.7) * noisy.times)
known = {"x0": noisy.truth[0], "P0": 0.3 * np.eye(2)}
exam.same_run(KF, noisy, "with other noise and another time step", **known)
print("passed")

# %% id="grade-west" tags=["hidden"] points=2 title="KF: landmarks due west"
rng = exam.rng()
west = Map([Landmark((-6 - i, y), 5 - i) for i, y in enumerate(rng.uniform(-3, 3, 6))])
exam.same_run(KF, drive(rng, west, steps=100, range=20), "with landmarks in the west")
print("passed")

# %% id="grade-one-landmark" tags=["hidden"] points=1 title="KF: a single landmark"
rng = exam.rng()
lighthouse = Map([Landmark((3.5, rng.uniform(-1, 1)), "lighthouse")])
alone = drive(rng, lighthouse, range=20, start=(1, -2), steps=80)
exam.same_run(KF, alone, "with a single landmark", x0=alone.truth[0], P0=0.2 * np.eye(2))
print("passed")

# %% id="grade-no-landmark" tags=["hidden"] points=1 title="KF: nothing in view at all"
exam.same_run(KF, drive(exam.rng(), Map([]), steps=40), "without any landmark")
print("passed")

# %% id="grade-many" tags=["hidden"] points=1 title="KF: many landmarks at once"
exam.same_run(KF, drive(exam.rng(), 60, steps=30, range=6), "with many landmarks in view")
print("passed")

# %% id="grade-honest" tags=["hidden"] points=2 title="KF: honest over a long run (NEES)"
rng = exam.rng()
long = drive(rng, 25, steps=300)
known = {"x0": long.truth[0], "P0": 0.2 * np.eye(2)}
mine = exam.same_run(KF, long, "over a long run", **known)
right = [exam.history(one, long, **known) for one in exam.right("KF")]
mean, *due = [metrics.nees(one, long)[40:].mean() for one in [mine, *right]]
if min(abs(mean / one - 1) for one in due) > 0.05:
    exam.fail(
        f"Over a long run your mean NEES is {mean:.2g}; a right filter has {due[0]:.2g}."
    )
print("passed")

# %% [markdown]
# ## Summary
#
# - The extended Kalman filter is the Kalman filter with a tangent in place of the curve, taken at the estimate.
# - Differences of angles are wrapped, always.
# - Near a landmark the curve bends, and the filter is surer than it should be.
# - On a real robot noise is neither white nor known: admit more of it than the data sheet says, and doubt what looks impossible.
#
# Save, and run `labkit check notebooks/03_range_bearing_ekf.ipynb` in a terminal before you hand it in.
#
# **Next:** here the robot could drive in any direction, and a compass gave the heading. The handout remarks that a robot with wheels or legs, which turns and drives ahead, can be
# localized in the same way, although its motion is not linear either. Its heading is then part of the estimate: that is lab 4.
#
# ## Errata and references
# - The handout's $\arctan(d_y/d_x)$ must be atan2; the wrapping of the bearing innovation is missing there; $I_{2p \times 2p} \otimes R$ must be $I_{p \times p} \otimes R$. Its
#   scripts tell the range-bearing filter so much noise that its mean NEES is 0.15.
# - I. Rañó, practice handout, section 4, questions Q6 and Q7.
# - S. Thrun, W. Burgard, D. Fox, *Probabilistic Robotics*, MIT Press 2005, sections 3.3 (extended Kalman filter) and 7.4 (localization).
# - K. Leung, Y. Halpern, T. Barfoot, H. Liu, "The UTIAS multi-robot cooperative localization and mapping dataset", *International Journal of Robotics Research* 30(8), 969–974, 2011.
# - R. Labbe, *Kalman and Bayesian Filters in Python*: the book behind `filterpy`.

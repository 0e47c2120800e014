# %% [markdown]
# # Lab 1 · Where is the robot? A Kalman filter with landmarks
#
# *About 110 minutes. It uses nothing of other labs: you need Python with NumPy arrays, a little matrix algebra, and no knowledge of Kalman filters.*
#
# A robot drives a square. It knows what it was told to do, but its wheels slip. It sees landmarks that are on its map, but not
# sharply. Neither is enough; together they are. The Kalman filter is the recipe for putting them together.
#
# **By the end you can**
# - say what a filter *believes*: a position and a covariance, drawn as an ellipse;
# - predict that belief through a motion, and correct it with measurements;
# - judge whether a filter is right *and* whether it knows how right it is.
#
# **You will write** `stack`, `repeat_R` and the class `KF` with its two methods `predict` and `update`. Under each answer is a
# *check* cell: run it as often as you like. It tells you what is wrong, not just that something is. (If a cell shows `[*]` for more than ten
# seconds, your code loops: Kernel → Interrupt.)
#
# **Before some cells you make a prediction:** write the letter of your choice into `guess = "?"`, then run the cell. It says why each choice was
# tempting. Nobody marks it.
#
# *The handout* is the practice text by I. Rañó that this lab grew from (it stands under the references, at the end). Its questions and its names in
# the code are kept. Where it slips, a box that begins with **Erratum** says so.

# %% id="setup" tags=["setup"]
import matplotlib.pyplot as plt
import numpy as np

from labkit import EnvPlot, Landmark, Map, Robot, check, explore, explore_line, make_filter
from labkit import play, random_map, replay, reveal, simulate
from labkit.metrics import distances, inside, nees, semi_axis, steps_to_converge
from labkit.plots import show_run
from labkit.plots.bell import draw_bell, draw_cloud

# %% [markdown]
# ## 1. One number first
#
# A robot stands somewhere on a line. You **believe** that it is at 0 m, but an error of 1.7 m would not surprise you. Now a sensor says: "2 m".
# Its errors are more like 0.4 m. Where is the robot?
#
# The *standard deviation* σ tells how large an error usually is. Its square is the *variance*, here 1.7² ≈ 3 m² for the belief and
# 0.4² = 0.16 m² for the sensor. Errors that come by chance, a new one with each reading, are called *noise*. Here small ones are frequent and large ones rare, in the shape of
# a bell, and σ is how wide the bell is: such noise is called **Gaussian**. To see it, let the sensor measure the same place, 2 m, ten thousand times.

# %%
readings = np.random.default_rng(1).normal(2.0, 0.4, 10_000)  # [m]
fig, ax = plt.subplots(figsize=(6.4, 2.8), layout="constrained")
draw_bell(ax, readings, (2.0, 0.4**2))
plt.show()
for n in (1, 2, 3):
    share = np.mean(abs(readings - 2.0) < n * 0.4)
    print(f"within {n}σ: {100 * share:.1f} % of the readings")

# %% [markdown]
# For a Gaussian these shares are 68.3, 95.4 and 99.7 %, whatever σ is. Two numbers describe such a bell: its *mean*, where its middle is, and its variance.
#
# The sensor is such a bell, and so is the belief: the places where the robot may be, and how likely each is. Neither is thrown away: the new estimate lies between the two, and nearer to the one with the smaller variance.
# With the variances $P$ of the belief and $R$ of the sensor,
#
# $$ K = \frac{P}{P + R}, \qquad \text{new} = \text{old} + K\,(\text{seen} - \text{old}), \qquad \text{new variance} = P - K P . $$
#
# $K$, the *Kalman gain*, says which part of the way to go: 0 is "ignore the sensor", 1 is "believe the sensor only".
#
# **Before you run it:** the belief has a variance of 3 m², the sensor one of 0.16 m². Which variance has the new estimate?
# - (a) one between the two, since it is a mixture;
# - (b) 0.16 m², that of the better one;
# - (c) less than 0.16 m²;
# - (d) 3.16 m², since errors add up.

# %% id="guess-new-variance" tags=["guess"]
guess = "c"
P, R = 3.0, 0.16  # variances of belief and sensor [m^2]
old, seen = 0.0, 2.0  # [m]
K = P / (P + R)
print(f"K = {K:.3f}: the estimate moves from {old:.2f} m to {old + K * (seen - old):.2f} m")
after = P - K * P  # [m^2]
print(f"the variance falls from {P} m² to {after:.3f} m², σ to {np.sqrt(after):.2f} m")
reveal("new-variance", guess)

# %% [markdown]
# **Try it** (mouse, or Tab and the arrow keys). Make the belief as good as the sensor: where is the new bell then? Which slider moves the new bell without
# making it wider or narrower? Can you make it wider than one of the other two?

# %%
explore_line()

# %% [markdown]
# <details><summary>What there is to see</summary>
#
# With equal variances $K$ is ½, the new bell stands in the middle, and its variance is half of theirs. *What* the sensor says moves the bell and does not change its
# width: how sure you are follows from $P$ and $R$ alone, so it could be computed before anything is measured. And you cannot make the new bell wider
# than either: a second opinion never makes this filter less sure, however poor it is.
# </details>
#
# **In the plane** the place has two numbers, $x$ and $y$, and the bell becomes a hill, here seen from above as a cloud of possible places. Its width is now a
# **covariance**: a matrix with the variances of $x$ and $y$ on the diagonal, and beside them a number that says how much the two err together. We draw it as
# an **ellipse** that reaches 3σ far in each direction.

# %%
P = np.array([[3.0, 1.2], [1.2, 1.0]])  # [m^2]
cloud = np.random.default_rng(1).multivariate_normal([0, 0], P, 10_000, method="cholesky")
fig, ax = plt.subplots(figsize=(6.4, 2.8), layout="constrained")
draw_cloud(ax, cloud[:2000], P)
plt.show()
squared = np.sum(cloud * np.linalg.solve(P, cloud.T).T, axis=1)  # distance in σ, squared
print(f"in the 3σ ellipse: {100 * np.mean(squared < 9):.0f} % of the cloud")

# %% [markdown]
# The ellipse leans to the right: this belief says that if the robot is farther to the right than believed, it is probably farther up, too.
#
# > **Erratum.** The handout says that the truth lies in the 3σ ellipse with 99.7 % probability. That is true for *one* number. For two, it is
# > $1 - e^{-9/2}$ = 98.9 %: in a run of 160 steps the truth is outside about twice, in some runs never, in others four times, and nothing is wrong with that.
#
# ## Symbols
#
# | symbol | in the code | shape | unit | what it is |
# |---|---|---|---|---|
# | $\hat x$ | `kf.xk_k` | (2,) | m | estimated position in the map's axes, which are called the world frame |
# | $P$ | `kf.Pk_k` | (2, 2) | m² | its covariance: how unsure the filter is |
# | $v$ | `u` | (2,) | m/s | commanded velocity |
# | $T$ | `kf.dt` | number | s | length of a step, 0.25 s |
# | $Q$ | `kf.Q` | (2, 2) | m² | covariance of the motion noise of one step |
# | $R$ | `kf.R` | (2, 2) | m² | covariance of the noise of one measured landmark |
# | – | `y` | list of `Landmark` | m | the landmarks in view, as measured now |
# | $p$ | `len(y)` | number | – | how many landmarks are in view |
# | $y$, $\hat y$ | `seen`, `expected` | (2p,) | m | what is measured of all of them, stacked, and what the map lets expect |
# | $x_{li}$ | `m[m.index(y[i])].p` | (2,) | m | place on the map of the $i$-th landmark *in view* |
# | $H$ | `H` | (2p, 2) | – | derivative of $\hat y$ by the position |
# | $S$ | `S` | (2p, 2p) | m² | covariance of $y - \hat y$, the innovation (section 4) |
# | $K$ | `K` | (2, 2p) | – | Kalman gain |
#
# What a symbol means in other labs: [all symbols](../notebooks/glossary.md).
#
# $P$, $R$ and $K$ are what they were on the line; they are matrices now. Three remarks on names. `xk_k` is the handout's $\hat x_{k|k}$: the estimate at step k after the
# measurements of step k. `Q` and `R` are told *per second* where robots and filters are made; everywhere inside `KF`, and in all formulas from
# section 4 on, they are those of *one step*. And the field `p` of a landmark, `lm.p`, is a place, not the number $p$: both are the handout's.
#
# ## 2. The robot and its world
#
# The map is a list of landmarks. Each has a position `p` and a name `id`. The robot moves one step with `action()`, which returns the
# velocity it was told to drive, and looks around with `measure(m)`, which returns the landmarks within 2.5 m. In a measurement, `p` is
# the vector *from the robot to the landmark*; its axes are those of the map, as this robot has no heading. Noise is everywhere: in the motion (covariance `Q`) and
# in what it sees (covariance `R`).
#
# **Before you run it:** the robot is at (2, −2) and is told to drive up at 0.5 m/s for 0.25 s. Where would it be after one step if its
# motion had no noise? (The first line that is printed tells.)

# %%
Q = np.diag([0.25**2, 0.25**2])  # motion noise, per second [m^2/s]
R = np.diag([0.2**2, 0.2**2])  # measurement noise of one landmark, times one second [m^2 s]

m = random_map(25, rng=1)
r = Robot((2, -2), Q, R, rng=1)
u = r.action()
y = r.measure(m)

print("without noise it would be at", np.array([2, -2]) + r.dt * u)
print("told to drive", u, "m/s; is really at", r.p.round(3))
for lm in y:
    on_map = m[m.index(lm)].p.round(2)
    print(f"sees landmark {lm.id:2d} at {lm.p.round(2)}; on the map it is at {on_map}")

# %% [markdown]
# Three things to take along:
# - `m.index(lm)` finds a measured landmark on the map: two landmarks are equal (`==`) when their names are. A name is not a place in the list.
# - `landmark - x` is the vector from a position `x` to the landmark.
# - The noise is told *per second*, so that it does not depend on the step. A longer step slips more: its motion noise has covariance $Q\,T$. A
#   shorter look is a noisier one: a measurement has $R/T$. `r.Q` and `r.R` are these step values; your filter will make the same conversion
#   once, when it is made. With $T$ = 0.25 s the motion has σ = 0.125 m a step, and a landmark is seen with σ = 0.4 m, as on the line.
#
# A seed such as `rng=1` makes each cell print the same whenever you run it. Change it, and you have another world.
#
# ## 3. Why commands alone do not do
#
# `simulate` drives the robot through the whole square, 8 s a side; for the last 8 s it is told to stand still, and slips all the same. It records a
# *log*: what the robot was told (`log.controls`), what it saw, and the true path (`log.truth`), which no filter ever gets.

# %%
log = simulate(Robot((2, -2), Q, R, rng=1), m)
square = np.array([2, -2]) + np.vstack([[0, 0], np.cumsum(log.dt * log.controls, axis=0)])

fig, ax = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
ax.plot(*m.positions.T, "k*", label="landmarks")
ax.plot(*square.T, "--", color="#777777", label="as told")
ax.plot(*log.truth.T, color="#0072B2", label="true path")
ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="Told to drive a square")
ax.legend(loc="upper left", bbox_to_anchor=(1, 1), frameon=False)
plt.show()
off = np.linalg.norm(log.truth[-1] - square[-1])
print(f"At the end it is {off:.2f} m from where it was told to be.")

# %% [markdown]
# Is that much? Let a thousand robots do the same, each with slips of its own. As a typical distance we take the *root mean square* (RMS): the root of the mean of the
# squared distances.
#
# **Before you run it:** after 10 s they are 1.1 m off, in the root mean square. And after 40 s, four times as long?
# - (a) still 1.1 m: there are as many slips to the left as to the right;
# - (b) 2.2 m, twice as much;
# - (c) 4.5 m, four times as much.

# %% id="guess-dead-reckoning" tags=["guess"]
guess = "b"
slips = np.random.default_rng(5).normal(0, 0.125, (1000, 160, 2))  # robot, step, x or y
distance = np.linalg.norm(slips.cumsum(axis=1), axis=2)  # (1000, 160) [m]
rms = np.sqrt(np.mean(distance**2, axis=0))
fig, ax = plt.subplots(figsize=(6.4, 2.8), layout="constrained")
ax.plot(log.times[1:], distance[:30].T, color="#0072B2", lw=0.6, alpha=0.4)
ax.plot(log.times[1:], rms, "k", label="RMS of 1000 robots; blue: 30 of them")
ax.set(xlabel="time [s]", ylabel="off by [m]", xlim=(0, 40), ylim=0)
ax.legend(loc="upper left", frameon=False)
plt.show()
print(f"RMS after 10 s {rms[39]:.1f} m, after 40 s {rms[-1]:.1f} m")
print(f"after 40 s half of them are within {np.median(distance[:, -1]):.1f} m")
reveal("dead-reckoning", guess)

# %% [markdown]
# To go by commands alone is called *dead reckoning*. What adds up is the *variance*: after $k$ steps it is $k$ times that of one step, so σ grows as $\sqrt k$. After
# 160 steps σ = 0.125 m · √160 = 1.6 m in each direction, which makes 2.2 m (RMS) in the plane; the run above is one of the worse ones: only one in ten ends farther off. Nothing takes the error away
# again. Landmarks can, since their place is known.
#
# ## 4. What should I see from here?
#
# Suppose the robot is at $\hat x$, and $p$ landmarks are in view. Count them as they come in the list `y`, and call $x_{li}$ the place on the map of the $i$-th *in view*: it
# need not be the $i$-th of the map. It should appear at $x_{li} - \hat x$. It does appear at $y_i$. The difference between what is seen and what is expected is
# the **innovation**: the news in a measurement. We stack all of it into vectors of $2p$ numbers,
#
# $$ y = \begin{bmatrix} y_1 \\ \vdots \\ y_p \end{bmatrix}, \qquad
#    \hat y = \begin{bmatrix} x_{l1} - \hat x \\ \vdots \\ x_{lp} - \hat x \end{bmatrix}, \qquad \text{innovation} = y - \hat y . $$
#
# ### Exercise 1 · `stack(y, m, x)`
# Return the pair `(seen, expected)`, two arrays of shape (2p,), in the order in which the landmarks stand in `y`.
#
# (The check below may say that something *acts as* some numbers: your code behaves as if these stood in that place, whatever line they come from.)
#
# *Example.* With a map of two landmarks, id 0 at (1, 0) and id 1 at (3, 2), a robot believed to be at `x = (1, 1)` and
# `y = [Landmark((2.1, 0.9), 1)]`, the answer is `seen = [2.1, 0.9]`, `expected = [2, 1]`.
#
# <details><summary>Hint</summary>
#
# For each `lm` in `y`: `lm.p` is what was seen; `m[m.index(lm)] - x` is what the map expects. `np.concatenate` glues a list of arrays
# into one.
# </details>


# %% id="answer-stack" tags=["answer"]
def stack(y, m, x):
    """Stacked measurement (2p,) and what the map predicts from position x (2p,)."""
    ### BEGIN SOLUTION
    seen = np.concatenate([lm.p for lm in y])
    expected = np.concatenate([m[m.index(lm)] - x for lm in y])
    return seen, expected
    ### END SOLUTION


# %% id="check-stack" tags=["check"] points=1 title="stack"
check("cartesian-stack", stack)

# %% [markdown]
# ## 5. One R for each landmark
#
# `R` (2, 2) is the noise of *one* landmark. The stacked vector has $2p$ numbers, so it needs a $2p \times 2p$ covariance. The landmarks are
# measured independently of each other, so `R` is repeated along the diagonal, with zeros everywhere else. This is a Kronecker product:
#
# $$ I_{p} \otimes R = \begin{bmatrix} R & & \\ & \ddots & \\ & & R \end{bmatrix} . $$
#
# > **Erratum.** The handout writes $I_{2p \times 2p} \otimes R$. Count the rows: that would be $4p$. It has to be $I_{p \times p}$.
#
# ### Exercise 2 · `repeat_R(R, p)`
# Return the (2p, 2p) covariance. *Example:* for `p = 1` it is `R` itself.
#
# <details><summary>Hint</summary>
#
# `np.kron(A, B)` puts a copy of `B`, times the entry, in the place of each entry of `A`. `np.eye(p)` is the identity. The order matters.
# </details>


# %% id="answer-repeat" tags=["answer"]
def repeat_R(R, p):
    """Covariance (2p, 2p) of p landmarks, measured independently, each with R (2, 2)."""
    ### BEGIN SOLUTION
    return np.kron(np.eye(p), R)
    ### END SOLUTION


# %% id="check-repeat" tags=["check"] points=1 title="repeat_R"
check("cartesian-repeat", repeat_R)

# %% [markdown]
# ## 6. The filter
#
# The belief is a Gaussian in the plane: mean $\hat x$, covariance $P$. Two things happen to it, in turn.
#
# **Predict.** The robot was told $v$. The mean moves along, and the noise of the motion makes the filter less sure:
#
# $$ \hat x \leftarrow \hat x + T\,v, \qquad P \leftarrow P + Q . $$
#
# **Update.** Landmarks are seen. The innovation pulls the mean, and the covariance shrinks:
#
# $$ \begin{aligned}
# H &= \text{derivative of } \hat y \text{ by } \hat x, \quad (2p, 2) \\
# S &= H P H^\top + (I_p \otimes R) && \text{how large the innovation may be} \\
# K &= P H^\top S^{-1} && \text{how much of it to believe} \\
# \hat x &\leftarrow \hat x + K\,(y - \hat y) \\
# P &\leftarrow P - K S K^\top
# \end{aligned} $$
#
# These are the formulas of section 1: if the sensor measures the position itself, $H$ is 1, and $K = P/(P+R)$ and $KSK = KP$. So read $K$ as before: a filter
# that is unsure of itself (large $P$) listens to its sensors; one that mistrusts its sensors (large $R$) listens to itself.
#
# What is new is $H$. This sensor does not measure the position, but the way from there to a landmark. Try it on the line, where all of this is one number.
#
# **Before you run it:** a landmark appears 1 m farther to the *right* than expected. Where does the update move the estimate of the robot?
# - (a) to the right, since that is where the news points;
# - (b) to the left;
# - (c) that depends on whether the landmark is to the robot's right or left.

# %% id="guess-sign" tags=["guess"]
guess = "b"
P, R1, H = 3.0, 0.16, -1.0  # one step to the right, and a landmark is seen one step less far
S = H * P * H + R1
K = P * H / S
innovation = 1.0  # [m]
print(f"S = {S:.2f} m², K = {K:.3f}, P becomes {P - K * S * K:.3f} m²")
print(f"the estimate moves by {K * innovation:.2f} m")
reveal("sign", guess)

# %% [markdown]
# What seems too far to the right of me tells me that I am farther to the left than I thought. That is what the minus in $K$ says; without a sign it is the $K$ of section 1, and $P$
# becomes what it became there.
#
# ### Exercise 3 · the class `KF`
# Write `predict(u)` and `update(y)`. They return nothing; they change `self.xk_k`, shape (2,), and `self.Pk_k`, shape (2, 2).
#
# - `self.Q` and `self.R` are already those of one step (see `__init__`): do not multiply or divide by `dt` again.
# - `y` may be empty. Then there is no news, and `update` changes nothing.
# - You may call `stack` and `repeat_R`.
# - Write `predict` first and run the check: it says that only `update` is missing. (The constructor is given, and is counted as right from the start.)
#
# *Example.* From `x = (0, 0)`, `predict(np.array([0, 0.5]))` with `dt = 0.25` leads to `x = (0, 0.125)`.
#
# <details><summary>Hint 1: what is H?</summary>
#
# Each landmark contributes two rows, one for x and one for y. Its expected measurement is $x_{li} - \hat x$. If the robot moves one metre to the right, what happens
# to the landmark as seen from the robot? So the two rows are $-I$, and `np.tile` repeats them.
# </details>
# <details><summary>Hint 2: the inverse of S</summary>
#
# `np.linalg.solve(S, B)` gives $S^{-1}B$ and is more exact than `inv`. Since $S$ and $P$ are symmetric, $K = (S^{-1} H P)^\top$.
# </details>


# %% id="answer-kf" tags=["answer"]
class KF:
    """Kalman filter for the position of a robot that sees relative Cartesian positions."""

    def __init__(self, x0, P0, Q, R, m, dt=0.25):
        self.xk_k = np.array(x0, dtype=float)  # (2,) estimate of the position [m]
        self.Pk_k = np.array(P0, dtype=float)  # (2, 2) its covariance [m^2]
        self.Q = np.array(Q) * dt  # (2, 2) motion noise of one step [m^2]
        self.R = np.array(R) / dt  # (2, 2) noise of one measured landmark [m^2]
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
        seen, expected = stack(y, self.map, self.xk_k)
        innovation = seen - expected
        H = np.tile(-np.eye(2), (p, 1))
        S = H @ self.Pk_k @ H.T + repeat_R(self.R, p)
        K = np.linalg.solve(S, H @ self.Pk_k).T
        self.xk_k = self.xk_k + K @ innovation
        self.Pk_k = self.Pk_k - K @ S @ K.T
        ### END SOLUTION


# %% id="check-kf" tags=["check"] points=3 title="KF: single steps and a short drive"
check("cartesian-kf", KF)

# %% [markdown]
# ## 7. Let it run
#
# The filter is started at (0, 0), which is wrong, with $P = 3\,I$, which admits it: σ = 1.7 m. Blue is the robot: `+` where it truly is,
# a dashed circle how far it sees, stars what it measures. Orange-red is your filter: `+` its estimate and an ellipse out to 3σ. A
# measured star may lie outside the circle: it is what the robot reports, noise and all.
#
# **Before you run it:** at the start the ellipse is a circle with a radius of 5.2 m. How large is it after the first step, with six landmarks in view?
# - (a) about 5 m: one step is not much;
# - (b) about 2.5 m: the filter meets the sensor half way;
# - (c) about 0.5 m;
# - (d) 0 m: the landmarks are on the map, so now it knows.

# %% id="guess-first-look" tags=["guess"]
guess = "c"
r = Robot((2, -2), Q, R, rng=1)
kf = KF((0, 0), 3 * np.eye(2), Q, R, m)
e = EnvPlot()
e.plotSim(r, m, kf, pause=True)  # in a window of its own it waits for a key
radius = []  # of the 3σ ellipse, the longer half axis [m]
for k in range(40):
    u = r.action()
    kf.predict(u)
    y = r.measure(m)
    kf.update(y)
    e.plotSim(r, m, kf)
    radius.append(3 * np.sqrt(np.linalg.eigvalsh(kf.Pk_k)[-1]))
print(f"longer half axis after 1 step {radius[0]:.2f} m, after 10 steps {radius[9]:.2f} m")
reveal("first-look", guess)

# %% [markdown]
# Now the run that was recorded in section 3, whole, to play, pause and step through (click the slider and use the arrow keys). Map and commands are the same as in the
# loop just now, but its noise is another: soon the robot is at other places.

# %%
play(make_filter(KF, log), log)

# %% [markdown]
# ## 8. How many steps until it knows?
#
# `replay(kf, log)` runs a filter over a recorded log and returns its history. The picture shows the run, with the ellipse of every eighth step and a blue dot where the
# robot truly was then; the error, beside 3σ as the filter tells them (the same for x and y here, since $P_0$, $Q$ and $R$ are); and a number called NEES: the error
# squared, measured in the filter's own σ. Single values jump up and down, for a right filter 95 % of them within the grey band; the *mean* over the run should be about 2, since x and y are two numbers.
# Lab 2 is about that; for now it is enough that the mean is neither 0.02 nor 200.
#
# The *RMSE* is the root of the mean of the squared distances to the truth. The start, 2.83 m off, is left out of it here.

# %%
history = replay(make_filter(KF, log), log)
show_run(log, history)
off = distances(history, log)[1:]  # [m]
print(f"position RMSE from step 1 on {np.sqrt(np.mean(off**2)):.2f} m")
print(f"mean NEES {nees(history, log)[1:].mean():.2f}")

# %% [markdown]
# Now the handout's first question. The filter is *right* when the true position is inside its ellipse. Here are the first steps:

# %%
history = replay(make_filter(KF, log), log)
print("step  truth inside?  longer half axis of the 3σ ellipse [m]")
for k in range(6):
    answer = "yes" if inside(history, log)[k] else "no"
    print(f"{k:4d}  {answer:13s}  {semi_axis(history)[k]:.2f}")
print("inside, and for ten steps in a row, from step", steps_to_converge(history, log))
print(f"outside in {np.sum(~inside(history, log))} of {len(log)} steps")

# %% [markdown]
# ### Question Q1
# How many steps does your filter need until the true position is inside its ellipse? The first row of the table may surprise you: why is
# it so, and what should one ask for, besides being inside, before calling an estimate *good*? Say how fast the ellipse shrinks, and why it
# stops shrinking.

# %% [markdown] id="answer-q1" tags=["answer"] points=2 title="Question Q1"
# ### BEGIN SOLUTION
# No step at all: the truth is inside from step 0, since the start was honest. With $P = 3I$ the ellipse reaches out to 5.2 m, and the true
# position (2, −2) is only 2.8 m away. Being inside is cheap when the ellipse is large; one must also ask for a small one.
#
# A single update with the landmarks in view brings the half axis from 5.2 m to about 0.5 m, because at first $P$ is so much larger than $R$
# that the estimate jumps to where the landmarks say (on the line: $K$ is almost −1). Then it sinks to about 0.4 m and stays, where each update takes away just
# what $Q$ adds at each prediction. With more landmarks in view this balance is lower, with fewer it is higher.
# ### END SOLUTION

# %% [markdown] id="rubric-q1" tags=["hidden"]
# **Q1, 2 points.**
# - 1 point: the truth is inside from the start, or after very few steps, *with the reason*: P = 3 I makes the ellipse large.
# - 1 point: inside is not enough, the ellipse must also be small; or: what Q adds and the updates take away come into balance.

# %% [markdown]
# ## 9. Play with it
#
# The first two sliders change what the *filter is told*: a factor on its $Q$ or $R$, that is on a variance. Factor 100 means a σ that is ten times as large; beside the slider stands
# which. The robot's run and its noise stay as they are, and factor 1 is the truth. The third slider is of another kind: it changes the landmarks, and another run is recorded (the robot drives the same path, but sees other things).
#
# **Before you move anything:** what will you see in the middle panel when the filter is told that its sensors have a σ ten times as large (factor 100)? Read the numbers at its axis, which is made as high as the curves need. (The RMSE below it counts the wrong start too: at factor 1 it says 0.28 m, without the start 0.17 m.)

# %%
explore(KF, sliders=("Q", "R", "landmarks"))

# %% [markdown]
# <details><summary>What there is to see</summary>
#
# The bounds move out, from about ±0.4 m to ±1.4 m, and it takes them longer to come in: the filter does not trust what it sees. The error grows too, but less: it stays well
# inside, and the mean NEES falls below 2. Lab 2 asks why.
# </details>
#
# Now a world with three landmarks only, so that the robot often sees none.
#
# **Before you run it:** what do the ellipses do?
# - (a) They stay as with 25 landmarks: each landmark is seen as well as it was.
# - (b) They grow as long as nothing is in view; the first look takes more from them than all later ones together.
# - (c) They grow as long as nothing is in view, and after it shrink as slowly as they grew.
# - (d) They stay as they are as long as nothing is in view: nothing is learned, and nothing forgotten.

# %% id="guess-few-landmarks" tags=["guess"]
guess = "b"
few = simulate(Robot((2, -2), Q, R, rng=1), random_map(3, rng=1))
history = replay(make_filter(KF, few), few)
show_run(few, history)
half = semi_axis(history)  # [m] the longer half axis of the 3σ ellipse
dark = (half[:-1] > 1.5) & (few.count > 0)  # a look after a long time without
for k in np.flatnonzero(dark):
    print(f"after {k * few.dt:4.1f} s: before the look {half[k]:.1f} m;", end=" ")
    print("after each of four steps", ", ".join(f"{a:.1f}" for a in half[k + 1 : k + 5]), "m")
reveal("few-landmarks", guess)

# %% [markdown]
# ### Question
# In the explorer set the number of landmarks to 60, then to 3. How large are the ellipses along the path in the two worlds? Which line of your class makes them small, and which one makes them grow?

# %% [markdown] id="answer-landmarks" tags=["answer"] points=2 title="Question on the number of landmarks"
# ### BEGIN SOLUTION
# With 60 landmarks the ellipses are small everywhere; with 3 they grow to metres wherever nothing is in view. What makes them small is
# $P \leftarrow P - KSK^\top$ in `update`. Written with inverses, one step is $P^{-1} \leftarrow P^{-1} + p\,R^{-1}$: each landmark in view adds its share of
# information, whatever its distance. What makes them grow is $P \leftarrow P + Q$ in `predict`: it comes at every step, and with nothing in view `update` takes nothing away.
# ### END SOLUTION

# %% [markdown] id="rubric-landmarks" tags=["hidden"]
# **Number of landmarks, 2 points.**
# - 1 point: small ellipses with many landmarks, and the line P - K S K' (each landmark in view takes something away).
# - 1 point: ellipses that grow where nothing is in view, and the line P + Q of `predict`.

# %% [markdown] tags=["hidden"]
# ## Graded checks
#
# They stand only in this copy. When a class is graded, each runs with numbers drawn for each student.

# %% id="setup-exam" tags=["setup", "hidden"]
import dataclasses

from labkit.instructor.exam.exam import Exam

exam = Exam("01_cartesian_ekf")
check = exam.check
Q, R = np.diag([0.25**2, 0.25**2]), np.diag([0.2**2, 0.2**2])  # as in section 2


def drive(rng, landmarks=25, Q=Q, R=R, steps=160, range=2.5):
    """A run with its own map, start and noise; landmarks: how many, or a Map."""
    world = random_map(landmarks, rng=rng) if isinstance(landmarks, int) else landmarks
    return simulate(Robot(rng.uniform(-2, 2, 2), Q, R, range=range, rng=rng), world, steps)


# %% id="figure" tags=["hidden"]
public = simulate(Robot((2, -2), Q, R, rng=1), random_map(25, rng=1))
exam.figure(KF, public)

# %% id="grade-stack" tags=["hidden"] points=1 title="stack: many landmarks, in any order"
rng = exam.rng()
calls = []
for n in (1, 6, 40):
    world = random_map(n, rng=rng)
    y = [Landmark(rng.normal(size=2), int(i)) for i in rng.permutation(n)[:20]]
    calls.append((y, world, rng.normal(size=2)))
exam.same(stack, calls, "many landmarks")
print("passed")

# %% id="grade-repeat" tags=["hidden"] points=1 title="repeat_R: any covariance, any number"
rng = exam.rng()
Rs = [np.array([[1, c], [c, 2]]) for c in rng.uniform(0.5, 1, 3)]
exam.same(repeat_R, [(R, p) for R, p in zip(Rs, (1, 5, 12))], "other covariances")
print("passed")

# %% id="grade-other-map" tags=["hidden"] points=2 title="KF: a drive on another map"
exam.same_run(KF, drive(exam.rng(), 12, steps=120), "on another map")
print("passed")

# %% id="grade-other-noise" tags=["hidden"] points=2 title="KF: other noise, other time step"
rng = exam.rng()
a, b = rng.uniform(0.5, 0.8, 2) * rng.choice([-1, 1], 2)  # never without correlation
noisy = drive(
    rng, 10, Q=0.1 * np.array([[1, a], [a, 1]]), R=0.08 * np.array([[1, b], [b, 2]]), steps=80
)
noisy = dataclasses.replace(noisy, times=rng.uniform(0.3, 0.7) * noisy.times)
exam.same_run(KF, noisy, "with correlated noise and another time step", x0=rng.normal(size=2))
print("passed")

# %% id="grade-one-landmark" tags=["hidden"] points=1 title="KF: a single landmark"
rng = exam.rng()
lighthouse = Map([Landmark(rng.uniform(-1, 1, 2), 0)])
exam.same_run(KF, drive(rng, lighthouse, steps=80, range=9), "with a single landmark")
print("passed")

# %% id="grade-no-landmark" tags=["hidden"] points=1 title="KF: nothing in view at all"
exam.same_run(KF, drive(exam.rng(), Map([]), steps=40), "without any landmark")
print("passed")

# %% id="grade-many" tags=["hidden"] points=1 title="KF: many landmarks at once"
exam.same_run(KF, drive(exam.rng(), 60, steps=30, range=6), "with many landmarks in view")
print("passed")

# %% id="grade-honest" tags=["hidden"] points=2 title="KF: honest over a long run (NEES)"
rng = exam.rng()
long = drive(rng, 15, steps=300)
mine = exam.same_run(KF, long, "over a long run")
right = exam.history(exam.right("KF")[0], long)
mean, due = nees(mine, long)[40:].mean(), nees(right, long)[40:].mean()
if abs(mean / due - 1) > 0.05:
    exam.fail(f"Over a long run your mean NEES is {mean:.2g}; a right filter has {due:.2g}.")
print("passed")

# %% [markdown]
# ## Summary
#
# - A belief is a mean *and* a covariance. Predict makes it wider, update makes it narrower.
# - The innovation is what was seen minus what was expected; the gain $K$ says how much of it to believe.
# - A good filter is close to the truth *and* knows how close.
# - Here the measurement was a linear function of the position, so this was a plain Kalman filter. Why the file's name says EKF, you learn in lab 3.
#
# Save the notebook (Ctrl+S): lab 2 uses your `KF`. To check all code once more before you hand it in, run
# `labkit check notebooks/01_cartesian_ekf.ipynb` in a terminal (in JupyterLab: File → New → Terminal). It does not read your written answers.
#
# **Next:** in [lab 2](02_noise_mismatch.ipynb) you lie to the filter about its noise, and learn to catch a filter that lies to you.
#
# ## Errata and references
#
# What differs here from the handout and its scripts, and why:
#
# | there | here |
# |---|---|
# | the scripts draw noise with the *variance* as standard deviation, so that the filter is told far too much noise (its mean NEES is 0.22, not 2) | noise is drawn from the covariance |
# | $I_{2p \times 2p} \otimes R$ | $I_{p \times p} \otimes R$ |
# | 3σ ellipse: 99.7 % | 98.9 % in two dimensions |
# | other noise in every run, none can be repeated | a seed, `rng=1` |
# | the last part of the drive sets one velocity twice, so that the robot stands still | kept: it is instructive to watch a filter without motion |
#
# - I. Rañó, *Localización de un robot con filtro de Kalman extendido*, practice handout, sections 1–3.
# - S. Thrun, W. Burgard, D. Fox, *Probabilistic Robotics*, MIT Press 2005, section 3.2 (Kalman filter).
# - Y. Bar-Shalom, X. R. Li, T. Kirubarajan, *Estimation with Applications to Tracking and Navigation*, Wiley 2001, section 5.4 (consistency).

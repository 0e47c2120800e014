# %% [markdown]
# # Lab 5 · Lost, found, and taking turns
#
# *About 130 minutes. You need your `EKF` from lab 4, filled in and saved.*
#
# Your EKF of lab 4 is quick and precise, and once it is lost it stays lost. The paper's other half (F. Martín, V. Matellán, P. Barrera, J. M. Cañas) is a **fuzzy grid**: slow, coarse, and able to start from nothing. The two take turns. You write the heart of the grid and the rule that switches, find out whether the paper's rule works,
# and let the whole thing run against its rivals.
#
# **By the end you can**
# - explain how a fuzzy grid finds a robot that could be anywhere, and what the size of its cells costs;
# - take a mean of angles;
# - say when a filter should stop believing itself, and why its covariance alone cannot tell;
# - compare localizers fairly, over many walks.
#
# **You will write** `membership`, `fuse_range`, `estimate`, `lost_by_spread` and `lost`.

# %% [markdown]
# ## Symbols
#
# | symbol | in the code | shape | unit | what it is |
# |---|---|---|---|---|
# | $\varphi$ | `phi` | number or array | rad | a heading that is asked about |
# | $\theta, c, s$ | `theta`, `c`, `s` | numbers | rad | a fuzzy heading: its middle, half its *core* (where it is as possible as can be), half its *support* (all but what is hardly possible) |
# | $h$ | `h` | number | – | its height, from 0 to 1 |
# | $b$ | `b` | number | – | its *bias*: what is left outside the support; also the least value of $S$ |
# | $\mu$ | `membership(...)` | number or array | – | how possible a heading is |
# | $r, \sigma$ | `r`, `sigma` | numbers | m | range at which a landmark is seen (lab 4's ρ), its standard deviation |
# | $e$ | `e` | one for each cell | m | how far a cell's distance to that landmark is from $r$, without sign |
# | | `cell`, `floor` | numbers | m, – | width of a cell; the least possibility that a cell may have |
# | $w_i$ | `w` | one for each cell | – | weights, of the cells that are at least `part` times as possible as the best |
# | $\bar\theta$ | | number | rad | the mean heading |
# | $S$ | `S` | one for each cell | – | how well a cell fits to $r$ (the paper's $S_t(x, y \mid r)$) |
# | $P$ | `P` | (3, 3) | m², rad² | covariance of your EKF's pose |
# | $d^2$ | `d2` | array | – | of each sighting: how far it is off, in standard deviations, squared and added up, from lab 4 |
#
# What a symbol means in other labs: [all symbols](../notebooks/glossary.md).
#
# The letters are those of the paper's section 3, but for $c$ and $s$: the paper has a width Δ and a flank α, which say the same (this α is no bearing).

# %% id="setup" tags=["setup"]
from functools import partial

import matplotlib.pyplot as plt
import numpy as np

from labkit import check, load_answer, make_filter, progress, replay, reveal, wrap
from labkit.legged import FIELD, FuzzyGrid, Hybrid, LeggedRobot, ParticleFilter
from labkit.legged import Triangulation, explore, play, plot_cells, plot_possible, plot_race
from labkit.legged import race, show_beliefs, table

EKF = load_answer("04_legged_robot", "EKF")  # your own filter, as you last saved it in lab 4
START = np.diag([0.1, 0.1, 0.1]) ** 2

# %% [markdown]
# ## 1. A fuzzy heading
#
# Cut the field into cells of 10 cm. Each cell keeps how *possible* it is that the robot is there: a number from 0 to 1. And since a robot in that cell would have to face somewhere, each cell also keeps *one fuzzy
# heading*, a trapezoid (the paper's figure 3): as possible as its height $h$ in its **core** around θ, and hardly possible beyond its **support**; in between it falls in a straight line. It never falls below the bias $b$, since any sighting may be false.
#
# $$ \mu(\varphi) = b + (h - b)\cdot\operatorname{clip}\!\left(\frac{s - |\varphi - \theta|}{s - c},\, 0,\, 1\right) $$
#
# ### Exercise 1 · `membership(phi, theta, c, s, h, b)`
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
sure = membership(phi, theta=0.5, c=0.1, s=0.4, h=1, b=0.1)
hardly = membership(phi, theta=3.0, c=0.8, s=1.6, h=0.7, b=0.1)
fig, ax = plt.subplots(figsize=(7, 2.6), layout="constrained")
ax.plot(np.rad2deg(phi), sure, "-", label="sure of the heading")
ax.plot(np.rad2deg(phi), hardly, "--", label="hardly sure, across ±180°")
ax.set(xlabel="heading φ [°]", ylabel="μ", ylim=(0, 1.05), xlim=(-180, 180))
ax.set_xticks(range(-180, 181, 60))
ax.legend(frameon=False)
plt.show()

# %% [markdown]
# ## 2. Seeing, for a grid
#
# A landmark is seen at the range $r$. Each cell compares its own distance to the landmark with $r$: they differ by $e = |\text{distance} - r|$. As long as this is explained by noise and by the size of the cell (up to σ + 0.3 cell), the cell stays fully possible. Then its possibility falls in a straight line, by 0.45 for each σ, until it meets $b$; with $b = 0.2$ that is 1.8 σ further on. It never falls to zero, for a sighting may be false:
#
# $$ S = \operatorname{clip}\!\left(1 - 0.9\,\frac{e - (\sigma + 0.3\,\text{cell})}{2\sigma},\; b,\; 1\right) . $$
#
# To **fuse** is to multiply: what the grid believed, times $S$. Then all is divided by the largest value, and after that no cell is left below a `floor` (0.01), or it could never come back.
#
# ### Exercise 2 · `fuse_range(possible, distance, r, sigma, cell, b, floor)`
# `possible` and `distance` are arrays of one shape, a value for each cell. Return the new array. No loop is needed. (0.3 and 0.9 are choices, nothing deeper; σ = `sigma`.) *Example:* two cells,
# `possible = np.array([1, 1])`, `distance = np.array([2.0, 2.4])`, r = 2, σ = 0.1, cell = 0.1, b = 0.2, floor = 0.01: the result is `[1, 0.2]`.
#
# <details><summary>Hint</summary>
#
# One line for each sentence: $e$, $S$, the product, the division, the floor. `np.maximum` compares an array with a number, cell by cell.
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
# A robot stands still and sees three landmarks, one after the other. Only the ranges are used here, each good to 5 %.
#
# **Before you run it:** what shape has the set of possible cells after the first range, and how many places are left after the second?
# - (a) A spot around the robot; after the second a smaller one.
# - (b) A ring around the landmark; after the second the two spots where two rings cross.
# - (c) A ring around the landmark; after the second both rings, since either sighting may be the false one.

# %% id="guess-rings" tags=["guess"]
guess = "b"
grid = FuzzyGrid()
possible, robot = np.ones(grid.px.shape), np.array([-0.8, 1.2])
fig, axes = plt.subplots(1, 3, figsize=(11, 2.9), layout="constrained")
for ax, landmark in zip(axes, [FIELD.map[0], FIELD.map[1], FIELD.map[3]]):
    distance = np.hypot(landmark.p[0] - grid.px, landmark.p[1] - grid.py)
    r = np.hypot(*(landmark.p - robot))
    possible = fuse_range(possible, distance, r, sigma=0.05 * r)
    plot_possible(ax, grid, possible, landmark, robot)
    ax.set_title(f"{landmark.id}, {r:.1f} m away", fontsize=10)
plt.show()
reveal("rings", guess)

# %% [markdown]
# ## 3. From cells to a pose
#
# Where is the robot, then? Take the cells that are at least 0.7 times (`part`) as possible as the best, and of these the mean, each weighted by how possible it is. For x and y that is the usual weighted mean. For headings it is not: the mean of 179° and −179° must be 180° and not 0°. So
# draw each heading as an arrow of length 1, take the weighted mean of the *arrows*, and return where that points:
#
# $$ \bar\theta = \operatorname{atan2}\Big(\sum_i w_i \sin\theta_i,\; \sum_i w_i \cos\theta_i\Big), \qquad \sum_i w_i = 1 . $$
#
# ### Exercise 3 · `estimate(possible, x, y, theta, part)`
# Four arrays of one shape, a value for each cell: how possible it is, where it lies, and the middle of its fuzzy heading. Return the pose (3,). *Example:* with `possible` 1, 1, 0.5, `x` 0, 1, 9, `y` 2, 2, 9 and `theta` 3, −3, 0 (each an array) the result is (0.5, 2, π).
#
# <details><summary>Hint</summary>
#
# An array of booleans picks cells: `x[best]` is a flat array, also if `x` is a table. Pick first, then divide the weights by their sum.
# </details>


# %% id="answer-estimate" tags=["answer"]
def estimate(possible, x, y, theta, part=0.7):
    """Pose (3,) from the cells that are at least `part` times as possible as the best."""
    ### BEGIN SOLUTION
    best = possible >= part * possible.max()
    w = possible[best] / possible[best].sum()
    heading = np.arctan2(w @ np.sin(theta[best]), w @ np.cos(theta[best]))
    return np.array([w @ x[best], w @ y[best], heading])
    ### END SOLUTION


# %% id="check-estimate" tags=["check"] points=2 title="estimate"
check("legged-estimate", estimate)

# %% [markdown]
# The kit's `FuzzyGrid` does all that you wrote, and fuses the headings too: seen from a given cell, a bearing to a known landmark means one heading (the direction to the landmark, less the bearing), so each cell has its own. To walk, it is shifted. A step of 2.5 cm is less than a cell; so steps are collected until a whole cell has come together, then the grid is blurred a little (a possible cell lends to its neighbours) and each
# cell is moved *along its own heading*.
#
# Here it starts from nothing. This is a picture like the paper's figure 4: the darker the green, the more possible (after 0 steps everything is possible); black needles show the headings of the best cells.

# %%
run = LeggedRobot("real", rng=12).record(60)
show_beliefs(FuzzyGrid(run.noise.told()), run, steps=[0, 1, 4, 10, 20, 60])

grid = FuzzyGrid(run.noise.told())
for u, seen in zip(run.controls, run.measurements()):
    grid.predict(u)
    grid.update(seen)
mine = estimate(grid.h, grid.px, grid.py, grid.theta)
print("your estimate after 60 steps:", mine.round(1), " the truth:", run.truth[60].round(1))

# %% [markdown]
# Grid, EKF and particles on one walk; press play. (The particles, green dots, are guesses; when nothing fits some are drawn anew, often far off. Section 6 explains them.) At 8 s the robot is kidnapped. The EKF knows the start, the others do not.

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
# ## 4. How large a cell?
#
# The grid looks at all of its cells at every sighting. Larger cells are fewer; the paper writes that they lose much precision, and that this is why it wanted a Kalman filter at all.
#
# **Before you run it:** from cells of 10 cm to cells of 40 cm there are 16 times fewer. With 10 cm the mean error is about 10 cm. What does it become?
# - (a) 16 times as large, as there are 16 times fewer cells.
# - (b) 4 times as large, as a cell is 4 times as wide.
# - (c) Larger, but less than 4 times.
# - (d) The same: the mean over many cells does not mind.

# %% id="guess-cells" tags=["guess", "nbval-ignore-output"]
guess = "c"
logs = [LeggedRobot("real", rng=seed).record(200) for seed in range(12)]
sizes = [0.05, 0.1, 0.2, 0.4]
results = race(
    {
        f"{100 * size:.0f} cm": lambda log, size=size: FuzzyGrid(log.noise.told(), cell=size)
        for size in sizes
    },
    logs,
    progress,
)
plot_cells(sizes, results)
reveal("cells", guess)

# %% [markdown]
# ## 5. Taking turns
#
# The paper lets the two take turns. The grid works until it is sure enough. Here that means, in three pictures in a row:
# - the best cell fits well to what was seen lately (its quality, from 0 to 1, is above 0.6);
# - the cells that are at least 0.7 times as possible as the best lie in a square of one metre.
#
# Then the EKF takes over, from the mean and the covariance of those cells. And back?
#
# > *If the matrix P reflects too much uncertainty, the grid takes over again* (our words, section 5 of the paper).
#
# ### Exercise 4 · `lost_by_spread(P, position, heading)`
# True if the position's standard deviation $\sqrt{P_{xx} + P_{yy}}$ is above `position` (0.5 m) or that of the heading above `heading` (1 rad).


# %% id="answer-spread" tags=["answer"]
def lost_by_spread(P, position=0.5, heading=1.0):
    """Whether the covariance P (3, 3) of a pose is too wide: the paper's rule."""
    ### BEGIN SOLUTION
    return bool(np.sqrt(P[0, 0] + P[1, 1]) > position or np.sqrt(P[2, 2]) > heading)
    ### END SOLUTION


# %% id="check-spread" tags=["check"] points=1 title="lost_by_spread"
check("legged-spread", lost_by_spread)


# %% [markdown]
# Twenty robots are kidnapped at 15 s of 30. The hybrid of grid and EKF switches by the paper's rule.
#
# **Before you run it:** how many of them will be found again?
# - (a) All: that is what the rule is for.
# - (b) About half: it depends on where they are put down.
# - (c) Hardly any.


# %% id="guess-papers-rule" tags=["guess"]
def follower(log):
    """What a Hybrid needs to start your EKF: a function of x0 and P0."""
    return lambda x0, P0: make_filter(EKF, log, x0=x0, P0=P0, noise=log.noise.told())


def hybrid(log, rule, background=0):
    """Grid and EKF taking turns; rule(P, d2) says when the EKF gives up."""
    return Hybrid(FuzzyGrid(log.noise.told()), follower(log), rule, background)


guess = "c"
kidnapped = [LeggedRobot("real", rng=seed).record(300, kidnap=150) for seed in range(20)]
(result,) = race(
    {"spread": lambda log: hybrid(log, lambda P, d2: lost_by_spread(P))}, kidnapped
)
found = np.isfinite(result.recovered())
print(f"{found.sum()} of {len(found)} kidnapped robots were found again")
reveal("papers-rule", guess)

# %% [markdown]
# What does change, if $P$ does not? The filter is *surprised*: sighting after sighting has an impossible $d^2$. One alone may be a false alarm; most of the last eight cannot be.
#
# ### Exercise 5 · `lost(P, d2, bound, share)`
# `d2` (array) holds the $d^2$ of the last sightings, at most eight, the oldest first. Return True if the paper's rule says so, *or* if there are eight and at least the `share` of them is above `bound`.
#
# <details><summary>Hint</summary>
#
# The mean of an array of booleans is the share of those that are True. With fewer than eight sightings wait: after the switch the list starts empty.
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

# %% [markdown]
# Is it better? And is it calm? The paper writes that there is "no continual switching". Count it: a robot that is found once, carried away and found again needs three switches.

# %%
(result,) = race({"your rule": lambda log: hybrid(log, lost)}, kidnapped)
steps = result.recovered()
print(f"{np.isfinite(steps).sum()} of {len(steps)} kidnapped robots were found again,")
print(f"half of them within {np.nanmedian(steps) / 10:.1f} s")
for share in (0.6, 0.2):
    switches = []
    for log in kidnapped:
        both = hybrid(log, partial(lost, share=share))
        replay(both, log)
        switches.append(both.switches)
    print(f"number of switches in each walk, share {share}:", *switches)

# %% [markdown]
# Try when to switch. The walk stays the same; only your code runs again. This robot has a bad day (`harsh`): switch to `real` and `paper` as well, and look at a few walks.

# %%
explore(EKF, lost)

# %% [markdown]
# One walk proves little. The same over twenty walks, under `harsh` noise; the last variant has an EKF without a gate, which believes every sighting.

# %% tags=["nbval-ignore-output"]
harsh = [LeggedRobot("harsh", rng=seed).record(300, kidnap=150) for seed in range(20)]


def ungated(log):
    """The hybrid, with an EKF that believes every sighting."""
    told, KF = log.noise.told(), partial(EKF, gate=np.inf)
    follow = lambda x0, P0: make_filter(KF, log, x0=x0, P0=P0, noise=told)
    return Hybrid(FuzzyGrid(told), follow, lost)


variants = {
    f"share {share}": lambda log, share=share: hybrid(log, partial(lost, share=share))
    for share in (0.6, 0.2, 1.0)
}
print(table(race({**variants, "no gate": ungated}, harsh, progress)))

# %% [markdown]
# ### Question A
# What does a share of 0.2 do, what one of 1.0, before and after the kidnapping? And why does a filter without a gate not do as well?

# %% [markdown] id="answer-switch" tags=["answer"] points=3 title="Question A: when to switch"
# ### BEGIN SOLUTION
# With a share of 0.2 two false alarms or unlucky sightings among eight suffice, and the grid takes over although nothing has happened: worse accuracy and more computing. In exchange a kidnapping is noticed sooner. With 1.0 all eight have to be surprises:
# after a kidnapping one sighting that happens to fit is enough to stay lost, so the switch comes late or, in some runs, never.
#
# Without the gate the filter is dragged towards each sighting, right or wrong: each false alarm pulls it away for a while, and it is sure of itself there. The gate and the rule belong together: the gate protects from single lies, the rule notices when the liar is the filter itself.
# ### END SOLUTION

# %% [markdown] id="rubric-switch" tags=["hidden"]
# **Question A, 3 points.**
# - 1 point: a small share switches on false alarms, without need.
# - 1 point: a large share switches late or never.
# - 1 point: without the gate single false alarms drag the filter, and recovery is a matter of luck.

# %% [markdown]
# ## 6. The rivals
#
# In the paper's table 1, of sixteen teams at the RoboCup 2004 ten used **Monte Carlo localization** (MCL), two an EKF, two both, two plain **triangulation**. The kit has them:
#
# - `ParticleFilter(n, noise)`: n guesses (*particles*) walk along with the odometry; those that explain the sightings are copied, the others die. When nothing fits any more, new ones are drawn from poses that explain a present sighting.
# - `Triangulation()`: lays the landmarks of the last two seconds on the map. It has no filter at all.
# - `Hybrid` takes the particles in place of the grid, too: Monte Carlo and your EKF. With `background=3` the grid goes on working at every third step while the EKF leads.
#
# One function runs them all over the same walks. Each walk starts from nothing (the EKF alone has to know its start) and has a kidnapping at 15 s.
#
# **Before you run it:** look only at the time before the kidnapping. Which one tracks best?
# - (a) 2000 particles: they can hold any belief, not only a Gaussian.
# - (b) The EKF, alone or with a finder.
# - (c) The fuzzy grid: it looks at the whole field.
# - (d) Triangulation: it forgets everything after two seconds, so that no old error stays.

# %% id="guess-rivals" tags=["guess", "nbval-ignore-output"]
guess = "b"
mcl = lambda log, n: ParticleFilter(n, log.noise.told(), rng=0)
contestants = {
    "EKF alone": lambda log: follower(log)(log.truth[0], START),
    "fuzzy grid alone": lambda log: FuzzyGrid(log.noise.told()),
    "MCL, 500": lambda log: mcl(log, 500),
    "MCL, 2000": lambda log: mcl(log, 2000),
    "triangulation": lambda log: Triangulation(),
    "MCL + EKF": lambda log: Hybrid(mcl(log, 500), follower(log), lost),
    "grid + EKF": lambda log: hybrid(log, lost),
    "grid (backgr.) + EKF": lambda log: hybrid(log, lost, background=3),
}
results = race(contestants, kidnapped, progress)
print(table(results))
reveal("rivals", guess)

# %% tags=["nbval-ignore-output"]
fig, axes = plt.subplots(
    1, 3, figsize=(11, 4.3), layout="constrained", width_ratios=[1.3, 1, 1.2]
)
plot_race(axes, results)
plt.show()

# %% [markdown]
# The picture has a row for each localizer. Left: the darker, the larger its median error. In the middle: how many are found again at all and, if these are more than half, a dot at their median time and a line to the time that 95 % of them do not exceed. Right: good and cheap is at the lower left.
#
# ### Question B
# Which would you put on the robot, which has to think about football too? Give the two numbers of the table that decide it for you, and one that speaks against your choice.

# %% [markdown] id="answer-rivals" tags=["answer"] points=2 title="Question B: which localizer"
# ### BEGIN SOLUTION
# Grid + EKF: it tracks as well as the EKF alone (about 5 cm, where the grid has 12 and 2000 particles have 8), finds every kidnapped robot, and costs much less than the grid. Against it: after a kidnapping it takes about a
# second longer than the grid alone, for the grid starts from nothing; with the grid in the background it is quicker, at three times the cost of the EKF. Monte Carlo with 500 particles and an EKF is a good choice as well.
# ### END SOLUTION

# %% [markdown] id="rubric-rivals" tags=["hidden"]
# **Question B, 2 points.**
# - 1 point: a choice with two figures of the table for it (accuracy, recovery, cost).
# - 1 point: a figure that speaks against it.

# %% [markdown] tags=["hidden"]
# ## Graded checks
#
# They stand only in this copy. When a class is graded, each runs with numbers drawn for each student.

# %% id="setup-exam" tags=["setup", "hidden"]
from labkit.instructor.exam.exam import Exam

exam = Exam("05_fuzzy_hybrid")
check = exam.check

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

# %% id="grade-estimate" tags=["hidden"] points=2 title="estimate: other grids, headings around ±180°"
rng = exam.rng()
tables = []
for middle in (*rng.uniform(-3, 3, 4), np.pi, np.pi):
    possible, x, y, off = rng.uniform(0.01, rng.uniform(0.3, 1), (4, 6, 5))
    theta = wrap(middle + 3 * (off - 0.3))
    tables.append((possible, 5 * x - 2, 4 * y - 2, theta, rng.uniform(0.3, 0.9)))
exam.same(estimate, tables, "other grids")
print("passed")

# %% id="grade-spread" tags=["hidden"] points=1 title="lost_by_spread: other covariances and limits"
rng = exam.rng()
wide = []
for position, heading in rng.uniform(0.4, 2, (8, 2)):
    for near, far in ((0.8, 0.1), (1.2, 0.1), (0.1, 0.8), (0.1, 1.2), (0.8, 0.8), (1.2, 1.2)):
        for share in (0.5, rng.uniform(0, 0.1), rng.uniform(0.9, 1)):
            xy = (near * position) ** 2 * np.array([share, 1 - share])
            wide.append((np.diag([*xy, (far * heading) ** 2]), position, heading))
exam.same(lost_by_spread, wide, "other covariances")
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
# - A grid keeps a value for every cell and can start from nothing; it costs time, and more so the smaller its cells.
# - The mean of angles is the direction of the mean arrow.
# - The covariance does not tell that a filter is lost. Its surprises do: most of the last sightings far off.
# - Two methods that are good at different things can take turns: one finds, the other follows.
# - Compare over many walks, with figures for accuracy, recovery and cost side by side.
#
# Save, and run `labkit check notebooks/05_fuzzy_hybrid.ipynb` in a terminal before you hand it in.
#
# **Next:** so far there was a map. In lab 6 there is none: robots that see each other build a frame of their own. Ideas that go further wait in lab 8.
#
# ## References
# - F. Martín, V. Matellán, P. Barrera, J. M. Cañas, "Localización basada en lógica difusa y filtros de Kalman para robots con patas": table 1, sections 3 (grid), 5 (switching), 6 (experiments).
# - P. Buschka, A. Saffiotti, Z. Wasik, "Fuzzy landmark-based localization for a legged robot", IROS 2000; D. Herrero-Pérez, H. Martínez-Barberá, A. Saffiotti, "Fuzzy self-localization using natural features in the four-legged league", RoboCup 2004.
# - S. Thrun, W. Burgard, D. Fox, *Probabilistic Robotics*, MIT Press 2005, chapters 7 and 8; S. Lenser, M. Veloso, "Sensor resetting localization for poorly modelled mobile robots", ICRA 2000.

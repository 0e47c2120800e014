# %% [markdown]
# # Lab 2 · What if the noise is not what you told the filter?
#
# *About 90 minutes. From lab 1 it uses your `KF`, filled in and saved, and the innovation $\nu$ with its covariance $S$.*
#
# A filter is told how noisy the motion is (`Q`) and how noisy the sensor is (`R`). In a simulation these are known. On a real robot somebody
# guesses, and guesses wrong. In this lab you lie to your filter on purpose, watch what happens, and learn two numbers that expose a filter which
# is too sure of itself.
#
# **By the end you can**
# - tell an *overconfident* filter from an *underconfident* one, with and without knowing the truth;
# - say what `Q` and `R` each do, and why mostly their ratio matters;
# - explain what a filter does when it sees nothing.
#
# **You will write** `nees`, `nis`, `verdict` and `longest_dark`, each a few lines, and answer questions Q2 to Q5.
#
# **Before some cells you make a prediction:** write the letter of your choice into `guess = "?"`, then run the cell. It says why each choice was
# tempting. Nobody marks it; but what you predicted and got wrong is what you will remember.

# %% [markdown]
# ## Symbols
#
# | symbol | in the code | shape | unit | what it is |
# |---|---|---|---|---|
# | $x$ | `truth` | (2,) | m | true position |
# | $\hat x$, $P$ | `x`, `P` | (2,), (2, 2) | m, m² | what the filter believes |
# | $e$ | `truth - x` | (2,) | m | error |
# | $\epsilon$ | `nees(...)` | number | – | NEES, the normalized estimation error squared, $e^\top P^{-1} e$ |
# | $p$ | `len(y)` | number | – | how many landmarks are in view |
# | $\nu$, $S$ | `nu`, `S` | (2p,), (2p, 2p) | m, m² | innovation and its covariance, from lab 1 |
# | – | `nis(...)` | number | – | NIS, the normalized innovation squared, $\nu^\top S^{-1} \nu$ |
# | $Q$, $R$ | `Q`, `R` | (2, 2) | m²/s, m² s | noise of the motion and of the sensor, per second, as robots and filters are told it |
# | $\chi^2_n$ | `chi2_bounds(n)` | two numbers | – | chi-square distribution with $n$ degrees of freedom |
#
# What a symbol means in other labs: [all symbols](../notebooks/glossary.md).

# %% id="setup" tags=["setup"]
import matplotlib.pyplot as plt
import numpy as np

from labkit import Robot, check, explore, load_answer, make_filter, metrics, progress
from labkit import random_map, replay, reveal, simulate
from labkit.metrics import chi2_bounds
from labkit.plots import ConsistencyPanel, plot_mean_nees, plot_run, show_run

KF = load_answer("01_cartesian_ekf", "KF")  # your own filter, as you last saved it in lab 1

# %% [markdown]
# ## 1. How sure may a filter be?
#
# An error of 0.3 m is nothing when the filter says "give or take 1 m", and a scandal when it says "give or take 1 cm". So measure the
# error in units of the filter's own uncertainty:
#
# $$ \epsilon = e^\top P^{-1} e . $$
#
# This is the **NEES**. For a single number it would be $(e/\sigma)^2$: two σ off gives 4. So "the truth is inside the 3σ ellipse", which you counted in
# lab 1, is nothing else than $\epsilon < 9$.
#
# How large may it be by chance? Take $n$ random numbers with mean 0 and variance 1, bell-shaped (Gaussian), square them and add them up: the
# sum follows the **chi-square distribution with $n$ degrees of freedom**, written $\chi^2_n$. Its mean is $n$. If the filter is honest, $e$ measured in its σ is
# two such numbers, so $\epsilon$ follows $\chi^2_2$: its mean is 2, and it lies between 0.05 and 7.4 in 95 % of the steps. Much larger: *overconfident*, the
# filter errs more than it admits. Much smaller: *underconfident*, it knows more than it says.
#
# ### Exercise 1 · `nees(truth, x, P)`
# Return the NEES of one step, a number. *Example:* an error of `(1, 0)` with `P = 0.25 I` (σ = 0.5 m) is two σ, so the NEES is 4.
#
# <details><summary>Hint</summary>
#
# `np.linalg.solve(P, e)` is $P^{-1}e$. The product of two 1-D arrays, `a @ b`, is a number.
# </details>


# %% id="answer-nees" tags=["answer"]
def nees(truth, x, P):
    """NEES of one step, from truth (2,), estimate x (2,) and covariance P (2, 2)."""
    ### BEGIN SOLUTION
    e = truth - x
    return e @ np.linalg.solve(P, e)
    ### END SOLUTION


# %% id="check-nees" tags=["check"] points=2 title="nees"
check("mismatch-nees", nees)

# %% [markdown]
# Here is your number along one run of your filter, first told the truth about its noise.

# %%
Q = np.diag([0.25**2, 0.25**2])  # motion noise, per second [m^2/s]
R = np.diag([0.2**2, 0.2**2])  # measurement noise of one landmark, times one second [m^2 s]
log = simulate(Robot((2, -2), Q, R, rng=1), random_map(25, rng=1))

history = replay(make_filter(KF, log), log)
values = [nees(*step) for step in zip(log.truth, history.x, history.P)]
low, high = chi2_bounds(2)
outside = np.mean([not low < v < high for v in values])
print(f"mean NEES {np.mean(values):.2f}")
print(f"{100 * outside:.0f} % of the steps outside {low:.2f} ... {high:.2f}; expected: 5 %")

# %% [markdown]
# ## 2. Told that the sensor is better than it is
#
# `make_filter(KF, log, R=0.01 * R)` makes your filter with another `R` than the robot's. The recorded run stays the same, noise and all.
# The filter now thinks that a landmark is seen with σ = 0.04 m, where it is 0.4 m.
#
# **Before you run it:** what does such a filter do?
# - (a) It gets better: its ellipses are smaller and its estimate is smoother.
# - (b) Its ellipses are smaller, its estimate is rougher, and the truth is mostly outside.
# - (c) Its ellipses are smaller and its estimate is rougher, but the truth stays inside, since the sensor is what it was.
# - (d) Nothing visible: the recorded measurements are the same.

# %% id="guess-small-r" tags=["guess"]
guess = "b"
history = replay(make_filter(KF, log, R=0.01 * R), log)
show_run(log, history)
print(metrics.summary(history, log))
reveal("small-r", guess)

# %% [markdown]
# ### Question Q2
# How many steps does it take until the truth is inside the ellipse, and does it stay there? What happens to the estimate? Explain it with the
# equations for $S$, $K$ and $P$ of lab 1.

# %% [markdown] id="answer-q2" tags=["answer"] points=2 title="Question Q2"
# ### BEGIN SOLUTION
# It never stays inside: apart from the huge ellipse of the start, the truth is inside in only a few per cent of the steps, and the mean NEES is
# about 214 instead of 2. The estimate is rougher (RMSE 0.35 m instead of 0.28 m), but not lost.
#
# With $R$ a hundred times too small, $S = HPH^\top + R$ is hardly more than $HPH^\top$, so $K$ is close to −1 for one landmark: the filter throws its
# prediction away and follows each measurement, noise and all. And $P \leftarrow P - KSK^\top$ leaves an ellipse ten times too narrow (half axis 0.05 m),
# since the filter believes that these measurements are good to 4 cm. It is overconfident.
# ### END SOLUTION

# %% [markdown] id="rubric-q2" tags=["hidden"]
# **Q2, 2 points.**
# - 1 point: the truth leaves the ellipse and mostly stays outside; the ellipse is far too small (overconfident).
# - 1 point: why: R too small makes S small, K close to -1 (each measurement is believed), and P shrinks too much.

# %% [markdown]
# ## 3. Told that the sensor is worse than it is
#
# Now the other way round: `R=100 * R`, that is σ = 4 m for a landmark.
#
# **Before you run it:** the filter starts at (0, 0), the robot at (2, −2). What will you see?
# - (a) The wrong start is forgotten at the first landmark, as in lab 1.
# - (b) The wrong start is forgotten slowly, and meanwhile the truth is outside the ellipse.
# - (c) The wrong start is forgotten slowly, and the truth is inside the ellipse all the time.

# %% id="guess-large-r" tags=["guess"]
guess = "c"
history = replay(make_filter(KF, log, R=100 * R), log)
show_run(log, history)
print(metrics.summary(history, log))
half = metrics.semi_axis(history)[[0, 1, 10, 40]].round(2)
print("longer half axis of the 3σ ellipse after 0, 1, 10, 40 steps:", half, "m")
reveal("large-r", guess)

# %% [markdown]
# ### Question Q3
# The same questions: how many steps, what happens to the estimate, is the truth inside, and why? In what sense is *always inside* not a compliment?

# %% [markdown] id="answer-q3" tags=["answer"] points=2 title="Question Q3"
# ### BEGIN SOLUTION
# The truth is inside at every step, from the first on. But the ellipse is huge (half axis 3.6 m after one step, still 1.4 m in the middle of the run),
# and the estimate is worse: RMSE 0.47 m, and it needs several seconds to forget the wrong start.
#
# A large $R$ makes $S$ large and $K$ small: the filter takes only a small part of each innovation and otherwise trusts its own motion model. So it
# is smooth and slow, averages over many measurements, and follows the robot's slips late. Its covariance shrinks slowly for the same reason.
# Its mean NEES is well below 2: it is underconfident. An ellipse that always holds the truth because it is far too large tells nobody where the robot is.
# ### END SOLUTION

# %% [markdown] id="rubric-q3" tags=["hidden"]
# **Q3, 2 points.**
# - 1 point: always inside but slow and less accurate; K is small because S is large.
# - 1 point: an ellipse that is far too large says nothing: underconfident.

# %% [markdown]
# ## 4. A test that needs no truth
#
# On a real robot nobody knows the true position, so nobody can compute the NEES. But the innovation is there at each step, and the filter says how
# large it should be: its covariance is $S$. So
#
# $$ \text{NIS} = \nu^\top S^{-1} \nu $$
#
# follows $\chi^2_{2p}$: two numbers for each of the $p$ landmarks in view.
#
# ### Exercise 2 · `nis(x, P, R, y, m)`
# Return the NIS of one step, a number. `x` and `P` are what `predict` has left, `R` (2, 2) is that of one landmark and one step, as `self.R` in lab 1, `y` is the list of landmarks in view, `m` the
# map. The first lines are those of your `update` in lab 1, up to $S$. With nothing in view there is no NIS: return `np.nan`.
#
# *Example:* one landmark, `P` and `R` both `0.5 I`: $S$ is the unit matrix, and an innovation of (1, 2) gives 5.
#
# <details><summary>Hint</summary>
#
# $\nu$ is what was seen less what is expected; `m[m.index(lm)] - x` is where a landmark is expected. $H$ is a $-I$ for each landmark, one above the other.
# </details>


# %% id="answer-nis" tags=["answer"]
def nis(x, P, R, y, m):
    """NIS of one step, from x (2,), P (2, 2) before the update; NaN with nothing in view."""
    ### BEGIN SOLUTION
    if not y:
        return np.nan
    p = len(y)
    nu = np.concatenate([lm.p - (m[m.index(lm)] - x) for lm in y])
    H = np.tile(-np.eye(2), (p, 1))
    S = H @ P @ H.T + np.kron(np.eye(p), R)
    return nu @ np.linalg.solve(S, nu)
    ### END SOLUTION


# %% id="check-nis" tags=["check"] points=2 title="nis"
check("mismatch-nis", nis)

# %% [markdown]
# Over a whole run the kit does it for you: `metrics.nis`. It finds the same numbers from what the filter believed before and after each update, without its
# $S$. Here both are side by side, for your filter that was told the truth.

# %%
honest = replay(make_filter(KF, log), log)
before = zip(honest.x_prior, honest.P_prior, log.measurements())
mine = [nis(x, P, honest.R, y, log.map) for x, P, y in before]
print("yours:", np.round(mine[:5], 2))
print("kit's:", metrics.nis(honest, log)[0][:5].round(2))

# %% [markdown]
# Now all three filters. The picture divides the NIS by $2p$, so that 1 is right whatever the number of landmarks; the bounds move because $p$ does.
#
# **Before you run it:** which is right?
# - (a) Told 0.01 R: above the bounds. Told 100 R: below.
# - (b) Told 0.01 R: below the bounds. Told 100 R: above.
# - (c) All three near 1: the measurements are the same, so the innovations are.

# %% id="guess-nis" tags=["guess"]
guess = "a"
factors = [0.01, 1, 100]
histories = [replay(make_filter(KF, log, R=factor * R), log) for factor in factors]
fig, axes = plt.subplots(1, 3, figsize=(11, 4.0), layout="constrained", sharey=True)
for ax, factor, history in zip(axes, factors, histories):
    ConsistencyPanel(ax, 40, "nis").show(log, history)
    ax.set_title(f"told {factor:g} × R: mean {metrics.mean_nis(history, log):.2f}")
    ax.label_outer()
plt.show()
reveal("three-nis", guess)

# %% [markdown]
# ## 5. Q against R
#
# Now lie about the motion instead. One table, one run, five filters. Below it are sliders for everything in between; watch their third panel: it is the
# NIS, the one you would also have on a real robot.
#
# **Before you run it:** which other row has the same error (RMSE) as `0.01 R`?
# - (a) `100 R`: both are wrong by a factor of a hundred.
# - (b) `0.01 Q`: both make the filter too sure.
# - (c) `100 Q`: in both, Q is a hundred times too large beside R.

# %% id="guess-alike" tags=["guess"]
guess = "c"
late = slice(40, None)  # after the first 10 s, when the wrong start is forgotten
print("told       RMSE after 10 s [m]  inside 3σ  NEES  NIS per number  half axis, 20 s [m]")
lies = [("0.01 R", 1, 0.01), ("100 R", 1, 100), ("0.01 Q", 0.01, 1), ("100 Q", 100, 1)]
for name, q, r in [("the truth", 1, 1), *lies]:
    history = replay(make_filter(KF, log, Q=q * Q, R=r * R), log)
    rmse = np.sqrt(np.mean(metrics.distances(history, log)[late] ** 2))
    inside = 100 * metrics.inside(history, log).mean()
    mean_nees = metrics.nees(history, log).mean()
    mean_nis, half = metrics.mean_nis(history, log), metrics.semi_axis(history)[80]
    print(f"{name:10s}{rmse:15.3f}{inside:14.0f} %{mean_nees:8.1f}", end="")
    print(f"{mean_nis:12.2f}{half:20.2f}")
reveal("alike", guess)

# %%
explore(KF, kind="nis")

# %% [markdown]
# ### Question Q4
# Which has more influence on the result, `Q` or `R`? Compare the rows for `0.01 R` and `100 Q`, and those for `100 R` and `0.01 Q`: what is the same,
# what is different, and why?

# %% [markdown] id="answer-q4" tags=["answer"] points=3 title="Question Q4"
# ### BEGIN SOLUTION
# The gain depends on $P$ over $S$, and $P$ settles where what $Q$ adds balances what $R$ takes away. If $Q$ and $R$ are both multiplied by the same
# number, so is $P$, and $K$ does not change. So for the *estimate* only the ratio $Q/R$ matters, once the start is forgotten (its $P$ was not scaled): `0.01 R` and
# `100 Q` have the same RMSE to the millimetre, both listen to the sensors too much; `100 R` and `0.01 Q` are nearly equal too, both listen too little.
#
# The *covariance* is another matter. It scales with both. `0.01 R` is wildly overconfident, while `100 Q` is nearly harmless: its estimate is as
# rough, but its ellipse, limited by the true $R$, is honest about that. On the other side `100 R` is only underconfident, while `0.01 Q` is the
# dangerous one: it believes its motion model, ignores the landmarks, drifts away from the truth and is sure of itself (NEES about 70).
# So neither is "more important". For *honesty* too small is worse than too large, for both. For *accuracy* it is the other way round for $R$: `100 R` errs
# more than `0.01 R`. And here a wrong $R$ shows at once in the NIS, since there are several landmarks in view at each step, while a wrong $Q$ shows in it
# only weakly.
# ### END SOLUTION

# %% [markdown] id="rubric-q4" tags=["hidden"]
# **Q4, 3 points.**
# - 1 point: the estimate depends (after the start) on the ratio Q/R only; pairs of rows have the same RMSE.
# - 1 point: the covariance scales with both, so the pairs differ in NEES and ellipse.
# - 1 point: for honesty too small is worse than too large (NEES), for accuracy too large an R is worse than too small (RMSE); with a number from the table.

# %% [markdown]
# ## 6. Many runs prove more
#
# A lie by a factor of a hundred is easily seen. Now a small one: half of the true `R`.

# %%
history = replay(make_filter(KF, log, R=0.5 * R), log)
show_run(log, history)
print(metrics.summary(history, log))

# %% [markdown]
# In the picture you would hardly have noticed. The mean NEES is a hint; but how far from 2 may the mean of one run be? Its steps hang together, each
# keeps the error of the step before, so the chi-square bounds do not say. With many independent runs they do.
#
# The NEES of one step jumps between 0.01 and 10 even for a perfect filter. Averaged over many independent runs, other maps and other noise, it comes
# close to 2 at each step, and the bounds come close to each other: the sum of $k$ numbers that follow $\chi^2_2$ follows $\chi^2_{2k}$.
# `chi2_bounds(dof=2, runs=k)` gives the two bounds of the *mean*. This is a **Monte Carlo** test, of your own filter.
#
# ### Exercise 3 · `verdict(mean_nees, runs)`
# Return `"overconfident"`, `"consistent"` or `"underconfident"`, from the mean NEES of `runs` runs, with the 95 % bounds.
# *Example:* a mean of 2.4 is consistent for 10 runs and overconfident for 500.
#
# <details><summary>Hint</summary>
#
# `low, high = chi2_bounds(dof=2, level=0.95, runs=runs)`. Overconfident means that the error is larger than the filter thinks.
# </details>


# %% id="answer-verdict" tags=["answer"]
def verdict(mean_nees, runs):
    """'overconfident', 'consistent' or 'underconfident', for a mean NEES of `runs` runs."""
    ### BEGIN SOLUTION
    low, high = chi2_bounds(dof=2, level=0.95, runs=runs)
    if mean_nees > high:
        return "overconfident"
    if mean_nees < low:
        return "underconfident"
    return "consistent"
    ### END SOLUTION


# %% id="check-verdict" tags=["check"] points=2 title="verdict"
check("mismatch-verdict", verdict)


# %% [markdown]
# Sixty runs with other maps and other noise, each seen by three filters: told half of `R`, `R` itself, and twice `R`. In the pictures each step has its own
# mean and its own verdict; the title is the verdict that most of the 161 steps get.

# %%
logs = []
for seed in range(60):
    robot, world = Robot((2, -2), Q, R, rng=seed), random_map(25, rng=seed)
    logs.append(simulate(robot, world))

# %%
fig, axes = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
for ax, factor in zip(axes, [0.5, 1, 2]):
    values = []  # NEES (runs, N+1) of your filter, told this factor of R
    for one in progress(logs, f"runs told {factor:g} R"):
        history = replay(make_filter(KF, one, R=factor * R), one)
        values.append(metrics.nees(history, one))
    plot_mean_nees(ax, log.times, values)
    verdicts = [verdict(v, len(logs)) for v in np.mean(values, axis=0)]
    most = max(set(verdicts), key=verdicts.count)
    ax.set(title=f"told {factor:g} × R: {most}", ylim=(0, 6))
plt.show()

# %% [markdown]
# Told half the true `R`, a single run looks fine to the eye. Sixty runs convict it at nearly every step.
#
# ## 7. Nothing in view
#
# Back to the true `Q` and `R`, but with five landmarks in the map. Somewhere along the square there is nothing to see.
#
# ### Exercise 4 · `longest_dark(count)`
# `log.count` says for each step how many landmarks were in view. Return the length of the longest row of steps with none.
# *Example:* for `[1, 0, 0, 2, 0]` it is 2.
#
# <details><summary>Hint</summary>
#
# Go through the steps with two counters: the length of the dark row you are in (back to 0 when something is seen) and the longest so far.
# </details>


# %% id="answer-dark" tags=["answer"]
def longest_dark(count):
    """Longest row of steps with no landmark in view; count (N,) is the number in view."""
    ### BEGIN SOLUTION
    longest = current = 0
    for n in count:
        current = current + 1 if n == 0 else 0
        longest = max(longest, current)
    return longest
    ### END SOLUTION


# %% id="check-dark" tags=["check"] points=2 title="longest_dark"
check("mismatch-dark", longest_dark)

# %% [markdown]
# **Before you run it:** what does the ellipse do while the robot sees nothing?
# - (a) It grows, and shrinks at once when a landmark is seen again.
# - (b) It stays as it was: there is nothing new to learn.
# - (c) It grows, and takes about as many steps to shrink again as it was in the dark.

# %% id="guess-dark" tags=["guess"]
guess = "a"
few = simulate(Robot((2, -2), Q, R, rng=3), random_map(5, rng=3))
history = replay(make_filter(KF, few), few)
dark = few.count == 0  # grey in the picture
fig, axes = plt.subplots(1, 3, figsize=(11, 4.1), layout="constrained")
plot_run(axes, few, history)
for ax in axes[1:]:
    low, high = ax.get_ylim()
    ax.fill_between(few.times[1:], low, high, where=dark, step="pre", color="0.85", zorder=0)
plt.show()
print(f"{dark.sum()} of {len(few)} steps with nothing in view,", end=" ")
print(f"{longest_dark(few.count)} of them in a row")
values = metrics.nees(history, few)[1:]
print(f"mean NEES in the dark {values[dark].mean():.1f}, in sight {values[~dark].mean():.1f}")
reveal("in-the-dark", guess)

# %% [markdown]
# ### Question Q5
# What happens when the robot sees no landmark, and why? Is the filter still honest in the dark? (In a dark row each step
# keeps the error of the step before: 54 steps are no 54 runs. Look at the bounds in the middle panel.) And how many dark steps would it take, beginning near zero,
# until its σ is as large as the sensor's range of 2.5 m? (One step has σ = 0.125 m, as in lab 1.)

# %% [markdown] id="answer-q5" tags=["answer"] points=2 title="Question Q5"
# ### BEGIN SOLUTION
# Only `predict` acts. The mean moves with the commands (dead reckoning), and $P$ grows by $Q$ at each step, so the 3σ ellipse widens like the square root of the
# time: there is no measurement, so $K$ has nothing to work on. The error may wander, but it stays within the 3σ bounds, which widen as fast: the filter is
# still honest, its NEES stays near 2 (here 2.9 in the dark and 2.4 in sight; one run says no more than that). As soon as one landmark is seen, $P$ is large compared to $R$, $K$ is close to −1, and the first look takes most of the ellipse.
#
# σ after $k$ dark steps is $0.125\sqrt{k}$ m, so 2.5 m takes $k = 20^2 = 400$ steps, or 100 s.
# ### END SOLUTION

# %%
explore(KF, sliders=("Q", "landmarks", "range"), landmarks=5, seed=3)

# %% [markdown] id="rubric-q5" tags=["hidden"]
# **Q5, 2 points.**
# - 1 point: only predict acts; P grows by Q a step, the ellipse widens like the root of the number of steps; it stays honest.
# - 1 point: (2.5 / 0.125)^2 = 400 steps.

# %% [markdown] tags=["hidden"]
# ## Graded checks
#
# They stand only in this copy. When a class is graded, each runs with numbers drawn for each student.

# %% id="setup-exam" tags=["setup", "hidden"]
from labkit.instructor.exam.exam import Exam

exam = Exam("02_noise_mismatch")
check = exam.check
Q, R = np.diag([0.25**2, 0.25**2]), np.diag([0.2**2, 0.2**2])  # as in section 1
LabKF = Exam("01_cartesian_ekf").right("KF")[0]  # lab 1 is marked with lab 1


def lied_to(rng, q=1, r=1, steps=160):
    """(truth, x, P) of each step of a filter that was told q Q and r R."""
    run = simulate(
        Robot(rng.uniform(-2, 2, 2), Q, R, rng=rng), random_map(25, rng=rng), steps
    )
    told = replay(make_filter(LabKF, run, Q=q * Q, R=r * R), run)
    return list(zip(run.truth, told.x, told.P))


# %% id="figure" tags=["hidden"]
public = simulate(Robot((2, -2), Q, R, rng=1), random_map(25, rng=1))
believed = replay(make_filter(LabKF, public), public)
steps = list(zip(public.truth, believed.x, believed.P))
exam.curve(nees, steps, public.times, chi2_bounds(2), "your NEES along one run")

# %% id="grade-nees-run" tags=["hidden"] points=2 title="nees: along whole runs"
rng = exam.rng()
exam.same(
    nees, lied_to(rng) + lied_to(rng, r=0.01) + lied_to(rng, q=100), "the steps of a run"
)
print("passed")

# %% id="grade-nees-correlated" tags=["hidden"] points=1 title="nees: long, thin ellipses"
rng = exam.rng()
thin = [np.linalg.qr(A)[0] * [1.0, 0.03] for A in rng.normal(size=(20, 2, 2))]
exam.same(nees, [(*rng.normal(size=(2, 2)), A @ A.T) for A in thin], "long, thin ellipses")
print("passed")

# %% id="grade-nees-sure" tags=["hidden"] points=1 title="nees: very sure and very unsure filters"
rng = exam.rng()
sizes = [1e-6, 1e-3, 1e3]
exam.same(
    nees,
    [(*rng.normal(size=(2, 2)), size * np.eye(2)) for size in sizes],
    "P large and small",
)
print("passed")

# %% id="grade-nis-run" tags=["hidden"] points=2 title="nis: other maps, with and without landmarks"
rng = exam.rng()
steps = []
for n in (1, 4, 25):
    run = simulate(Robot(rng.uniform(-2, 2, 2), Q, R, rng=rng), random_map(n, rng=rng), 40)
    told = replay(make_filter(LabKF, run, R=rng.uniform(0.3, 3) * R), run)
    steps += [
        (x, P, told.R, y, run.map)
        for x, P, y in zip(told.x_prior, told.P_prior, run.measurements())
    ]
exam.same(nis, steps, "the steps of a run")
print("passed")

# %% id="grade-nis-correlated" tags=["hidden"] points=1 title="nis: noise that differs by direction"
rng = exam.rng()
run = simulate(Robot((0, 0), Q, R, rng=rng), random_map(25, rng=rng), 20)
steps = []
for y in run.measurements():
    A, B = rng.normal(size=(2, 2, 2))
    steps.append((rng.normal(size=2), A @ A.T, B @ B.T, y, run.map))
exam.same(nis, steps, "the steps of a run")
print("passed")

# %% id="grade-verdict-bounds" tags=["hidden"] points=2 title="verdict: near the bounds"
rng = exam.rng()
bounds = [(n, b) for n in rng.integers(2, 400, 12).tolist() for b in chi2_bounds(2, 0.95, n)]
exam.same(
    verdict,
    [(float(b * f), n) for n, b in bounds for f in (0.99, 1.01)],
    "means near the bounds",
)
print("passed")

# %% id="grade-verdict-runs" tags=["hidden"] points=1 title="verdict: few runs and many"
rng = exam.rng()
means = rng.uniform(1.2, 3.0, 60)
exam.same(
    verdict,
    [(float(mean), n) for mean in means for n in (1, 30, 1000)],
    "other numbers of runs",
)
print("passed")

# %% id="grade-dark-random" tags=["hidden"] points=2 title="longest_dark: random maps"
rng = exam.rng()
runs = [rng.poisson(0.7, n) for n in (1, 10, 200, 1000)]
runs += [np.append(run, [0] * 20) for run in runs]  # dark at its end
exam.same(longest_dark, [(run,) for run in runs], "other runs")
print("passed")

# %% id="grade-dark-edges" tags=["hidden"] points=1 title="longest_dark: at the ends, never, always"
rng = exam.rng()
n = int(rng.integers(3, 9))
zeros, ones = np.zeros(n, int), np.ones(n, int)
rows = [zeros, ones, np.concatenate([ones, zeros]), np.concatenate([zeros, ones, zeros[1:]])]
exam.same(longest_dark, [(row,) for row in rows], "the ends of a run")
print("passed")

# %% [markdown]
# ## Summary
#
# - NEES (needs the truth) and NIS (does not) measure the error in the filter's own σ; chi-square bounds say what is still chance. NIS needs no truth, but it
#   relies on noise that is new at each step; the real robot of lab 3 will show what happens otherwise.
# - `Q/R` decides how the estimate moves; their size decides how sure the filter is.
# - Told too little noise, a filter is dishonest; told too much noise of the sensor, it is slow and errs more, but says so. Which is worse depends on
#   who relies on it: for a decision that must be safe, admit more noise.
# - Without landmarks, the ellipse grows, and that is right.
#
# **Next:** in [lab 3](03_range_bearing_ekf.ipynb) the robot measures distances and angles, as real sensors do; at the end your filter runs on a real robot.
#
# ## References
# - I. Rañó, practice handout, questions Q2 to Q5.
# - Y. Bar-Shalom, X. R. Li, T. Kirubarajan, *Estimation with Applications to Tracking and Navigation*, Wiley 2001, section 5.4: NEES, NIS and their bounds.
# - S. Särkkä, *Bayesian Filtering and Smoothing*, Cambridge 2013, chapter 4: the Kalman filter in modern notation.

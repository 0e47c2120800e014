# %% id="setup" tags=["setup"]
import numpy as np

from labkit import Robot, check, load_answer, random_map, replay, simulate
from labkit.metrics import chi2_bounds

KF = load_answer("01_cartesian_ekf", "KF")

# %% id="answer-nees" tags=["answer"]
def nees(truth, x, P):
    """Normalized estimation error squared of one step: truth (2,), estimate x (2,), covariance P (2, 2)."""
    ### BEGIN SOLUTION
    e = truth - x
    return e @ np.linalg.solve(P, e)
    ### END SOLUTION


# %% id="check-nees" tags=["check"]
check("mismatch-nees", nees)

# %% id="answer-verdict" tags=["answer"]
def verdict(mean_nees, runs):
    """'overconfident', 'consistent' or 'underconfident', from the mean NEES of `runs` runs at one step."""
    ### BEGIN SOLUTION
    low, high = chi2_bounds(dof=2, level=0.95, runs=runs)
    if mean_nees > high:
        return "overconfident"
    if mean_nees < low:
        return "underconfident"
    return "consistent"
    ### END SOLUTION


# %% id="check-verdict" tags=["check"]
check("mismatch-verdict", verdict)

# %% id="answer-dark" tags=["answer"]
def longest_dark(count):
    """Length of the longest row of steps with no landmark in view; count (N,) is the number in view."""
    ### BEGIN SOLUTION
    longest = current = 0
    for n in count:
        current = current + 1 if n == 0 else 0
        longest = max(longest, current)
    return longest
    ### END SOLUTION


# %% id="check-dark" tags=["check"]
check("mismatch-dark", longest_dark)

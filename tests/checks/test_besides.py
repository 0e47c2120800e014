"""What a check says of a filter that leaves something out, keeps something, or whose numbers come in another order."""

import pytest
from checks.test_checks import failure

LAB1, LAB3 = "cartesian-kf", "range-bearing-kf"
GAIN = "K = np.linalg.solve(S, H @ self.Pk_k).T"
CHANGED_P = f"self.Pk_k = self.Pk_k - self.Pk_k @ H.T @ np.linalg.inv(S) @ H @ self.Pk_k\n        {GAIN}"
SPREAD = "self.Pk_k = self.Pk_k - K @ S @ K.T"
FROM_NEW_P = "the gain comes from the Pk_k that `update` has changed already"

LEFT_OUT = [
    (LAB1, [("p = len(y)", "y = y[1:]\n        p = len(y)"), ("if not y:", "if len(y) < 2:")], "last of the list left"),
    (LAB1, [("= self.xk_k + K @ innovation", "= np.round(self.xk_k + K @ innovation, 1)")], "is something rounded"),
    (
        LAB3,
        [("if not y:", "y = [lm for lm in y if abs(lm.p[1]) < 1.6]\n        if not y:")],
        "landmark 3 has no effect on xk_k, others have",
    ),
    (LAB1, [(GAIN, CHANGED_P), (SPREAD, "pass")], FROM_NEW_P),
    (LAB3, [(GAIN, CHANGED_P), (SPREAD, "pass")], FROM_NEW_P),
]
ALL = "self.all += y\n        y = self.all\n        if not y:"
AT = "self.at = getattr(self, 'at', self.xk_k)\n        H = np.vstack([jacobian(self.at, k)"
KEPT = [
    (LAB1, [("self.dt = dt", "self.dt = dt\n        self.all = []"), ("if not y:", ALL)]),
    (LAB3, [("H = np.vstack([jacobian(self.xk_k, k)", AT)]),
]


def said(name, form):
    return " ".join(str(failure(name, form)).split())


@pytest.mark.parametrize("name, form, says", LEFT_OUT)
def test_what_has_no_effect_is_told_as_that(name, form, says):
    text = said(name, form)
    assert says in text and "assigned" not in text and "not from the measurement" not in text


@pytest.mark.parametrize("name, form", KEPT)
def test_what_is_kept_between_updates_is_told(name, form):
    assert "something besides the estimate and its covariance is kept" in said(name, form)


def test_a_field_of_another_name_does_not_stop_an_update():
    form = [("self.Q = np.array(Q) * dt", "self.q = np.array(Q) * dt"), ("self.Pk_k + self.Q", "self.Pk_k + self.q")]
    text = said(LAB1, form)
    assert "no field `Q`" in text and "stops" not in text


def test_the_check_that_looks_closer_is_named():
    text = said("team-paper", [("np.diag(sigma**2)", "np.diag(sigma)")])
    assert "First mend what `team-reading` says" in text
    assert "team-reading" not in said("team-paper", [("self.d2[-1] < self.gate", "self.d2[-1] < 13.8")])


def test_a_known_mistake_that_shows_in_part_is_a_guess():
    text = said("team-circles", [("wrap(z2[1] - z1[1])", "wrap(z1[1] - z2[1])")])
    assert "arctan2 takes y first" not in text or "Perhaps: arctan2 takes y first" in text


def test_noise_that_is_subtracted_is_not_taken_for_a_transpose():
    text = said("legged-predicted", [("A.T + W @", "A.T - W @")])
    assert "is subtracted" in text and "transposed" not in text


def test_of_a_large_matrix_one_row_is_shown():
    text = said("team-ekf", [("self.P = F @ self.P @ F.T + slips", "self.P = slips + 0 * F")])
    assert "in row" in text and len(text) < 700

"""What was once said and was false, of mistakes that look like others: it is not said any more."""

import pytest
from checks.test_checks import failure

STACK, KF = "cartesian-stack", "cartesian-kf"
SEEN, CALL = "seen = np.concatenate([lm.p for lm in y])", "stack(y, self.map, self.xk_k)"
DEF, K = "def stack(y, m, x):", "K = np.linalg.solve(S, H @ self.Pk_k).T"
X, P = "self.xk_k = self.xk_k + K @ innovation", "self.Pk_k = self.Pk_k - K @ S @ K.T"
GUARD = "        if not y:\n            return\n"
RB, ROW, PARALLEL = "range-bearing-kf", "dy / r**2, -dx / r**2", "dx / r**2, dy / r**2"
WRAP, BLOCKS = "innovation[1::2] = wrap(innovation[1::2])", "np.kron(np.eye(p), self.R)"

CASES = {
    "the order of the map in both": (
        STACK,
        [(SEEN, "y = sorted(y, key=m.index)\n    " + SEEN)],
        "Both results stand in the order of the map",
        ["all x first", "in the order of y, what is"],
    ),
    "another order, which nobody listed": (
        STACK,
        [(SEEN, "y = sorted(y, key=lambda lm: lm.p[0])\n    " + SEEN)],
        "(the right numbers in another order)",
        ["all x first", "in the order of the map"],
    ),
    "without the first": (
        STACK,
        [(SEEN, "y = y[1:]\n    " + SEEN)],
        "The first landmark of y is left out",
        ["sees no landmark", "inside the loop"],
    ),
    "a list that is kept": (
        STACK,
        [
            (DEF, "def stack(y, m, x, kept=[]):"),
            (SEEN, "kept.extend(lm.p for lm in y)\n    seen = np.concatenate(kept)"),
        ],
        "`kept=[]` is made once, and all calls go on with the same one",
        ["Random numbers belong"],
    ),
    "H where H' belongs": (
        KF,
        [("H @ self.Pk_k @ H.T +", "H @ self.Pk_k @ H +")],
        "or H stands where its transpose belongs?",
        ["H and R are still those of one landmark, but"],
    ),
    "arguments of stack exchanged": (
        KF,
        [(CALL, "stack(y, self.xk_k, self.map)")],
        "two arguments that are exchanged",
        [],
    ),
    "arguments of repeat_R exchanged": (
        KF,
        [("repeat_R(self.R, p)", "repeat_R(p, self.R)")],
        "Perhaps two arguments are exchanged in a call?",
        [],
    ),
    "Q once more": (
        KF,
        [("p = len(y)", "p = len(y)\n        self.Pk_k = self.Pk_k + self.Q")],
        "`self.Q` has an effect on the gain in `update`",
        ["times what it should be", "acts as", "are stacked"],
    ),
    "Q and R swapped, and P inverted": (
        RB,
        [
            ("np.array(Q) * dt", "np.array(R) * dt"),
            ("np.array(R) / dt", "np.array(Q) / dt"),
            (K, "K = np.linalg.inv(self.Pk_k) @ H.T @ np.linalg.inv(S)"),
        ],
        "swapped in the constructor",
        ["self.Q` has an effect"],
    ),
    "P before the gain": (
        KF,
        [(f"{X}\n        {P}", f"{P}\n        {K}\n        {X}")],
        "Pk_k comes out right",
        ["are stacked"],
    ),
    "no K' and no guard": (
        KF,
        [(GUARD, ""), (P, P.replace(" @ K.T", ""))],
        "with nothing in view, `update` stops",
        ["Perhaps"],
    ),
    "what was seen moved": (
        KF,
        [("innovation = seen", "innovation = seen + np.tile(self.xk_k, p)")],
        "what was seen is off",
        [],
    ),
    "rows of H that say the same, and no wrap": (RB, [(ROW, PARALLEL), (WRAP, "pass")], "bearing row", ["wrapped"]),
    "rows of H that say the same, and R subtracted": (
        RB,
        [(ROW, PARALLEL), (f"+ {BLOCKS}", f"- {BLOCKS}")],
        "its columns are multiples of one another",
        [],
    ),
    "arctan and K H": (
        RB,
        [("np.arctan2(dy, dx)", "np.arctan(dy / dx)"), (P, P.replace("S @ K.T", "H"))],
        "K H is not a covariance",
        ["With two in view"],
    ),
    "a number for R, and a plus": (
        RB,
        [(BLOCKS, "self.R[0, 0]"), (P, P.replace("_k - K", "_k + K"))],
        "grows in `update`",
        ["With two in view"],
    ),
    "S is not inverted, and dt": (
        RB,
        [(K, "K = self.Pk_k @ H.T @ S"), ("K @ innovation", "self.dt * K @ innovation")],
        "0.25 times as large",
        ["acts as 4 times"],
    ),
    "no sign, from the other side": (
        RB,
        [
            ("x\n    return np.array([np.hypot", "x\n    dx, dy = -dx, -dy\n    return np.array([np.hypot"),
            (WRAP, WRAP.replace("wrap(in", "abs(wrap(in") + ")"),
        ],
        "First mend `h`",
        ["has the other sign"],
    ),
    "degrees": (
        "team-converted",
        [("np.exp(-(sigma**2) / 2)", "np.exp(-(np.deg2rad(sigma) ** 2) / 2)")],
        "in radians",
        ["Nothing is debiased"],
    ),
}


@pytest.mark.parametrize("name, form, says, never", CASES.values(), ids=CASES)
def test_what_is_said_is_so(name, form, says, never):
    text = " ".join(str(failure(name, form)).split())
    assert says in text
    assert [words for words in never if words in text] == []
    also = [line for line in str(failure(name, form)).splitlines() if line.startswith("Also:")]
    assert len(also) == len(set(also))

"""Mistakes in `update`, which labs 1 and 3 have in common."""

from labkit.instructor.authoring.spec import Mistake

GUARD = "        if not y:\n            return\n"
K = "K = np.linalg.solve(S, H @ self.Pk_k).T"
SHORT = "self.Pk_k = (np.eye(2) - K @ H) @ self.Pk_k"
JOSEPH = "A = np.eye(2) - K @ H\n        self.Pk_k = A @ self.Pk_k @ A.T + K @ {} @ K.T"
TALL = K.removesuffix(".T")
X = "self.xk_k = self.xk_k + K @ innovation"
P = "self.Pk_k = self.Pk_k - K @ S @ K.T"

FORMS = {  # of the same filter, right for labs 1 and 3
    "least squares": [(K, "K = np.linalg.lstsq(S, H @ self.Pk_k, rcond=None)[0].T")],
    "symmetrised": [(P, P + "\n        self.Pk_k = (self.Pk_k + self.Pk_k.T) / 2")],
    "floor": [(P, P + " + 1e-12 * np.eye(2)")],
    "einsum": [(K, "K = np.einsum('ij,kj,kl->il', self.Pk_k, H, np.linalg.inv(S))")],
    "history": [(X, X + "\n        self.history = getattr(self, 'history', []) + [self.xk_k.copy()]")],
    "column": [(X, "self.xk_k = (self.xk_k.reshape(2, 1) + K @ innovation.reshape(-1, 1)).ravel()")],
    "options": [("m, dt=0.25):", "m, dt=0.25, gate=None, verbose=False):")],
    "kept x0": [("np.array(x0, dtype=float)", "x0")],
}


def update_mistakes(blocks, H, H_one, H_beside):
    """blocks: how the solution writes R of all landmarks; H: its Jacobian, and that of one, and side by side."""
    S = f"S = H @ self.Pk_k @ H.T + {blocks}"
    sizes = _sizes(blocks, S, H, H_one, H_beside)
    return [*_flow(), *_noise(blocks, S), *sizes, *_gain(blocks), *_result(blocks)]


def _flow():
    return [
        Mistake(
            "empty-crash",
            "`update` does not expect an empty list: with no landmark in view there is nothing "
            "to correct, and the estimate stays as it is.",
            [(GUARD, "")],
            [(GUARD, "        first = y[0]\n")],
            [(GUARD, "        1 / len(y)\n")],
        ),
        Mistake(
            "empty-wipes",
            "With no landmark in view, `update` must leave xk_k and Pk_k as they are; yours changes them.",
            [(GUARD, "        if not y:\n            self.xk_k = np.zeros(2)\n            return\n")],
            [(GUARD, "        if not y:\n            self.Pk_k = self.Pk_k + self.Q\n            return\n")],
        ),
        Mistake(
            "update-empty",
            "`update` changes nothing: are the new values assigned to `self.xk_k` and `self.Pk_k`?",
            [(X, "pass"), (P, "pass")],
            [(X, "x = self.xk_k + K @ innovation"), (P, "P = self.Pk_k - K @ S @ K.T")],
        ),
        Mistake(
            "x-not-corrected",
            "`update` sets a new covariance but leaves the estimate as it was: is the "
            "corrected position assigned to `self.xk_k`? Or is the innovation always 0?",
            [(X, "self.xk_k + K @ innovation")],
        ),
        Mistake(
            "p-not-updated",
            "`update` leaves the covariance as it was: a measurement makes the position more certain.",
            [(P, "pass")],
            [(P, "Pk_k = self.Pk_k - K @ S @ K.T")],
        ),
        Mistake(
            "first-only",
            "Only the first landmark of y is used, whatever else is in view.",
            [("p = len(y)", "y = y[:1]\n        p = 1")],
        ),
        Mistake(
            "last-only",
            "Only the last landmark of y is used: is something overwritten in a loop, instead of being collected?",
            [("p = len(y)", "y = y[-1:]\n        p = 1")],
        ),
        Mistake(
            "q-in-update", "Q is added in `update` as well: the robot moves in `predict` only.", [(P, P + " + self.Q")]
        ),
    ]


def _noise(blocks, S):
    return [
        Mistake(
            "r-kron-order",
            "The entries of R are spread over all landmarks: the order of the two matrices matters in kron.",
            [(blocks, "np.kron(self.R, np.eye(p))")],
        ),
        Mistake(
            "r-tiled",
            "R stands in every block, also off the diagonal: that says that all landmarks are "
            "measured with the same error. Independent errors have zeros there.",
            [(blocks, "np.tile(self.R, (p, p))")],
        ),
        Mistake(
            "r-diagonal-only",
            "Only the diagonal of R is used: its off-diagonal entries belong into each block too.",
            [(blocks, "np.kron(np.eye(p), np.diag(np.diag(self.R)))")],
            [(blocks, "np.diag(np.tile(np.diag(self.R), p))")],
        ),
        Mistake(
            "r-one-number",
            "One number of R is used for all: the two components of a measurement have different variances.",
            [(blocks, "np.eye(2 * p) * self.R[0, 0]")],
        ),
        Mistake(
            "r-everywhere",
            "A number of R is added to every entry of S: R belongs into the blocks on the diagonal.",
            [(blocks, "self.R[0, 0]")],
        ),
        Mistake(
            "r-dt-again",
            "The update divides by dt a second time: `self.R` is R / dt already.",
            [(blocks, f"{blocks} / self.dt")],
        ),
        Mistake(
            "r-dt-undone",
            "The update multiplies R by dt, which takes back what the constructor did.",
            [(blocks, f"{blocks} * self.dt")],
        ),
        Mistake(
            "q-for-r",
            "The update takes Q as the noise of the measurement: that is the noise of the motion.",
            [(blocks, "np.kron(np.eye(p), self.Q)")],
        ),
        Mistake(
            "r-squared",
            "R is squared: it is a covariance already, not a standard deviation.",
            [(blocks, "np.kron(np.eye(p), self.R @ self.R)")],
        ),
        Mistake(
            "s-without-r",
            "R is missing in S: the innovation is uncertain because of the estimate (H P H') and of the sensor (R).",
            [(f" + {blocks}", "")],
            [(f" + {blocks}", ""), (K, "K = self.Pk_k @ H.T @ np.linalg.pinv(S)")],
        ),
        Mistake(
            "s-without-p",
            "H P H' is missing in S: the innovation is uncertain because of the estimate (H P "
            "H') and of the sensor (R).",
            [(S, f"S = {blocks}")],
        ),
        Mistake(
            "s-minus-r",
            "R is subtracted in S: both terms make the innovation more uncertain.",
            [(f"+ {blocks}", f"- {blocks}")],
        ),
    ]


def _sizes(blocks, S, H, H_one, H_beside):
    return [
        Mistake(
            "r-not-repeated",
            "R is not repeated for each landmark: with p landmarks in view H P H' is (2p, "
            "2p), but R is still (2, 2). It needs one block R for each landmark on the diagonal.",
            [(blocks, "self.R")],
            [(S, "S = H @ self.Pk_k @ H.T\n        S += self.R")],
        ),
        Mistake(
            "s-sizes",
            "The two terms of S differ in size: either H has not grown with the number of landmarks "
            "(two rows for each), or R is not repeated for each landmark.",
            [(S, "S = self.R + H @ self.Pk_k @ H.T")],
            [(H, H_one)],
        ),
        Mistake(
            "nothing-grows",
            "Two sizes do not fit when several landmarks are in view: with p of them the innovation has 2p entries, "
            "H 2p rows, and R is repeated for each. Perhaps H and R are still those of one landmark, or H stands "
            "where its transpose belongs?",
            [(H, H_one), (blocks, "self.R")],
        ),
        Mistake(
            "h-beside",
            "Two sizes do not fit when several landmarks are in view. Perhaps the blocks of H stand side by side, "
            "(2, 2p)? They must stand below one another, (2p, 2).",
            [(H, H_beside)],
        ),
        Mistake(
            "r-too-large",
            "R of all landmarks comes out as (4p, 4p). That is the handout's slip: its identity "
            "must be of size p, the number of landmarks, not 2p.",
            [(blocks, "np.kron(np.eye(2 * p), self.R)")],
        ),
        Mistake(
            "star-for-at",
            "`*` multiplies entry by entry: the product of a matrix and a vector is `@`.",
            [("K @ innovation", "K * innovation")],
        ),
        Mistake(
            "innovation-column",
            "The innovation is a column (2p, 1): added to the vector xk_k (2,) it makes a "
            "(2, 2) matrix. Keep it (2p,).",
            [("K @ innovation", "K @ innovation.reshape(-1, 1)")],
        ),
        Mistake(
            "innovation-not-flat",
            "The innovation is a table (p, 2), one row a landmark: it must be one long vector (2p,).",
            [("K @ innovation", "K @ innovation.reshape(-1, 2)")],
        ),
    ]


def _gain(blocks):
    return [
        Mistake(
            "s-not-inverted",
            "S is not inverted in the gain: K = P H' S^-1, so that a noisy sensor has little weight.",
            [(K, "K = self.Pk_k @ H.T @ S")],
        ),
        Mistake(
            "s-entries-inverted",
            "1 / S takes the reciprocal of each entry: the gain needs the inverse of the matrix.",
            [(K, "K = self.Pk_k @ H.T @ (1 / S)")],
            [(K, "K = self.Pk_k @ H.T @ S**-1.0")],
        ),
        Mistake(
            "gain-inverts-r",
            "The gain inverts R instead of S = H P H' + R.",
            [(K, f"K = self.Pk_k @ H.T @ np.linalg.inv({blocks})")],
        ),
        Mistake("gain-without-p", "P is missing in the gain: K = P H' S^-1.", [(K, "K = H.T @ np.linalg.inv(S)")]),
        Mistake(
            "gain-inverts-p",
            "The gain takes the inverse of P: in K = P H' S^-1 only S is inverted.",
            [(K, "K = np.linalg.inv(self.Pk_k) @ H.T @ np.linalg.inv(S)")],
        ),
        Mistake(
            "gain-times-dt",
            "The correction is multiplied by dt: a measurement is taken at one instant.",
            [("K @ innovation", "self.dt * K @ innovation")],
        ),
        Mistake(
            "gain-transposed",
            "The gain is transposed: K has two rows, one for each coordinate of the robot, and 2p columns.",
            [("K @ innovation", "K.T @ innovation")],
        ),
        Mistake(
            "gain-not-transposed",
            "K has to be (2, 2p): `solve(S, H P)` gives its transpose, add `.T`.",
            *([(K, TALL), (P, new)] for new in (P, SHORT, JOSEPH.format(blocks), "self.Pk_k = self.Pk_k - K @ H")),
        ),
        Mistake(
            "x-replaced",
            "The correction replaces the estimate: K times the innovation is added to the prediction.",
            [(X, "self.xk_k = K @ innovation")],
        ),
        Mistake("correction-twice", "The correction is added twice.", [(X, X + " + K @ innovation")]),
    ]


def _result(blocks):
    return [
        Mistake(
            "p-plus",
            "The covariance grows in `update`: a measurement makes the position more certain, so K S "
            "K' is subtracted. (With (I - K H) P, look at the sign of H.)",
            [(P, P.replace("-", "+"))],
            [(P, "self.Pk_k = (np.eye(2) + K @ H) @ self.Pk_k")],
        ),
        Mistake(
            "p-without-h",
            "The covariance is computed as (I - K) P: H is missing, it is (I - K H) P.",
            [(P, "self.Pk_k = (np.eye(2) - K) @ self.Pk_k")],
        ),
        Mistake(
            "p-without-s",
            "S is missing in the new covariance: it is P - K S K'.",
            [(P, "self.Pk_k = self.Pk_k - K @ K.T")],
        ),
        Mistake(
            "p-without-kt",
            "The second K is missing in the new covariance: it is P - K S K'.",
            [(P, "self.Pk_k = self.Pk_k - K @ S")],
        ),
        Mistake(
            "p-replaced",
            "The covariance is replaced by K S K': that is what the measurement takes away from P.",
            [(P, "self.Pk_k = K @ S @ K.T")],
        ),
        Mistake(
            "p-without-p",
            "P is missing in the new covariance: it is (I - K H) P, not I - K H.",
            [(P, "self.Pk_k = np.eye(2) - K @ H")],
        ),
        Mistake(
            "p-minus-kh",
            "K H is not a covariance: what the measurement takes away from P is K H P (or K S K').",
            [(P, "self.Pk_k = self.Pk_k - K @ H")],
        ),
        Mistake(
            "p-half-joseph",
            "The second half of the Joseph form is missing: (I - K H) P (I - K H)' + K R K'.",
            [(P, "A = np.eye(2) - K @ H\n        self.Pk_k = A @ self.Pk_k @ A.T")],
        ),
        Mistake(
            "p-r-for-s",
            "The covariance is updated with K R K': it is P - K S K', with S = H P H' + R.",
            [(P, f"self.Pk_k = self.Pk_k - K @ {blocks} @ K.T")],
        ),
    ]

"""Mistakes in the constructor and in `predict`, which labs 1 and 3 have in common."""

from labkit.instructor.authoring.spec import Mistake

SCALE_Q, SCALE_R = "np.array(Q) * dt", "np.array(R) / dt"

CONSTRUCTOR = [
    Mistake(
        "q-unscaled",
        "Q is not multiplied by dt: it is given per second, and a step lasts dt seconds.",
        [(SCALE_Q, "np.array(Q)")],
    ),
    Mistake(
        "q-divided",
        "Q is divided by dt, but must be multiplied: a shorter step gathers less noise.",
        [(SCALE_Q, "np.array(Q) / dt")],
    ),
    Mistake(
        "q-dt-squared",
        "Q is multiplied by dt twice: the variance grows with the time, not with its square.",
        [(SCALE_Q, "np.array(Q) * dt**2")],
        [(SCALE_Q, "np.array(Q) * dt * dt")],
    ),
    Mistake(
        "r-unscaled",
        "R is not divided by dt: it is given for a look of one second, and one look has dt seconds.",
        [(SCALE_R, "np.array(R)")],
    ),
    Mistake(
        "r-multiplied",
        "R is multiplied by dt in the constructor, but must be divided: a shorter look is a noisier one.",
        [(SCALE_R, "np.array(R) * dt")],
    ),
    Mistake(
        "dt-swapped",
        "The two scalings are swapped: Q is multiplied by dt, and R is divided by it.",
        [(SCALE_Q, "np.array(Q) / dt"), (SCALE_R, "np.array(R) * dt")],
    ),
    Mistake(
        "q-r-swapped",
        "Q and R are swapped in the constructor: Q is the noise of the motion, R that of a measurement.",
        [(SCALE_Q, "np.array(R) * dt"), (SCALE_R, "np.array(Q) / dt")],
    ),
    Mistake(
        "start-ignored",
        "The filter does not start at x0: its first estimate is what the constructor was given.",
        [("np.array(x0, dtype=float)", "np.zeros(2)")],
    ),
    Mistake(
        "start-covariance",
        "The filter does not start with P0: its first covariance is what the constructor was given.",
        [("np.array(P0, dtype=float)", "np.eye(2)")],
        [("np.array(P0, dtype=float)", "3 * np.eye(2)")],
    ),
]

MOVE, GROW = "self.xk_k = self.xk_k + self.dt * u", "self.Pk_k = self.Pk_k + self.Q"

PREDICT = [
    Mistake(
        "dt-forgotten",
        "`predict` moves the estimate by u, but u is a velocity: in one step the robot goes dt times as far.",
        [("self.dt * u", "u")],
    ),
    Mistake(
        "dt-twice",
        "`predict` multiplies u by dt twice: velocity times time is the distance already.",
        [("self.dt * u", "self.dt * self.dt * u")],
    ),
    Mistake(
        "dt-divides",
        "`predict` divides u by dt: the distance is velocity times time.",
        [("self.dt * u", "u / self.dt")],
    ),
    Mistake(
        "dt-fixed",
        "`predict` takes 0.25 s for every step: use the dt that the constructor was given.",
        [("self.dt * u", "0.25 * u")],
    ),
    Mistake(
        "minus-u",
        "`predict` moves the estimate backwards: the motion is added to the position.",
        [("+ self.dt * u", "- self.dt * u")],
    ),
    Mistake(
        "x-replaced-by-u",
        "`predict` forgets where the robot was: the motion is added to the old estimate.",
        [(MOVE, "self.xk_k = self.dt * u")],
    ),
    Mistake(
        "x-not-moved",
        "`predict` does not move the estimate: is the new position assigned to `self.xk_k`?",
        [(MOVE, "xk_k = self.xk_k + self.dt * u")],
        [(MOVE, "self.xk_k + self.dt * u")],
    ),
    Mistake(
        "predict-empty",
        "`predict` changes neither xk_k nor Pk_k: are the results assigned to fields of `self`?",
        [(MOVE, "pass"), (GROW, "return None")],
        [(MOVE, "x = self.xk_k + self.dt * u"), (GROW, "P = self.Pk_k + self.Q")],
    ),
    Mistake(
        "q-not-added",
        "`predict` does not add Q to the covariance: each step of driving makes the position less certain.",
        [(GROW, "pass")],
        [(GROW, "Pk_k = self.Pk_k + self.Q")],
        [(GROW, "A = np.eye(2)\n        self.Pk_k = A @ self.Pk_k @ A.T")],
    ),
    Mistake(
        "q-dt-again",
        "`predict` multiplies Q by dt a second time: the constructor did that already.",
        [(GROW, GROW + " * self.dt")],
    ),
    Mistake(
        "q-dt-undone",
        "`predict` divides Q by dt, which takes back what the constructor did.",
        [(GROW, GROW + " / self.dt")],
    ),
    Mistake(
        "p-is-q",
        "`predict` replaces the covariance by Q: Q is added to what was uncertain before.",
        [(GROW, "self.Pk_k = self.Q")],
    ),
    Mistake(
        "q-subtracted", "`predict` subtracts Q: noise makes a covariance larger.", [(GROW, GROW.replace("+", "-"))]
    ),
    Mistake(
        "r-in-predict",
        "`predict` adds R, the noise of the sensor: the noise of the motion is Q.",
        [(GROW, GROW.replace("self.Q", "self.R"))],
    ),
    Mistake("q-twice", "`predict` adds Q twice to the covariance.", [(GROW, GROW + " + self.Q")]),
    Mistake(
        "p-times-dt",
        "`predict` scales the old covariance with dt: the old position is kept as it is, so its "
        "covariance is kept as well, and Q comes on top.",
        [(GROW, "self.Pk_k = self.dt * self.Pk_k * self.dt + self.Q")],
    ),
]

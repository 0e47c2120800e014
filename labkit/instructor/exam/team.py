"""What check cells use besides `Exam` where the student's filter is one for a whole team."""

import warnings

import numpy as np

from ...checks.compare import gap_of
from ...team import FrameWarning, replay
from ..sandbox.proxy import Stand
from .exam import Exam


class TeamExam(Exam):
    """The examination of a lab with filters for teams."""

    def same_team(self, KF, log, x0, P0, noise, what="on this run", **options):
        """Fail unless the filter estimates what the solution's does over a whole TeamLog; returns its (x, P).

        x0 (n, 3), P0 (3n, 3n), noise and options: what the filter is made with.
        """
        x, P = self.team(KF, log, x0, P0, noise, **options)
        far = []
        for right in self.right(KF.__name__):
            due_x, due_P = _run(right, log, (x0, P0, noise), options)
            wrong = [k for k in range(len(x)) if gap_of(x[k], due_x[k]) > 1 or gap_of(P[k], due_P[k]) > 1]
            if not wrong:
                return x, P
            far.append((wrong[0], float(np.linalg.norm((x - due_x)[..., :2], axis=2).max())))
        step, apart = max(far)
        start = "from the start" if step == 0 else f"from step {step} of {len(log)} on"
        self.fail(f"Your filter's estimate {what} differs from the right one {start}, by {apart:.2g} m.")

    def team(self, KF, log, x0, P0, noise, **options):
        """(x (N+1, n, 3), P (N+1, 3n, 3n)) of a student's (or the solution's) filter class over a TeamLog."""
        if not isinstance(KF, Stand):
            return _run(KF, log, (x0, P0, noise), options)
        answer = KF.replay_team(log, np.asarray(x0, float), np.asarray(P0, float), noise, options)
        shapes = {"x": (len(log) + 1, log.n, 3), "P": (len(log) + 1, 3 * log.n, 3 * log.n)}
        for field, shape in shapes.items():
            array = answer.get(field)
            if not (isinstance(array, np.ndarray) and array.dtype == float and np.isfinite(array).all()):
                self.fail("Your filter's estimate is not made of finite numbers.")
            if array.shape != shape:
                self.fail(f"Your filter's estimate has another shape than {shapes['x'][1:]} and {shapes['P'][1:]}.")
        return answer["x"], answer["P"]


def _run(KF, log, told, options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FrameWarning)
        return replay(KF(*told, **options), log)

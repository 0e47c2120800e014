"""What check cells use besides `Exam` where the student's filter is one for a whole team."""

import warnings

import numpy as np

from ...checks.compare import gap_of
from ...log import History, replay
from ...team import FrameWarning
from ..sandbox.proxy import Stand
from .exam import Exam


class TeamExam(Exam):
    """The examination of a lab with filters for teams."""

    def same_team(self, KF, log, x0, P0, noise, what="on this run", **options):
        """Fail unless the filter estimates what the solution's does over a whole TeamLog; returns its History.

        x0 (n, 3), P0 (3n, 3n), noise and options: what the filter is made with.
        """
        mine = self.team(KF, log, x0, P0, noise, **options)
        far = []
        for right in self.right(KF.__name__):
            due = _run(right, log, (x0, P0, noise), options)
            pairs = [(mine.x, due.x), (mine.P, due.P)]
            wrong = [k for k in range(len(mine.x)) if any(gap_of(a[k], b[k]) > 1 for a, b in pairs)]
            if not wrong:
                return mine
            far.append((wrong[0], float(np.linalg.norm((mine.x - due.x)[..., :2], axis=2).max())))
        step, apart = max(far)
        start = "from the start" if step == 0 else f"from step {step} of {len(log)} on"
        self.fail(f"Your filter's estimate {what} differs from the right one {start}, by {apart:.2g} m.")

    def team(self, KF, log, x0, P0, noise, **options):
        """The History of a student's (or the solution's) filter class over a TeamLog."""
        if not isinstance(KF, Stand):
            return _run(KF, log, (x0, P0, noise), options)
        answer = KF.replay_team(log, np.asarray(x0, float), np.asarray(P0, float), noise, options)
        n, steps = log.n, len(log)
        shapes = {"x": (steps + 1, n, 3), "P": (steps + 1, 3 * n, 3 * n)}
        shapes |= {"x_prior": (steps, n, 3), "P_prior": (steps, 3 * n, 3 * n)}
        for field, shape in shapes.items():
            array = answer.get(field)
            if not (isinstance(array, np.ndarray) and array.dtype == float and np.isfinite(array).all()):
                self.fail("Your filter's estimate is not made of finite numbers.")
            if array.shape != shape:
                self.fail(f"Your filter's estimate has another shape than {shapes['x'][1:]} and {shapes['P'][1:]}.")
        return History(log.times, **{field: answer[field] for field in shapes}, R=None)


def _run(KF, log, told, options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FrameWarning)
        return replay(KF(*told, **options), log)

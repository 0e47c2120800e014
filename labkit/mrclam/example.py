"""A small simulated data set in the format of MRCLAM, for those who have no real one at hand.

It has what makes real robots hard for a filter: ranges whose errors stay the same for seconds, a few barcodes that are
read as another landmark's, and commands that lead the motion and promise more than comes.  It lacks the gaps of the
real files, and bearings that are off by radians.
"""

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from ..geometry import wrap
from .files import write_set

DT = 0.1  # [s] between two rows of odometry or ground truth
LOOK = 3  # steps from one camera image to the next
EPOCH = 1.2e9  # [s] stamps are seconds since 1970, as in the real files
VIEW = 0.55  # [rad] half the camera's field of view
SIGMA_V, SIGMA_W = 0.03, 0.03  # motion: [m/sqrt(s)] along the heading, [rad/sqrt(s)]
SIGMA_RANGE, SIGMA_BEARING = 0.15, 0.02  # of one measurement [m], [rad]
LASTING = 10.0  # [s] in which the error of a landmark's range is forgotten, to a third
LAG = 2  # steps from a command to the motion
PROMISED = 1.07  # the speed that is reported, over that which comes
MISREAD = (0, 1, 3, 1, 3)  # measurements of each robot that carry the barcode of another landmark
SPURIOUS = (34, 50)  # barcodes that nothing has


@cache
def folder() -> Path:
    """Folder of the example, written once a session and removed at its end."""
    path = tempfile.mkdtemp(prefix="labkit-mrclam-")
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return write(path)


def write(folder: str | Path, seconds: float = 400, seed: int = 7) -> Path:
    """Write all 17 files of a simulated set of `seconds` into `folder` (existing); the Path of it."""
    rng = np.random.default_rng(seed)
    landmarks = rng.uniform([-1.0, -5.0], [5.0, 5.0], (15, 2))  # [m], about the size of the real room
    codes = rng.permutation(np.setdiff1d(np.arange(5, 91), SPURIOUS))[:20]  # of subjects 1..20
    stamps = EPOCH + DT * np.arange(round(seconds / DT) + 1)
    poses, commands = _drive(len(stamps), rng)
    subjects = np.arange(1, 21)
    tables = {
        "Barcodes.dat": np.column_stack([subjects, codes]),
        "Landmark_Groundtruth.dat": np.column_stack([subjects[5:], landmarks, np.full((15, 2), 1e-4)]),
    }
    for r in range(5):
        first = round((6 + r) / DT)  # odometry starts seconds after the ground truth, as in the real sets
        tables[f"Robot{r + 1}_Groundtruth.dat"] = np.column_stack([stamps, poses[:, r]])
        tables[f"Robot{r + 1}_Odometry.dat"] = np.column_stack([stamps, commands[:, r]])[first:]
        looks = np.arange(first, len(stamps), LOOK)
        targets = np.concatenate([poses[looks, :, :2], np.broadcast_to(landmarks, (len(looks), 15, 2))], axis=1)
        tables[f"Robot{r + 1}_Measurement.dat"] = _look(poses[looks, r], targets, codes, stamps[looks], MISREAD[r], rng)
    write_set(folder, tables)
    return Path(folder)


def _drive(n, rng):
    """Poses (n, 5, 3) and commands (n, 5, 2) of five unicycles that head for random places."""
    pose = np.column_stack([rng.uniform([0, -4], [4, 4], (5, 2)), rng.uniform(-np.pi, np.pi, 5)])
    told = np.zeros((LAG, 5, 2))  # commands on their way
    goal, poses, commands = rng.uniform([0, -4], [4, 4], (5, 2)), np.empty((n, 5, 3)), np.empty((n, 5, 2))
    noise = np.sqrt(DT) * np.array([SIGMA_V, SIGMA_W]) * rng.standard_normal((n, 5, 2))
    fresh = rng.uniform([0, -4], [4, 4], (n, 5, 2))
    for k in range(n):
        dx, dy = (goal - pose[:, :2]).T
        turn = wrap(np.arctan2(dy, dx) - pose[:, 2])
        command = np.column_stack([np.where(abs(turn) < 0.5, 0.12, 0.04), np.clip(turn, -0.5, 0.5)])
        poses[k], commands[k] = pose, command
        ahead, turned = (DT * told[0] / PROMISED + noise[k]).T
        told = np.concatenate([told[1:], command[None]])
        middle = pose[:, 2] + turned / 2
        pose = pose + np.column_stack([ahead * np.cos(middle), ahead * np.sin(middle), turned])
        goal = np.where(np.hypot(dx, dy)[:, None] < 0.3, fresh[k], goal)
    poses[..., 2] = wrap(poses[..., 2])
    return poses, commands


def _look(pose, targets, codes, stamps, misread, rng):
    """Rows (time, barcode, range, bearing) of what a robot at `pose` (n, 3) sees of targets (n, 20, 2)."""
    offset = targets - pose[:, None, :2]
    distance = np.hypot(offset[..., 0], offset[..., 1])
    bearing = wrap(np.arctan2(offset[..., 1], offset[..., 0]) - pose[:, 2:])
    seen = (abs(bearing) < VIEW) & (distance > 0.5) & (rng.random(distance.shape) < 0.5)  # half are missed
    image, which = np.nonzero(seen)
    n = len(which)
    code = np.where(rng.random(n) < 0.002, rng.choice(SPURIOUS, n), codes[which])
    wrong = rng.choice(np.flatnonzero(which >= 5), misread, replace=False)
    code[wrong] = codes[5 + (which[wrong] - 5 + rng.integers(1, 15, misread)) % 15]
    ranges = distance + SIGMA_RANGE * _lasting(distance.shape, LOOK * DT / LASTING, rng)
    bearings = bearing[seen] + SIGMA_BEARING * rng.standard_normal(n)
    return np.column_stack([stamps[image], code, ranges[seen], bearings])


def _lasting(shape, forgotten, rng):
    """Noise (n, m) with variance 1 that each of m landmarks forgets slowly from one look to the next."""
    noise, kept = rng.standard_normal(shape), np.exp(-forgotten)
    for k in range(1, len(noise)):
        noise[k] = kept * noise[k - 1] + np.sqrt(1 - kept**2) * noise[k]
    return noise

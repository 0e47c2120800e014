"""Robots that see each other: a common frame without a map, and a formation in it.

Source: F. E. Schneider, D. Wildermuth, on the use of relative positions in the navigation of groups of robots
(in Russian, 2005; called "the paper" here).
"""

from .. import lazily
from .frame import frame_errors, relative_nees_per_dimension
from .initial_pose import initial_pose
from .log import TeamLog, dead_reckoned, delayed, later, of_logs
from .start import first_metres, median_of_pairs, near, own_start, start_errors, started
from .warning import FrameWarning
from .world import Route, Team, TeamNoise

# Widgets load on first use, as in labkit itself.
__getattr__, __dir__ = lazily(globals(), explore="widgets", play="widgets")

"""labkit: the small world behind the robot localization labs.

Data flows one way: world -> robot -> log -> filter -> history -> metrics -> plots -> widgets.
The filter is missing on purpose: it is what the student writes.
"""

from .checks.feedback import FilterError
from .geometry import rotation, wrap
from .lazy import lazy
from .log import History, Log, make_filter, replay, simulate
from .robot import Robot
from .world import Landmark, Map, random_map

__version__ = "0.1.0"

# Drawing, widgets and checks load on first use, so that `import labkit` stays as quick as numpy.
_LAZY = {
    "EnvPlot": "envplot",
    "check": "checks",
    "explore": "widgets",
    "play": "widgets",
    "progress": "widgets",
    "load_answer": "notebook.answers",
    "metrics": "metrics",
    "mrclam": "mrclam",
}

__all__ = [
    "FilterError",
    "History",
    "Landmark",
    "Log",
    "Map",
    "Robot",
    "make_filter",
    "random_map",
    "replay",
    "rotation",
    "simulate",
    "wrap",
    *_LAZY,
]

__getattr__, __dir__ = lazy(__name__, __all__, _LAZY)

"""labkit: the small world behind the robot localization labs.

Data flows one way: world -> robot -> log -> filter -> history -> metrics -> plots -> widgets.
The filter is missing on purpose: it is what the student writes.
"""

from importlib import import_module

from .checks.feedback import FilterError
from .geometry import rotation, wrap
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
    "metrics",
    "mrclam",
]


_MODULES = ("metrics", "mrclam")  # reachable as labkit.metrics without an import of their own


def __getattr__(name):
    if name in _MODULES:
        return import_module(f".{name}", __name__)
    if name in _LAZY:
        return getattr(import_module(f".{_LAZY[name]}", __name__), name)
    raise AttributeError(f"module 'labkit' has no attribute '{name}'")


def __dir__():
    return sorted(__all__)

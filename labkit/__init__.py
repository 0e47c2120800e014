"""labkit: the small world behind the robot localization labs.

Data flows one way: world -> robot -> log -> filter -> history -> metrics -> plots -> widgets.
The filter is missing on purpose: it is what the student writes.
"""

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

from .checks.feedback import FilterError
from .geometry import rotation, wrap
from .history import History, make_filter, replay
from .log import Log, simulate
from .robot import Robot
from .world import Landmark, Map, random_map

__version__ = "0.1.0"


def lazily(package: dict[str, Any], **modules: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The `__getattr__` and `__dir__` of a package, its globals, with more names: each loads its module on first use.

    A name that is its module's own is the module.
    """

    def find(name):
        if name not in modules:
            raise AttributeError(f"module {package['__name__']!r} has no attribute {name!r}")
        module = import_module(f".{modules[name]}", package["__name__"])
        return module if name == modules[name].rpartition(".")[2] else getattr(module, name)

    def own(value):
        return not isinstance(value, ModuleType) and getattr(value, "__module__", "labkit").startswith("labkit")

    names = sorted(modules.keys() | {name for name, value in package.items() if name[0] != "_" and own(value)})
    return find, lambda: names


# Drawing, widgets and checks load on first use, so that `import labkit` stays as quick as numpy.
__getattr__, __dir__ = lazily(
    globals(),
    EnvPlot="envplot",
    check="checks",
    explore="widgets",
    explore_line="widgets.line",
    play="widgets",
    progress="widgets",
    reveal="guesses",
    load_answer="notebook.answers",
    metrics="metrics",
    mrclam="mrclam",
    variant="notebook.variant",
)

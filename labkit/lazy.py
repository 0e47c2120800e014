"""Names of a package whose modules load when they are first used, so that importing it stays quick."""

from collections.abc import Callable
from importlib import import_module
from typing import Any


def lazy(package: str, names: list[str], modules: dict[str, str]) -> tuple[Callable[[str], Any], Callable[[], list]]:
    """The `__getattr__` and `__dir__` of a package that offers `names`; modules: {name: module that it comes from}.

    A name that is its module's own is the module.  Raises AttributeError for a name that is not there.
    """

    def find(name):
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module = import_module(f".{modules[name]}", package)
        return module if name == modules[name] else getattr(module, name)

    return find, lambda: sorted(names)

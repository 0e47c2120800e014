"""What the checks ask, which other right answers there are, and which mistakes students make.

Only maintainers need this: `labkit build` turns it into the numbers in labkit/checks/data. Each module in here that
has a list CHECKS brings its checks; a new lab brings a module.
"""

from importlib import import_module
from pkgutil import iter_modules

modules = [import_module(f"{__name__}.{found.name}") for found in iter_modules(__path__)]
CHECKS = [check for module in modules for check in getattr(module, "CHECKS", [])]

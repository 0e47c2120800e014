"""A legged robot on a football field: its world, its noise, and localizers of four kinds.

Source: F. Martín, V. Matellán, P. Barrera, J. M. Cañas, "Localización basada en lógica difusa y filtros
de Kalman para robots con patas" (called "the paper" here), and the works that it builds on.
"""

from importlib import import_module

from .field import FIELD, Field
from .fuzzygrid import FuzzyGrid
from .hybrid import Hybrid
from .memory import Memory, PastSightings, poses_around
from .noise import HARSH, PAPER, PRESETS, REAL, Noise
from .particles import ParticleFilter
from .race import race, table
from .robot import FieldLog, LeggedRobot, Sighting
from .triangulation import Triangulation

# Drawing and widgets load on first use, as in labkit itself.
_LAZY = {
    "explore": "widgets",
    "play": "widgets",
    "plot_experiment": "walkplots",
    "plot_race": "raceplots",
    "show_beliefs": "beliefplots",
    "show_walk": "walkplots",
}

__all__ = [
    "FIELD",
    "Field",
    "FieldLog",
    "FuzzyGrid",
    "HARSH",
    "Hybrid",
    "LeggedRobot",
    "Memory",
    "Noise",
    "PAPER",
    "PRESETS",
    "ParticleFilter",
    "REAL",
    "PastSightings",
    "Sighting",
    "Triangulation",
    "race",
    "poses_around",
    "table",
    *_LAZY,
]


def __getattr__(name):
    if name in _LAZY:
        return getattr(import_module(f".{_LAZY[name]}", __name__), name)
    raise AttributeError(f"module 'labkit.legged' has no attribute '{name}'")


def __dir__():
    return sorted(__all__)

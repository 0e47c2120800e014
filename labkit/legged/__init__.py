"""A legged robot on a football field: its world, its noise, and localizers of four kinds.

Source: F. Martín, V. Matellán, P. Barrera, J. M. Cañas, "Localización basada en lógica difusa y filtros
de Kalman para robots con patas" (called "the paper" here), and the works that it builds on.
"""

from .. import lazily
from .field import FIELD, Field
from .fuzzygrid import FuzzyGrid
from .hybrid import Hybrid
from .memory import Memory, PastSightings, poses_around
from .noise import HARSH, PAPER, PRESETS, REAL, Noise
from .particles import ParticleFilter
from .race import race, steps_until_found, table
from .robot import FieldLog, LeggedRobot, Sighting
from .triangulation import Triangulation

# Drawing and widgets load on first use, as in labkit itself.
__getattr__, __dir__ = lazily(
    globals(),
    explore="widgets",
    play="widgets",
    plot_cells="raceplots",
    plot_experiment="walkplots",
    plot_possible="beliefplots",
    plot_race="raceplots",
    show_beliefs="beliefplots",
    show_frames="frames",
    show_walk="walkplots",
)

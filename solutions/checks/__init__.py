"""What the checks ask, which other right answers there are, and which mistakes students make.

Only maintainers need this: `labkit build` turns it into the numbers in labkit/checks/data.
"""

from . import (
    cartesian,
    cartesian_parts,
    formation,
    fuzzy,
    legged,
    legged_parts,
    mismatch,
    range_bearing,
    range_bearing_parts,
    team,
    team_parts,
)

CHECKS = [
    *cartesian_parts.CHECKS,
    *cartesian.CHECKS,
    *mismatch.CHECKS,
    *range_bearing_parts.CHECKS,
    *range_bearing.CHECKS,
    *legged_parts.CHECKS,
    *legged.CHECKS,
    *fuzzy.CHECKS,
    *team_parts.CHECKS,
    *formation.CHECKS,
    *team.CHECKS,
]

"""What the answers of labs 4 and 5 can be given: see `labkit.checks.kinds`."""

from ..checks.kinds import LANDMARK, fields, many, point, run
from ..world import Map
from .noise import Noise
from .robot import FieldLog, Sighting


def _tell(stored):
    return f"Noise({', '.join(f'{name}={value:.4g}' for name, value in stored.items())})"


def _used(stored, method):
    told = ("odometry", "slip", "spin") if method == "predict" else ("range_", "bearing")
    return f"noise: {', '.join(f'{name} {value:g}' for name, value in stored.items() if name.startswith(told))}"


KINDS = {
    "map": many(LANDMARK, Map, "map", "FIELD.map"),
    "noise": fields(Noise, tell=_tell, noise=_used),
    "sightings": many(point(Sighting, "complete")),
    "sighting": point(Sighting, "complete"),
    "log": run(FieldLog, "complete"),
}

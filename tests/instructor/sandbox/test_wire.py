"""What passes between grader and worker: data as they are, garbage as garbage, and nothing made at a worker's word."""

import subprocess
import sys

import numpy as np
import pytest

from labkit import Landmark, Log, Map
from labkit.instructor.sandbox import wire
from labkit.legged import Noise, Sighting
from labkit.team import TeamNoise


def through(value, objects=False):
    """A value that has travelled."""
    frame = wire.pack({"value": value}, objects)
    text, _ = wire.sizes(frame[:8])
    return wire.unpack(frame[8 : 8 + text], frame[8 + text :], objects)["value"]


DATA = [
    None,
    True,
    3,
    2.5,
    float("inf"),
    "text",
    "half \ud83d",
    [],
    [1, [2.0, "x"]],
    (1, (2, 3)),
    {"a": {"b": [1]}},
    np.eye(2),
    np.arange(3),
    np.array(2.5),
    np.zeros((0, 2)),
    np.array([True, False]),
    [(1, 0, np.array([2.0, 0.1]))],
]


@pytest.mark.parametrize("value", DATA, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("objects", [False, True])
def test_data_come_through_as_they_are(value, objects):
    came = through(value, objects)
    if isinstance(value, np.ndarray):
        assert came.dtype == value.dtype and came.shape == value.shape
        np.testing.assert_array_equal(came, value)
    elif value and isinstance(value, list):
        assert type(came) is type(value) and repr(came) == repr(value)
    else:
        assert came == (value if value != "half \ud83d" else "half ?")


SEEN = Landmark((1, 2), "six")
OBJECTS = [
    SEEN,
    Map([SEEN, Landmark((3, 4), 0)]),
    Sighting((1, 2), "pink-blue", complete=False),
    Noise(odometry=0.2),
    TeamNoise(walk=0.3, drift=0.0, bearing=0.01),
    [SEEN, (Noise(), Map())],
]


@pytest.mark.parametrize("value", OBJECTS, ids=lambda value: type(value).__name__)
def test_objects_of_a_kind_go_out_and_do_not_come_back(value):
    came = through(value, objects=True)
    assert type(came) is type(value) and repr(came) == repr(value)
    with pytest.raises(wire.FrameError):
        wire.pack(value)
    frame = wire.pack(value, objects=True)
    text, _ = wire.sizes(frame[:8])
    with pytest.raises(wire.FrameError):
        wire.unpack(frame[8 : 8 + text], frame[8 + text :])


def test_a_log_travels_without_the_truth():
    ids = np.array(["six"])
    log = Log(np.arange(3.0), np.ones((2, 2)), np.array([1]), ids, np.ones((1, 2)), Map([SEEN]), truth=np.ones((3, 2)))
    came = through(log, objects=True)
    assert type(came) is Log and came.truth is None and came.map == log.map
    for name in ("times", "controls", "seen_step", "seen_id", "seen"):
        np.testing.assert_array_equal(getattr(came, name), getattr(log, name))


@pytest.mark.parametrize(
    "value", [object(), np.array([None]), np.array([1j]), {1, 2}, b"x", len], ids=lambda value: type(value).__name__
)
@pytest.mark.parametrize("objects", [False, True])
def test_what_is_no_data_does_not_go_out(value, objects):
    with pytest.raises(wire.FrameError):
        wire.pack({"value": value}, objects)


@pytest.mark.parametrize(
    "text, raw",
    [
        (b"no json", b""),
        (b"\xff", b""),
        (b"[" * 100_000, b""),
        (b'{"array": ["<f8", [2]]}', b"12345678"),
        (b'{"array": ["<f8", [-1]]}', b""),
        (b'{"array": ["<f8", [1e9]]}', b""),
        (b'{"array": ["<f8", [4000000000, 4000000000]]}', b""),
        (b'{"array": ["|O8", [1]]}', b"12345678"),
        (b'{"array": [["<f8"], [1]]}', b"12345678"),
        (b'{"array": ["<f8", [true]]}', b"12345678"),
        (b'{"array": 1}', b""),
        (b'{"array": []}', b""),
        (b'{"pickle": "x"}', b""),
        (b'{"a": 1, "b": 2}', b""),
        (b"{}", b""),
        (b'{"dict": [1]}', b""),
        (b'{"tuple": 1}', b""),
        (b"1", b"left over"),
        (b'{"tuple": ' * 30 + b"[]" + b"}" * 30, b""),
        (b'{"kind": ' * 30 + b"[]" + b"}" * 30, b""),
        (b'{"kind": 1}', b""),
        (b'{"kind": ["map"]}', b""),
        (b'{"kind": [1, []]}', b""),
        (b'{"kind": ["map", [1]]}', b""),
        (b'{"kind": ["landmark", [0, [1]]]}', b""),
        (b'{"kind": ["ints", [1]]}', b""),
        (b'{"kind": ["legged.noise", {"dict": {"odometry": "much"}}]}', b""),
        (b'{"kind": ["legged.noise", {"dict": {"__class__": 1}}]}', b""),
        (b'{"kind": ["team.log", {"dict": {}}]}', b""),
        (b'{"kind": ["os.system", "true"]}', b""),
    ],
)
@pytest.mark.parametrize("objects", [False, True])
def test_garbage_is_garbage(text, raw, objects):
    with pytest.raises(wire.FrameError):
        wire.unpack(text, raw, objects)


def test_a_kinds_name_imports_nothing_but_kinds():
    """Not even where objects are read: no other module, whatever the name."""
    code = """
import sys
import labkit.metrics  # which the kinds of teams need
from labkit.instructor.sandbox import wire
before = set(sys.modules)
names = "plots.map canvas. .map . .. mrclam.example instructor.map instructor.exam.exam checks.map legged team. this.x"
odd = ["labkit.plots", "../legged.noise", "legged/../team.noise", "", " ", "\\0.x", "x" * 10**5 + ".y"]
for name in names.split() + odd:
    try:
        wire.unpack(b'{"kind": [%s, []]}' % __import__("json").dumps(name).encode(), b"", objects=True)
    except wire.FrameError:
        continue
    raise SystemExit(f"{name!r} made an object")
print(sorted(m for m in set(sys.modules) - before if not m.startswith(("labkit.legged", "labkit.team"))))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stdout + done.stderr


def test_a_frame_that_says_it_is_too_large_is_refused():
    with pytest.raises(wire.FrameError):
        wire.sizes(b"\x7f\xff\xff\xff\x7f\xff\xff\xff")

"""The only thing that passes between grader and worker: frames of plain data.

A frame is a JSON text and, behind it, the raw numbers of its arrays; no pickle, no objects. What comes
in is checked against the frame's own sizes before anything is made of it, so that garbage is just that.
"""

import json
import struct

import numpy as np

from ...legged.noise import Noise
from ...legged.robot import Sighting
from ...team.hall import TeamNoise
from ...world import Landmark, Map

LIMIT = 16_000_000  # bytes of one frame
TYPES = ("<f8", "<i8", "|b1")
_HEAD = struct.Struct(">II")


class FrameError(Exception):
    """A frame that is none."""


def pack(message):
    """The bytes of a frame; raises FrameError if `message` holds what is no data."""
    blobs = []
    text = json.dumps(_plain(message, blobs)).encode()
    raw = b"".join(blobs)
    if len(text) + len(raw) > LIMIT:
        raise FrameError(f"more than {LIMIT // 10**6} MB came back")
    return _HEAD.pack(len(text), len(raw)) + text + raw


def sizes(head):
    """How many bytes follow a frame's first eight."""
    text, raw = _HEAD.unpack(head)
    if text + raw > LIMIT:
        raise FrameError(f"more than {LIMIT // 10**6} MB came back")
    return text, raw


def unpack(text, raw):
    """The message of a frame's two parts."""
    try:
        stored = json.loads(text)
    except (ValueError, RecursionError):
        raise FrameError("no JSON came back") from None
    used = [0]
    message = _rebuilt(stored, raw, used, 0)
    if used[0] != len(raw):
        raise FrameError("numbers are left over")
    return message


def write(stream, message):
    stream.write(pack(message))
    stream.flush()


def read(stream):
    """The next message of a blocking stream; None at its end."""
    head = stream.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    text, raw = sizes(head)
    return unpack(stream.read(text), stream.read(raw))


def _plain(value, blobs):
    if value is None or isinstance(value, bool | int | float | str):
        return value if not isinstance(value, np.generic) else value.item()
    if isinstance(value, np.generic):
        return _plain(value.item(), blobs)
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "U":  # names of landmarks
            return value.tolist()
        kind = {"f": "<f8", "i": "<i8", "u": "<i8", "b": "|b1"}.get(value.dtype.kind)
        if kind is None:
            raise FrameError(f"an array of {value.dtype} is no array of numbers")
        blobs.append(np.ascontiguousarray(value, dtype=kind).tobytes())
        return {"array": [kind, list(value.shape)]}
    if isinstance(value, Noise):
        return {"noise": [_plain(vars(value), blobs)]}
    if isinstance(value, TeamNoise):
        return {"team_noise": [_plain(vars(value), blobs)]}
    if isinstance(value, Sighting):
        return {
            "sighting": [_plain(item, blobs) for item in (value.id, np.asarray(value.p, dtype=float), value.complete)]
        }
    if isinstance(value, Landmark):
        return {"landmark": [_plain(value.id, blobs), _plain(np.asarray(value.p, dtype=float), blobs)]}
    if isinstance(value, Map):
        return {"map": [_plain(landmark, blobs) for landmark in value]}
    if isinstance(value, tuple):
        return {"tuple": [_plain(item, blobs) for item in value]}
    if isinstance(value, list):
        return [_plain(item, blobs) for item in value]
    if isinstance(value, dict):
        return {"dict": {str(name): _plain(item, blobs) for name, item in value.items()}}
    raise FrameError(f"an object of type {type(value).__name__} is no data")


def _rebuilt(stored, raw, used, depth):
    if depth > 20:
        raise FrameError("it is nested too deeply")
    if isinstance(stored, list):
        return [_rebuilt(item, raw, used, depth + 1) for item in stored]
    if isinstance(stored, str):
        return stored.encode("utf-8", "replace").decode("utf-8")  # half an emoji is no text
    if not isinstance(stored, dict):
        return stored
    if len(stored) != 1:
        raise FrameError("an unknown kind of data came back")
    ((kind, content),) = stored.items()
    if kind == "dict" and isinstance(content, dict):
        return {name: _rebuilt(item, raw, used, depth + 1) for name, item in content.items()}
    if not isinstance(content, list):
        raise FrameError("an unknown kind of data came back")
    if kind == "array":
        return _array(content, raw, used)
    items = [_rebuilt(item, raw, used, depth + 1) for item in content]
    if kind == "tuple":
        return tuple(items)
    if kind == "landmark" and len(items) == 2 and np.shape(items[1]) == (2,):
        return Landmark._of(items[1], items[0])
    if kind == "sighting" and len(items) == 3 and np.shape(items[1]) == (2,) and isinstance(items[2], bool):
        return _sighting(items[1], items[0], items[2])
    if kind in ("noise", "team_noise") and len(items) == 1 and isinstance(items[0], dict):
        return _noise(items[0], Noise if kind == "noise" else TeamNoise)
    if kind == "map" and all(isinstance(item, Landmark) for item in items):
        return Map(items)
    raise FrameError("an unknown kind of data came back")


def _sighting(p, name, complete):
    try:
        return Sighting(p, name, complete)
    except ValueError:
        raise FrameError("a sighting without numbers came back") from None


def _noise(fields, of=Noise):
    try:
        return of(**fields)
    except (TypeError, ValueError):
        raise FrameError("a noise that cannot be came back") from None


def _array(content, raw, used):
    kind, shape = content if len(content) == 2 else (None, None)
    sound = (
        kind in TYPES
        and isinstance(shape, list)
        and len(shape) <= 8
        and all(type(n) is int and 0 <= n <= LIMIT for n in shape)
    )
    if not sound:
        raise FrameError("an array of an unknown kind came back")
    count = 1
    for n in shape:
        count *= n
    end = used[0] + count * np.dtype(kind).itemsize
    if end > len(raw):
        raise FrameError("an array came back without its numbers")
    array = np.frombuffer(raw[used[0] : end], dtype=kind).reshape(shape).copy()
    used[0] = end
    return array

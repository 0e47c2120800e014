"""The only thing that passes between grader and worker: frames of plain data.

A frame is a JSON text and, behind it, the raw numbers of its arrays; no pickle. A request may also hold objects of
the kinds in `labkit.checks.kinds`, made anew in the worker. An answer may not, so that nothing is made, and nothing
imported, at a worker's word; it is checked against the frame's own sizes before its arrays are filled.
"""

import json
import struct
from typing import Any, BinaryIO

import numpy as np

from ...checks import kinds

LIMIT = 16_000_000  # bytes of a request
# Of an answer: bytes of both parts, and lists and tables in it. The longest of a right notebook's have 0.01 and 0.4 MB
# and some hundred lists; this much is read in 50 ms and 16 MB, whatever it is.
TEXT, RAW, LISTS = 2**16, 2**21, 8000
TYPES = ("<f8", "<i8", "|b1")
DEEPEST = 20  # lists in lists
_HEAD = struct.Struct(">II")


class FrameError(Exception):
    """A frame that is none."""


def pack(message: Any, objects: bool = False) -> bytes:
    """A frame. Raises FrameError if `message` holds what is no data; with `objects`, those of a kind may be in it."""
    blobs: list[bytes] = []
    text = json.dumps(_plain(message, blobs, objects), ensure_ascii=False).encode("utf-8", "replace")
    raw = b"".join(blobs)
    _fit(len(text), len(raw), objects)
    return _HEAD.pack(len(text), len(raw)) + text + raw


def sizes(head: bytes, objects: bool = False) -> tuple[int, int]:
    """How many bytes of text and of raw numbers follow a frame's first eight. Raises FrameError for too many."""
    text, raw = _HEAD.unpack(head)
    _fit(text, raw, objects)
    return text, raw


def _fit(text, raw, objects):
    if text + raw > LIMIT or not objects and (text > TEXT or raw > RAW):
        raise FrameError(f"{(text + raw) / 1e6:.1f} MB came back, more than any answer needs")


def unpack(text: bytes, raw: bytes, objects: bool = False) -> Any:
    """The message of a frame's two parts. Raises FrameError, also for an object where none is expected."""
    if not objects and text.count(b"[") + text.count(b"{") > LISTS:
        raise FrameError("more lists came back than any answer needs")
    try:
        stored = json.loads(text.decode("utf-8"))
    except (ValueError, RecursionError):
        raise FrameError("no JSON came back") from None
    reader = _Reader(raw, objects)
    message = reader.value(stored)
    if reader.used != len(raw):
        raise FrameError("numbers are left over")
    return message


def read(stream: BinaryIO, objects: bool = False) -> Any:
    """The next message of a blocking stream; None at its end."""
    head = stream.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    text, raw = sizes(head, objects)
    return unpack(stream.read(text), stream.read(raw), objects)


def _plain(value, blobs, objects):
    if value is None or isinstance(value, bool | int | float | str):
        return value if not isinstance(value, np.generic) else value.item()
    if isinstance(value, np.generic):
        return _plain(value.item(), blobs, objects)
    if isinstance(value, np.ndarray):
        return _plain_array(value, blobs)
    if objects and (found := kinds.of(type(value))):
        name, kind = found
        return {"kind": [name, _plain(kind.send(value), blobs, objects)]}
    if isinstance(value, tuple):
        return {"tuple": [_plain(item, blobs, objects) for item in value]}
    if isinstance(value, list):
        return [_plain(item, blobs, objects) for item in value]
    if isinstance(value, dict):
        return {"dict": {str(name): _plain(item, blobs, objects) for name, item in value.items()}}
    raise FrameError(f"an object of type {type(value).__name__} is no data")


def _plain_array(array, blobs):
    if array.dtype.kind == "U":  # names of landmarks
        return array.tolist()
    dtype = {"f": "<f8", "i": "<i8", "u": "<i8", "b": "|b1"}.get(array.dtype.kind)
    if dtype is None:
        raise FrameError(f"an array of {array.dtype} is no array of numbers")
    blobs.append(np.ascontiguousarray(array, dtype=dtype).tobytes())
    return {"array": [dtype, list(array.shape)]}


class _Reader:
    """Makes the message of a frame again. raw: the numbers of its arrays, of which `used` bytes are read."""

    def __init__(self, raw, objects):
        self.raw, self.objects, self.used = raw, objects, 0

    def value(self, stored, depth=0):
        if depth > DEEPEST:
            raise FrameError("it is nested too deeply")
        if isinstance(stored, list):
            return [self.value(item, depth + 1) for item in stored]
        if isinstance(stored, str):  # half an emoji is no text
            return stored if stored.isascii() else stored.encode("utf-8", "replace").decode("utf-8")
        if not isinstance(stored, dict):
            return stored
        form, content = next(iter(stored.items())) if len(stored) == 1 else ("", None)
        if form == "dict" and isinstance(content, dict):
            return {self.value(name): self.value(item, depth + 1) for name, item in content.items()}
        if form == "array" and isinstance(content, list) and len(content) == 2:
            return self.array(*content)
        if form == "tuple" and isinstance(content, list):
            return tuple(self.value(content, depth))
        if form == "kind" and self.objects:
            return self.object(content, depth)
        raise FrameError("an unknown kind of data came back")

    def array(self, dtype, shape):
        sound = (
            dtype in TYPES
            and isinstance(shape, list)
            and len(shape) <= 8
            and all(type(n) is int and 0 <= n <= LIMIT for n in shape)
        )
        if not sound:
            raise FrameError("an array of an unknown kind came back")
        count = 1
        for n in shape:
            count *= n
        end = self.used + count * np.dtype(dtype).itemsize
        if end > len(self.raw):
            raise FrameError("an array came back without its numbers")
        array = np.frombuffer(self.raw[self.used : end], dtype=dtype).reshape(shape).copy()
        self.used = end
        return array

    def object(self, content, depth):
        try:
            name, data = self.value(content, depth)
            return kinds.find(name).receive(data)
        except Exception:  # a kind may raise anything for what it cannot be made of
            raise FrameError("an object came that cannot be") from None

"""Whatever a worker answers, the grader reads it soon and in little memory, never raises, and lets nothing wrong pass.

LABKIT_FUZZ=1000000 tries as many answers of each kind; CI tries more than who tests at home.
"""

import json
import os
import time
import tracemalloc

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from labkit.checks import CheckError, decide, stored
from labkit.checks.feedback import FilterError
from labkit.instructor.exam.traces import answer_form, traces
from labkit.instructor.sandbox import wire
from labkit.instructor.sandbox.channel import StudentCodeError, understood
from labkit.instructor.sandbox.forms import fields, result, several
from labkit.instructor.sandbox.proxy import HISTORY, VALUE, load_form

from helpers.reference import IN_CI

pytestmark = pytest.mark.slow

TRIES = int(os.environ.get("LABKIT_FUZZ", "10000" if IN_CI else "3000")) // 2  # two tests share them
fuzzed = settings(
    max_examples=TRIES, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)
DATA = stored("cartesian-kf")


def wrong_traces():
    """What a filter that stays at zero is seen to do."""
    found = {}
    for s in DATA["scenarios"]:
        steps = [[np.zeros(np.shape(value)) for value in step] for step in s["right"][0][0]]
        found[s["id"]] = {"steps": steps, "stop": None, "printed": ""}
    return {"traces": found}


STOP = [[1, "ValueError", [3], ""], "no", "line"]
KINDS = {  # a form, and an answer that has it
    "traces": (answer_form(DATA), wrong_traces()),
    "told": (answer_form(DATA), {"told": "no", "lines": ["a", "b"], "stopped": False}),
    "history": (HISTORY, {name: np.zeros((3, 2)) for name in ("x", "P", "x_prior", "P_prior")}),
    "value": (VALUE, {"value": [1.5, np.eye(2), "text", (1, 2), None]}),
    "values": (fields(values=several(result, 2, 2)), {"values": [1.5, np.eye(2)]}),
    "load": (
        load_form(["KF", "h"]),
        {"kinds": {"KF": "type"}, "problems": [{"place": "cell 3", "lines": ["x"]}], "stopped": False},
    ),
    "raised": (VALUE, {"raised": "ValueError", "place": ["cell 3", 2], "text": "no", "stopped": False}),
    "odd": (VALUE, {"odd": "an object"}),
}


def parts(answer):
    """The text of an answer's frame as JSON has it, and its raw numbers."""
    frame = wire.pack(answer)
    size, _ = wire.sizes(frame[:8])
    return json.loads(frame[8 : 8 + size]), frame[8 + size :]


def read(text, raw, kind):
    """Read an answer as the grader does; True if it was taken for one of this kind. What is wrong does not pass."""
    form, _ = KINDS[kind]
    try:
        answer = understood(text, raw, form)
    except (wire.FrameError, StudentCodeError):
        return False
    if kind in ("traces", "told"):
        with pytest.raises(CheckError):
            decide(DATA, traces(DATA, answer))
    return True


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20) | st.just(10**400),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(["dict", "array", "tuple", "kind", "steps", "stop", "odd"]), inner, max_size=3
        )
    ),
    max_leaves=12,
)


@pytest.mark.parametrize("kind", KINDS)
def test_what_has_its_form_is_read(kind):
    text, raw = parts(KINDS[kind][1])
    assert read(json.dumps(text).encode(), raw, kind) == (kind not in ("raised", "odd"))


@fuzzed
@given(
    st.sampled_from(sorted(KINDS)),
    st.binary(max_size=200) | JSON.map(json.dumps).map(str.encode),
    st.binary(max_size=64),
)
def test_arbitrary_answers_do_no_harm(kind, text, raw):
    read(text, raw, kind)


PREPARED = {kind: parts(answer) for kind, (_, answer) in KINDS.items()}


def places(stored, path=()):
    """The paths of all values in some JSON."""
    yield path
    items = stored.items() if isinstance(stored, dict) else enumerate(stored) if isinstance(stored, list) else ()
    for key, item in items:
        yield from places(item, (*path, key))


PLACES = {kind: [path for path in places(text) if path] for kind, (text, _) in PREPARED.items()}


@fuzzed
@given(st.sampled_from(sorted(KINDS)), st.data())
def test_nearly_right_answers_do_no_harm(kind, data):
    text, raw = PREPARED[kind]
    text = json.loads(json.dumps(text))
    for _ in range(data.draw(st.integers(1, 3))):
        *path, key = data.draw(st.sampled_from(PLACES[kind]))
        change = data.draw(st.sampled_from(["drop", "twice", "other", "nest", "text"]))
        try:
            parent = text
            for step in path:
                parent = parent[step]
            value = parent[key]
            if change == "drop":
                del parent[key]
            elif change == "twice" and isinstance(parent, list):
                parent.insert(key, value)
            else:
                parent[key] = {"nest": [value], "text": str(value) * 3}.get(change) or data.draw(JSON)
        except (KeyError, IndexError, TypeError):  # an earlier change has taken the place away
            continue
    read(
        json.dumps(text).encode(), raw[: data.draw(st.integers(0, len(raw)))] if data.draw(st.booleans()) else raw, kind
    )


def full(piece, before=b"[", after=b"]"):
    """A text of as many bytes as an answer may have."""
    return before + b",".join([piece] * ((wire.TEXT - len(before + after)) // (len(piece) + 1))) + after


WORST = {
    "empty lists": (full(b"[]"), b""),
    "nested lists": (b"[" * (wire.TEXT // 2) + b"]" * (wire.TEXT // 2), b""),
    "lists as deep as they may be": (full(b"[" * 15 + b"]" * 15), b""),
    "tables": (full(b'{"dict":{}}'), b""),
    "a table": (full(b'"\\u00e9\\u00ea":[]', b'{"dict":{', b"}}"), b""),
    "numbers": (full(b"1"), b""),
    "long numbers": (full(b"9" * 4000), b""),
    "a longer number": (b"9" * wire.TEXT, b""),
    "fractions": (full(b"1e9"), b""),
    "texts": (full(b'"x"'), b""),
    "one text": (b'"' + b"\\ud83d" * (wire.TEXT // 6) + b'"', b""),
    "empty arrays": (full(b'{"array":["<f8",[0]]}'), b""),
    "arrays of one number": (full(b'{"array":["|b1",[1]]}'), b"1" * 5461),
    "one large array": (b'{"array":["<f8",[%d]]}' % (wire.RAW // 8), b"\0" * wire.RAW),
    "an array of many sides": (full(b'{"array":["<f8",[1,1,1,1,1,1,1,0]]}'), b""),
    "what is not said": (b"", b"\0" * wire.RAW),
}


@pytest.mark.parametrize("what", WORST)
def test_the_worst_answer_costs_little(what):
    text, raw = WORST[what]
    assert len(text) <= wire.TEXT and len(raw) <= wire.RAW
    text = b'{"dict":{"value":' + text + b"}}"
    took = []
    for _ in range(5):
        start = time.process_time()
        read(text, raw, "value")
        took.append(time.process_time() - start)
    tracemalloc.start()
    read(text, raw, "value")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert min(took) < 0.1 and peak + len(text) + len(raw) < 16e6, (min(took), peak)


@fuzzed
@given(st.binary(min_size=8, max_size=8))
def test_the_size_of_a_frame_is_known_before_it_is_read(head):
    try:
        text, raw = wire.sizes(head)
    except wire.FrameError:
        return
    assert text <= wire.TEXT and raw <= wire.RAW


def test_failing_answers_are_told_as_the_student_s():
    with pytest.raises(FilterError, match="no number and no array: an object"):
        understood(b'{"dict":{"odd":"an object"}}', b"", VALUE)

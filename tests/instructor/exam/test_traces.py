"""What a worker answers is taken only if it is what was asked for."""

import ast
import inspect

import numpy as np
import pytest

from labkit.checks import CheckError, stored, trace
from labkit.checks.probing import expanded
from labkit.instructor.exam.traces import INPUTS, answer_form, inputs, probes, traces
from labkit.instructor.sandbox.wire import FrameError

DATA = stored("cartesian-kf")
FORM = answer_form(DATA)


def answer():
    """What a right filter's worker would say."""
    found = {}
    for s in DATA["scenarios"]:
        steps = [[np.array(value, dtype=float) for value in step] for step in s["right"][0][0]]
        found[s["id"]] = {"steps": steps, "stop": None, "printed": ""}
    return found


def test_what_was_asked_for_gets_through():
    assert traces(DATA, FORM({"traces": answer()})).keys() == {s["id"] for s in DATA["scenarios"]}
    for sent in (inputs(DATA), probes(DATA)):
        assert "right" not in str(sent) and "mistakes" not in sent and "known" not in str(sent)


def test_a_worker_knows_all_that_running_a_scenario_takes():
    """Else what passes in the notebook fails when it is graded."""
    tree = ast.parse(inspect.getsource(trace))
    got = (n for n in ast.walk(tree) if isinstance(n, ast.Call) and ast.unparse(n.func) == "scenario.get")
    taken = (n for n in ast.walk(tree) if isinstance(n, ast.Subscript) and ast.unparse(n.value) == "scenario")
    read = {n.args[0].value for n in got} | {n.slice.value for n in taken}
    assert read == {*trace.READ, "begin"} and set(trace.READ) <= set(INPUTS)


def test_probes_are_asked_for_apart():
    asked = expanded(DATA["probing"]["probes"])
    zeros = {s["id"]: [[np.zeros(2), *[np.eye(2)] * (len(s["look"]) - 1)] for _ in s["at"]] for s in asked}
    found = {id: {"steps": steps, "stop": None, "printed": ""} for id, steps in zeros.items()}
    form = answer_form(probes(DATA))
    assert traces(DATA, form({"traces": found})).keys() == {s["id"] for s in asked}
    with pytest.raises(FrameError):
        form({"traces": answer()})


STOP = [[1, "ValueError", [], "no"], "no", "line"]
ODD = {
    "no steps": lambda trace: trace.update(steps=[]),
    "empty steps": lambda trace: trace.update(steps=[[] for _ in trace["steps"]]),
    "short steps": lambda trace: trace.update(steps=[step[:1] for step in trace["steps"]]),
    "long steps": lambda trace: trace.update(steps=[[*step, step[0]] for step in trace["steps"]]),
    "too many steps": lambda trace: trace.update(steps=trace["steps"] * 2),
    "too many steps before a stop": lambda trace: trace.update(steps=trace["steps"] * 2, stop=STOP),
    "a table": lambda trace: trace.update(steps={"0": 1}),
    "words": lambda trace: trace.update(steps="all right"),
    "ragged": lambda trace: trace.update(steps=[[[[1], [1, 2]]] * 4 for _ in trace["steps"]]),
    "no stop": lambda trace: trace.pop("stop"),
    "an odd stop": lambda trace: trace.update(stop=["x"]),
    "an early end": lambda trace: trace.update(steps=trace["steps"][:-1]),
    "whole numbers": lambda trace: trace.update(steps=[[value.astype(int) for value in s] for s in trace["steps"]]),
    "lists for arrays": lambda trace: trace.update(steps=[[value.tolist() for value in s] for s in trace["steps"]]),
    "a field more": lambda trace: trace.update(points=5),
    "printed numbers": lambda trace: trace.update(printed=3),
}


@pytest.mark.parametrize("what", ODD)
def test_what_was_not_asked_for_does_not(what):
    found = answer()
    ODD[what](found[DATA["scenarios"][1]["id"]])
    with pytest.raises(FrameError):
        FORM({"traces": found})


@pytest.mark.parametrize(
    "said", [{}, 3, None, "traces", ["traces"], {"traces": None}, {"traces": 3}, {"traces": [1]}, {"traces": {}}]
)
def test_no_traces_are_no_answer(said):
    with pytest.raises(FrameError):
        FORM(said)


def test_texts_are_cut_here():
    with pytest.raises(CheckError) as caught:
        traces(DATA, FORM({"told": "x" * 10**5, "lines": ["y" * 10**5] * 6, "stopped": False}))
    assert len(str(caught.value)) < 5000

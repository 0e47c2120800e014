"""A new lab with inputs of a kind of its own: checked, told, varied and graded, without a line in the kit."""

import importlib
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import labkit
from labkit import Landmark, Map
from labkit.checks import CheckError, judge
from labkit.instructor.exam.exam import Exam
from labkit.instructor.exam.variants import variant
from labkit.instructor.sandbox.proxy import Notebook, Student

from helpers.inside import Inside

CURRENT = """
from dataclasses import dataclass
from labkit import Log

@dataclass
class Current:
    "A stream that carries a boat away."
    speed: float
    towards: tuple

@dataclass(frozen=True)
class BoatLog(Log):
    "A Log that knows how deep the water was."
    depth: float = 1.0
"""
KINDS = """
from labkit.checks.kinds import Kind, run
from . import BoatLog, Current

def watch(current):
    speed = current.speed
    return lambda: "" if current.speed == speed else "changes the current that it was given"

KINDS = {
    "current": Kind(
        lambda stored: Current(stored[0], tuple(stored[1:])),
        tell=lambda stored: f"Current({stored[0]:g} m/s)",
        noise=lambda stored, method: f"a current of {stored[0]:g} m/s" if method == "predict" else "",
        watch=watch,
        cls=Current,
        send=lambda current: [current.speed, current.towards],
        receive=lambda data: Current(*data),
    ),
    "log": run(BoatLog, "depth"),
}
"""
FORCE = {"toy.current": [2.0, 0.6, 0.8]}
ANSWER = "def drift(current, t):\n    return current.speed * t * np.array(current.towards)\n"
BOAT = """
class Boat:
    def __init__(self, x0, current):
        self.x, self.current = np.array(x0), current

    def predict(self, t):
        self.x = self.x + self.current.speed * t * np.array(self.current.towards)
"""
DRIFTER = """
class Drifter:
    def __init__(self, x0, P0, m, current):
        self.xk_k, self.Pk_k, self.current = x0, P0, current

    def predict(self, u):
        self.xk_k = self.xk_k + u + self.current.speed * np.array(self.current.towards)

    def update(self, y):
        self.Pk_k = self.Pk_k / (1 + len(y))
"""


@pytest.fixture(scope="module")
def toy(tmp_path_factory):
    """The package of the lab, `labkit.toy`, in a folder of its own."""
    folder = tmp_path_factory.mktemp("kit")
    for name, text in {"__init__": CURRENT, "kinds": KINDS}.items():
        (folder / "toy").mkdir(exist_ok=True)
        (folder / "toy" / f"{name}.py").write_text(text, encoding="utf-8")
    labkit.__path__.append(str(folder))
    yield importlib.import_module("labkit.toy")
    labkit.__path__.remove(str(folder))
    for name in [name for name in sys.modules if name.startswith("labkit.toy")]:
        del sys.modules[name]


def answer(source, name):
    names = {"np": np}
    exec(compile(source, "cell 'answer'", "exec"), names)
    return names[name]


def function_check():
    call = {"id": "one", "title": "ten seconds", "look": [""], "calls": [["drift", FORCE, 10.0]]}
    scenario = {**call, "right": [[[[[12.0, 16.0]]], None]]}
    return {"name": "toy-drift", "subject": "drift", "kind": "function", "scenarios": [scenario], "mistakes": []}


def filter_check():
    make = [{"x0": [1.0, 0.0], "current": FORCE}, {}]
    run = {"id": "one", "title": "ten seconds", "look": ["x"], "make": make, "calls": [["predict", 10.0]]}
    scenario = {**run, "right": [[[[[1.0, 0.0]], [[13.0, 16.0]]], None]]}
    return {"name": "toy-boat", "subject": "Boat", "kind": "filter", "scenarios": [scenario], "mistakes": []}


def told(data, subject):
    with pytest.raises(CheckError) as caught:
        judge(data, subject)
    return " ".join(str(caught.value).split())


def test_its_inputs_are_read_and_told(toy):
    judge(function_check(), answer(ANSWER, "drift"))
    judge(filter_check(), answer(BOAT, "Boat"))
    assert "call drift(Current(2 m/s), 10.0)" in told(function_check(), lambda current, t: 2 * t * np.ones(2))
    wrong = told(filter_check(), answer(BOAT.replace("self.x +", "2 * self.x +"), "Boat"))
    assert "before x = [1, 0] a current of 2 m/s" in wrong and "call predict(10.0)" in wrong


def test_its_inputs_are_watched(toy):
    greedy = answer(ANSWER.replace("return", "current.speed *= 2; return"), "drift")
    assert "Your function changes the current that it was given" in told(function_check(), greedy)


def test_its_inputs_are_varied(toy):
    (scenario,) = function_check()["scenarios"]
    other = variant(scenario, np.random.default_rng(1))
    (_, current, t), (_, again, _) = other["calls"][0], variant(scenario, np.random.default_rng(1))["calls"][0]
    assert current == again and list(current) == ["toy.current"] and "right" not in other
    assert 0.02 <= abs(current["toy.current"][0] / 2.0 - 1) <= 0.06 and t != 10.0


@pytest.fixture
def student(toy):
    cells = [
        {"number": 1, "id": "setup", "role": "setup", "code": True, "source": "import numpy as np"},
        {"number": 2, "id": "answer", "role": "answer", "code": True, "source": ANSWER + BOAT + DRIFTER},
    ]
    return Student(None, Notebook(cells), ["drift", "Boat", "Drifter"], spare=Inside())


def test_its_answers_are_graded_in_a_worker(student, toy, monkeypatch):
    exam = Exam("01_cartesian_ekf")
    data = function_check()
    monkeypatch.setitem(exam._accepted, "drift", [answer(ANSWER, "drift")])
    monkeypatch.setattr("labkit.checks.stored", lambda name: data)
    exam.definitions = [SimpleNamespace(name="toy-drift", subject="drift", right=[])]
    drift = student.find("drift")
    exam.check("toy-drift", drift)
    exam.same(drift, [(toy.Current(2.0, (0.6, 0.8)), t) for t in (1.0, 2.0)])

    boat = student.find("Boat")((1.0, 0.0), toy.Current(2.0, (0.6, 0.8)))
    boat.predict(10.0)
    np.testing.assert_allclose(boat.x, [13.0, 16.0])


def test_its_logs_go_to_a_worker_whole_but_for_the_truth(student, toy, monkeypatch):
    exam = Exam("01_cartesian_ekf")
    monkeypatch.setitem(exam._accepted, "Drifter", [answer(DRIFTER, "Drifter")])
    seen = np.array([0, 2]), np.array([0, 0]), np.ones((2, 2))
    truth = np.zeros((4, 2))
    log = toy.BoatLog(np.arange(4.0), np.ones((3, 2)), *seen, Map([Landmark((1, 2), 0)]), truth=truth, depth=3.0)
    told = {"x0": (0.5, 1.0), "P0": np.eye(2), "noise": toy.Current(2.0, (0.6, 0.8))}
    worker, received = student.channel.inner, []
    whole = worker.do_replay
    monkeypatch.setattr(worker, "do_replay", lambda **sent: received.append(sent["record"]) or whole(**sent))
    mine = exam.same_run(student.find("Drifter"), log, **told)
    np.testing.assert_allclose(mine.x[-1], (0.5 + 3 * 2.2, 1.0 + 3 * 2.6))
    (came,) = received
    assert type(came) is toy.BoatLog and came.depth == 3.0 and came.truth is None
    exam._accepted["Drifter"] = [answer(DRIFTER.replace("+ u +", "+ 2 * u +"), "Drifter")]
    with pytest.raises(CheckError, match=r"on this run differs from the right one\.$"):
        exam.same_run(student.find("Drifter"), log, **told)

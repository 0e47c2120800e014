"""What ran into a limit of time is tried once more, alone, and costs only its own points."""

import json

import pytest

from labkit.instructor.exam import paper, pool
from labkit.instructor.exam.jobs import Job, Room, batches, keep
from labkit.instructor.intake.submission import Work

from helpers.reference import LABS


class Runner:
    """In the place of a process; says = {(job id, check): marks that come one after the other}."""

    def __init__(self, says, order):
        self.says, self.order = says, order

    def grade(self, room, jobs, runtime):
        for job in jobs:
            for cell in room.paper.cells:
                if cell.id not in job.done and cell.points is not None:
                    self.order.append((job.id, cell.id))
                    marks = self.says.get((job.id, cell.id), [{"status": "passed"}])
                    mark = marks.pop(0) if len(marks) > 1 else marks[0]
                    if mark == "dies":
                        raise OSError("gone")
                    yield "mark", job.id, {"check": cell.id, **mark}
            yield "done", job.id, "figure"

    def end(self):
        pass


@pytest.fixture
def room():
    return Room(paper.read(LABS[0]), 1, {}, {"call": 1, "total": 2})


def graded(room, says, monkeypatch):
    """({(job, check): status}, {job: end}, the order in which checks ran) of two jobs."""
    order: list = []
    local = pool.Local.__new__(pool.Local)
    local._workers, local._stopped, local._scratch, local.runtime = 1, False, None, ""
    local._runners = [Runner(says, order)]
    monkeypatch.setattr(pool, "Runner", lambda scratch: Runner(says, order))
    marks, ends = {}, {}
    for kind, id, item in local.grade(room, [Job(1, "a", ""), Job(2, "b", "")]):
        if kind == "mark":
            assert (id, item["check"]) not in marks
            marks[id, item["check"]] = item["status"]
        else:
            ends[id] = kind, item
    return marks, ends, order


BROKEN = {"status": "error", "again": True}
SLOW = {"status": "failed", "again": True}


def test_what_was_stopped_is_tried_once_more_when_all_else_is_done(room, monkeypatch):
    first, second = "check-kf", "grade-many"
    says = {(1, first): [SLOW, {"status": "passed"}], (1, second): [SLOW, {"status": "failed"}]}
    marks, ends, order = graded(room, says, monkeypatch)
    assert marks[1, first] == "passed" and marks[1, second] == "failed"
    assert {status for key, status in marks.items() if key != (1, second)} == {"passed"}
    assert order[-2:] == [(1, first), (1, second)] and ends == {1: ("done", "figure"), 2: ("done", "figure")}


def test_what_is_stopped_again_costs_only_its_own_points_and_little_time(room, monkeypatch):
    says = {(1, check): [SLOW] for check in ("check-kf", "grade-many", "grade-honest")}
    marks, _, order = graded(room, says, monkeypatch)
    assert {key for key, status in marks.items() if status == "failed"} == says.keys()
    checks = sum(cell.points is not None for cell in room.paper.cells)
    assert len(order) == 2 * checks + 1  # one of the three was enough to see


def test_a_process_that_ends_at_the_second_try_leaves_the_first_marks(room, monkeypatch):
    marks, ends, _ = graded(room, {(1, "check-kf"): [SLOW, "dies"]}, monkeypatch)
    assert marks[1, "check-kf"] == "failed" and ends[1] == ("done", "figure")


def test_what_could_not_be_graded_is_tried_again_and_then_in_a_process_of_its_own(room, monkeypatch):
    says = {
        (1, "check-kf"): [BROKEN, {"status": "passed"}],
        (2, "check-kf"): [BROKEN, BROKEN, {"status": "passed"}],
        (2, "grade-many"): [BROKEN],
    }
    marks, ends, order = graded(room, says, monkeypatch)
    assert {key for key, status in marks.items() if status != "passed"} == {(2, "grade-many")}
    assert marks[2, "grade-many"] == "error" and ends[2] == ("done", "figure")
    assert order.count((2, "grade-many")) == 3 and order.count((1, "check-kf")) == 2


def test_each_process_gets_one_batch_of_a_usual_class():
    jobs = [Job(n, "", "") for n in range(60)]
    assert [len(batch) for batch in batches(jobs, 2)] == [30, 30] and [len(b) for b in batches(jobs, 1)] == [40, 20]


def test_what_is_run_stays_on_the_disk_and_travels_to_other_machines(tmp_path):
    job = Job(1, "Ada", keep(tmp_path / "1.json", Work(cells=[{"source": "x = 1"}], files={"help.py": b"y = 2"})))
    assert len(str(job)) < 500
    packed = job.packed()
    assert json.loads(packed.work) == json.loads((tmp_path / "1.json").read_text()) and packed.packed() == packed

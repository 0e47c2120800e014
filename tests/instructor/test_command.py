"""A whole class from Moodle's zip to its worksheet: killed, resumed, marked by hand, graded anew, on a cluster."""

import atexit
import csv
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from labkit.instructor.exam import cluster
from labkit.instructor.records import CommandError

from helpers.classroom import LAB, a_class, as_file, code, filled, moodle_zip, worksheet
from helpers.reference import ROOT

pytest.importorskip("nbval")
pytestmark = pytest.mark.slow

RIGHT = 16  # points without the written answers


def command(*arguments):
    """With one process, unless told otherwise: each more of them loads all that grading needs."""
    return [sys.executable, "-m", "labkit", "grade", "--jobs", "1", *map(str, arguments), "--lab", LAB]


# All that these graders start is told from others' by this name, in its command line or its variables.
TEMPORARY = Path(tempfile.mkdtemp(prefix="labkit-class-"))
TEMPORARY.chmod(0o755)
atexit.register(shutil.rmtree, TEMPORARY, ignore_errors=True)
ENV = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1", "TMPDIR": str(TEMPORARY)}


def grade(*arguments, status=0):
    done = subprocess.run(command(*arguments), capture_output=True, text=True, encoding="utf-8", env=ENV)
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout


def rows(out, name="grades.csv"):
    with open(out / name, encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file))


def points(out):
    """{student: points of the checks}"""
    total = {}
    for row in rows(out):
        total[row["student"]] = total.get(row["student"], 0) + float(row["points"] or 0)
    return total


@pytest.fixture(scope="module")
def class_of_20(tmp_path_factory):
    """(pupils, folder): class.zip, worksheet.csv and the results of an undisturbed run in `out`."""
    folder = tmp_path_factory.mktemp("a class of ñ")
    pupils = a_class(20)
    moodle_zip(folder / "class.zip", pupils)
    worksheet(folder / "worksheet.csv", pupils)
    grade(*options(folder), "--out", folder / "out")
    return pupils, folder


def options(folder):
    """One seed for all runs, so that their marks can be compared to the last digit."""
    return (
        folder / "class.zip",
        "--moodle",
        folder / "worksheet.csv",
        "--partial",
        "--due",
        "2026-11-20T00:00",
        "--seed",
        "7",
        "--call",
        "600",  # none of them hangs, and a slow machine is no reason to lose points
        "--total",
        "3600",
    )


def test_each_kind_of_student_gets_what_they_deserve(class_of_20):
    pupils, folder = class_of_20
    got = points(folder / "out")
    summary = {row["student"]: row for row in rows(folder / "out", "summary.csv")}
    for pupil in pupils:
        if pupil.kind in ("right", "late", "twice"):
            assert got[pupil.name] == RIGHT, pupil
        elif pupil.kind == "half":
            assert got[pupil.name] == 4
        else:
            assert got[pupil.name] < RIGHT, pupil
        assert (summary[pupil.name]["late"] not in ("", "no", "0", "False")) == (pupil.kind == "late")
    twice = next(pupil for pupil in pupils if pupil.kind == "twice")
    assert "2 attempts: the newest counts" in summary[twice.name]["notes"]


def test_the_worksheet_has_exactly_its_columns(class_of_20):
    pupils, folder = class_of_20
    before = (folder / "worksheet.csv").read_text(encoding="utf-8").splitlines()
    after = (folder / "out" / "moodle.csv").read_text(encoding="utf-8").splitlines()
    assert after[0] == before[0] and len(after) == len(before) == 21
    with open(folder / "out" / "moodle.csv", encoding="utf-8", newline="") as file:
        filled_in = {row["Full name"]: row for row in csv.DictReader(file)}
    got = points(folder / "out")
    assert {p.name: float(filled_in[p.name]["Grade"]) for p in pupils} == pytest.approx(got)


def test_killed_twice_it_ends_with_the_same_marks(class_of_20):
    _, folder = class_of_20
    out = folder / "killed"
    for marks in (20, 100):
        process = subprocess.Popen(
            command(*options(folder), "--jobs", "2", "--out", out), env=ENV, stdout=subprocess.DEVNULL
        )
        wait_until(lambda: count(out) >= marks or process.poll() is not None)
        assert process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert not (out / "grades.csv").exists()
    kept = count(out)
    grade(*options(folder), "--jobs", "2", "--out", out)
    assert rows(out) == rows(folder / "out")
    assert (out / "moodle.csv").read_bytes() == (folder / "out" / "moodle.csv").read_bytes()
    with sqlite3.connect(out / "gradebook.db") as book:
        assert book.execute("SELECT count(*), count(DISTINCT student) FROM submission").fetchone() == (20, 20)
        assert book.execute("SELECT count(*) FROM mark").fetchone()[0] == 20 * 11 > kept
    wait_until(lambda: not leftovers())


def wait_until(there):
    """Return once there() is true; ten minutes are no limit but a stop for what never comes."""
    stop = time.monotonic() + 600
    while not there():
        assert time.monotonic() < stop
        time.sleep(0.05)


def count(out):
    try:
        with sqlite3.connect(f"file:{out / 'gradebook.db'}?mode=ro", uri=True) as book:
            return book.execute("SELECT count(*) FROM mark").fetchone()[0]
    except sqlite3.Error:
        return 0


def leftovers():
    """Processes of these graders that are still there."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            line = process.joinpath("cmdline").read_bytes().replace(b"\0", b" ").decode("utf-8", "replace")
            mine = process.joinpath("environ").read_bytes()
        except OSError:
            continue
        if str(TEMPORARY) in line or str(TEMPORARY).encode() in mine:
            found.append(line)
    return found


def test_a_second_run_grades_nobody_and_changes_nothing(class_of_20):
    pupils, folder = class_of_20
    before = (folder / "out" / "grades.csv").read_bytes()
    said = grade(*options(folder), "--out", folder / "out")
    assert "20 of 20 submissions graded" in said and not any(f"{pupil.name}: " in said for pupil in pupils)
    assert (folder / "out" / "grades.csv").read_bytes() == before


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    """A folder with the hand-ins of Ada, who is right, and Bela, who has not written the filter."""
    folder = tmp_path_factory.mktemp("small")
    as_file(folder / "class" / "Ada" / f"{LAB}.ipynb", filled())
    as_file(folder / "class" / "Bela" / f"{LAB}.ipynb", filled(answer_kf=None))
    grade(folder / "class", "--out", folder / "out")
    return folder


@pytest.fixture
def small(graded, tmp_path):
    """A copy of it, and of its results, that can be changed."""
    return shutil.copytree(graded, tmp_path / "small")


def edit(path, student, check, **cells):
    table = rows(path.parent)
    for row in table:
        if (row["student"], row["check"]) == (student, check):
            row.update(cells)
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, table[0])
        writer.writeheader()
        writer.writerows(table)


def mark(out, student, check):
    return next(row for row in rows(out) if (row["student"], row["check"]) == (student, check))


def test_marks_by_hand_are_taken_in_and_stay(small):
    table = small / "out" / "grades.csv"
    assert mark(small / "out", "Ada", "answer-q1")["status"] == "open"
    edit(table, "Ada", "answer-q1", points="1,5", reason="Good reason, no number.")
    edit(table, "Bela", "check-kf", points="1", reason="You explained it well in class.")
    assert "Took 2 marks" in grade(small / "class", "--out", small / "out")
    for again in (True, False):
        ada = mark(small / "out", "Ada", "answer-q1")
        assert (ada["points"], ada["status"], ada["reason"]) == ("1.5", "by hand", "Good reason, no number.")
        assert mark(small / "out", "Bela", "check-kf")["points"] == "1"
        if again:
            grade(small / "class", "--out", small / "out", "--regrade", "all")
    assert "Good reason" in (small / "out" / "feedback" / LAB / "Ada.html").read_text(encoding="utf-8")


def test_a_bad_mark_by_hand_stops_the_run_and_loses_nothing(small):
    table = small / "out" / "grades.csv"
    edit(table, "Ada", "answer-q1", points="7")
    before = table.read_bytes()
    done = subprocess.run(command(small / "class", "--out", small / "out"), capture_output=True, text=True, env=ENV)
    assert done.returncode == 2 and "more than" in done.stderr and "line" in done.stderr
    assert table.read_bytes() == before


def test_the_rules_of_a_course_change_what_counts_and_no_mark(small):
    rules, table = small / "out" / "course.toml", small / "out" / "grades.csv"
    for day, name in enumerate(("Ada", "Bela")):  # all files of one minute would be those of a download
        os.utime(small / "class" / name / f"{LAB}.ipynb", (1.6e9 + 86400 * day,) * 2)
    before = table.read_bytes()
    rules.write_text(f"[labs.{LAB}]\ndue 2020-01-01\n", encoding="utf-8")
    done = subprocess.run(command(small / "class", "--out", small / "out"), capture_output=True, text=True, env=ENV)
    assert done.returncode == 2 and "course.toml, line 2: this is no TOML" in done.stderr
    rules.write_text(f"[labs.{LAB}]\ndue = 2020-01-01\n[late]\npercent_a_day = 9\ncap = 25\n", encoding="utf-8")
    said = grade(small / "class", "--out", small / "out")
    assert "Ada: 16 of" not in said and "4 points less), Bela (" in said and table.read_bytes() == before
    assert {row["student"]: row["points"] for row in rows(small / "out", "summary.csv")} == {"Ada": "12", "Bela": "3"}
    assert "12" == rows(small / "out", "term.csv")[0][LAB]
    page = (small / "out" / "feedback" / LAB / "Ada.html").read_text(encoding="utf-8")
    assert "9 % a day, at most 25 %, 4 of 16 points less." in page
    said = grade(small / "class", "--out", small / "out", "--late", "count")
    assert "Note: --late count goes before what course.toml says of late hand-ins." in said
    assert {row["student"]: row["points"] for row in rows(small / "out", "summary.csv")} == {"Ada": "16", "Bela": "4"}


def test_a_changed_submission_is_graded_anew_and_the_old_mark_kept(small):
    as_file(small / "class" / "Bela" / f"{LAB}.ipynb", filled())
    said = grade(small / "class", "--out", small / "out")
    assert "Bela: 16 of 20" in said and "Ada: " not in said
    assert points(small / "out") == {"Ada": RIGHT, "Bela": RIGHT}
    with sqlite3.connect(small / "out" / "gradebook.db") as book:
        kept = book.execute(
            "SELECT sum(points), current FROM submission JOIN mark ON submission = id WHERE student = 'Bela' "
            "GROUP BY id ORDER BY id"
        ).fetchall()
    assert kept == [(4, 0), (RIGHT, 1)]
    # and back again: the older mark counts once more, without grading
    as_file(small / "class" / "Bela" / f"{LAB}.ipynb", filled(answer_kf=None))
    assert "Bela: " not in grade(small / "class", "--out", small / "out")
    assert points(small / "out")["Bela"] == 4


def test_what_the_grader_could_not_run_is_run_the_next_time(small):
    with sqlite3.connect(small / "out" / "gradebook.db") as book:
        book.execute("UPDATE mark SET status = 'error', points = 0 WHERE chk = 'grade-many'")
    said = grade(small / "class", "--out", small / "out")
    assert "Ada: 16 of 20" in said and points(small / "out") == {"Ada": RIGHT, "Bela": 4}


def test_one_student_is_graded_anew_on_demand(small):
    said = grade(small / "class", "--out", small / "out", "--regrade", "Ada")
    assert "Ada: 16 of 20" in said and "Bela: " not in said


def test_a_student_who_is_not_there_is_not_graded_anew(small):
    before = (small / "out" / "grades.csv").read_bytes()
    more = ["--regrade", "Ad"]
    done = subprocess.run(
        command(small / "class", "--out", small / "out", *more), capture_output=True, text=True, env=ENV
    )
    assert done.returncode == 2 and "no student 'Ad' has handed in this lab. Did you mean 'Ada'?" in done.stderr
    assert (small / "out" / "grades.csv").read_bytes() == before


def test_the_best_of_several_attempts(tmp_path):
    for number, book in enumerate([filled(), filled(answer_kf=None)]):
        path = as_file(tmp_path / "class" / "Ada" / f"{LAB} ({number}).ipynb", book)
        os.utime(path, (1_790_000_000 + number, 1_790_000_000 + number))
    grade(tmp_path / "class", "--out", tmp_path / "out", "--attempts", "best")
    assert points(tmp_path / "out") == {"Ada": RIGHT}


def test_who_cannot_be_graded_is_named_and_the_others_are_graded(small):
    (small / "class" / "Carl").mkdir()
    (small / "class" / "Carl" / f"{LAB}.ipynb").write_text("{", encoding="utf-8")
    (small / "class" / "Dora").mkdir()
    (small / "class" / "Dora" / "essay.pdf").write_bytes(b"%PDF")
    said = grade(small / "class", "--out", small / "out", status=1)
    assert "Could not be graded: Carl" in said and "cut off" in said and "Dora" in said
    assert points(small / "out")["Ada"] == RIGHT
    page = (small / "out" / "feedback" / LAB / "Carl.html").read_text(encoding="utf-8")
    assert "could not be graded" in page and "cut off" in page


def test_cells_that_were_changed_moved_or_lost(tmp_path):
    def handed_in(name, change):
        book = filled()
        change(book["cells"])
        as_file(tmp_path / "class" / name / f"{LAB}.ipynb", book)

    def find(cells, id):
        return next(cell for cell in cells if cell["id"] == id)

    handed_in("moved", lambda cells: cells.reverse())
    handed_in("setup gone", lambda cells: cells.remove(find(cells, "setup")))
    handed_in("check changed", lambda cells: find(cells, "check-kf").update(source="print('passed')"))
    handed_in("check gone", lambda cells: cells.remove(find(cells, "check-kf")))
    handed_in("answer gone", lambda cells: cells.remove(find(cells, "answer-stack")))
    handed_in("answer retyped", lambda cells: find(cells, "answer-stack").update(cell_type="markdown"))
    helper = code("def helper(x):\n    return np.array(x, dtype=float)", "helper")
    handed_in(
        "own helper",
        lambda cells: (
            cells.insert(1, helper),
            find(cells, "answer-kf").update(
                source=find(cells, "answer-kf")["source"].replace("np.array(x0, dtype=float)", "helper(x0)")
            ),
        ),
    )
    handed_in(
        "own module",
        lambda cells: find(cells, "answer-kf").update(
            source="import my_hand\n" + find(cells, "answer-kf")["source"].replace("np.array(x0", "my_hand.kept(x0")
        ),
    )
    (tmp_path / "class" / "own module" / "my_hand.py").write_text("from numpy import array as kept\n", encoding="utf-8")
    handed_in("hidden check copied", lambda cells: cells.append(code("exam.same = print", "grade-stack")))
    grade(tmp_path / "class", "--out", tmp_path / "out")
    got = points(tmp_path / "out")
    assert got.pop("answer gone") == 3 + 11 / 2  # the filter uses stack when it sees something: half of it is shown
    assert set(got.values()) == {RIGHT}
    notes = {row["student"]: row["notes"] for row in rows(tmp_path / "out", "summary.csv")}
    assert "Nothing in the notebook defines `stack`." in notes["answer gone"]


def test_on_a_cluster_a_dead_worker_costs_only_time(tmp_path):
    distributed = pytest.importorskip("distributed")
    for i in range(6):
        as_file(tmp_path / "class" / f"student {i}" / f"{LAB}.ipynb", filled() if i % 3 else filled(answer_kf=None))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as machines:
        process = subprocess.Popen(
            command(tmp_path / "class", "--out", tmp_path / "out", "--scheduler", machines.scheduler_address),
            env=ENV,
            stdout=subprocess.PIPE,
            text=True,
        )
        wait_until(lambda: count(tmp_path / "out") > 0 or process.poll() is not None)
        assert process.poll() is None
        os.kill(next(iter(machines.workers.values())).pid, signal.SIGKILL)
        said, _ = process.communicate()
    assert process.returncode == 0, said
    assert points(tmp_path / "out") == {f"student {i}": RIGHT if i % 3 else 4 for i in range(6)}


def test_no_scheduler(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "ANSWER", 0.2)
    with pytest.raises(CommandError, match="No Dask scheduler answers"):
        list(cluster.remote(None, [], "tcp://127.0.0.1:1"))


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["nowhere", "--out", "out"], "nowhere"),
        (["class", "--out", "file"], "cannot be made"),
        (["class", "--out", "class"], "--out class is the folder of the submissions: what is written there"),
        (["empty", "--out", "out"], "holds no hand-ins"),
        (["class", "--out", "broken"], "cannot be used as a gradebook"),
    ],
)
def test_what_cannot_work_says_why(tmp_path, arguments, words):
    as_file(tmp_path / "class" / "Ada" / f"{LAB}.ipynb", filled())
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("x", encoding="utf-8")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "gradebook.db").write_text("no database" * 100, encoding="utf-8")
    done = subprocess.run(command(*arguments), cwd=tmp_path, capture_output=True, text=True, env=ENV)
    assert done.returncode == 2 and words in done.stderr and "Traceback" not in done.stderr


def test_two_graders_do_not_share_a_folder(small):
    from labkit.instructor.command import alone

    with alone(small / "out"):
        done = subprocess.run(command(small / "class", "--out", small / "out"), capture_output=True, text=True, env=ENV)
    assert done.returncode == 2 and "Another labkit grade" in done.stderr

"""`course.toml`: what it says is read as it is meant, and every error is a sentence that says where and what to do."""

import re
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

import pytest

from labkit.instructor import policy
from labkit.instructor.policy.course import Group, Late
from labkit.instructor.records import CommandError

from helpers.reference import ROOT

LAB = "01_cartesian_ekf"


def read(folder, text):
    (folder / "course.toml").write_text(text, encoding="utf-8")
    return policy.read(folder / "course.toml")


def test_no_file_and_an_empty_one_leave_everything_as_it_is(tmp_path):
    for course in (policy.read(tmp_path / "course.toml"), read(tmp_path, "\n# nothing\n")):
        assert not course.late.costs and course.partial_credit and course.lab(LAB).attempts == "newest"
        assert course.lab(LAB).due is None and course.weights[LAB] == 1 and not course.groups


def test_the_example_of_the_docs_is_read_as_the_docs_say(tmp_path):
    text = re.search(r"```toml\n(.*?)```", (ROOT / "docs/instructors.md").read_text(encoding="utf-8"), re.S)[1]
    course = read(tmp_path, text)
    madrid = ZoneInfo("Europe/Madrid")
    assert course.late == Late(percent=10, grace=timedelta(minutes=15), cap=50)
    assert course.lab(LAB).due == datetime(2026, 11, 20, 23, 59, 59, 999999, madrid)
    assert course.lab("02_noise_mismatch").due == datetime(2026, 12, 4, 12, tzinfo=madrid)
    assert course.lab("02_noise_mismatch").attempts == "best" and course.lab(LAB).attempts == "newest"
    assert course.weights[LAB] == 1 and course.weights["02_noise_mismatch"] == 2
    assert [(one.student, one.lab, f"{one.due:%d %H:%M}") for one in course.extensions] == [
        ("Ada Lovelace", LAB, "27 23:59"),
        ("1017", LAB, "24 12:00"),
    ]
    assert course.groups == (
        Group(("Grace Hopper", "Katherine Johnson"), (), "", "[[groups]] 1,"),
        Group(("Emmy Noether", "Alan Turing"), (LAB,), "own", "[[groups]] 2,"),
    )
    assert course.students == ("Ngọc Trần",)


def test_windows_marks_and_line_ends_and_times_with_a_zone(tmp_path):
    text = f'\ufeff[labs.{LAB}]\r\ndue = 2026-11-20T23:59+09:00\r\nattempts = "first"\r\n'
    (tmp_path / "course.toml").write_bytes(text.encode())
    lab = policy.read(tmp_path / "course.toml").lab(LAB)
    assert lab.due == datetime.fromisoformat("2026-11-20T14:59:00Z") and lab.attempts == "first"
    assert read(tmp_path, f'[labs.{LAB}]\ndue = "2026-11-20 23:59"').lab(LAB).due.minute == 59


EXTENSION = f'[[extensions]]\nstudent = "Ada"\nlab = "{LAB}"\ndue = 2026-11-27\n'
BAD = {  # text of the file: what is said of it
    "a = \nb = 2": "course.toml, line 1: this is no TOML: Invalid value.",
    "[late]\n\nx": "course.toml, line 3: this is no TOML: ",
    f"weight = {'9' * 5000}": "course.toml, line 1: this is no TOML: Exceeds the limit",
    f"[labs.{LAB}]\ndue = 24.11.2026\n": "; write 2026-11-24T12:00.\n  due = 24.11.2026\n",
    f"[labs.{LAB}]\ndue = 24.11.2026 9:30\n": "; write 2026-11-24T09:30.\n",
    f"[labs.{LAB}]\ndue = 11/24/2026": "or 2026-11-20 for the end of that day.\n  due = 11/24/2026\n",
    'zone = "Europe/Madrid\nattempts = 1': 'perhaps a quote is open.\n  zone = "Europe/Madrid\n',
    "lates = 1": "lates: there is no such key; did you mean 'late'?",
    "xyz = 1": "xyz: there is no such key; there are zone, attempts,",
    "[late]\npercent_per_day = 10": "[late] percent_per_day: there is no such key; did you mean 'percent_a_day'?",
    f"[labs.{LAB}]\ndu = 1": f"[labs.{LAB}] du: there is no such key; did you mean 'due'?",
    "[labs.01_cartesian]": "there is no lab '01_cartesian'; did you mean '01_cartesian_ekf'?",
    f"[labs]\n{LAB} = 2026-11-20": f"[labs] {LAB}: this is a date, and should be a table: [labs.{LAB}].",
    "labs = 3": "labs: this is a number, and should be tables such as [labs.01_cartesian_ekf].",
    f'[labs.{LAB}]\nweight = "2"': "weight: this is a text in quotes, and should be a number.",
    f"[labs.{LAB}]\nweight = true": "weight: this is true or false, and should be a number.",
    f"[labs.{LAB}]\nweight = -1": "weight: -1 is not possible; write a number from 0 to 1000.",
    f"[labs.{LAB}]\nweight = nan": "weight: nan is not possible",
    '[labs."09_none"]\nweight = 1': "there is no lab '09_none'",
    f'[labs.{LAB}]\ndue = "2026-11-31"': "due: '2026-11-31' is no date; write 2026-11-20T23:59, or 2026-11-20 for the",
    f'[labs.{LAB}]\ndue = "next friday"': "'next friday' is no date",
    f"[labs.{LAB}]\ndue = 20": "due: 20 is no date",
    f"[labs.{LAB}]\ndue = 23:59:00": "due: 23:59:00 is no date",
    f"[labs.{LAB}]\ndue = 0001-01-01": "the year 1 is none of a course",
    f'[labs.{LAB}]\nattempts = "last"': "attempts: 'last' is not possible; there are newest, first, best.",
    'attempts = "bets"': "attempts: 'bets' is not possible; did you mean 'best'?",
    'partial_credit = "off"': "partial_credit: this is a text in quotes, and should be true or false.",
    'zone = "Europe/Madird"': "there is no zone 'Europe/Madird'; did you mean 'Europe/Madrid'?",
    'zone = "Europe"': "there is no zone 'Europe'; write one such as 'Europe/Madrid'.",
    'zone = "../../etc/passwd"': "there is no zone",
    "[late]\npercent_a_day = 110": "percent_a_day: 110 is not possible; write a number from 0 to 100.",
    "[late]\npercent_a_day = 10\npoints_a_day = 1": "there is percent_a_day too; keep one of them.",
    "[late]\npercent_a_day = 10\nignore = true": "[late] ignore: late hand-ins cannot be left out and cost points too",
    "[late]\ncap = 5": "cap: there is no points_a_day or percent_a_day that it could be for.",
    '[late]\npercent_a_day = 10\nof = "max"': "of: 'max' is not possible; there are reached, possible.",
    "[late]\ngrace_minutes = -5": "grace_minutes: -5 is not possible",
    "[late]\ngrace_minutes = 1e9": "grace_minutes: 1000000000.0 is not possible; write a number from 0 to 10080.",
    "[extensions]\nstudent = 1": "extensions: this is a table, and should be a table in two brackets, [[extensions]].",
    "extensions = [3]": "extensions 1: this is a number, and should be a table [[extensions]].",
    '[[extensions]]\nstudent = "Ada"': "[[extensions]] 1, lab: it is missing: an extension has student, lab and due.",
    EXTENSION.replace(
        LAB, "01_cartesion_ekf"
    ): "lab: there is no lab '01_cartesion_ekf'; did you mean '01_cartesian_ekf'?",
    EXTENSION.replace("Ada", " "): "student: it is empty",
    EXTENSION + EXTENSION: f"[[extensions]] 2, student: 'Ada' has an extension for {LAB} already, in [[extensions]] 1;",
    f"{EXTENSION}[labs.{LAB}]\ndue = 2026-11-28": "due: this is before the lab is due, 2026-11-28 23:59.",
    '[[groups]]\nmembers = ["Ada"]': "[[groups]] 1, members: a group has two members or more.",
    "[[groups]]\nlabs = []": "members: a group has two members or more.",
    '[[groups]]\nmembers = "Ada"': "members: this is a text in quotes, and should be a list of texts in quotes.",
    '[[groups]]\nmembers = ["Ada", "Bo"]\nlabs = []': "labs: it is empty; leave it out, and the group is one in all",
    '[[groups]]\nmembers = ["Ada", ""]': "members: one of them is empty",
    f'[labs.{LAB}]\ndue = "20261120"': "due: '20261120' is no date",
    f'[labs.{LAB}]\ndue = "2026-W47"': "due: '2026-W47' is no date",
    EXTENSION.replace(LAB, ""): "[[extensions]] 1, lab: it is missing: an extension has student, lab and due.",
    '[[groups]]\nmembers = ["Ada", "Ada", "Bo"]': "members: 'Ada' stands there twice.",
    '[[groups]]\nmembers = ["Ada", 1.5]': "members: there is a number in the list, which should hold texts in quotes.",
    '[[groups]]\nmembers = ["Ada", "Bo"]\nlabs = ["01"]': "labs: there is no lab '01'",
    '[[groups]]\nmembers = ["Ada", "Bo"]\ncounts = "later"': "counts: 'later' is not possible; there are newest,",
}


@pytest.mark.parametrize("text, told", BAD.items(), ids=range(len(BAD)))
def test_each_error_is_a_sentence(tmp_path, text, told):
    with pytest.raises(CommandError) as error:
        read(tmp_path, text)
    said = str(error.value)
    assert told in said and "course.toml" in said and "Nothing was graded or changed." in said
    assert said.endswith((".", "?")) and ".." not in said.replace("../", "") and "?." not in said


@pytest.mark.parametrize(
    "text", ['[late]\npercent_a_day = "10"\nof = "possible"\ncap = 5', '[variants]\ncourse = 3\nroster = "r.csv"']
)
def test_a_value_of_the_wrong_kind_is_not_told_as_missing_too(tmp_path, text):
    with pytest.raises(CommandError) as told:
        read(tmp_path, text)
    assert len(str(told.value).splitlines()) == 2


def test_all_errors_are_told_at_once_and_of_very_many_the_first(tmp_path):
    with pytest.raises(CommandError) as error:
        read(tmp_path, "a = 1\nb = 2\n[late]\nc = 3")
    assert len(str(error.value).splitlines()) == 4
    with pytest.raises(CommandError, match="and 40 more"):
        read(tmp_path, "\n".join(f"a{n} = 1" for n in range(50)))


def test_what_is_no_text_or_cannot_be_read(tmp_path):
    (tmp_path / "course.toml").write_bytes("zone = 'Zürich'".encode("utf-16"))
    with pytest.raises(CommandError, match="no text in UTF-8"):
        policy.read(tmp_path / "course.toml")
    (tmp_path / "folder").mkdir()
    with pytest.raises(CommandError, match="cannot be read: Is a directory"):
        policy.read(tmp_path / "folder")


def test_weights_that_are_all_0_give_no_total(tmp_path):
    labs = read(tmp_path, "").known
    text = "\n".join(f"[labs.{lab}]\nweight = 0" for lab in labs)
    with pytest.raises(CommandError, match="all weights are 0"):
        read(tmp_path, text)
    assert sum(read(tmp_path, text.replace("weight = 0", "weight = 0.5", 1)).weights.values()) == 0.5

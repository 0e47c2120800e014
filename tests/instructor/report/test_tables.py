"""grades.csv out, through a spreadsheet and back; the tables of Moodle and Canvas with grades in them."""

import csv
import io
import os
import random
from datetime import UTC, datetime
from pathlib import Path

import pytest

from labkit.instructor.records import BY_HAND, FAILED, OPEN, PASSED, CommandError, Mark, Result
from labkit.instructor.report import lms
from labkit.instructor.report.lms import fill_canvas, fill_moodle
from labkit.instructor.report.names import labels
from labkit.instructor.report.sheet import Sheet
from labkit.instructor.report.tables import read_hand_marks, write_grades, write_summary

LAB = "01_cartesian_ekf"


def result(student, identifier="", first=2.0, written=None, **more):
    """Two checks (2 and 3 points; the first failed unless it gives 2) and a written question of 5."""
    marks = [
        Mark("kf", first, 2.0, *((PASSED, "") if first == 2 else (FAILED, "The sign of K is wrong."))),
        Mark("map", 3.0, 3.0, PASSED),
        Mark("q1", written, 5.0, OPEN if written is None else BY_HAND, "" if written is None else "Good."),
    ]
    return Result(student, identifier, LAB, marks=marks, **more)


def some():
    return [result("Ada Lovelace", "101"), result("Łukasz Żak", "102", first=0.5), result("王小明", "103", written=4.0)]


def cells(path):
    with open(path, encoding="utf-8-sig", newline="") as file:
        return list(csv.reader(file))


def line_of(rows, student, check):
    return next(i for i, row in enumerate(rows) if (row[0], row[2]) == (student, check))


def saved(path, results, *changes, delimiter=",", encoding="utf-8-sig", comma=False, end="\r\n", all_quoted=False):
    """grades.csv of `results` after a person set (student, check, points[, reason]) and saved it again."""
    write_grades(path, results)
    rows = cells(path)
    for student, check, points, *reason in changes:
        row = rows[line_of(rows, student, check)]
        row[3] = points
        row[6:] = reason or row[6:]
    if comma:
        rows[1:] = [[c.replace(".", ",") if n in (3, 4) else c for n, c in enumerate(row)] for row in rows[1:]]
    text = io.StringIO()
    quoting = csv.QUOTE_ALL if all_quoted else csv.QUOTE_MINIMAL
    csv.writer(text, delimiter=delimiter, lineterminator=end, quoting=quoting).writerows(rows)
    path.write_bytes(text.getvalue().encode(encoding, "replace"))
    return path


def edit(path, change):
    """Change the rows of a written grades.csv by `change(rows)`."""
    rows = cells(path)
    change(rows)
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows(rows)


# ---- grades.csv


def test_grades_have_a_row_for_each_mark(tmp_path):
    path = tmp_path / "grades.csv"
    results = [*some()[:2], Result("Eve", lab=LAB, problem="The notebook is not JSON.")]
    write_grades(path, results)
    assert path.read_bytes().startswith(b"\xef\xbb\xbf")
    assert cells(path) == [
        ["student", "lab", "check", "points", "max_points", "status", "reason"],
        ["Ada Lovelace", LAB, "kf", "2", "2", "passed", ""],
        ["Ada Lovelace", LAB, "map", "3", "3", "passed", ""],
        ["Ada Lovelace", LAB, "q1", "", "5", "open", ""],
        ["Łukasz Żak", LAB, "kf", "0.5", "2", "failed", "The sign of K is wrong."],
        ["Łukasz Żak", LAB, "map", "3", "3", "passed", ""],
        ["Łukasz Żak", LAB, "q1", "", "5", "open", ""],
        ["Eve", LAB, "", "", "", "error", "The notebook is not JSON."],
    ]
    assert read_hand_marks(path, results) == {}


SAVED = {
    "as written": {},
    "Excel DE": {"delimiter": ";", "comma": True},
    "Excel DE, old CSV": {"delimiter": ";", "comma": True, "encoding": "cp1252"},
    "Excel, Unicode text": {"delimiter": "\t", "encoding": "utf-16"},
    "Excel, Unicode text, big end first": {"delimiter": "\t", "encoding": "utf-16-be"},
    "LibreOffice": {"encoding": "utf-8", "end": "\n"},
    "LibreOffice, all quoted": {"encoding": "utf-8", "end": "\n", "all_quoted": True},
    "Numbers": {"encoding": "utf-8", "delimiter": ";"},
    "decimal commas between commas": {"comma": True},
    "old Mac line ends": {"end": "\r"},
}


@pytest.mark.parametrize("how", SAVED.values(), ids=SAVED)
def test_a_filled_in_table_comes_back_from_any_spreadsheet(tmp_path, how):
    bob = 'O\'Neil, "Bob"'
    results = [result("Zoë Ünal", "1"), result(bob, "2", first=0.5), result("Jo; Do", "3", written=4.0)]
    path = saved(tmp_path / "g.csv", results, **how)
    if how.get("encoding") == "utf-16-be":
        path.write_bytes(b"\xfe\xff" + path.read_bytes())
    assert read_hand_marks(path, results) == {}
    path = saved(path, results, ("Zoë Ünal", "q1", "2.5", "Größe fehlt"), (bob, "kf", "2"), **how)
    if how.get("encoding") == "utf-16-be":
        path.write_bytes(b"\xfe\xff" + path.read_bytes())
    assert read_hand_marks(path, results) == {
        ("Zoë Ünal", LAB, "q1"): (2.5, "Größe fehlt"),
        (bob, LAB, "kf"): (2.0, "The sign of K is wrong."),
    }


@pytest.mark.parametrize("text", ["2", "2.0", "2,0", " 2 ", "2,000", "2.", "+2", "\u00a02"])
def test_the_same_number_in_other_letters_is_no_change(tmp_path, text):
    assert read_hand_marks(saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "kf", text)), some()) == {}


def test_a_changed_comment_on_given_points_counts(tmp_path):
    path = saved(tmp_path / "g.csv", some(), ("王小明", "q1", "4", "Very good."))
    assert read_hand_marks(path, some()) == {("王小明", LAB, "q1"): (4.0, "Very good.")}


def test_rows_and_columns_may_be_moved_and_headers_capitalised(tmp_path):
    path = saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "q1", "5"))

    def change(rows):
        rows[0] = ["Student", "LAB", "Check ", "Points", "Max Points", "Status", "Reason"]
        rows[1:] = rows[:0:-1]
        rows[:] = [["my own", *row[::-1], "", ""] for row in rows] + [[""] * 10, []]

    edit(path, change)
    assert read_hand_marks(path, some()) == {("Ada Lovelace", LAB, "q1"): (5.0, "")}


def test_columns_that_are_not_needed_may_be_deleted(tmp_path):
    path = saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "q1", "5"))

    def change(rows):
        rows[:] = [[row[0], *row[2:4]] for row in rows]

    edit(path, change)
    assert read_hand_marks(path, some()) == {("Ada Lovelace", LAB, "q1"): (5.0, "")}


def test_emptied_points_take_nothing_away(tmp_path):
    notes = []
    path = saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "kf", ""), ("Ada Lovelace", "q1", "", "see me"))
    assert read_hand_marks(path, some(), notes) == {}
    assert notes == [
        "line 2: Ada Lovelace, kf: the points were emptied; its 2 points stay.",
        "line 4: Ada Lovelace, q1: there is a comment but no points, so it stays open.",
    ]


def setting(column, *texts, row=3):
    """A change that puts `texts` into one row (by default that of Ada's q1) from `column` on."""
    return lambda rows: rows[row].__setitem__(slice(column, column + len(texts)), texts)


WRONG = {
    "a word": (setting(3, "good"), "line 4: the points 'good' are not a number; write one such as 1.5"),
    "a date": (setting(3, "01. Mai"), "line 4: .* made a date of it"),
    "negative": (setting(3, "-1"), "line 4: the points '-1' are less than 0"),
    "too much": (setting(3, "5.5"), "line 4: the points '5.5' are more than q1 gives, 5"),
    "nan": (setting(3, "NaN"), "line 4: the points 'NaN' are not a number"),
    "inf": (setting(3, "inf"), "line 4: the points 'inf' are not a number"),
    "huge": (setting(3, "9" * 400), "line 4: .* not a number"),
    "student": (setting(0, "Adda"), "line 4: there is no student 'Adda'; leave the columns student, lab and"),
    "no student": (setting(0, ""), "line 4: there is no student ''"),
    "check": (setting(2, "q9"), "line 4: 'Ada Lovelace' has no check 'q9'; leave the columns"),
    "no check": (setting(2, "", "3"), "line 4: there are points .'3'., but no check"),
    "lab": (setting(1, "02_x"), "line 4: 'Ada Lovelace' has no lab '02_x' here"),
    "rows that disagree": (lambda rows: rows.append([*rows[1][:3], "1"]), "line 11: disagrees with line 2 on kf"),
    "a bare decimal comma": (setting(3, "1", "5", "5", "open"), "line 4: .* decimal comma in quotes"),
    "missing column": (setting(3, "score", row=0), "no column 'points' in line 1, .* put it back"),
    "column twice": (setting(6, "points", row=0), "two columns 'points'"),
}


@pytest.mark.parametrize(("change", "text"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_a_mark_is_told_by_line(tmp_path, change, text):
    path = tmp_path / "g.csv"
    write_grades(path, some())
    edit(path, change)
    with pytest.raises(CommandError, match=text):
        read_hand_marks(path, some())


def test_all_problems_are_told_at_once(tmp_path):
    results = [result(f"Student {n}") for n in range(12)]
    path = saved(tmp_path / "g.csv", results, *((f"Student {n}", "q1", "x") for n in range(12)))
    with pytest.raises(CommandError) as told:
        read_hand_marks(path, results)
    assert str(told.value).count("\n  line ") == 10 and str(told.value).endswith("and 2 more")


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "is empty"),
        (b"\xef\xbb\xbf \r\n;;;\r\n", "is empty"),
        (b"PK\x03\x04rest", "is a workbook"),
        (b"student\0\x81", "not a text file"),
        (None, "cannot be read"),
    ],
)
def test_a_file_that_is_no_table_is_told(tmp_path, data, text):
    path = tmp_path / "g.csv"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(CommandError, match=text):
        read_hand_marks(path, some())


def test_letters_lost_by_an_old_encoding_are_told(tmp_path):
    path = saved(tmp_path / "g.csv", [*some(), result("Zoë")], encoding="cp1252")
    with pytest.raises(CommandError, match=r"'.ukasz .ak'(.|\n)*CSV UTF-8"):
        read_hand_marks(path, [*some(), result("Zoë")])


def test_rows_that_agree_may_be_there_twice(tmp_path):
    path = saved(tmp_path / "g.csv", some(), ("Ada Lovelace", "q1", "3"))
    edit(path, lambda rows: rows.append([*rows[3][:3], "3,0", *rows[3][4:]]))
    assert read_hand_marks(path, some()) == {("Ada Lovelace", LAB, "q1"): (3.0, "")}


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "'=1", "''-1", '=LINK("x";1)'])
def test_no_text_of_a_person_becomes_a_formula(tmp_path, text):
    results = [Result(text, "1", LAB, marks=[Mark("kf", 0.0, 1.0, FAILED, text)], source=text, notes=[text])]
    for write in (write_grades, write_summary):
        write(tmp_path / "t.csv", results)
        assert not any(cell.startswith(tuple("=+-@\t\r")) for row in cells(tmp_path / "t.csv") for cell in row)
    write_grades(tmp_path / "t.csv", results)
    assert read_hand_marks(tmp_path / "t.csv", results) == {}
    edit(tmp_path / "t.csv", lambda rows: rows[1].__setitem__(3, "1"))
    assert read_hand_marks(tmp_path / "t.csv", results) == {(labels(results)[0], LAB, "kf"): (1.0, text)}


def test_students_with_one_name_are_told_apart(tmp_path):
    results = [result("Ada Lovelace", "123"), result("ada  lovelace", "124"), result("Bob", "125")]
    assert labels(results) == ["Ada Lovelace (123)", "ada lovelace (124)", "Bob"]
    path = saved(tmp_path / "g.csv", results, ("ada lovelace (124)", "q1", "1"))
    assert read_hand_marks(path, results) == {("ada lovelace (124)", LAB, "q1"): (1.0, "")}
    saved(path, [results[0]])  # written when there was one Ada only
    with pytest.raises(CommandError, match=r"now 'Ada Lovelace \(123\)' or 'ada lovelace \(124\)'\?"):
        read_hand_marks(path, results)


def test_several_labs_in_one_table(tmp_path):
    results = [Result("A", lab=lab, marks=[Mark(f"q{lab}", None, 1.0, OPEN)]) for lab in ("1", "2")]
    write_grades(tmp_path / "g.csv", results)
    edit(tmp_path / "g.csv", lambda rows: rows[2].__setitem__(3, "1"))
    assert read_hand_marks(tmp_path / "g.csv", results) == {("A", "2", "q2"): (1.0, "")}
    edit(tmp_path / "g.csv", lambda rows: rows[0].__setitem__(1, "?"))
    with pytest.raises(CommandError, match="no column 'lab'"):
        read_hand_marks(tmp_path / "g.csv", results)


@pytest.mark.parametrize("seed", range(20))
def test_what_is_written_reads_as_unchanged(tmp_path, seed):
    pick, letters = random.Random(seed), "aZ ,;\"'\t\r\n=+-@01é王\u0301\u200d\ud800\x00|\u2028"

    def text():
        return "".join(pick.choices(letters, k=pick.randrange(12)))

    results = [
        Result(
            text(),
            text(),
            LAB,
            text(),
            problem=pick.choice(["", "", "bad"]),
            marks=[Mark(f"c{n}", pick.choice([None, 0.0, 1 / 3, 2.25]), 2.25, FAILED, text()) for n in range(3)],
        )
        for _ in range(8)
    ]
    write_grades(tmp_path / "g.csv", results)
    assert read_hand_marks(tmp_path / "g.csv", results) == {}
    assert len(set(labels(results))) == 8


def test_a_kill_while_writing_does_no_harm(tmp_path, monkeypatch):
    path = tmp_path / "grades.csv"
    saved(path, some(), ("Ada Lovelace", "q1", "3"))
    before = path.read_bytes()
    monkeypatch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        write_grades(path, some())
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
    monkeypatch.undo()
    assert read_hand_marks(path, some()) == {("Ada Lovelace", LAB, "q1"): (3.0, "")}
    write_grades(path, some())
    assert list(tmp_path.iterdir()) == [path] and read_hand_marks(path, some()) == {}


def test_a_file_open_in_a_spreadsheet_is_told(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(CommandError, match="is it open in a spreadsheet"):
        write_grades(tmp_path / "g.csv", some())
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(CommandError, match="cannot be written"):
        write_summary(tmp_path / "no" / "s.csv", some())


def test_summary(tmp_path):
    when = datetime(2025, 3, 1, 12, 0, tzinfo=UTC)
    notes = ["Two attempts.", "Late."]
    one = result("Ada", "007", source="ada.ipynb", when=when, late=True, level=3, notes=notes)
    write_summary(tmp_path / "s.csv", [one, Result("Eve", lab=LAB, problem="No notebook.")])
    rows = [dict(zip(cells(tmp_path / "s.csv")[0], row)) for row in cells(tmp_path / "s.csv")[1:]]
    assert datetime.fromisoformat(rows[0].pop("handed_in")) == when
    assert list(rows[0].values()) == [
        "Ada",
        "007",
        LAB,
        "5",
        "10",
        "50.0",
        "1",
        "yes",
        "ada.ipynb",
        "3",
        "Two attempts. Late.",
    ]
    assert list(rows[1].values()) == ["Eve", "", LAB, "", "0", "", "0", "", "", "", "0", "No notebook."]


# ---- Moodle

MOODLE = {  # language: header, word for a participant, yes, no
    "en": (
        "Identifier,Full name,Email address,Status,Grade,Maximum Grade,Grade can be changed,"
        "Last modified (submission),Last modified (grade),Feedback comments",
        "Participant ",
        "Yes",
        "No",
    ),
    "es": (
        "Identificador,Nombre completo,Dirección de correo,Estado,Calificación,Calificación máxima,"
        "La calificación puede ser cambiada,Última modificación (entrega),"
        "Última modificación (calificación),Comentarios de retroalimentación",
        "Participante ",
        "Sí",
        "No",
    ),
    "de": (
        "ID,Vollständiger Name,E-Mail-Adresse,Status,Bewertung,Bestwertung,Bewertung kann geändert werden,"
        "Zuletzt geändert (Abgabe),Zuletzt geändert (Bewertung),Feedback als Kommentar",
        "Teilnehmer/in",
        "Ja",
        "Nein",
    ),
    "fr": (
        "Identifiant,Nom complet,Adresse de courriel,Statut,Note,Note maximale,La note peut être modifiée,"
        "Dernière modification (travail remis),Dernière modification (note),Feedback par commentaires",
        "Participant",
        "Oui",
        "Non",
    ),
    "it": (
        "Identificativo,Nome completo,Indirizzo email,Stato,Valutazione,Valutazione massima,"
        "La valutazione può essere cambiata,Ultima modifica (consegna),Ultima modifica (valutazione),"
        "Commenti",
        "Partecipante ",
        "Sì",
        "No",
    ),
    "pt": (
        "Identificador,Nome completo,E-mail,Estado,Nota,Nota máxima,Nota pode ser alterada,"
        "Última modificação (envio),Última modificação (nota),Comentários de feedback",
        "Participante",
        "Sim",
        "Não",
    ),
    "ru": (
        "Идентификатор,Полное имя,Почта,Статус,Оценка,Максимальная оценка,Оценка может быть изменена,"
        "Последнее изменение (ответ),Последнее изменение (оценка),Отзыв в виде комментария",
        "Участник ",
        "Да",
        "Нет",
    ),
    "ca": (
        "Identificador,Nom complet,Adreça electrònica,Estat,Qualificació,Qualificació màxima,"
        "Es pot canviar la qualificació,Darrera modificació (tramesa),Darrera modificació (qualificació),"
        "Comentaris de retroalimentació",
        "Participant ",
        "Sí",
        "No",
    ),
    "an unknown one": ("a,b,c,d,e,f,g,h,i,j", "Osallistuja ", "Kyllä", "Ei"),
}


def worksheet(path, language="en", rows=None, delimiter=",", end="\r\n", most="10.00", encoding="utf-8-sig"):
    """A worksheet with `rows` (number, name, grade, changeable, feedback)."""
    header, person, yes, no = MOODLE[language]
    names = {101: "Ada Lovelace", 102: "Łukasz Żak", 9: "Nobody"}
    rows = rows or [(number, name, "", True, "") for number, name in names.items()]
    lines = [",".join(f'"{h}"' if " " in h else h for h in header.split(","))]
    for number, name, grade, changeable, feedback in rows:
        lines.append(
            f'"{person}{number}","{name}",x@example.org,"Submitted, for grading",{_quoted(grade)},'
            f'{_quoted(most)},{yes if changeable else no},"Monday, 3 March 2025",-,{_quoted(feedback)}'
        )
    text = end.join([*lines, ""])
    if delimiter != ",":
        text = "".join(
            delimiter if c == "," and n % 2 == 0 else c
            for n, part in enumerate(text.split('"'))
            for c in (part if n % 2 == 0 else f'"{part}"')
        )
    path.write_bytes(text.encode(encoding))
    return path


def _quoted(text):
    return f'"{text}"' if "," in text or " " in text else text


def table(path, delimiter=",", encoding="utf-8-sig"):
    return list(csv.reader(io.StringIO(path.read_bytes().decode(encoding), newline=""), delimiter=delimiter))


def whole():
    """Results without open answers: 10 and 8.5 of 10 points."""
    return [result("Ada Lovelace", "101", written=5.0), result("Łukasz Żak", "102", first=0.5, written=5.0)]


@pytest.mark.parametrize("language", MOODLE)
def test_moodle_in_many_languages(tmp_path, language):
    source, out = worksheet(tmp_path / "w.csv", language), tmp_path / "out.csv"
    report = fill_moodle(source, out, whole())
    before, after = table(source), table(out)
    assert [row[4] for row in after[1:]] == ["10", "8.5", ""]
    assert [row[9] for row in after[1:]] == [
        "Points: 10 of 10. q1: Good.",
        "Points: 8.5 of 10. kf: The sign of K is wrong. q1: Good.",
        "",
    ]
    assert [row[:4] + row[5:9] for row in before] == [row[:4] + row[5:9] for row in after]
    assert report == ["Filled in: the grades of 2 students.", "In the table without a graded submission: 1 (Nobody)."]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16-le"])
@pytest.mark.parametrize("end", ["\r\n", "\n"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_moodle_keeps_each_other_byte(tmp_path, encoding, end, delimiter):
    rows = [(101, "Ada", "7,50", True, ""), (102, 'D""E, F', "", True, ""), (7, "=1", "3,00", True, "keep; me")]
    source, out = tmp_path / "w.csv", tmp_path / "out.csv"
    worksheet(source, "de", rows, delimiter, end, "10,00", encoding)
    if encoding == "utf-16-le":
        source.write_bytes(b"\xff\xfe" + source.read_bytes())
    fill_moodle(source, out, [result("x", "102", first=0.5, written=3.0)])
    before, after = source.read_bytes().decode(encoding), out.read_bytes().decode(encoding)
    grade = '"6,5"' if delimiter == "," else "6,5"
    new = "Points: 6.5 of 10. kf: The sign of K is wrong. q1: Good."
    expected, empty = before.split(end), f'{delimiter}{delimiter}"10,00"'
    assert expected[2].count(empty) == 1 and expected[2].endswith(delimiter)
    expected[2] = expected[2].replace(empty, f'{delimiter}{grade}{delimiter}"10,00"') + f'"{new}"'
    assert after == end.join(expected)


def test_moodle_unchanged_without_results(tmp_path):
    source, out = worksheet(tmp_path / "w.csv"), tmp_path / "out.csv"
    assert fill_moodle(source, out, [])[0] == "Filled in: the grades of 0 students."
    assert source.read_bytes() == out.read_bytes()


def test_moodle_scales_to_the_maximum_grade(tmp_path):
    rows, out = [(1, "Ada", "", True, "")], tmp_path / "out.csv"
    source = worksheet(tmp_path / "w.csv", most="100,00", rows=rows)
    one = Result("Ada", "1", LAB, marks=[Mark("a", 1.0, 3.0, FAILED, "No.")])
    fill_moodle(source, out, [one])
    assert table(out)[1][4] == "33,33" and b'"33,33"' in out.read_bytes()


def test_moodle_leaves_open_and_locked_and_broken_alone(tmp_path):
    rows = [(1, "Open", "", True, ""), (2, "Locked", "1.00", False, ""), (3, "Broken", "", True, "")]
    source, out = worksheet(tmp_path / "w.csv", rows=rows), tmp_path / "out.csv"
    broken = Result("Broken", "3", LAB, problem="No JSON.")
    results = [result("Open", "1"), result("Locked", "2", written=1.0), broken, result("Gone", "99", written=1.0)]
    report = fill_moodle(source, out, results)
    assert source.read_bytes() == out.read_bytes()
    assert report == [
        "Filled in: the grades of 0 students.",
        "Left as they were, since written answers wait to be marked: 1 (Open); --partial fills them in.",
        "Left as they were, since the submission could not be graded: 1 (Broken).",
        "Left as they were, since the table says 'grade cannot be changed': 1 (Locked).",
        "Graded, but not in the table: 1 (Gone).",
    ]
    fill_moodle(source, out, results, partial=True)
    assert [row[4] for row in table(out)[1:]] == ["5", "1.00", ""]
    assert table(out)[1][9] == "Points: 5 of 10. q1: not marked yet."


def test_moodle_by_name_where_it_is_unique(tmp_path):
    rows = [
        (1, "ZOË  Ünal", "", True, ""),
        (2, "Two Same", "", True, ""),
        (3, "Two Same", "", True, ""),
        (4, "One Row", "", True, ""),
    ]
    source, out = worksheet(tmp_path / "w.csv", rows=rows), tmp_path / "out.csv"
    people = [("Zoe Unal", ""), ("Two Same", ""), ("Two Same", "3"), ("One Row", ""), ("One Row", "77")]
    report = fill_moodle(source, out, [result(name, number, written=5.0) for name, number in people])
    assert [row[4] for row in table(out)[1:]] == ["10", "", "10", ""]
    unclear = "3 (Two Same, One Row, One Row (77))"
    assert f"Graded, but more than one row or result fits: {unclear}; fill these in by hand." in report


def test_moodle_tells_what_it_replaced_and_keeps_equal_grades(tmp_path):
    rows = [(101, "Ada", "4.00", True, "well"), (102, "Bob", "8.50", True, "")]
    source, out = worksheet(tmp_path / "w.csv", rows=rows), tmp_path / "out.csv"
    report = fill_moodle(source, out, whole())
    assert "Something else was there before: 1 (Ada Lovelace (the grade 4.00 and a comment))." in report
    assert [row[4] for row in table(out)[1:]] == ["10", "8.50"]
    again = fill_moodle(out, tmp_path / "again.csv", whole())
    assert out.read_bytes() == (tmp_path / "again.csv").read_bytes() and len(again) == 1


def test_moodle_comments_are_one_harmless_line(tmp_path):
    source, out = worksheet(tmp_path / "w.csv", rows=[(1, "Ada", "", True, "")]), tmp_path / "out.csv"
    texts = {"a": 'It gave <b>=1+1</b>,\r\nnot "2".', "b": "x " * 900}
    marks = [Mark(check, 0.0, 1.0, FAILED, text) for check, text in texts.items()]
    fill_moodle(source, out, [Result("Ada", "1", LAB, marks=marks)])
    text = table(out)[1][9]
    assert text.startswith('Points: 0 of 2. a: It gave &lt;b&gt;=1+1&lt;/b&gt;, not "2". b: x x')
    assert "\n" not in text and len(text) < 600 and text.endswith("feedback page.")


def test_moodle_columns_by_option(tmp_path):
    path, out = tmp_path / "w.csv", tmp_path / "out.csv"
    path.write_text("Identifier,Foo,Bar\nParticipant 101,,\nParticipant 102,,x\n")
    with pytest.raises(CommandError, match=r"Identifier, Foo, Bar.*--grade-column"):
        fill_moodle(path, out, whole())
    assert not out.exists()
    with pytest.raises(CommandError, match="--grade-column 'Fo' is not one of its columns, Identifier, Foo, Bar"):
        fill_moodle(path, out, whole(), "Fo")
    report = fill_moodle(path, out, whole(), "foo", "BAR")
    assert out.read_text().startswith('Identifier,Foo,Bar\nParticipant 101,10,"Points: 10 of 10')
    assert "Something else was there before: 1 (Łukasz Żak (a comment))." in report


def test_moodle_without_comments(tmp_path):
    path, out = tmp_path / "w.csv", tmp_path / "out.csv"
    path.write_text("Identifier,Grade,Maximum Grade,Last modified (grade)\nParticipant 101,,5.00,-\n")
    report = fill_moodle(path, out, whole()[:1])
    assert out.read_text() == path.read_text().replace(",,", ",5,")
    assert report[-1].startswith("No comments were written") and "--feedback-column" in report[-1]


@pytest.mark.parametrize("text", ["Name,Mark\nAda,1\n", "Identifier,Grade,Scale\nParticipant 1,,Good\n"])
def test_what_is_no_worksheet_is_told(tmp_path, text):
    (tmp_path / "w.csv").write_text(text)
    with pytest.raises(CommandError, match=r"w\.csv"):
        fill_moodle(tmp_path / "w.csv", tmp_path / "out.csv", whole())
    with pytest.raises(CommandError, match="results of 01, 02"):
        fill_moodle(tmp_path / "w.csv", tmp_path / "out.csv", [Result("A", lab="01"), Result("A", lab="02")])


def test_headers_are_stored_as_they_are_compared():
    for words in (*lms.HEADERS.values(), lms.YES, lms.NO):
        assert {lms.fold(word) for word in words} == words


# ---- Canvas

CANVAS = (
    "Student,ID,SIS Login ID,Section,Lab 1: EKF (5001),Lab 2 (5002),Lab 11 (5011),Essay (5100),"
    "Final Score (2025)\r\n"
    ",,,,Manual Posting,,,,\r\n"
    "    Points Possible,,,,20.00,10.00,10.00,5.00,(read only)\r\n"
    '"Lovelace, Ada",101,ada@x.org,"A, and B",,9.00,,,45.00\r\n'
    '"Żak, Łukasz",102,lz@x.org,A,3.00,,N/A,,\r\n'
    '"O\'Neil, ""Bob""",103,bob@x.org,A,EX,,,,\r\n'
    '"Doe, Jane",104,jane@x.org,A,,,,,\r\n'
    '"Student, Test",999,t@x.org,A,,,,,\r\n'
)


def canvas(tmp_path, text=CANVAS, encoding="utf-8"):
    path = tmp_path / "gradebook.csv"
    path.write_bytes(text.encode(encoding))
    return path, tmp_path / "out.csv"


def test_canvas(tmp_path):
    source, out = canvas(tmp_path)
    people = [*whole(), result("Bob O'Neil", "103", written=5.0), result("Test Student", "999", written=5.0)]
    report = fill_canvas(source, out, people)
    expected = CANVAS.replace('"A, and B",,', '"A, and B",20,').replace("A,3.00,", "A,17,")
    assert out.read_bytes().decode() == expected
    assert report == [
        "Grades go to the column 'Lab 1: EKF (5001)'.",
        "Filled in: the grades of 2 students.",
        "Something else was there before: 1 (Łukasz Żak (the grade 3.00)).",
        "Left as they were, since the table says 'EX': 1 (Bob O'Neil).",
        "Graded, but not in the table: 1 (Test Student).",
        "In the table without a graded submission: 1 (Doe, Jane).",
    ]


@pytest.mark.parametrize("name", ["Jane Doe", "Doe, Jane", "jané  DOE", "Doe Jane"])
def test_canvas_by_name(tmp_path, name):
    source, out = canvas(tmp_path)
    fill_canvas(source, out, [result(name, written=5.0)])
    assert table(out, encoding="utf-8")[6][4] == "20"


def test_canvas_with_two_columns_of_names_semicolons_and_decimal_commas(tmp_path):
    text = (
        "LastName;FirstName;ID;Section;Cartesian filter (7)\n    Points Possible;;;;10,00\n"
        "Lovelace;Ada;1;A;\nŻak;Łukasz;102;A;\nStudent;Test;9;A;\n"
    )
    source, out = canvas(tmp_path, text, "utf-8-sig")
    fill_canvas(source, out, whole())
    expected = text.replace("Ada;1;A;", "Ada;1;A;10").replace("102;A;", "102;A;8,5")
    assert out.read_bytes().decode("utf-8-sig") == expected


CHOICES = [  # lab, lab_title, column, titles, what is taken
    (LAB, None, None, ["Lab 1 (1)", "Lab 2 (2)", "Lab 10 (3)", "Lab21 (4)"], "Lab 1 (1)"),
    (LAB, None, None, ["Labor 01 - Filter (1)", "Labor 02 - Filter (2)"], "Labor 01 - Filter (1)"),
    (LAB, None, None, ["The Cartesian EKF (1)", "Range (2)"], "The Cartesian EKF (1)"),
    (LAB, None, None, ["Práctica 1 (8)", "Práctica 2 (9)"], "Práctica 1 (8)"),
    (LAB, None, None, ["Homework 1 (8)", "Lab 1 (9)"], "Lab 1 (9)"),
    (LAB, "Kalman", None, ["Lab 1 (1)", "kalman filters (2)"], "kalman filters (2)"),
    (LAB, None, "9", ["Lab 1 (1)", "Other (9)"], "Other (9)"),
    (LAB, None, "other", ["Lab 1 (1)", "Other (9)"], "Other (9)"),
    (LAB, None, "Other (9)", ["Lab 1 (1)", "Other (9)"], "Other (9)"),
    (LAB, None, None, ["Lab 1 code (1)", "Lab 1 text (2)"], "more than one .*Lab 1 code (1), Lab 1 text (2); name"),
    (LAB, None, None, ["Essay (1)", "Lab 2 (2)"], "none .*: Essay (1), Lab 2 (2); name one with --column"),
    (LAB, None, "nine", ["Lab 1 (1)"], "none of its assignments is 'nine'"),
    (LAB, "?[", None, ["Essay (1)"], "none"),
    ("", None, None, ["Essay (1)"], "none"),
]


@pytest.mark.parametrize(("lab", "title", "column", "titles", "taken"), CHOICES)
def test_canvas_column(tmp_path, lab, title, column, titles, taken):
    lines = [["Student,ID,Section", *titles], ["    Points Possible,,", *["5"] * len(titles)], ["A,1,S"]]
    source, out = canvas(tmp_path, "\n".join(map(",".join, lines)))
    one = [Result("A", "1", lab, marks=[Mark("a", 1.0, 1.0, PASSED)])]
    if taken in titles:
        assert fill_canvas(source, out, one, title, column)[0] == f"Grades go to the column {taken!r}."
        assert table(out, encoding="utf-8")[2][3 + titles.index(taken)] == "5"
    else:
        with pytest.raises(CommandError, match=taken.replace("(", r"\(").replace(")", r"\)")):
            fill_canvas(source, out, one, title, column)


def test_what_is_no_gradebook_is_told(tmp_path):
    for text in ("Student,Lab 1 (1)\n    Points Possible,5\n", "Student,ID,Lab 1 (1)\nAda,1,\n"):
        source, out = canvas(tmp_path, text)
        with pytest.raises(CommandError, match="not a gradebook as Canvas exports it"):
            fill_canvas(source, out, whole())
    source, out = canvas(tmp_path, "Student,ID,Lab 1 (1)\n    Points Possible,,0\nAda,1,\n")
    with pytest.raises(CommandError, match=r"'Lab 1 \(1\)' gives no points"):
        fill_canvas(source, out, whole())


# ---- Sheet


@pytest.mark.parametrize("seed", range(30))
def test_a_sheet_saves_what_it_read(tmp_path, seed):
    pick = random.Random(seed)
    data = "a,b\n" + "".join(pick.choices('a"",,,;\t\r\n é\x0b\u2028=', k=200))
    path = tmp_path / "s.csv"
    path.write_bytes(data.encode())
    sheet = Sheet(path)
    sheet.save(path)
    assert path.read_bytes() == data.encode()
    for row, column, text in ((0, 1, "x,y"), (0, 5, 'quo"ted'), (len(sheet._raw) - 1, 0, "two\nlines")):
        sheet.put(row, column, text)
        assert sheet.row(row)[column] == text


def test_a_line_that_names_the_delimiter(tmp_path):
    path = Path(tmp_path / "s.csv")
    path.write_text("sep=;\n\nstudent;check;points\nAda Lovelace;q1;1,5\n")
    assert read_hand_marks(path, some()) == {("Ada Lovelace", LAB, "q1"): (1.5, "")}

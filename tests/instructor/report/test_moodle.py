"""Moodle's grading worksheet, filled in: in any language, each other byte as it was."""

import pytest

from labkit.instructor.records import FAILED, CommandError, Mark, Result
from labkit.instructor.report import moodle
from labkit.instructor.report.lms import fold
from labkit.instructor.report.moodle import fill_moodle

from helpers.graded import LAB, result, table, whole

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
    assert text.startswith('Points: 0 of 2. a: It gave &lt;b&gt;&#61;1+1&lt;/b&gt;, not "2". b: x x')
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
    for words in (*moodle.HEADERS.values(), moodle.YES, moodle.NO):
        assert {fold(word) for word in words} == words

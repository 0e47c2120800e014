"""Grades into the tables of learning platforms: Moodle's grading worksheet, Canvas's gradebook.

The instructor downloads the table and uploads it again, so each cell without a new grade stays, byte for
byte. Both functions return the sentences that tell what was filled in and what was not.
"""

import html
import re
import unicodedata
from collections import Counter

from ..records import BY_HAND, CommandError
from .names import labels
from .sheet import Sheet
from .tables import SHOWN
from .texts import clean, guard, number, plain

LONGEST = 500  # characters of a feedback comment
NO = {"no", "nein", "non", "nao", "нет"}
YES = {"yes", "si", "ja", "oui", "sim", "да"}
# Moodle's headers in English, Spanish, German, French, Italian, Portuguese, Russian and Catalan, as `fold`
# gives them.
HEADERS = {
    "identifier": {"identifier", "identificador", "id", "identifiant", "identificativo", "идентификатор"},
    "name": {
        "full name",
        "nombre completo",
        "nombre",
        "vollstandiger name",
        "nom complet",
        "nome completo",
        "полное имя",
        "nome",
    },
    "grade": {
        "grade",
        "calificacion",
        "bewertung",
        "note",
        "valutazione",
        "voto",
        "nota",
        "avaliacao",
        "оценка",
        "qualificacio",
    },
    "maximum": {
        "maximum grade",
        "calificacion maxima",
        "bestwertung",
        "note maximale",
        "valutazione massima",
        "nota maxima",
        "avaliacao maxima",
        "максимальная оценка",
        "qualificacio maxima",
    },
    "changeable": {
        "grade can be changed",
        "la calificacion puede ser cambiada",
        "la calificacion puede cambiarse",
        "bewertung kann geandert werden",
        "la note peut etre modifiee",
        "la valutazione puo essere cambiata",
        "nota pode ser alterada",
        "a nota pode ser alterada",
        "оценка может быть изменена",
        "es pot canviar la qualificacio",
        "la qualificacio es pot canviar",
    },
    "feedback": {
        "feedback comments",
        "comentarios de retroalimentacion",
        "feedback als kommentar",
        "feedback par commentaires",
        "commenti",
        "commenti di feedback",
        "comentarios de feedback",
        "отзыв в виде комментария",
        "comentaris de retroalimentacio",
        "comentaris de retroaccio",
    },
}


def fill_moodle(worksheet, out, results, grade_column=None, feedback_column=None, partial=False):
    """Write `worksheet`, as Moodle gave it, to `out` with the grades and comments of `results`.

    A row is its student's by the number in its identifier, else by the full name where that is unique.
    Points are scaled to the row's maximum grade. A student with written answers still to be marked is
    left out, unless `partial`. The columns are known by Moodle's own headers in eight languages or by what
    they hold; grade_column and feedback_column name them otherwise (with a grade_column and no maximum
    grade to be found, points are not scaled).

    Returns a report, a list of sentences. Problem: a file cannot be read or written, a column is not
    found, or `results` are of several labs.
    """
    _one_lab(results)
    sheet = Sheet(worksheet)
    column = _moodle_columns(sheet, grade_column, feedback_column)
    comma = _decimal_comma(sheet, [column["grade"], column["maximum"]])

    def cell(index, name):
        return "" if column[name] is None else sheet.cell(index, column[name])

    def locked(index):
        return "grade cannot be changed" if fold(cell(index, "changeable")) in NO else ""

    rows = {i: (cell(i, "identifier"), cell(i, "name"), locked(i)) for i in sheet.body()}

    def put(index, result):
        most = number(cell(index, "maximum"))
        most = result.max_points if most is None else most
        old = _put_grade(sheet, index, column["grade"], result, most, comma)
        if column["feedback"] is not None:
            # Moodle stores comments as HTML, in which '<' would begin a tag.
            text = guard(html.escape(comment(result), quote=False))
            old += ["a comment"] * (cell(index, "feedback") not in ("", text))
            sheet.put(index, column["feedback"], text)
        return old

    report = _fill(rows, results, put, partial)
    if column["feedback"] is None:
        report.append(
            f"No comments were written, since {sheet.path.name} has no known column for them; switch on "
            "feedback comments in Moodle's assignment, or name the column with --feedback-column."
        )
    sheet.save(out)
    return report


def _moodle_columns(sheet, grade_column, feedback_column):
    """{name of HEADERS: column or None}; Problem when the grades' column cannot be told."""
    header, body = [fold(text) for text in sheet.header], sheet.body()
    column = {name: _one(i for i, text in enumerate(header) if text in HEADERS[name]) for name in HEADERS}

    def cells(c):
        return [sheet.cell(i, c) for i in body]

    if column["identifier"] is None and body and all(re.search(r"\D\d+$", text) for text in cells(0)):
        column["identifier"] = 0
    if column["name"] is None and column["identifier"] == 0 and len(header) > 1:
        # Names come next, or a status where names are hidden, and that is the same in many rows.
        column["name"] = 1 if len(set(cells(1))) == len(body) else None
    if column["maximum"] is None and body:  # one number, the same in all rows, behind the grades
        same = [c for c in range(1, len(header)) if len(set(cells(c))) == 1 and number(cells(c)[0])]
        column["maximum"] = _one(c for c in same if all(not t or number(t) is not None for t in cells(c - 1)))
    if column["changeable"] is None:
        words = [{fold(text) for text in cells(c)} for c in range(len(header))]
        column["changeable"] = _one(c for c, found in enumerate(words) if found and found <= NO | YES)
    if column["grade"] is None and column["maximum"]:
        column["grade"] = column["maximum"] - 1
    if column["feedback"] is None and body:
        # Comments come last; what else can come last, times of changes, is never empty ('-').
        last = len(header) - 1
        used = set(column.values())
        column["feedback"] = last if last not in used and "" in cells(last) else None
    for name, option, wanted in (
        ("grade", "--grade-column", grade_column),
        ("feedback", "--feedback-column", feedback_column),
    ):
        if wanted is not None:
            column[name] = _one(i for i, text in enumerate(header) if text == fold(wanted))
            if column[name] is None:
                columns = _list(sheet.header)
                raise CommandError(f"{sheet.path}: {option} {wanted!r} is not one of its columns, {columns}.")
    if column["identifier"] is None and column["name"] is None:
        raise CommandError(
            f"{sheet.path} has no column that tells its students, as Moodle's Identifier does; its columns "
            f"are {_list(sheet.header)}. Download the grading worksheet from the assignment's page."
        )
    if column["grade"] is None or column["maximum"] is None and grade_column is None:
        raise CommandError(
            f"{sheet.path}: its columns are {_list(sheet.header)}; which is for the grades, and which one "
            "holds the maximum grade, cannot be told; name the first with --grade-column. (An assignment "
            "graded on a scale of words has no maximum grade; give it points in Moodle.)"
        )
    return column


def fill_canvas(gradebook, out, results, lab_title=None, column=None, partial=False):
    """Write `gradebook`, as Canvas exported it, to `out` with the grades of `results`.

    column: title or number of the assignment; without it, the only one whose title holds `lab_title`, the
    lab's number ('Lab 1') or its name ('Cartesian'). A row is its student's by the ID, else by the name
    where that is unique. Points are scaled to Points Possible. 'EX' and 'N/A' stay, and so does the
    test student. A student with written answers still to be marked is left out, unless `partial`.

    Returns a report, a list of sentences. Problem: a file cannot be read or written, the column
    is not found or not the only one, or `results` are of several labs.
    """
    lab = _one_lab(results)
    sheet = Sheet(gradebook)
    header, body = [fold(text) for text in sheet.header], sheet.body()
    top = _one(i for i in body if fold(sheet.row(i)[0]) == "points possible")
    if "id" not in header or top is None:
        raise CommandError(
            f"{sheet.path} is not a gradebook as Canvas exports it, with a column ID and a row Points "
            f"Possible; its columns are {_list(sheet.header)}. Export it from Canvas's Gradebook again."
        )
    ids = header.index("id")
    points = {
        c: number(sheet.cell(top, c))
        for c, text in enumerate(sheet.header)
        if c > ids and re.search(r"\(\d+\)$", text.strip()) and number(sheet.cell(top, c)) is not None
    }
    chosen = _canvas_column(sheet, list(points), lab, lab_title, column)
    if not points[chosen]:
        raise CommandError(
            f"{sheet.path}: {sheet.header[chosen]!r} gives no points (Points Possible is "
            f"{sheet.cell(top, chosen)}); set its points in Canvas and export again."
        )
    comma = _decimal_comma(sheet, points)
    rows = {}
    for i in body[body.index(top) + 1 :]:
        name = ", ".join(sheet.cell(i, c) for c in range(ids))  # from Student, or LastName and FirstName
        now = sheet.cell(i, chosen)
        if name_key(name) != ("student", "test"):
            rows[i] = (sheet.cell(i, ids), name, now if now.upper() in ("EX", "N/A") else "")

    def put(index, result):
        return _put_grade(sheet, index, chosen, result, points[chosen], comma)

    report = _fill(rows, results, put, partial)
    sheet.save(out)
    return [f"Grades go to the column {sheet.header[chosen]!r}.", *report]


def _canvas_column(sheet, columns, lab, lab_title, wanted):
    """The one of the assignments' `columns` that is meant; Problem when there is none or several."""
    titles = {c: sheet.header[c].strip() for c in columns}
    plainly = {c: fold(re.sub(r"\s*\(\d+\)$", "", title)) for c, title in titles.items()}

    def having(pattern):
        return {c for c in columns if re.search(pattern, plainly[c])}

    if wanted is not None:
        numbers = {c: re.search(r"\((\d+)\)$", title)[1] for c, title in titles.items()}
        ways = [{c for c in columns if fold(wanted) in (fold(titles[c]), plainly[c], numbers[c])}]
    else:
        digits, name = re.fullmatch(r"0*(\d*)(.*)", fold(lab)).groups()
        words = re.findall(r"[^\W_]+", name)
        named = having(rf"(?<!\w){words[0]}(?!\w)") if words else set()
        numbered = having(rf"(?<!\w)lab[^\W\d]*\W*0*{digits}(?!\d)") if digits else set()
        ways = [
            having(re.escape(fold(lab_title))) if lab_title else set(),
            named | numbered,
            having(rf"(?<!\d)0*{digits}(?!\d)") if digits else set(),
        ]
    found = next((way for way in ways if way), [])
    if len(found) == 1:
        return min(found)
    meant = f"{wanted!r}" if wanted is not None else f"the lab {lab}"
    says = "more than one of its assignments may be" if found else "none of its assignments is"
    raise CommandError(
        f"{sheet.path}: {says} {meant}: {_list(titles[c] for c in sorted(found) or columns)}; name "
        "one with --column, by its title or the number behind it."
    )


def _fill(rows, results, put, partial):
    """Put each result into its row and return the report.

    rows: {row: (identifier, name, why it must stay or '')};  put(row, result) returns what it replaced.
    """
    names, of, unclear = labels(results), *_match(rows, results)
    filled, replaced, held, failed = [], [], [], []
    stays = {}  # reason: names of the rows
    for row, at in of.items():
        result, name, stay = results[at], names[at], rows[row][2]
        if stay:
            stays.setdefault(stay, []).append(name)
        elif result.problem:
            failed.append(name)
        elif result.open and not partial:
            held.append(name)
        else:
            filled.append(name)
            if old := put(row, result):
                replaced.append(f"{name} ({' and '.join(old)})")
    doubtful = [names[at] for at in unclear]
    left = [names[at] for at in range(len(results)) if at not in of.values() and at not in unclear]
    without = [name or identifier for row, (identifier, name, _) in rows.items() if row not in of]
    report = [f"Filled in: the {'grade' if len(filled) == 1 else 'grades'} of {_some(filled)}."]
    for sentence, who in (
        ("Something else was there before: {}.", replaced),
        ("Left as they were, since written answers wait to be marked: {}; --partial fills them in.", held),
        ("Left as they were, since the submission could not be graded: {}.", failed),
        *((f"Left as they were, since the table says '{stay}': {{}}.", who) for stay, who in stays.items()),
        ("Graded, but not in the table: {}.", left),
        ("Graded, but more than one row or result fits: {}; fill these in by hand.", doubtful),
        ("In the table without a graded submission: {}.", without),
    ):
        if who:
            report.append(sentence.format(f"{len(who)} ({_list(who)})"))
    return report


def _match(rows, results):
    """({row: index of its result}, indices of results that may be several rows' or share one)."""
    numbers = {row: _digits(identifier) for row, (identifier, _, _) in rows.items()}
    keys = {row: name_key(name) for row, (_, name, _) in rows.items()}
    mine, called = [_digits(result.identifier) for result in results], [name_key(r.student) for r in results]
    of, unclear = {}, set()
    for ours, theirs in ((mine, numbers), (called, keys)):
        many, places = Counter(ours), {}
        for row, key in theirs.items():
            places.setdefault(key, []).append(row)
        for at, key in enumerate(ours):
            if not key or key not in places or at in of.values():
                continue
            if many[key] > 1 or len(places[key]) > 1 or places[key][0] in of:
                unclear.add(at)
            else:
                of[places[key][0]] = at
    return of, sorted(unclear - set(of.values()))


def comment(result):
    """What the table tells the student on one line: the points, then why each check that lacks some does."""
    text = f"Points: {plain(result.points, 2)} of {plain(result.max_points, 2)}."
    why = {}  # the same reason is told once
    for mark in result.marks:
        if mark.points is None:
            why.setdefault("not marked yet.", []).append(mark.check)
        elif mark.reason and (mark.points < mark.max_points or mark.status == BY_HAND):
            why.setdefault(clean(mark.reason), []).append(mark.check)
    end = " … See your feedback page."
    for reason, checks in why.items():
        more = f" {checks[0]}{f' and {len(checks) - 1} more' if len(checks) > 1 else ''}: {reason}"
        room = LONGEST - len(end) - len(text)
        if len(more) > room:
            return text + (more[:room].rsplit(" ", 1)[0] if room > 60 else "") + end
        text += more
    return text


def _put_grade(sheet, row, column, result, most, comma):
    """Set a cell to the points of `result` out of `most`; returns a list that names another grade before."""
    share = result.points / result.max_points if result.max_points else 0
    text, old = plain(share * most, 2), sheet.cell(row, column)
    if number(old) == number(text):
        return []  # '7,50' stays '7,50'
    sheet.put(row, column, text.replace(".", ",") if comma else text)
    return [f"the grade {old}"] if old else []


def _decimal_comma(sheet, columns):
    """Whether the numbers in `columns` have a decimal comma."""
    texts = [sheet.cell(i, c) for i in sheet.body() for c in columns if c is not None]
    return any("," in text and number(text) is not None for text in texts)


def _one_lab(results):
    """The lab of all `results`; Problem when they are of several."""
    labs = sorted({result.lab for result in results})
    if len(labs) > 1:
        raise CommandError(f"The table is for one lab, but there are results of {_list(labs)}; choose one.")
    return labs[0] if labs else ""


def _one(items):
    """The only one of `items`, or None when there is none or more."""
    items = list(items)
    return items[0] if len(items) == 1 else None


def _digits(identifier):
    """'123' of 'Participant 123', 'Teilnehmer/in123', '0123'; '' without a number at the end."""
    found = re.search(r"(\d+)\s*$", identifier)
    return found[1].lstrip("0") if found else ""


def fold(text):
    """`text` without capitals, accents and idle spaces, for comparing."""
    letters = unicodedata.normalize("NFKD", " ".join(text.split()).casefold())
    return "".join(letter for letter in letters if unicodedata.category(letter) != "Mn").rstrip(".")


def name_key(name):
    """The words of a name in no order: one key for 'Lovelace, Ada' and 'Ada  LOVELACE'."""
    return tuple(sorted(fold(name).replace(",", " ").split()))


def _some(names):
    return f"{len(names)} student{'' if len(names) == 1 else 's'}"


def _list(names):
    names = list(names)
    rest = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + rest

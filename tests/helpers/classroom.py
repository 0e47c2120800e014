"""A made-up class: notebooks filled in rightly, wrongly, half and with bad intent, and packed as an LMS does."""

import io
import json
import zipfile
from dataclasses import dataclass

from labkit.instructor.authoring.spec import definitions

from helpers.reference import ROOT

LAB = "01_cartesian_ekf"
NAMES = [
    "Ada",
    "Bela",
    "Chloé",
    "Dmitri",
    "Emine",
    "Farid",
    "Gerda",
    "Hồng",
    "Ines",
    "Jürgen",
    "Kofi",
    "Lena",
    "Māra",
    "Noor",
    "Oleg",
    "Priya",
    "Qin",
    "Rosa",
    "Søren",
    "Tomás",
]
FAMILIES = ["Lovelace", "van der Berg", "O'Hara"]


@dataclass(frozen=True)
class Pupil:
    """One student: what the notebook holds, and how it reached the LMS."""

    name: str
    number: int
    kind: str
    notebooks: tuple  # of (file name, notebook as a dictionary, (year, month, day, hour, minute, second))


def blank(lab=LAB):
    """The students' notebook as a dictionary."""
    book = json.loads((ROOT / "notebooks" / f"{lab}.ipynb").read_text(encoding="utf-8"))
    for cell in book["cells"]:
        cell["source"] = "".join(cell["source"])
    return book


def answers(lab=LAB):
    """{cell id: source} of the answer cells in the solution notebook."""
    book = json.loads((ROOT / "solutions" / f"{lab}.ipynb").read_text(encoding="utf-8"))
    return {c["id"]: "".join(c["source"]) for c in book["cells"] if c["metadata"].get("labkit") == "answer"}


def filled(lab=LAB, edits=(), own=(), **cells):
    """A notebook with all answers: edits (old, new) are made in them, `own` cells come last.

    cells: {id with _ for -: source} replaces a cell's source; None leaves the stub.
    """
    book, given = blank(lab), answers(lab)
    given.update({id.replace("_", "-"): source for id, source in cells.items()})
    for old, new in edits:
        holders = [id for id, source in given.items() if source and old in source and cell_is_code(book, id)]
        assert len(holders) == 1, (old, holders)
        given[holders[0]] = given[holders[0]].replace(old, new)
    for cell in book["cells"]:
        if given.get(cell["id"]) is not None:
            cell["source"] = given[cell["id"]]
    book["cells"] += [code(source, f"own{i}") for i, source in enumerate(own)]
    return book


def cell_is_code(book, id):
    return any(cell["id"] == id and cell["cell_type"] == "code" for cell in book["cells"])


def code(source, id):
    return {"cell_type": "code", "id": id, "metadata": {}, "source": source, "outputs": [], "execution_count": None}


def mistaken(number, lab=LAB):
    """A notebook with the known mistake `number` (they are counted round)."""
    checks = [check for check in definitions(ROOT) if check.lab == lab]
    forms = [(m, form) for check in checks for m in check.mistakes for form in m.forms if usable(lab, form)]
    mistake, form = forms[number * 7 % len(forms)]
    return mistake.id, filled(lab, form)


def usable(lab, form):
    """Whether a form is made of edits of the answer cells alone."""
    given = {id: s for id, s in answers(lab).items() if cell_is_code(blank(lab), id)}
    return not isinstance(form, str) and all(sum(old in s for s in given.values()) == 1 for old, _ in form)


HOSTILE = [
    ("exit", {"own": ["import os\nKF.predict = lambda self, u: os._exit(0)"]}),
    ("forger", {"own": ["np.allclose = lambda *a, **k: True\ncheck = print\nKF.update = lambda self, y: None"]}),
    ("looper", {"own": ["def forever(self, y):\n    while True: pass\nKF.update = forever"]}),
]


def a_class(count=60, lab=LAB, hostile=True):
    """`count` pupils of every kind; most are right or wrong in a known way."""
    pupils = []
    for i in range(count):
        name = f"{NAMES[i % len(NAMES)]} {FAMILIES[i // len(NAMES) % len(FAMILIES)]}" + (f" {i}" if i >= 60 else "")
        day, right = (2026, 11, 10, 12, 0, 0), filled(lab)
        kind, books = "right", [right]
        if i % 10 in (3, 4, 5):
            mistake, book = mistaken(i, lab)
            kind, books = f"mistake {mistake}", [book]
        elif i % 10 == 6:
            kind, books = "half", [filled(lab, answer_kf=None)]
        elif i % 10 == 7:
            kind, day = "late", (2026, 11, 21, 9, 30, 0)
        elif i % 10 == 8:
            kind, books = "twice", [filled(lab, answer_kf=None), right]
        elif hostile and i % 20 == 9:
            label, what = HOSTILE[i // 20 % len(HOSTILE)]
            kind, books = f"hostile {label}", [filled(lab, **what)]
        notebooks = tuple(
            (f"{lab}{'' if j == 0 else f' ({j})'}.ipynb", book, (*day[:2], day[2] + j, *day[3:]))
            for j, book in enumerate(books)
        )
        pupils.append(Pupil(name, 1000 + i, kind, notebooks))
    return pupils


def zipped(files):
    """The bytes of a zip of {name: bytes}."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as file:
        for name, raw in files.items():
            file.writestr(name, raw)
    return content.getvalue()


def moodle_zip(path, pupils):
    """Write what Moodle's 'download all submissions' gives."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for pupil in pupils:
            for name, book, when in pupil.notebooks:
                inside = f"{pupil.name}_{pupil.number}_assignsubmission_file/{name}"
                archive.writestr(zipfile.ZipInfo(inside, when), json.dumps(book))
    return path


def worksheet(path, pupils, most=20):
    """Write Moodle's grading worksheet for these pupils."""
    head = (
        'Identifier,"Full name","Email address",Status,Grade,"Maximum Grade","Grade can be changed",'
        '"Last modified (submission)","Last modified (grade)","Feedback comments"'
    )
    rows = [
        f'"Participant {p.number}","{p.name}",x{p.number}@example.org,"Submitted for grading",,{most:.2f},Yes,-,-,'
        for p in pupils
    ]
    path.write_text("\r\n".join([head, *rows, ""]), encoding="utf-8")
    return path


def as_file(path, book):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(book), encoding="utf-8")
    return path

"""Reading notebooks, running their cells without Jupyter, and fetching answers of earlier labs."""

import json

import pytest

from labkit.checks.feedback import LabError
from labkit.notebook import answers, read as notebook
from labkit.notebook.answers import EarlierLabError, load_answer
from labkit.notebook.read import NotebookError, read
from labkit.notebook.session import Session, plain

from helpers.notebooks import LAB1, code, released, save

FILTER = "    def update(self, y):"  # a line of the answer cell of lab 1


def cells(tmp_path, *sources):
    return read(save(tmp_path / "a.ipynb", {"nbformat": 4, "cells": [code(s, i) for i, s in sources]}))


# Files

GOOD = json.dumps(released(LAB1))
BAD = {
    "is empty": b"\n",
    "byte order mark": b"\xef\xbb\xbf" + GOOD.encode(),
    "byte order mark:": GOOD.encode("utf-16"),
    "not UTF-8": GOOD.encode() + b"\xff",
    "line 1 is not JSON": b"import numpy",
    "ends in the middle": GOOD[: len(GOOD) // 2].encode(),
    "ends in the middle:": GOOD[:-1].encode(),
    "nested too deeply": b"[" * 200_000,
    "is JSON, but not a notebook": b"[1, 2]",
    "is JSON, but not a notebook.": b'{"nbformat": "4"}',
    "of format 3, not 4": b'{"nbformat": 3, "worksheets": []}',
    "of format 5, not 4": b'{"nbformat": 5, "cells": []}',
    "without a list of cells": b'{"nbformat": 4, "cells": {}}',
    "cell 1 is not": b'{"nbformat": 4, "cells": [7]}',
    "cell 2 is not": b'{"nbformat": 4, "cells": [{"cell_type": "", "source": ""}, {"cell_type": "", "source": [1]}]}',
}


@pytest.mark.parametrize("says", BAD)
def test_a_file_that_is_no_notebook_is_told_in_one_line(tmp_path, says):
    path = tmp_path / "a.ipynb"
    path.write_bytes(BAD[says])
    with pytest.raises(NotebookError) as caught:
        read(path)
    assert says.rstrip(":.") in str(caught.value) and "a.ipynb" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_folders_and_large_files(tmp_path, monkeypatch):
    with pytest.raises(NotebookError, match="does not exist"):
        read(tmp_path / "no.ipynb")
    with pytest.raises(NotebookError, match="is a folder"):
        read(tmp_path)
    monkeypatch.setattr(notebook, "MAX_BYTES", 1000)
    with pytest.raises(NotebookError, match="clear its outputs"):
        read(save(tmp_path / "a.ipynb", GOOD))


def test_roles_come_from_metadata_then_tags_then_ids(tmp_path):
    content = {
        "nbformat": 4,
        "cells": [
            code("1", "setup"),
            code("2", "x1", labkit="answer"),
            code("3", "x2", tags=["hide", "check"]),
            code("4", "answer-kf"),
            code("5", "9f3a"),
            code("6", "answer-x", labkit="show"),
            code("7", None, labkit=3, tags=3),
            {"cell_type": "markdown", "source": ["a\n", "b"], "id": "text-1"},
        ],
    }
    found = read(save(tmp_path / "a.ipynb", content))
    assert [c.role for c in found] == ["setup", "answer", "check", "answer", "own", "show", "own", "text"]
    assert [c.label for c in found][1:5] == ["cell 2", "cell 3", "cell 'answer-kf'", "cell 5"]
    assert found[-1].source == "a\nb" and not found[-1].code


# Cells


@pytest.mark.parametrize(
    "source, result",
    [
        ("%matplotlib inline\nx = 1", "None\nx = 1"),
        ("if 1:\n    !ls\n    y = 2", "if 1:\n    None\n    y = 2"),
        ("files = !ls\nnp.kron?\n?np.kron", "files = None\nNone\nNone"),
        ("%%time\nx = 1", "None\nx = 1"),
        ("%%bash\nrm -rf x", ""),
        ("x = (7\n     % 4)", "x = (7\n     % 4)"),
    ],
)
def test_magics_are_taken_out(source, result):
    assert plain(source) == result


def events(tmp_path, *sources, wanted=()):
    session = Session(cells(tmp_path, *sources), wanted=wanted)
    return list(session.run()), session.names


def test_only_what_is_needed_runs(tmp_path):
    told, names = events(
        tmp_path,
        ("setup", "import math"),
        ("own1", "%pip list\nfactor = 2\nwhile True: pass\n"),
        ("own2", "1 / 0\nunused = later"),
        ("show-1", "offset = display(3) and 1"),
        ("answer-f", "def f(x):\n    return math.floor(factor * x) + offset"),
        ("own3", "f.twice = 2"),
        ("check-f", "check = lambda name, f: names.append(f(1.6) + f.twice)\nnames = []\ncheck('f', f)"),
    )
    assert [(e.check, e.error) for e in told] == [("f", None)]
    assert names["names"] == [6] and "unused" not in names


def test_a_class_needs_no_cell_for_the_names_that_it_makes_itself(tmp_path):
    source = "class A:\n    @property\n    def P(self):\n        return own\n    @P.setter\n    def P(self, P):\n"
    source += "        pass\n    Q = Q"
    told, names = events(
        tmp_path, ("show-1", "P = 1 / 0"), ("show-2", "Q = 2"), ("show-3", "own = 5"), ("answer-a", source)
    )
    assert told == [] and "P" not in names and names["A"].Q == 2 and names["A"]().P == 5


NAMES = {  # a statement: what it sets, and what it may look up
    "x += 1": ("x", "x"),
    "del x": ("", ""),
    "import a.b": ("a", ""),
    "from a import b as c": ("c", ""),
    "for i in r:\n    x = [i * w for w in r if (y := w)], {k: v for k, v in z}": ("i x y", "i r z"),
    "def f(a, b=k):\n    global g\n    g = n = a\n    n += m": ("f g", "k m"),
    "@dec\ndef f(x: T):\n    return lambda: x + y": ("f", "T dec y"),
    "class A(B):\n    x = x\n    y = x\n    def f(self): return y": ("A", "B x y"),
    "class A:\n    n = 0\n    n += m\n    def f(self): return super().f()": ("A", "m super"),
    "class A:\n    global g\n    g = 1\n    from m import x\n    y = x": ("A g", ""),
}


@pytest.mark.parametrize("source", NAMES)
def test_the_names_that_a_statement_sets_and_looks_up(tmp_path, source):
    (step,) = Session(cells(tmp_path, ("answer", source))).steps
    sets, uses = NAMES[source]
    assert (step.sets, step.uses) == (set(sets.split()), set(uses.split()))


def test_a_cell_that_stops_is_told_if_it_matters(tmp_path):
    check = ("check-f", "def check(name, f):\n    f()\ncheck('f', f)")
    told, _ = events(
        tmp_path,
        ("own", "import nothing_like_it as n\nhelp_me = n.one"),
        ("own2", "1 / 0"),
        ("answer-f", "def f():\n    return help_me"),
        check,
    )
    assert len(told) == 1 and told[0].check == "f"
    assert "cell 'answer-f', in f, line 2:  return help_me" in told[0].lines
    assert any("`help_me` comes from cell 1, which stopped: ModuleNotFoundError" in line for line in told[0].lines)
    told, _ = events(tmp_path, ("answer-f", "def f(:\n    pass"), check)
    assert [e.where for e in told] == ["cell 'answer-f'", "cell 'check-f'"]
    assert "cell 'answer-f', line 1:  def f(:" in told[0].lines
    assert any("`f` may come from cell 'answer-f'" in line for line in told[1].lines)
    told, _ = events(tmp_path, ("setup", "1 / 0\ndef f(): pass"), check)
    assert [(e.check, bool(e.error)) for e in told] == [("", True), ("f", False)]
    told, _ = events(tmp_path, ("answer-f", "def f(): pass\nexit()"), ("check-f", "# check('f', f)"))
    assert [e.lines[0].split(":")[0].rstrip(".") for e in told] == ["This cell calls no check any more", "SystemExit"]


# Answers of earlier labs


def test_load_answer_of_a_filled_in_notebook(tmp_path, capsys, monkeypatch):
    extra = [
        ("answer-stack", "%matplotlib inline\ndef minus(a, b):\n    print('x')\n    return a - b\nwhile True: pass")
    ]
    save(tmp_path / f"{LAB1}.ipynb", released(LAB1, ("seen - expected", "minus(seen, expected)"), extra=extra))
    from labkit import check

    check("cartesian-kf", load_answer(LAB1, "KF", tmp_path))
    monkeypatch.chdir(tmp_path)
    capsys.readouterr()
    assert load_answer(LAB1, "repeat_R")([[1]], 2).tolist() == [[1, 0], [0, 1]]
    assert capsys.readouterr().out == ""


def test_load_answer_of_an_unfilled_notebook_complains_only_when_used(tmp_path):
    save(tmp_path / f"{LAB1}.ipynb", released(LAB1, fill=False))
    kf = load_answer(LAB1, "KF", tmp_path)([0, 0], [[1, 0], [0, 1]], [[1, 0], [0, 1]], [[1, 0], [0, 1]], [])
    with pytest.raises(NotImplementedError):
        kf.predict([0, 0])


def test_load_answer_tells_if_its_check_does_not_pass_yet(tmp_path, capsys, monkeypatch):
    def told(*edits, **options):
        save(tmp_path / f"{LAB1}.ipynb", released(LAB1, *edits, **options))
        load_answer(LAB1, "KF", tmp_path)
        return capsys.readouterr().out

    assert told() == ""
    text = told(("seen - expected", "expected - seen"))
    assert text.startswith("Your `KF` from lab 1 does not pass its check yet: The correction points the wrong way")
    assert text.endswith("Finish it there, save it (Ctrl+S), and run this cell again.\n")
    assert "yet: `predict` is still to be written.\n" in told(fill=False)
    monkeypatch.setattr(answers, "SECONDS", 0.5)
    assert "yet: It was still running when" in told(("p = len(y)", "p = len(y)\n        while p: pass"))


def test_load_answer_says_what_to_do(tmp_path):
    with pytest.raises(EarlierLabError, match=r"Fill in `KF` in lab 1 first.*Ctrl\+S.*again"):
        load_answer(LAB1, "KF", tmp_path)
    save(tmp_path / f"{LAB1}.ipynb", released(LAB1, (FILTER, FILTER[:-1])))
    with pytest.raises(EarlierLabError) as caught:
        load_answer(LAB1, "KF", tmp_path)
    text = str(caught.value)
    assert "SyntaxError" in text and f"{LAB1}, cell 'answer-kf', line" in text and FILTER[:-1].strip() in text
    save(tmp_path / f"{LAB1}.ipynb", "{")
    with pytest.raises(LabError, match="ends in the middle"):
        load_answer(LAB1, "KF", tmp_path)


def test_load_answer_leaves_no_figures(tmp_path):
    from matplotlib import pyplot as plt

    extra = [
        (
            "answer-stack",
            "import matplotlib.pyplot as plt\nfig, ax = plt.subplots()\ndef minus(a, b):\n    fig\n    return a - b",
        )
    ]
    save(tmp_path / f"{LAB1}.ipynb", released(LAB1, ("seen - expected", "minus(seen, expected)"), extra=extra))
    before = plt.get_fignums()
    load_answer(LAB1, "KF", tmp_path)
    assert plt.get_fignums() == before

"""Reading notebooks, running their cells without Jupyter, and fetching answers of earlier labs."""

import ast
import json

import pytest

from labkit.checks.feedback import LabError
from labkit.notebook import read as notebook, rehearse
from labkit.notebook.answers import EarlierLabError, load_answer
from labkit.notebook.names import names
from labkit.notebook.read import NotebookError, read
from labkit.notebook.session import Session
from labkit.notebook.source import python, statements

from helpers.notebooks import LAB1, code, released, save
from helpers.reference import LABS, ROOT

FILTER = "    def update(self, y):"  # a line of the answer cell of lab 1


def cells(tmp_path, *sources):
    return read(save(tmp_path / "a.ipynb", {"nbformat": 4, "cells": [code(s, i) for i, s in sources]}))


# Files

GOOD = json.dumps(released(LAB1))
BAD = {
    "is empty": b"\n",
    "not UTF-8": b"\x89PNG\xff",
    "line 1 is not JSON": b"import numpy",
    "git's conflict marks are in it (line 3)": b"{\n\n<<<<<<< HEAD\n}\n=======\n}\n>>>>>>> theirs\n",
    "ends in the middle": GOOD[: len(GOOD) // 2].encode(),
    "ends in the middle:": GOOD[:-1].encode(),
    "git's conflict marks are in it (line 2)": b"{\r\n||||||| base\r\n=======\r\n}",
    "git's conflict marks are in it (line 2):": b"{\n=======\n}",
    "nested too deeply": b"[" * 200_000,
    "is JSON, but not a notebook": b"[1, 2]",
    "is JSON, but not a notebook.": b'{"nbformat": "4"}',
    "of format 2, not 4": b'{"nbformat": 2, "worksheets": []}',
    "without a list of": b'{"nbformat": 3, "worksheets": [7]}',
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


def test_what_other_programs_write_is_read_all_the_same(tmp_path):
    book = {"nbformat": 4, "cells": [code("x = 1  # ñ\ny = 2"), {"cell_type": "markdown"}]}
    text = json.dumps(book, ensure_ascii=False)
    lines = {**book, "cells": [{**code(""), "source": ["x = 1  # ñ", "y = 2"]}, {"cell_type": "code", "source": None}]}
    cells = [{"cell_type": "code", "input": ["x = 1  # ñ\n", "y = 2"]}, {"cell_type": "markdown", "source": ""}]
    older = {"nbformat": 3, "worksheets": [{"cells": cells[:1]}, {"cells": cells[1:]}]}
    twice = text.replace('"nbformat": 4', '"nbformat": 4, "nbformat": 4')
    raws = [text.encode(coding) for coding in ("utf-8-sig", "utf-16", "cp1252")]
    for raw in [*raws, twice.encode(), json.dumps(lines).encode(), json.dumps(older).encode()]:
        path = tmp_path / "a.ipynb"
        path.write_bytes(raw)
        assert [cell.source for cell in read(path)] == ["x = 1  # ñ\ny = 2", ""]


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
    "source, means",
    [
        ("%matplotlib inline\nx = 1", ["get_ipython().run_line_magic('matplotlib', 'inline')", "x = 1"]),
        ("if 1:\n    !ls\n    y = 2", ["if 1:\n    get_ipython().system('ls')\n    y = 2"]),
        ("!echo a \\\n  b\nx = 1", ["get_ipython().system('echo a    b')", "x = 1"]),
        ("files = !ls", ["files = get_ipython().getoutput('ls')"]),
        ("np.kron?\n?np.kron", ["get_ipython().run_line_magic('pinfo', 'np.kron')"] * 2),
        ("%%time\nx = 1", ["x = 1"]),
        (
            "\n%%capture out\n%matplotlib inline\nx = 1",
            ["get_ipython().run_line_magic('matplotlib', 'inline')", "x = 1"],
        ),
        ("%time x = f(1)", ["x = f(1)"]),
        ("%%timeit\nx = 1", []),
        ("%%bash\nrm -rf x", []),
        ("%%writefile -a h.py\nx = 1\n", ["__labkit_write__('h.py', 'x = 1\\n', True)"]),
        ("    x = 1\n    y = 2", ["x = 1", "y = 2"]),
        ("x = (7\n     % 4)", ["x = 7 % 4"]),
    ],
)
def test_a_cell_means_what_it_means_in_jupyter(source, means):
    assert [ast.unparse(node) for node in statements(python(source), "f")] == means


@pytest.mark.parametrize("source", ["\n%%time\n\n1 / 0", "\n\n%matplotlib inline\n1 / 0", "x = 1\n\n\n1 / 0"])
def test_lines_keep_their_numbers(source):
    assert statements(python(source), "f")[-1].lineno == 4


def left(tmp_path, *sources, wanted, given=()):
    """(problems, names) that a session leaves."""
    session = Session(cells(tmp_path, *sources))
    session.supply(cells(tmp_path, *given))
    return list(session.run(wanted)), session.names


def test_only_what_is_needed_runs(tmp_path):
    told, names = left(
        tmp_path,
        ("setup", "import math\nimport nothing_like_it"),
        ("own1", "%pip list\nfactor = 2\nwhile True: pass\n"),
        ("own2", "1 / 0\nunused = later"),
        ("show-1", "offset = display(3) and 1"),
        ("answer-f", "def f(x):\n    return math.floor(factor * x) + offset\nprint(1 / 0)"),
        ("own3", "f.twice = 2"),
        wanted="f",
    )
    assert told == [] and "unused" not in names and names["f"](1.6) + names["f"].twice == 6


F = "def f(): return g()"
PLACES = {  # cells that leave f() == 1, whatever a student's programs made of them
    "in another cell": [("answer-f", ""), ("own", "def f(): return 1")],
    "copied": [("answer-f", "def f(): return 1"), ("own", "def f(): return 1")],
    "two in one cell": [("answer-g", "def g(): return 1\n\ndef f(): return g()"), ("own", "x = 3")],
    "the last one counts": [("own", "def f(): return 2"), ("answer-f", "def f(): return 1")],
    "the last one counts, wherever it stands": [("answer-f", "def f(): return 2"), ("own", "def f(): return 1")],
    "above the stub": [("own", "def f(): return 1"), ("answer-f", "def f():\n    raise NotImplementedError('write')")],
    "in the set-up": [("setup", "import math\ndef f(): return math.floor(1.5)")],
    "in a check's cell": [("check-f", "def f(): return 1\ncheck('f', f)")],
    "helper in a cell that shows": [("answer-f", F), ("show-1", "print(1 / 0)\ndef g(): return 1")],
    "a method later": [("answer-f", "class f:\n  def __new__(c): return c.g()"), ("own", "f.g = lambda: 1")],
    "setattr": [("answer-f", "class f:\n  def __new__(c): return c.g()"), ("own", "setattr(f, 'g', lambda: 1)")],
    "a patching function": [
        ("answer-f", "class f:\n  def __new__(c): return c.g()\ndef add(c):\n  c.g = lambda: 1\nadd(f)")
    ],
    "a function that sets it": [("answer-f", "def make():\n  global f\n  f = lambda: 1\nmake()")],
    "a function that patches it": [
        ("answer-f", "class f:\n  def __new__(c): return c.g()\ndef patch():\n  f.g = lambda: 1\npatch()")
    ],
    "a module in a folder": [
        ("own", "import os\nos.makedirs('sub_folder', exist_ok=True)"),
        ("own2", "import sys\nsys.path.append('sub_folder')\nos.makedirs('sub_folder', exist_ok=True)"),
        ("own3", "%%writefile mod_two.py\ndef f(): return 1"),
        ("answer-f", "from mod_two import f"),
    ],
    "a patching decorator": [
        ("own", "def to(c):\n  def put(m): setattr(c, m.__name__, m)\n  return put"),
        ("answer-f", "class f:\n  def __new__(c): return c.g()"),
        ("own2", "@to(f)\ndef g(): return 1"),
    ],
    "in a loop": [("answer-f", "made = {}\nfor n in 'gf':\n    made[n] = lambda: 1\nf = made['f']")],
    "a list that grows": [("own", "parts = []"), ("own2", "parts.append(1)"), ("answer-f", "def f(): return parts[0]")],
    "a dataclass": [
        ("own", "from __future__ import annotations\nfrom dataclasses import dataclass"),
        ("answer-f", "@dataclass\nclass F:\n    x: F | None = 1\ndef f() -> Nowhere: return F().x"),
    ],
    "a factory": [("answer-f", "def make(n):\n    def f(): return n\n    return f\nf = make(1)")],
    "a subclass": [("own", "class A:\n  def __new__(c): return 1"), ("answer-f", "class f(A): pass")],
    "a star": [("own", "%%writefile starred.py\ndef f(): return 1"), ("own2", "from starred import *")],
    "%run": [("own", "%%file ran.py\ndef f(): return 1"), ("own2", "%run ran")],
    "a module": [
        ("own", "%%writefile mod_one.py\nONE = 1"),
        ("answer-f", "import mod_one\ndef f(): return mod_one.ONE"),
    ],
    "after magics": [("answer-f", "%%time\n%matplotlib inline\n!ls \\\n  x\ndef f(): return 1\nf?")],
    "await": [("answer-f", "import asyncio\nasync def one(): return 1\nx = await one()\ndef f(): return x")],
    "after a question": [("own", "n = int(input('n? '))"), ("answer-f", "def f(): return 1"), ("own2", "print(n)")],
    "after a loop without end": [("answer-f", "x = 1\ndef f(): return x\nwhile True: pass")],
    "after an error in its own cell": [("answer-f", "f = 1 / 0\ndef f(): return 1")],
    "under a condition": [("answer-f", "try:\n    import no_such as f\nexcept ImportError:\n    def f(): return 1")],
    "given": [("answer-f", "def f(): return given_one()")],
    "given, but changed": [("answer-f", "def f(): return given_two()"), ("own", "def given_two(): return 1")],
}


@pytest.mark.parametrize("place", PLACES)
def test_an_answer_is_found_wherever_it_stands(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    given = [("setup", "def given_one(): return 1\ndef given_two(): return 2\nf = 5")]
    _, names = left(tmp_path, *PLACES[place], wanted=["f"], given=given)
    assert names["f"]() == 1


def test_statements_that_take_too_long_are_told_and_the_others_go_on(tmp_path):
    ran = Session(cells(tmp_path, ("own", "while True: x = 1\ny = 2"), ("answer-f", "f = lambda: y\nz = x")))
    told, names = list(ran.run("fx", seconds=0.5)), ran.names
    assert [(problem.where, problem.lines[0][:23]) for problem in told] == [("cell 1", "It was still running wh")]
    assert names["f"]() == 2


def test_plots_and_questions_in_a_needed_statement(tmp_path):
    told, _ = left(tmp_path, ("answer-f", "f = input('how many? ')"), wanted="f")
    assert "`input()` waits for somebody to type" in told[0].lines[0]
    told, _ = left(tmp_path, ("answer-f", "class f:\n    n = int(input())"), wanted="f")
    assert "`input()` waits for somebody to type" in told[0].lines[0]


def test_a_class_needs_no_cell_for_the_names_that_it_makes_itself(tmp_path):
    source = "class A:\n    @property\n    def P(self):\n        return own\n    @P.setter\n    def P(self, P):\n"
    source += "        pass\n    Q = Q"
    told, names = left(
        tmp_path, ("show-1", "P = 1 / 0"), ("show-2", "Q = 2"), ("show-3", "own = 5"), ("answer-a", source), wanted="A"
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
    "async def f(a):\n    async with b as c:\n        return [d async for d in c]": ("f", "b"),
    "x = await f(y)": ("x", "f y"),
}


@pytest.mark.parametrize("source", NAMES)
def test_the_names_that_a_statement_sets_and_looks_up(source):
    found = names(ast.parse(source).body[0])
    assert (found.sets, found.uses) == tuple(set(words.split()) for words in NAMES[source])


CHANGES = {  # a statement: what it may change
    "KF.update = f": "KF",
    "a.b[0].c = f": "a",
    "a[i] = a.b(c)": "a",
    "a.append(b)": "a",
    "x = a.pop()": "",
    "def f(): a.b = 1": "",
    "@patch(KF)\ndef f(): pass": "KF",
    "for c in cs:\n    c.x = 1": "c cs",
    "np.fill_diagonal(J, 1)": "np J",
    "shuffle(a)": "a",
    "@f.register\ndef _(x: int): pass": "f",
    "@f.register(int)\ndef _(x): pass": "f int",
}


@pytest.mark.parametrize("source", CHANGES)
def test_what_a_statement_may_change(source):
    assert names(ast.parse(source).body[0]).changes == set(CHANGES[source].split())


def test_a_cell_that_stops_is_told_if_it_matters(tmp_path):
    sources = [
        ("own", "import nothing_like_it as n\nhelp_me = n.one"),
        ("own2", "1 / 0"),
        ("answer-f", "def f():\n    return help_me"),
    ]
    ran = Session(cells(tmp_path, *sources))
    told = list(ran.run("f"))
    assert [problem.where for problem in told] == ["cell 1"] and "nothing_like_it" in told[0].lines[0]
    with pytest.raises(NameError) as caught:
        ran.names["f"]()
    lines = ran.lines(caught.value)
    assert "cell 'answer-f', in f, line 2:  return help_me" in lines
    assert any("`help_me` comes from cell 1, which stopped: ModuleNotFoundError" in line for line in lines)
    told, names = left(tmp_path, ("answer-f", "def f(:\n    pass"), ("own", "def g(): pass"), wanted="fg")
    assert [problem.where for problem in told] == ["cell 'answer-f'"] and "g" in names and "f" not in names
    assert "cell 'answer-f', line 1:  def f(:" in told[0].lines
    assert left(tmp_path, ("answer-f", "def f(): pass\nexit()"), wanted="f")[0] == []


def test_conflict_marks_in_a_cell_are_told(tmp_path):
    told, _ = left(tmp_path, ("answer-f", "<<<<<<< HEAD\ndef f(): pass\n=======\n>>>>>>> theirs"), wanted="f")
    assert "Git's conflict marks are in this cell" in told[0].lines[1]


def test_copies_of_a_cell_are_told_apart(tmp_path):
    source = "def f():\n    return 1 / 0"
    ran = Session(cells(tmp_path, ("answer-f", "def f(): return 1"), ("answer-f", source)))
    list(ran.run("f"))
    with pytest.raises(ZeroDivisionError) as caught:
        ran.names["f"]()
    assert ran.lines(caught.value)[-1] == "cell 2, in f, line 2:  return 1 / 0"


@pytest.mark.parametrize("lab", LABS)
def test_no_cell_of_a_lab_but_its_answers_makes_what_is_graded(lab):
    """So nothing of the lab's own takes the place of an answer, although the last definition counts."""
    ran = Session(read(ROOT / "notebooks" / f"{lab}.ipynb"))
    subjects = {name for step in ran.steps if step.role == "answer" and step.unfilled for name in step.names.sets}
    others = [step for step in ran.steps if step.role != "answer" and (step.names.sets | step.names.changes) & subjects]
    assert subjects and [(step.label, ast.unparse(step.node)) for step in others] == []


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
    monkeypatch.setattr(rehearse, "CALL", 0.5)
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


def test_load_answer_of_a_cell_that_wrote_it_where_the_notebook_is_alone(tmp_path, capsys):
    """As in Colab: there is no notebook of lab 1, and the student pastes the answer into one of lab 2."""
    with pytest.raises(EarlierLabError, match=rf"%%writefile {LAB1}.py.* what it uses of your own"):
        load_answer(LAB1, "KF", tmp_path)
    answers = [cell["source"] for cell in released(LAB1)["cells"] if cell["id"].startswith("answer")]
    (tmp_path / f"{LAB1}.py").write_text("\r\n".join("\n\n".join(map("".join, answers)).splitlines()), encoding="utf-8")
    from labkit import check

    check("cartesian-kf", load_answer(LAB1, "KF", tmp_path))  # though numpy is imported in no cell of it
    (tmp_path / f"{LAB1}.py").write_text("def KF(", encoding="utf-8")
    with pytest.raises(EarlierLabError, match=rf"Fill in `KF` in lab 1 first \({LAB1}.py\)"):
        load_answer(LAB1, "KF", tmp_path)
    (tmp_path / f"{LAB1}.py").write_bytes(b"\xff")
    with pytest.raises(EarlierLabError, match="cannot be read"):
        load_answer(LAB1, "KF", tmp_path)
    save(tmp_path / f"{LAB1}.ipynb", released(LAB1))  # the notebook itself goes first
    load_answer(LAB1, "KF", tmp_path)
    assert "0 of" not in capsys.readouterr().out


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


# What tools and habits of students do to right work


def leaves(tmp_path, monkeypatch, wanted, *sources, given=()):
    """What a notebook leaves under a name, with these cells of the lab as it was handed out."""
    monkeypatch.chdir(tmp_path)
    session = Session(cells(tmp_path, *((f"own{number}", source) for number, source in enumerate(sources))))
    session.supply(read(save(tmp_path / "lab.ipynb", {"nbformat": 4, "cells": [code(text) for text in given]})))
    assert list(session.run([wanted])) == []
    return session.names[wanted]


CHECK = 'check("cartesian-kf", {})'
HABITS = {
    "the lab uses a helper's name later": ("def run():\n    return 1", "def KF():\n    return run()", CHECK, "run = 3"),
    "they do, when all is checked": ("def h():\n    return 1", "def KF():\n    return h()", CHECK, "h = 0.5"),
    "and with a module's": ("import math", "def KF():\n    return math.floor(1.5)", CHECK, "for math in (2, 3): pass"),
    "by another name": ("class A: pass\nfor one in [A]:\n    one.x = 1", "def KF():\n    return A.x"),
    "by another name, with setattr": (
        "class A: pass\nfor a in [A]:\n    setattr(a, 'x', 1)",
        "def KF():\n    return A.x",
    ),
    "filled by a library": ("import heapq\nq = []\nheapq.heappush(q, 1)", "def KF():\n    return q[0]"),
    "%pylab": ("%pylab inline", "def KF():\n    return dot(ones(1), ones(1))"),
    "numpy's own sum": ("from numpy import *", "def KF():\n    return sum(array([[1, 0], [0, 0]]), axis=None)"),
    "%run with options": ("%%writefile a.py\ny = 1", "%run -i a.py one two", "def KF():\n    return y"),
    "%run of a notebook": ("%run mine.ipynb", "def KF():\n    return y"),
    "another name is checked": ("def MyKF():\n    return 1", CHECK.format("MyKF")),
    "the stub is still there": (
        "def KF():\n    raise NotImplementedError",
        "def MyKF():\n    return 1",
        CHECK.format("MyKF"),
    ),
}


@pytest.mark.parametrize("habit", HABITS)
def test_right_work_stays_right(tmp_path, monkeypatch, habit):
    save(tmp_path / "mine.ipynb", {"nbformat": 4, "cells": [code("%matplotlib inline\ny = 1")]})
    sources = [source.format("KF") for source in HABITS[habit]]
    assert leaves(tmp_path, monkeypatch, "KF", *sources, given=[CHECK.format("KF"), "run = 3"])() == 1


def test_the_last_definition_wins_all_the_same(tmp_path, monkeypatch):
    check = CHECK.format("KF")
    later = ["def h():\n    return 0", "def KF():\n    return h()", check]
    for change in ("def h():\n    return 1", "def g():\n    return 1", "h = lambda: 1", "KF = lambda: 1"):
        more = [change, "h = g"] if "g()" in change else [change]
        assert leaves(tmp_path, monkeypatch, "KF", *later, *more, given=[check])() == 1

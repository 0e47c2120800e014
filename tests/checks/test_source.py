"""What the text of a failed answer shows: slips of Python, told in sentences that are true as they stand."""

import ast
import linecache
import re
import time
from html import escape

import numpy as np
import pytest
from checks.test_checks import failure

from labkit import cli
from labkit.checks import DATA, CheckError, decide, observe, probe, source, stored
from labkit.checks.slips import Method, odd, slips
from labkit.instructor import records
from labkit.instructor.authoring.spec import answers, definitions
from labkit.instructor.exam.beside import beside
from labkit.instructor.records import Check, Mark, Result
from labkit.instructor.report.feedback import SENTENCES, feedback_page
from labkit.notebook import rehearse
from labkit.notebook.read import read
from labkit.notebook.session import Session

from helpers.notebooks import LAB1, ROOT, released, save

GAIN = "K = np.linalg.solve(S, H @ self.Pk_k).T"
S_LINE = "S = H @ self.Pk_k @ H.T + repeat_R(self.R, p)"
X_LINE, P_LINE = "self.xk_k = self.xk_k + K @ innovation", "self.Pk_k = self.Pk_k - K @ S @ K.T"
LAB3, LAB4 = "03_range_bearing_ekf", "04_legged_robot"
ROWS = "[[-dx / r, -dy / r], [dy / r**2, -dx / r**2]]"
TWICE = "[np.hypot(dx, dy), np.arctan2", "[2 * np.hypot(dx, dy), np.arctan2"
WRONG_ROWS = "[[-2 * dx / r, -2 * dy / r], [dy / r**2, -dx / r**2]]"


def told(*edits, name="cartesian-kf"):
    """What a check says of the solution with these edits, on one line."""
    return " ".join(str(failure(name, edits)).split())


def read_off(text, outside=(), bound=False):
    """All sentences about a source, without its places."""
    methods = [Method(node, bound) for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
    return [
        sentence.split(": ", 1)[1] for sentence in [*slips(methods, lambda name, _: name in outside), *odd(methods)]
    ]


FILTER = [  # an edit of lab 1's solution, and what is said of it
    (
        GAIN,
        "K = self.Pk_k @ H.T / S",
        "`self.Pk_k @ H.T / S` divides entry by entry. With the inverse it is `self.Pk_k @ H.T @ np.linalg.inv(S)`.",
    ),
    (
        GAIN,
        "K = self.Pk_k * H.T @ np.linalg.inv(S)",
        "multiplies entry by entry. The matrix product is `self.Pk_k @ H.T`.",
    ),
    (GAIN, "K = self.Pk_k @ H.T * np.linalg.inv(S)", "`self.Pk_k @ H.T * np.linalg.inv(S)` multiplies entry by entry."),
    (GAIN, "K = self.Pk_k @ H.T @ S**-1", "inverts entry by entry. The inverse is `np.linalg.inv(S)`."),
    (GAIN, "K = np.linalg.inv(S) @ H @ self.Pk_k", "begins with the inverse of S, which is last in"),
    (GAIN, "K = np.matrix(self.Pk_k @ H.T) * np.matrix(S).I", "`np.matrix` makes another type"),
    (GAIN, "K = self.Pk_k @ H.T @ S.I", "`S.I`: an array has no `.I`."),
    (S_LINE, "S = H @ self.Pk_k @ H.T + np.diag([0.16, 0.36] * p)", "`self.R` is set here, and no method reads it."),
    (X_LINE, "self.xk_k + K @ innovation", "what `self.xk_k + K @ innovation` gives is not kept"),
    (P_LINE, "P = self.Pk_k - K @ S @ K.T", "`P` gets a value that nothing uses."),
    (
        "self.xk_k = self.xk_k + self.dt * u",
        "u *= 2 * self.dt; self.xk_k = self.xk_k + u",
        "changes the caller's `u` too",
    ),
]


@pytest.mark.parametrize("old, new, says", FILTER, ids=[says for *_, says in FILTER])
def test_a_slip_is_told_with_its_line(old, new, says):
    text = told((old, new))
    assert says in text
    assert "In `update`, line " in text or "In `predict`, line " in text or "In `__init__`, line " in text


FUNCTIONS = [
    ("def f(rows):\n for row in rows:\n  x = row\n  return x", "this `return` ends the loop in its first pass."),
    ("def f(x):\n return x == 0.3", "`x == 0.3` looks at every digit: `np.isclose` allows for rounding."),
    ("def f(x):\n x == 3\n return x", "`x == 3` compares and stores nothing: `=` stores."),
    ("def f(y, v):\n np.append(y, v)\n return y", "what `np.append(y, v)` gives is not kept: no `=` stores it."),
    ("def f(x):\n x[2] = 0\n return x", "`x[2] = 0` changes the caller's `x` too."),
    ("def f(x):\n return x + m", "`m` is a global of the notebook: take it from an argument."),
]


@pytest.mark.parametrize("text, says", FUNCTIONS, ids=[says for _, says in FUNCTIONS])
def test_a_slip_of_a_function_is_told(text, says):
    (sentence,) = read_off(text, "m")
    assert sentence.startswith(says)


RIGHT = {
    "a scalar times a matrix": "def f(self):\n a = self.dt * self.Q\n return a + self.Q * self.dt + self.R / self.dt",
    "a scalar S": "def f(x, P, r):\n H = x[0]\n S = H @ P @ H + r\n return P @ H / S",
    "symmetric": "def f(P):\n return 0.5 * (P + P.T) + (P + P.T) / 2",
    "a correlation": "def f(P):\n s = np.sqrt(np.diag(P))\n return P / np.outer(s, s)",
    "the gain, transposed after": "def f(P, H, S):\n K = np.linalg.inv(S) @ H @ P\n return K.T",
    "the information form": "def f(H, A, R):\n K = np.linalg.inv(A) @ H.T @ np.linalg.inv(R)\n return K",
    "a search": "def f(rows):\n for row in rows:\n  if row:\n   return row\n",
    "a search that goes on": "def f(rows):\n for row in rows:\n  if not row:\n   continue\n  return row",
    "a copy": "def f(u):\n u = np.array(u)\n u *= 2\n u[0] = 1\n return u",
    "methods that change": "def f(self, y):\n rows = []\n rows.append(y)\n self.d2.append(y * 2)\n return rows",
    "names of one's own": "def f(self, a, b):\n add(a, b)\n return self.matrix(b).T",
    "an output": "def f(a, b):\n np.add(a, 1, out=b)\n return b",
    "a guard": "def f(w):\n return 1 if w == 0.0 else w",
    "a counter": "def f(rows):\n n = 0\n for _ in rows:\n  n += 1\n last = n\n return last",
    "a comprehension": "def f(rows):\n return [m + k for m in rows for k in m]",
    "a constant and a tool": "def f(x):\n return LIMIT + m(x)",
    "a closure": "def f(x):\n scale = 2\n def g(y):\n  return scale * y\n return g(x)",
}


@pytest.mark.parametrize("text", RIGHT.values(), ids=RIGHT)
def test_what_is_right_is_not_called_a_slip(text):
    assert read_off(text, {"m", "LIMIT"}) == []


CLASS = "class KF:\n def __init__(self, Q, R, m, dt):\n  {}\n def update(self, y):\n  {}"


def in_class(head, body, outside=()):
    return read_off(CLASS.format(head, body), outside, bound=True)


def test_a_global_is_named_with_the_field_that_should_stand_there():
    text = "self.Q = Q * dt; self.R = R / dt; self.map = m", "return m[0] + self.Q + self.R + self.map"
    assert in_class(*text, "mkf") == ["`m` is a global of the notebook: use `self.map`."]
    text = "self.Q = Q * dt; self.R = R / dt; self.map = m", "return R + kf.P + self.Q + self.R + self.map"
    use = "take it from an argument or from `self`."
    assert in_class(*text, {"R", "kf"}) == [
        "`R` is a global of the notebook: use `self.R`.",
        f"`kf` is a global of the notebook: {use}",
    ]


def test_the_text_and_the_object_agree_on_what_is_a_global():
    """A number beside the class may be a constant of it, unless the filter has a field of that name."""
    text = "dt = 0.25\ngate = 9.2\nQ = np.eye(2)\n"
    text += CLASS.format("self.Q = Q * dt; self.dt = dt", "return self.Q * self.dt + gate + Q[0] * dt")
    linecache.cache["cell 'own'"] = (len(text), None, text.splitlines(True), "cell 'own'")
    names = {"np": np}
    exec(compile(text, "cell 'own'", "exec"), names)
    notes = source.notes_on(names["KF"])
    assert sorted(line.split(": ", 1)[1] for line in notes) == [
        "`Q` is a global of the notebook: use `self.Q`.",
        "`dt` is a global of the notebook: use `self.dt`.",
    ]
    assert source.notes_in([ast.parse(text)], "KF") == notes


def test_what_a_property_reads_is_read():
    text = "class KF:\n def __init__(self, R):\n  self.R = R\n @property\n def noise(self):\n  return self.R\n"
    linecache.cache["cell 'own'"] = (len(text), None, text.splitlines(True), "cell 'own'")
    names = {}
    exec(compile(text, "cell 'own'", "exec"), names)
    assert source.notes_on(names["KF"]) == source.notes_in([ast.parse(text)], "KF") == []


def test_brackets_are_kept_in_what_is_suggested():
    (sentence,) = read_off("def f(self, P):\n return (P + self.Q) * self.R")
    assert sentence.endswith("The matrix product is `(P + self.Q) @ self.R`.")


def test_a_field_is_read_by_whoever_gets_the_filter():
    head = "self.Q = Q; self.R = R; self.map = m; self.dt = dt"
    assert len(in_class(head, "return self.R + self.map")) == 2
    assert (
        in_class(head, "return step(self)") == in_class("self.W = np.kron(Q * dt, R); n = m.n", "return self.W + n")[1:]
    )
    assert in_class("self.Q = Q; self.half = Q / 2", "return self.half") == []


def test_nothing_untrue_would_be_said_of_any_right_form(monkeypatch):
    """All cells of the lab are there, so that a name of a cell's would be seen."""
    monkeypatch.setattr(source, "MOST", 99)
    said, labs = {}, {}
    for check in definitions(ROOT):
        if check.lab not in labs:
            cells = read(ROOT / "solutions" / f"{check.lab}.ipynb")
            labs[check.lab] = answers(cells), [source.parsed(cell.source) for cell in cells if cell.code]
        text, trees = labs[check.lab]
        for id, form in [("", ()), *((right.id, right.form) for right in check.right)]:
            other = f"{text}\n{form}" if isinstance(form, str) else text
            for old, new in () if isinstance(form, str) else form:
                other = other.replace(old, new)
            notes = source.notes_in([*filter(None, trees), source.parsed(other)], check.subject)
            said |= {(check.name, id): notes} if notes else {}
    unused = "gets a value that nothing uses."  # as it is in these: a form leaves some line without a use
    assert said == {
        ("legged-one", "K S K'"): [f"In `update`, line 102: `I_KH` {unused}"],
        ("legged-ekf", "K S K'"): [f"In `update`, line 102: `I_KH` {unused}"],
        ("mismatch-nis", "block by block"): [f"In `nis`, line 22: `H` {unused}"],
    }


HOSTILE = {
    "empty": "",
    "no Python": "class KF(:",
    "NUL": "class KF:\n x = 1\0",
    "surrogates": "class KF:\n x = '\ud800'",
    "long": "class KF: pass\n" + "x = P * P\n" * 100_000,
    "brackets": "class KF:\n x = " + "(" * 50_000,
    "minus": "def KF(P):\n return " + "-" * 90_000 + "P",
    "sum": "def KF(P):\n return " + "P*" * 40_000 + "P",
    "dots": "def KF(P):\n return P" + ".T" * 40_000,
    "calls": "def KF(P):\n return " + "f(" * 150 + "P" + ")" * 150,
    "names": "def KF(P):\n" + "".join(f" a{n} = a{n + 1} * a{n + 1}\n" for n in range(5000)),
    "products": "def KF(P):\n return [" + "P * P, " * 2_000 + "]",
    "in place": "def KF(u):\n" + " u += 1\n" * 2_000,
    "ifs": "def KF(P):\n" + "".join(" " * n + "if P:\n" for n in range(1, 99)) + " " * 99 + "return P * P",
    "a long name": f"def KF({'x' * 90_000}):\n {'x' * 90_000} += 1",
    "doubled": "def KF(P):\n a0 = P\n" + "".join(f" a{n + 1} = a{n} @ a{n} * a{n}\n" for n in range(60)),
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_a_text_that_was_made_to_break_it_costs_nothing(text):
    start = time.process_time()
    tree = source.parsed(text)
    lines = source.notes_in([tree], "KF") if tree else []
    assert len(lines) <= 6 and all(len(line) <= 100 for line in lines)
    assert time.process_time() - start < 2


def test_without_a_text_nothing_is_said():
    names = {}
    exec("def stack(y):\n np.append(y, 1)\n return y", names)
    assert source.notes_on(names["stack"]) == source.notes_on(len) == source.notes_on(3) == source.notes_on(int) == []


def test_a_stub_is_not_read():
    assert "gets a value" not in told(("self.Pk_k = self.Pk_k + self.Q", "half = 1\n        raise NotImplementedError"))


# The same words in the notebook, by `labkit check` and on the feedback page


SAME = [
    (LAB1, "cartesian-kf", [(GAIN, "K = self.Pk_k @ H.T / S")], "divides entry by entry"),
    (LAB3, "range-bearing-kf", [(ROWS, WRONG_ROWS)], "First mend `jacobian`: its own check does not pass yet."),
    (
        LAB3,
        "range-bearing-kf",
        [(ROWS, WRONG_ROWS), TWICE],
        "First mend `h` and `jacobian`: their own checks do not pass",
    ),
    (LAB4, "legged-ekf", [("change / (2 * step)", "change / step")], "First mend `jacobian`: its own check does"),
    (LAB4, "legged-stack", [("change / (2 * step)", "change / step")], "First mend `jacobian`: its own check does"),
    (
        LAB4,
        "legged-ekf",
        [("[x[0] + dx, x[1] + dy", "[x[0] + dx, x[1] - dy")],
        "First mend `motion`: its own check does",
    ),
]


def graded(path, names, name):
    """The lines that the trusted side would give, from what the code gives and from the text of the cells."""
    seen = {}
    for other in DATA.glob("*.json"):
        if stored(other.stem)["lab"] == stored(name)["lab"]:
            seen[other.stem] = observe(stored(other.stem), names[stored(other.stem)["subject"]])
    if "probing" in stored(name):
        seen[name] |= probe(stored(name), names[stored(name)["subject"]])
    cells = [{"code": cell.code, "source": cell.source} for cell in read(path)]
    with pytest.raises(CheckError) as caught, beside(stored(name)["subject"], cells, seen):
        decide(stored(name), seen[name])
    return caught.value


def told_of(path, name):
    """The session of a notebook, and the sentences beside a check's report, as `labkit check` has them."""
    session = Session(read(path))
    assert not list(session.run(rehearse.subjects(rehearse.checks_of(path, session.calls))))
    lines = rehearse.Rehearsal(session).judge(name)
    return session, [line for line in lines if line.startswith(SENTENCES[1:])]


@pytest.mark.parametrize("lab, name, edits, says", SAME)
def test_notebook_and_grading_say_the_same(lab, name, edits, says, tmp_path):
    path = save(tmp_path / f"{lab}.ipynb", released(lab, *edits))
    session, lines = told_of(path, name)
    assert says in " ".join(lines)
    error = graded(path, session.names, name)
    assert [line for line in error.details if line.startswith(SENTENCES[1:])] == lines
    mark = Mark(name, 0, 2, records.FAILED, error.summary, tuple(error.details))
    page = feedback_page(Result("Ada", marks=[mark]), [Check(name, "KF", 2)], "Lab")
    first = re.sub("`(.*?)`", r"<code>\1</code>", escape(lines[0]))
    assert f"<p>{first}" in page


def test_the_check_command_says_it_too(tmp_path, capsys):
    path = save(tmp_path / f"{LAB1}.ipynb", released(LAB1, *SAME[0][2]))
    lines = told_of(path, "cartesian-kf")[1]
    cli.main(["check", str(path)])
    out = capsys.readouterr().out.splitlines()
    assert lines and all(f"      {line}" in out for line in lines)

"""The checks: right answers pass in any form, known mistakes are named, and all else gets a sentence."""

import json
import linecache
import sys
from pathlib import Path

import numpy as np
import pytest

from labkit.checks import DATA, CheckError, check
from labkit.instructor.authoring.numbers import stale
from labkit.instructor.authoring.spec import answers, build, definitions
from labkit.notebook.read import read

from helpers.reference import IN_CI

ROOT = Path(__file__).resolve().parents[2]
CHECKS = {c.name: c for c in definitions(ROOT)}
FILTERS = ["cartesian-kf", "range-bearing-kf"]


def subject(name, form=()):
    """The solution of a check with texts replaced, as if it stood in the notebook's cell 'answer'."""
    source = answers(read(ROOT / "solutions" / f"{CHECKS[name].lab}.ipynb"))
    for old, new in () if isinstance(form, str) else form:
        assert source.count(old) == 1, old
        source = source.replace(old, new)
    source += form if isinstance(form, str) else ""
    linecache.cache["cell 'answer'"] = (len(source), None, source.splitlines(True), "cell 'answer'")
    names = {}
    exec(compile(source, "cell 'answer'", "exec"), names)
    return names[CHECKS[name].subject]


def failure(name, form):
    with pytest.raises(CheckError) as caught:
        check(name, subject(name, form))
    return caught.value


def kf(old, new):
    """What the Cartesian check says when `old` is replaced in the solution, on one line."""
    return " ".join(str(failure("cartesian-kf", [(old, new)])).split())


MISTAKES = [
    pytest.param(c.name, m.say, form, id=f"{c.name}-{m.id}-{i}")
    for c in CHECKS.values()
    for m in c.mistakes
    for i, form in enumerate(m.forms)
]
RIGHT = [pytest.param(c.name, r.form, id=f"{c.name}-{r.id}") for c in CHECKS.values() for r in c.right]


@pytest.mark.parametrize("name, say, form", MISTAKES)
def test_a_known_mistake_is_named(name, say, form):
    error = failure(name, form)
    assert error.summary == say
    assert len(str(error).splitlines()) <= (14 if name.startswith(("legged", "team")) else 12)  # a pose takes more room
    assert all(len(line) <= 115 or "cell 'answer'" in line for line in str(error).splitlines())


@pytest.mark.parametrize("name, form", RIGHT + [pytest.param(n, (), id=n) for n in CHECKS])
def test_a_right_answer_passes_in_any_form(name, form, capsys):
    check(name, build(answers(read(ROOT / "solutions" / f"{CHECKS[name].lab}.ipynb")), form, CHECKS[name].subject))
    first, *rest = capsys.readouterr().out.splitlines()
    assert first.startswith(f"{name}: all ") and first.endswith(" checks passed.")
    noted = "place" in str(form) or "lm.id" in form or "+=" in str(form)
    assert all(line.startswith("  ok  ") for line in rest) or noted


@pytest.mark.parametrize("name", FILTERS)
def test_who_goes_on_in_the_array_that_was_given_passes_and_hears_of_it(name, capsys):
    check(name, subject(name, [("np.array(x0, dtype=float)", "x0")]))
    assert "Note" not in capsys.readouterr().out  # it makes new ones
    (form,) = (right.form for right in CHECKS[name].right if right.id == "in place")
    check(name, subject(name, form))
    assert "Note: Your filter goes on in the array x0 or P0" in capsys.readouterr().out


def test_what_a_gate_of_ones_own_leaves_out_is_told_as_that():
    gate = "\n        if innovation @ np.linalg.solve(S, innovation) > 3 * p:\n            return"
    line = "S = H @ self.Pk_k @ H.T + np.kron(np.eye(p), self.R)"
    error = failure("range-bearing-kf", [(line, line + gate)])
    assert "left out on purpose, by a gate?" in " ".join(str(error).split())


@pytest.mark.parametrize("name", FILTERS)
def test_at_least_25_mistakes_are_known_for_a_filter(name):
    assert len({m["say"] for m in json.loads((DATA / f"{name}.json").read_text())["mistakes"]}) >= 25


def test_no_right_code_is_shipped():
    for path in DATA.glob("*.json"):
        text = path.read_text(encoding="utf-8")
        assert not any(code in text for code in ("def ", "np.", "K @", "return seen", ".append"))


@pytest.mark.slow
def test_the_stored_numbers_are_those_of_the_solutions():
    assert stale(ROOT, verify=IN_CI) == []


# Two mistakes at once


@pytest.mark.parametrize("predict", ["dt-forgotten", "minus-u", "q-not-added", "p-is-q", "r-in-predict"])
@pytest.mark.parametrize("update", ["r-dt-again", "p-not-updated", "s-not-inverted", "r-not-repeated"])
@pytest.mark.parametrize("name", FILTERS)
def test_a_mistake_in_predict_and_one_in_update_are_both_named(name, predict, update):
    known = {m.id: m for m in CHECKS[name].mistakes}
    error = failure(name, [*known[predict].forms[0], *known[update].forms[0]])
    assert error.summary == known[predict].say
    assert f"Also: {known[update].say}" in " ".join(" ".join(error.details).split())


def test_a_known_and_an_unknown_mistake():
    error = failure("cartesian-kf", [("self.dt * u", "u"), ("K @ innovation", "K @ innovation * 1.1")])
    assert error.summary.startswith("`predict` moves the estimate by u")
    error = failure("cartesian-kf", [("+ self.Q", "+ 3 * self.Q"), ("repeat_R(self.R, p)", "self.R")])
    assert "`predict` adds to Pk_k acts as" in error.summary and "(3 times as much)" in error.summary
    assert "Also: R is not repeated" in str(error)


def test_a_sequential_filter_with_a_known_mistake():
    known = {r.id: r.form for r in CHECKS["range-bearing-kf"].right}
    form = known["sequential"].replace("nu[1] = wrap(nu[1])", "pass")
    assert failure("range-bearing-kf", form).summary.startswith("Your bearing innovation is not wrapped")


@pytest.mark.parametrize("name", ["legged-ekf", "legged-motion"])
def test_a_diagnosis_that_fails_leaves_the_verdict_and_the_numbers(name, monkeypatch, fault):
    def fails(*_):
        raise KeyError("one")

    form = [("np.repeat(np.array(self.d2)", "np.tile(np.array(self.d2)"), ("wrap(x[2] + u[2])", "x[2] + u[2]")]
    monkeypatch.setattr(sys.modules["labkit.checks.diagnosis"], "recognise", fails)
    monkeypatch.setattr("labkit.checks._first_to_mend", fails)
    text = str(failure(name, form))
    assert " checks passed.\nNot yet right: " in text and "  expected  " in text and "  came  " in text
    assert "KeyError" in fault.text
    fault.clear()
    monkeypatch.setattr(sys.modules["labkit.checks.diagnosis"], "evidence", fails)
    assert "\nNot yet right: " in str(failure(name, form))
    fault.clear()


def test_a_filter_that_hardly_moves_is_told_of_without_a_fault():
    assert "`update` leaves xk_k as it was" in str(
        failure("legged-ekf", [("change / (2 * step)", "change / 2 * step")])
    )


# Mistakes that nobody thought of get what was expected, what came and where to look


def test_unknown_mistakes_show_numbers_and_a_hint():
    text = kf("K @ innovation", "K @ innovation * 1.1")
    assert "Pk_k comes out right, so H and R are; the correction is not what it should be (1.1 times" in text
    assert "before xk_k = [0.4, -0.7]" in text and "R = [[0.16, 0.08], [0.08, 0.36]]" in text
    assert "call update([Landmark([2.95, -0.95], id=2)])" in text
    assert "expected xk_k = [0.1235, -0.6634]" in text and "came xk_k = [0.09583, -0.6597]" in text
    assert "What `predict` adds to Pk_k acts as [[0.06," in kf("+ self.Q", "+ 3 * self.Q")
    assert "(7 times as much)" in str(failure("cartesian-repeat", [("np.eye(p), R", "np.eye(p), 7 * R")]))
    assert "transpose" in str(failure("range-bearing-kf", [("self.Pk_k - K @ S @ K.T", "np.triu(self.Pk_k)")]))
    assert "only the spelling differs" in str(failure("mismatch-verdict", [('"overc', '"Overc')]))
    assert "should be a text" in str(failure("mismatch-verdict", [('"consistent"', "0")]))
    order = failure("cartesian-stack", [("return seen, expected", "return seen[::-1], expected")])
    assert "in another order" in " ".join(str(order).split())


def test_a_single_number_is_no_multiple_of_another():
    text = str(failure("mismatch-nees", [("e @ np.linalg.solve(P, e)", "e @ e / np.linalg.det(P)")]))
    assert "Perhaps" not in text and "times the expected" not in text


SHAPES = [
    ("(self.xk_k + K @ innovation).reshape(2, 1)", "shape (2,), but it has (2, 1): keep vectors one-dimensional"),
    ("np.append(self.xk_k, 0) if p == 1 else self.xk_k", "shape (2,), but it has (3,)"),
    ("self.xk_k + (K @ innovation / 0)", "NaN means 'not a number'"),
    ("None", "`xk_k` is None"),
    ("'here'", "xk_k should be a number"),
    ("{1: 2}", "`xk_k` should be made of numbers, but it is a dict"),
    ("y[0]", "should be made of numbers, but it is a Landmark"),
]


@pytest.mark.parametrize("value, says", SHAPES)
def test_odd_values_get_a_sentence(value, says):
    assert says in kf("self.xk_k + K @ innovation", value)


def test_shapes_of_function_results():
    assert "a single number" in str(failure("mismatch-nees", [("e @ np.linalg", "e[None] @ np.linalg")]))
    assert "return seen, expected" in str(failure("cartesian-stack", [("return seen, expected", "return seen")]))
    assert "is the `return` missing" in str(failure("cartesian-stack", [("return seen", "seen")]))
    assert "is the `return` missing" in str(failure("cartesian-repeat", [("return np.kron", "np.kron")]))


RAISES = [
    ("K @ innovation", "K @ innovaton", "NameError", "typing slip"),
    ("K @ innovation", "K @ innovation.p", "AttributeError", "no such field"),
    ("K @ innovation", "K[9] @ innovation", "IndexError", "not there"),
    ("K @ innovation", "K @ None", "ValueError", "sizes do not fit"),
    ("K @ innovation", "1 // 0", "ZeroDivisionError", "division by zero"),
    ("K @ innovation", "self.update(y)", "RecursionError", "without an end"),
    ("K @ innovation", "exit()", "SystemExit", "ends Python itself"),
    ("self.xk_k + self.dt * u", "self.xk_k + self.dt * u; u += 1", "read-only", "changes an array"),
    ("p = len(y)", "p = len(y); y[0].p[0] = 1", "read-only", "changes an array"),
]


@pytest.mark.parametrize("old, new, kind, advice", RAISES)
def test_exceptions_get_advice_and_the_students_own_line(old, new, kind, advice):
    text = kf(old, new)
    assert kind in text and advice in text
    line = text[text.rindex("cell 'answer'") :]
    assert new.split(";")[-1].strip() in line and "labkit" not in line


NAMES = [
    ("self.map.index", "map.index", "range-bearing-kf", "yours is `self.map`"),
    ("p = len(y)", "p = len(y); stack(y, self.map, self.xk_k)", "range-bearing-kf", "function is an answer of lab 1"),
    ("self.map[self.map.index(lm)]", "self.map[lm.id + 9]", "range-bearing-kf", "a landmark's id is its name"),
    ("return longest", "return count[99]", "mismatch-dark", "positions count from 0"),
]


@pytest.mark.parametrize("old, new, name, advice", NAMES)
def test_names_and_positions_get_the_advice_that_fits(old, new, name, advice):
    assert advice.lower() in " ".join(str(failure(name, [(old, new)])).split()).lower()


def test_an_interrupted_check_says_where_it_was(capsys):
    text = kf("p = len(y)", "p = len(y); raise KeyboardInterrupt")
    assert "still running when it was stopped" in text and "cell 'answer', in update, line" in text
    assert len(str(failure("mismatch-dark", [("return longest", "raise KeyboardInterrupt")])).splitlines()) == 3


NEWEST = [
    ("class KF:\n    def update(self, y)\n", True),
    ("class KF:\nreturn 1", True),
    ("x = 1\n  class KF: pass", True),
    ("class KFold(:", False),
    ("%%time\nclass KF: pass", False),
    ("!ls\nclass KF: pass\nawait f()", False),
]


@pytest.mark.parametrize("cell, broken", NEWEST)
def test_a_newer_answer_that_is_no_python_is_told(cell, broken, monkeypatch, capsys):
    import IPython
    from IPython.core.interactiveshell import InteractiveShell

    shell = InteractiveShell()
    for raw in ("class KF: pass", cell, "check('cartesian-kf', KF)"):
        try:
            shell.history_manager.store_inputs(1, shell.transform_cell(raw), raw)
        except SyntaxError:
            shell.history_manager.store_inputs(1, raw, raw)
    monkeypatch.setattr(IPython, "get_ipython", lambda: shell)
    if broken:
        assert "the one before it" in failure("cartesian-kf", ()).summary
    else:
        check("cartesian-kf", subject("cartesian-kf"))


CHANGES = [
    ("y.sort(key=lambda lm: lm.id)", "changes the list of landmarks"),
    ("y.pop()", "changes the list of landmarks"),
    ("y[0].p = y[0].p + 1", "puts other values into a Landmark"),
    ("y[0].id = 77", "puts other values into a Landmark"),
    ("self.map.reverse()", "changes the map"),
    ("self.map[0].p = self.map[0].p + 1", "puts other values into a Landmark"),
]


@pytest.mark.parametrize("change, says", CHANGES)
def test_changing_the_inputs_is_told(change, says):
    assert f"`update` {says}" in kf("p = len(y)", f"p = len(y); {change}")


def test_random_numbers_and_shared_state():
    assert "another result each time" in kf("K @ innovation", "K @ innovation + np.random.normal(size=2)")
    shared = [
        ("    def predict", "    n = np.zeros(2)\n\n    def predict"),
        ("self.dt * u", "self.dt * u + self.n; self.n += 1"),
    ]
    assert "`n` belongs to the class" in str(failure("cartesian-kf", shared))
    assert (
        "your function"
        in str(failure("mismatch-dark", [("return longest", "return longest + np.random.randint(2, 99)")])).lower()
    )


def test_what_is_no_class_or_function():
    KF, stack = subject("cartesian-kf"), subject("cartesian-stack")
    x, P = np.zeros(2), np.eye(2)
    cases = [
        ("cartesian-kf", KF(x, P, P, P, []), 'check("cartesian-kf", KF)'),
        ("cartesian-kf", 3, "of type int"),
        ("cartesian-kf", None, "of type NoneType"),
        ("cartesian-kf", type("KF", (), {"update": 1}), "no method `predict`"),
        ("cartesian-kf", stack, "unexpected keyword argument 'dt'"),
        ("cartesian-kf", lambda *a, dt: object(), "no field `xk_k`"),
        ("cartesian-stack", KF, "the class KF came"),
        ("cartesian-stack", x, "without brackets"),
        ("cartesian-fk", KF, "is it 'cartesian-kf'?"),
        (KF, KF, "no check of that name"),
    ]
    for name, thing, says in cases:
        with pytest.raises(CheckError) as caught:
            check(name, thing)
        assert says in " ".join(str(caught.value).split()), (name, thing)


def test_an_unfilled_stub_is_still_to_be_written():
    stub = "raise NotImplementedError('predict: two lines')"
    error = failure("cartesian-kf", [("self.xk_k = self.xk_k + self.dt * u", stub)])
    assert error.summary == "Still to be written: predict: two lines"
    assert "cell 'answer', in predict, line" in str(error)
    error = failure("cartesian-kf", [("self.dt * u", "u"), ("p = len(y)", "raise NotImplementedError('update')")])
    assert "Also: Still to be written: update" in str(error)
    assert "replace the `raise" in str(failure("mismatch-dark", [("return longest", "raise NotImplementedError")]))


def test_prints_are_kept_apart(capsys):
    check("cartesian-kf", subject("cartesian-kf", [("p = len(y)", "p = len(y); print('p', p)")]))
    assert "p 1" not in capsys.readouterr().out
    text = kf("p = len(y)", "p = len(y); print('p', p); self.R = 1")
    assert "printed p 1" in text


def test_places_in_the_map_pass_in_lab_1_with_a_note(capsys):
    form = [("m[m.index(lm)] - x for", "m[lm.id] - x for")]
    check("cartesian-kf", subject("cartesian-kf", form))
    assert "Note: It works here because the ids happen to be the places" in capsys.readouterr().out
    check("cartesian-stack", subject("cartesian-stack", form))
    assert "In lab 3" in capsys.readouterr().out
    by_id = failure("range-bearing-kf", [("self.map[self.map.index(lm)]", "self.map[lm.id]")])
    assert "ids are names" in str(by_id)


def test_a_filter_that_looks_for_the_truth_finds_none():
    class KF:
        """Believes that the robot is where the robot is: all it can find are its own inputs."""

        def __init__(self, x0, P0, Q, R, m, dt=0.25):
            self.xk_k, self.Pk_k, self.Q, self.R, self.map = x0, P0, Q * dt, R / dt, m

        def predict(self, u):
            self.xk_k = getattr(self.map, "p", self.xk_k)

        def update(self, y):
            self.xk_k = next((lm.p for lm in y if hasattr(lm, "robot")), self.xk_k)

    with pytest.raises(CheckError):
        check("cartesian-kf", KF)

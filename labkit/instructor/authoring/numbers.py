"""Make the numbers of the checks from the solutions (for maintainers; run by `labkit build`).

`solutions/checks` says for each check which inputs it uses, which other forms of the right answer
there are, and which mistakes students make; see `labkit.instructor.authoring.spec`.
"""

import json
from collections.abc import Collection
from dataclasses import fields
from inspect import signature
from pathlib import Path

import numpy as np

from ...checks import DATA
from ...checks.compare import ANY, gap, nearest, recognise
from ...checks.identify import findings, probed
from ...checks.probing import Answer, expanded
from ...checks.trace import run
from .. import files
from ..records import CommandError
from . import pairs, percent
from .rights import rights
from .spec import Check, answers, build, definitions
from .stored import as_text, pack, short


def generate(root: Path, verify: bool = True, labs: Collection[str] = ()) -> dict[str, dict]:
    """{name: data} of the checks of these labs, by default all, made from the solutions under `root`.

    verify: as in `make`. Raises CommandError.
    """
    checks = [check for check in definitions(root) if not labs or check.lab in labs]
    sources = {lab: answers(percent.cells(root / "solutions" / f"{lab}.py")) for lab in {check.lab for check in checks}}
    return {check.name: make(check, sources[check.lab], verify) for check in checks}


def make(check: Check, source: str, verify: bool = True) -> dict:
    """The data of one check: right forms pass, each mistake fails clearly; CommandError otherwise.

    verify: whether mistakes are also held against each other, run on inputs that are a little other, and two at
    once (slow).
    """
    scenarios, problems = [dict(s) for s in check.scenarios], []
    traces = _run(check, source, ())
    for s in scenarios:
        s["right"] = [pack(traces[s["id"]])]
        if traces[s["id"]].stop:
            problems.append(f"the solution stops in '{s['id']}': {traces[s['id']].stop.text}")
    _refuse(check, problems)  # nothing that follows would be true
    for right in check.right:
        for s, trace in _each(scenarios, _run(check, source, right.form)):
            far = _far(trace, s)
            if right.other and far > 1 and not trace.stop:
                s["right"].append(pack(trace))
            elif far > 0.7 and "advice" not in s:
                problems.append(f"the right form '{right.id}' is {far:.1f} tolerances off in '{s['id']}'")
    mistakes = [_mistake(check, source, mistake, scenarios, problems, verify) for mistake in check.mistakes]
    problems += _misnamed(mistakes) if verify else ()
    _refuse(check, problems)
    data: dict = {"name": check.name, "lab": check.lab, "subject": check.subject, "kind": check.kind}
    if check.kind == "function":
        data |= {"args": list(signature(build(source, (), check.subject)).parameters), "parts": check.parts or {}}
    kept = [{k: m[k] for k in ("id", "say", "forms")} for m in mistakes]
    data |= {"scenarios": scenarios, "mistakes": kept, **_probing(check, source)}
    found = pairs.of(check, source, data) if verify else []
    return data | ({"pairs": found} if found else {})


def _refuse(check, problems):
    """Raise CommandError if there is anything wrong."""
    if problems:
        where = f"solutions/checks, check '{check.name}'"
        raise CommandError(
            "\n".join(f"{where}: {one}{'' if one.endswith(('.', '?', '!')) else '.'}" for one in problems)
        )


def _probing(check, source):
    """The probes of a filter with the right answers, and by what a known mistake shows in them."""
    if not check.probing:
        return {}
    asked = expanded(check.probing["probes"])
    right = rights(build(source, (), check.subject), check.kind, check.probing["probes"])
    probing = {**check.probing, "right": {id: _answer(answer) for id, answer in right.items()}, "known": {}}
    for form in (right.form for right in check.right):
        found = findings(probed(probing, _run(check, source, form, asked)))
        if found:
            raise CommandError(f"{check.name}: the right form {form!r} is taken for wrong: {found[0].text}")
    for mistake in check.mistakes:
        known = [findings(probed(probing, _run(check, source, form, asked))) for form in mistake.forms]
        probing["known"][mistake.id] = [
            [[f.part, *(short(np.asarray(v, dtype=float)) for v in f.value)] for f in found if f.value]
            for found in known
            if any(f.value for f in found)
        ]
    return {"probing": probing}


def _run(check, source, form, scenarios=None):
    try:
        subject = build(source, form, check.subject)
    except (Exception, SystemExit) as error:  # a solution is any code
        said = error if isinstance(error, CommandError) else f"{type(error).__name__}: {error}"
        where = f"solutions/{check.lab}.py" + f", changed as the check '{check.name}' says by {form!r}" * bool(form)
        raise CommandError(f"{where}: {said}.") from error
    return {s["id"]: run(subject, check.kind, s) for s in scenarios or check.scenarios}


def _each(scenarios, traces):
    return [(s, traces[s["id"]]) for s in scenarios]


def _far(trace, scenario):
    return nearest(trace, scenario["right"])[0]


def _mistake(check, source, mistake, scenarios, problems, verify):
    """Its data: for each form the scenarios where it fails, and what comes there."""
    must = [s for s in scenarios if "advice" not in s]
    forms, runs = [], []
    for form in mistake.forms:
        traces = _run(check, source, form)
        shaken = [_run(check, source, form, [_shake(s, k) for s in must]) for k in range(1, 4) if verify]
        stored = {}
        for s, trace in _each(must, traces):
            far = _far(trace, s)
            if 0.3 < far < 5:
                problems.append(f"'{mistake.id}' is {far:.1f} tolerances off in '{s['id']}', too close to call")
            elif far >= 5:
                packed = pack(trace)
                steady = all(gap(other[s["id"]], packed) < 0.3 for other in shaken)
                stored[s["id"]] = packed if steady and _size(trace) < 1e6 else ANY
        if all(v == ANY for v in stored.values()):
            problems.append(f"the mistake '{mistake.id}' passes: add a case in which it gives something else")
        elif stored not in forms:
            forms.append(stored)
            runs.append({s: traces[s] for s in stored})
    return {"id": mistake.id, "say": mistake.say, "forms": forms, "runs": runs}


def _size(trace):
    """The largest number in a trace: a filter that ran away ends elsewhere on another computer."""
    numbers = [np.abs(v) for step in trace.steps for v in step if not isinstance(v, str)]
    return max((np.nan_to_num(v).max(initial=0.0) for v in numbers), default=0.0)


def _misnamed(mistakes):
    """Complaints about mistakes that would be taken for others, now or after a small change of numbers."""
    for mistake in mistakes:
        for failed in mistake["runs"]:
            names = [m["id"] for m, _, _ in recognise(failed, mistakes)]
            if names != [mistake["id"]]:
                yield f"the mistake '{mistake['id']}' is taken for {names}"
            for other in mistakes:
                near = [form for form in other["forms"] if set(form) == set(failed)]
                if other is not mistake and any(max(gap(failed[s], f[s]) for s in failed) < 3 for f in near):
                    yield f"'{mistake['id']}' and '{other['id']}' are too alike"


def _answer(answer):
    """A probe's Answer as JSON, with nine digits: differences are taken of them."""
    parts = {f.name: getattr(answer, f.name) for f in fields(Answer) if f.name not in ("fields", "matrix")}
    stored = {name: short(part, 9) for name, part in parts.items() if part.size}
    return {**stored, "fields": {name: short(part, 9) for name, part in answer.fields.items()}}


def _shake(value, k):
    """The same inputs with a relative change of about 1e-9: what then changes a lot depends on rounding."""
    if isinstance(value, dict):
        return {key: v if key in ("at", "right") else _shake(v, k) for key, v in value.items()}
    if isinstance(value, list):
        return [_shake(v, k + i + 1) for i, v in enumerate(value)]
    return value * (1 + 1e-9 * np.sin(7.0 * k)) if isinstance(value, float) else value


def write(root: Path, folder: Path = DATA, labs: Collection[str] = ()) -> list[str]:
    """Write the data of the checks of these labs, by default all; leave alone what is alike, remove what is gone."""
    made = generate(root, labs=labs)
    folder.mkdir(exist_ok=True)
    for name in _unlike(made, folder, labs=labs):
        path = folder / f"{name}.json"
        if name in made:
            files.write(path, as_text(made[name]))
        else:
            path.unlink()
    return sorted(made)


def stale(root: Path, folder: Path = DATA, verify: bool = True) -> list[str]:
    """Names of the checks whose stored data are not what the solutions give today; verify: as in `make`."""
    return _unlike(generate(root, verify), folder, () if verify else ("pairs",))


def _unlike(made, folder, but=(), labs=()):
    kept = {p.stem: json.loads(p.read_text(encoding="utf-8")) for p in folder.glob("*.json")}
    kept = {name: data for name, data in kept.items() if not labs or data["lab"] in labs}
    kept = {name: {key: part for key, part in data.items() if key not in but} for name, data in kept.items()}
    return sorted(n for n in made.keys() | kept.keys() if not _alike(made.get(n), kept.get(n)))


def _alike(a, b):
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_alike(a[k], b[k]) for k in a)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(_alike, a, b))
    if isinstance(a, float) and isinstance(b, float):
        return bool(np.isclose(a, b, rtol=1e-6, atol=1e-9))
    return a == b or ANY in (a, b)  # what depends on rounding may have been steady by chance

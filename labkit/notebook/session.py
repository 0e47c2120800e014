"""Run a notebook's cells without Jupyter: only what the wanted names need, with what they mean in a kernel.

A kernel keeps the last definition of a name, wherever it stands; so does a session. What the notebook lacks is
supplied by the cells of the lab as it was handed out, if they are given.
"""

import __future__

import ast
import inspect
import linecache
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from ..checks.feedback import LabError, explain
from . import source
from .limits import CALL, TimeUpError, cpu_limit
from .names import names
from .needed import Step, is_future, is_unfilled, needed
from .read import Cell, labels
from .shell import stand_ins

STEP, ALL = 0.5, 0.8  # of the time for a notebook's cells: what one statement may take, and all together
DEFINITIONS = (ast.FunctionDef, ast.ClassDef, ast.Import, ast.ImportFrom)
FLAGS = ast.PyCF_ALLOW_TOP_LEVEL_AWAIT


@dataclass(frozen=True)
class Problem:
    """A cell that Python cannot read, or that raised: where, the exception, and lines on what went wrong."""

    where: str
    error: BaseException
    lines: list[str]


@dataclass(frozen=True)
class Call:
    """A cell's call of a check: its name, where, and the name of what is given to it, '' if that has none."""

    check: str
    where: str
    given: str = ""


class Session:
    """The cells of one notebook and the names that they make.

    place: what comes before a cell's name when it is told.
    """

    def __init__(self, cells: Sequence[Cell], place: str = "") -> None:
        self.names: dict[str, object] = {"__name__": "__main__", **stand_ins(self.run_text)}
        self.place = place
        self.calls: list[Call] = []
        self.retyped: list[str] = []  # text cells that are code, used for what no code defines
        self.broken: list[Problem] = []  # cells that Python cannot read
        self.stopped: dict[str, Problem] = {}  # by the label of the cell that raised
        self._subjects: dict[str, str] = {}  # {check: the answer that it is about}, as the lab says
        self._flags, self._runner = FLAGS, None
        label_of = labels(cells)
        own = [step for cell in cells if cell.code for step in self._steps(cell, label_of[cell.number])]
        last = max((cell.number for cell in cells if label_of[cell.number] in {c.where for c in self.calls}), default=0)
        self._late = {label_of[cell.number] for cell in cells if last and cell.number > last}  # behind all checks
        own += self._retyped(cells, label_of, {name for step in own for name in step.names.sets})
        self.steps = own

    def supply(self, given: Iterable[Cell]) -> None:
        """Add what the notebook lacks, and nothing else, of the cells of the lab as it was handed out."""
        made = {name for step in self.steps for name in step.names.sets}
        steps = [step for cell in given for step in self._steps(cell, cell.label, given=True)]
        self.steps = self._undisturbed({ast.dump(step.node) for step in steps})
        self.steps = [s for s in steps if not s.unfilled and s.names.sets and not s.names.sets <= made] + self.steps

    def _undisturbed(self, given):
        """The steps without those of the lab that would replace what the student has made before."""
        own: set[str] = set()
        kept = []
        for step in self.steps:
            theirs = ast.dump(step.node) not in given
            own |= step.names.sets if theirs and not step.unfilled else set()
            kept += [step] if theirs or not step.names.sets & own else []
        return kept

    def _renamed(self, wanted):
        """Steps that give wanted answers their names, where the student has other names checked in their place."""
        asked: dict[str, list[Call]] = {}
        for call in self.calls:
            if call.given and self._subjects.get(call.check) in wanted:
                asked.setdefault(self._subjects[call.check], []).append(call)
        found = []
        for subject, calls in asked.items():
            others = {call.given for call in calls}
            if subject not in others and any(step.names.sets & others for step in self.steps):
                code = f"{subject} = {calls[-1].given}"
                found += [Step(calls[-1].where, "own", False, *part) for part in _analysed(code, calls[-1].where, code)]
        return found

    def _settled(self, wanted):
        """The steps without those that use a function's or module's name for something else when all is checked."""
        made: set[str] = set()
        kept = []
        for step in self.steps:
            other = isinstance(step.node, ast.For) or isinstance(step.node, ast.Assign) and not _is_alias(step.node)
            late = other and step.label in self._late and not step.names.sets & (step.names.uses | wanted)
            kept += [] if late and step.names.sets & made else [step]
            made |= step.names.sets if isinstance(step.node, DEFINITIONS) else set()
        return kept

    def _retyped(self, cells, label_of, made):
        """What text cells define that no code has: pressing M or Y in Jupyter turns one into the other."""
        found = []
        for cell in cells:
            defined = {} if cell.code else set(re.findall(r"(?m)^(?:class|def) (\w+)", cell.source)) - made
            if defined and _parses(cell.source):
                label = label_of[cell.number]
                self.retyped.append(label)
                found += [step for step in self._steps(cell, label) if step.names.sets & defined]
        return found

    def _steps(self, cell, label, given=False):
        filename = self.place + label
        try:
            code = source.python(cell.source)
            _remember(filename, cell.source if code.count("\n") <= cell.source.count("\n") + 1 else code)
            steps = [Step(label, cell.role, given, *found) for found in _analysed(code, filename, cell.source)]
        except (SyntaxError, ValueError, RecursionError) as error:
            _remember(filename, cell.source)
            if not given:
                self.broken.append(Problem(label, error, explain(error).splitlines()))
            return []
        checks = {step: _check_of(step.node) for step in steps}
        calls = [Call(check, label, _given_to(step.node)) for step, check in checks.items() if check]
        self.calls += [] if given else calls
        self._subjects |= {call.check: call.given for call in calls if given}
        return [step for step in steps if not checks[step]]

    def run(self, wanted: Iterable[str], seconds: float = CALL) -> Iterator[Problem]:
        """Run, in order, what the wanted names need; yield a Problem for each cell that stopped: the others go on.

        seconds: of the processor, for all of it.
        """
        yield from self.broken
        left, failed = ALL * seconds, []
        wanted = set(wanted)
        for step in needed([*self._settled(wanted), *self._renamed(wanted)], wanted):
            spent, error = self._exec(
                step.node, self.place + step.label, min(STEP * seconds, max(left, 0.02 * seconds))
            )
            left -= spent
            failed += [(step, error)] if error else []
        for step, error in failed:  # cells may have been run in another order: what came too early is there now
            if isinstance(error, NameError):
                _, error = self._exec(step.node, self.place + step.label, STEP * seconds)
            if error and step.label not in self.stopped:
                self.stopped[step.label] = Problem(step.label, error, self.lines(error))
                yield self.stopped[step.label]
        if self._runner:
            self._runner.close()

    def _exec(self, node, filename, seconds):
        """(seconds that it took, what it raised or None)."""
        error = None
        try:
            with cpu_limit(seconds) as limit:
                code = compile(ast.Module([node], []), filename, "exec", self._flags, dont_inherit=True)
                if is_future(node):
                    self._flags |= getattr(__future__, node.names[0].name).compiler_flag
                if code.co_flags & inspect.CO_COROUTINE:
                    import asyncio  # slow to load, and hardly a notebook needs it

                    self._runner = self._runner or asyncio.Runner()
                    self._runner.run(eval(code, self.names))
                else:
                    exec(code, self.names)
        except (Exception, SystemExit, TimeUpError) as raised:
            error = raised
        return limit.spent, error

    def run_text(self, text: str, filename: str) -> None:
        """Run Python among the notebook's names, as `%run` does."""
        exec(compile(text, filename, "exec", dont_inherit=True), self.names)

    def lines(self, error: BaseException) -> list[str]:
        """What went wrong; where a name is missing, also which cell should have made it."""
        lines = error.lines if isinstance(error, LabError) else explain(error).splitlines()
        missing = re.search(r"name '(\w+)' is not defined", str(error))
        if not missing:
            return lines
        name = missing[1]
        for label in {step.label for step in self.steps if name in step.names.sets} & self.stopped.keys():
            lines.append(f"`{name}` comes from {label}, which stopped: {self.stopped[label].lines[0]}")
        for problem in self.broken:
            text = "".join(linecache.getlines(self.place + problem.where))
            if re.search(rf"\b{name}\b", text):
                lines.append(f"`{name}` may come from {problem.where}, which Python cannot read.")
        return lines


def _parses(text):
    try:
        return bool(ast.parse(text))
    except (SyntaxError, ValueError, RecursionError):
        return False


def _remember(filename, text):
    linecache.cache[filename] = (len(text), None, text.splitlines(True), filename)


_KNOWN: dict[str, list] = {}  # what was analysed before: a student's cells are mostly the lab's own


def _analysed(code, filename, text):
    """[(statement, its Names, whether it is a stub)] of a cell's code; raises SyntaxError or ValueError."""
    if text not in _KNOWN:
        nodes = [part for node in source.statements(code, filename) for part in _parts(node)]
        _KNOWN[text] = [(node, names(node), is_unfilled(node)) for node in nodes]
    return _KNOWN[text]


def _parts(node):
    """One statement for each name of an import: matplotlib is slow to load, and checks do not draw."""
    if isinstance(node, ast.Import):
        return [ast.copy_location(ast.Import([name]), node) for name in node.names]
    if isinstance(node, ast.ImportFrom):
        return [ast.copy_location(ast.ImportFrom(node.module, [name], node.level), node) for name in node.names]
    return [node]


def _is_alias(node):
    """Whether an assignment gives another name to what there is, or makes a function."""
    return isinstance(node.value, ast.Name | ast.Attribute | ast.Lambda)


def _given_to(node):
    """The second argument of a call, if it is a name, or ''."""
    args = node.value.args
    return args[1].id if len(args) > 1 and isinstance(args[1], ast.Name) else ""


def _check_of(node):
    """The name in a statement `check("name", ...)`, or ''."""
    call = node.value if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) else None
    is_check = call and getattr(call.func, "id", getattr(call.func, "attr", "")) == "check" and call.args
    return str(call.args[0].value) if is_check and isinstance(call.args[0], ast.Constant) else ""

"""Run a notebook's cells without Jupyter: all of what is asked for, and only what that needs."""

import ast
import dis
import linecache
import re
from dataclasses import dataclass

from ..checks.feedback import LabError, explain


@dataclass(frozen=True)
class Event:
    """A check that ran, or (check is '') a setup or answer cell that raised; lines say what went wrong."""

    check: str
    where: str
    error: BaseException | None
    lines: list


@dataclass(eq=False)
class Step:
    """One statement at the top of a cell."""

    cell: object
    node: ast.stmt
    code: object
    check: str
    sets: set
    uses: set


class Session:
    """The cells of one notebook and the names that they make.

    Statements of setup and answer cells run, and calls of `check`; an import of the set-up, or a
    statement of another cell (shown, or added by the student), runs if it sets a name that those need.
    """

    def __init__(self, cells, place="", wanted=()):
        self.names = {"__name__": "__main__", "input": lambda *_: "", "display": _NOTHING, "get_ipython": _NOTHING}
        self.place, self.current = place, None  # current: the step that runs
        self.stopped, self.broken = {}, []  # {cell: error} while it ran; [(cell, error)] of syntax
        code = [cell for cell in cells if cell.code]
        self.steps = _needed([step for cell in code for step in self._steps(cell)], set(wanted))
        calling = {step.cell for step in self.steps if step.check} | {cell for cell, _ in self.broken}
        self.emptied = [cell for cell in code if cell.role == "check" and cell not in calling]

    def _steps(self, cell):
        filename = self.place + cell.label
        source = plain(cell.source)
        linecache.cache[filename] = (len(source), None, source.splitlines(True), filename)
        try:
            body = [part for node in ast.parse(source, filename).body for part in _parts(node)]
            steps = [_step(cell, node, filename) for node in body]
        except (SyntaxError, ValueError) as error:
            self.broken.append((cell, error))
            return
        yield from steps

    def run(self):
        """Run the statements in order and yield an Event for each check and for each cell that raised."""
        for cell, error in self.broken:
            if cell.role in ("setup", "answer", "check"):
                yield Event("", cell.label, error, explain(error).splitlines())
        for cell in self.emptied:
            error = LabError("This cell calls no check any more: put its line `check(...)` back.")
            yield Event("", cell.label, error, error.lines)
        for step in self.steps:
            cell, check = step.cell, step.check
            if cell in self.stopped and not check:
                continue
            self.current = step
            error = self._exec(step.code)
            if check or error and cell.role in ("setup", "answer"):
                yield Event(check, cell.label, error, self._lines(error) if error else [])
            if error and not check and cell.role != "setup":
                self.stopped[cell] = error

    def _exec(self, code):
        try:
            exec(code, self.names)
        except (Exception, SystemExit) as error:
            return error

    def _lines(self, error):
        """What went wrong; where a name is missing, also which cell should have made it."""
        lines = error.lines if isinstance(error, LabError) else explain(error).splitlines()
        missing = re.search(r"name '(\w+)' is not defined", str(error))
        if not missing:
            return lines
        name = missing[1]
        for cell in {step.cell for step in self.steps if name in step.sets} & self.stopped.keys():
            why = explain(self.stopped[cell]).splitlines()[0]
            lines.append(f"`{name}` comes from {cell.label}, which stopped: {why}")
        for cell, _ in self.broken:
            if re.search(rf"\b{name}\b", cell.source):
                lines.append(f"`{name}` may come from {cell.label}, which Python cannot read.")
        return lines


def _parts(node):
    """One statement for each name of an import: matplotlib is slow to load, and checks do not draw."""
    if isinstance(node, ast.Import):
        return [ast.copy_location(ast.Import([name]), node) for name in node.names]
    if isinstance(node, ast.ImportFrom):
        return [ast.copy_location(ast.ImportFrom(node.module, [name], node.level), node) for name in node.names]
    return [node]


def _step(cell, node, filename):
    code = compile(ast.Module([node], []), filename, "exec", dont_inherit=True)
    sets, uses = _names(code)
    targets = getattr(node, "targets", None) or [getattr(node, "target", None)]
    for target in targets:  # KF.update = ... changes KF
        while isinstance(target, ast.Attribute | ast.Subscript):
            target = target.value
            sets |= {target.id} if isinstance(target, ast.Name) else set()
    call = node.value if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) else None
    is_check = call and getattr(call.func, "id", getattr(call.func, "attr", "")) == "check" and call.args
    name = call.args[0].value if is_check and isinstance(call.args[0], ast.Constant) else ""
    return Step(cell, node, code, str(name), sets, uses)


def _names(code, top=True):
    """The global names that a code object sets, and those that it may look up."""
    sets, uses, own = set(), set(), set()  # own: the names that a class body has given itself so far
    for instruction in dis.get_instructions(code):
        if instruction.opname == "STORE_GLOBAL" or top and instruction.opname == "STORE_NAME":
            sets.add(instruction.argval)
        elif instruction.opname == "STORE_NAME":
            own.add(instruction.argval)
        elif instruction.argval in own and instruction.opname == "LOAD_NAME":
            continue
        elif instruction.opname.startswith(("LOAD_NAME", "LOAD_GLOBAL", "LOAD_FROM_DICT_OR_GLOBALS")):
            uses.add(instruction.argval)
    for const in code.co_consts:
        if hasattr(const, "co_code"):
            inner_sets, inner_uses = _names(const, top=False)
            sets, uses = sets | inner_sets, uses | inner_uses
    return sets, uses


def _needed(steps, wanted):
    """The steps that run: checks, answers, the set-up but for its imports, and what all these depend on."""
    chosen = {step for step in steps if step.check or step.cell.role in ("setup", "answer")}
    chosen -= {step for step in chosen if step.cell.role == "setup" and isinstance(step.node, _IMPORTS)}
    while True:
        names = wanted.union(*(step.uses for step in chosen))
        more = {step for step in steps if step.sets & names} - chosen
        if not more:
            return [step for step in steps if step in chosen]
        chosen |= more


def plain(source):
    """The source without IPython's magics; each line keeps its number."""
    try:
        ast.parse(source)
        return source
    except (SyntaxError, ValueError):
        pass
    cell_magic = re.match(r"\s*%%(\w+)", source)
    if cell_magic and cell_magic[1] not in ("time", "timeit", "capture", "prun"):
        return ""
    return "\n".join(_MAGIC.sub(r"\1\2None", line) for line in source.split("\n"))


# %matplotlib inline, !pip list, files = !ls, ?np.kron, np.kron?
_MAGIC = re.compile(r"^(\s*)([\w.,\s]*=\s*)?(?:[%!?].*|[\w.]+\?+\s*)$")


_IMPORTS = (ast.Import, ast.ImportFrom)


class _Nothing:
    """Takes the place of what only Jupyter has: any use of it does nothing."""

    def __getattr__(self, name):
        return self

    def __call__(self, *args, **options):
        return self


_NOTHING = _Nothing()

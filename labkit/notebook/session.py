"""Run a notebook's cells without Jupyter: all of what is asked for, and only what that needs."""

import ast
import linecache
import re
import symtable
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from types import CodeType

from ..checks.feedback import LabError, explain
from .read import Cell


@dataclass(frozen=True)
class Event:
    """A check that ran, or (check is '') a setup or answer cell that raised; lines say what went wrong."""

    check: str
    where: str
    error: BaseException | None
    lines: list[str]


@dataclass(eq=False)
class Step:
    """One statement at the top of a cell."""

    cell: Cell
    node: ast.stmt
    code: CodeType
    check: str
    sets: set[str]
    uses: set[str]


class Session:
    """The cells of one notebook and the names that they make.

    Statements of setup and answer cells run, and calls of `check`; an import of the set-up, or a
    statement of another cell (shown, or added by the student), runs if it sets a name that those need.
    """

    def __init__(self, cells: Iterable[Cell], place: str = "", wanted: Iterable[str] = ()) -> None:
        self.names: dict[str, object] = {
            "__name__": "__main__",
            "input": lambda *_: "",
            "display": _NOTHING,
            "get_ipython": _NOTHING,
        }
        self.place = place
        self.current: Step | None = None  # the one that runs
        self.stopped: dict[Cell, BaseException] = {}  # by what they raised while they ran
        self.broken: list[tuple[Cell, Exception]] = []  # with the error of their syntax
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

    def run(self) -> Iterator[Event]:
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
    sets, uses = _names(node)
    targets = getattr(node, "targets", None) or [getattr(node, "target", None)]
    for target in targets:  # KF.update = ... changes KF
        while isinstance(target, ast.Attribute | ast.Subscript):
            target = target.value
            sets |= {target.id} if _is_name(target) else set()
    call = node.value if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) else None
    is_check = call and getattr(call.func, "id", getattr(call.func, "attr", "")) == "check" and call.args
    name = call.args[0].value if is_check and isinstance(call.args[0], ast.Constant) else ""
    return Step(cell, node, code, str(name), sets, uses)


def _names(node):
    """The global names that a statement, which is compiled already, sets, and those that it may look up."""
    node = _AsGenerators().visit(node)
    sets, uses = _of_table(_table(node))
    if isinstance(node, ast.ClassDef):
        uses = _used_by_class(node)
    changed = {each.target.id for each in ast.walk(node) if isinstance(each, ast.AugAssign) and _is_name(each.target)}
    return (set() if isinstance(node, ast.Delete) else sets), uses | changed & sets  # x += 1 looks x up


def _used_by_class(node):
    """The names that a class may look up: what its body gave itself before is its own."""
    head = [*node.decorator_list, *node.bases, *(keyword.value for keyword in node.keywords)]
    uses, own = set().union(*(_of_table(_table(ast.Expr(part)))[1] for part in head)), set()
    for part in node.body:
        level = _table(ast.ClassDef("_", [], [], [part], [])).get_children()[0]
        uses |= {symbol.get_name() for symbol in level.get_symbols() if symbol.is_referenced()} - own
        uses = uses.union(*(_of_table(inner)[1] for inner in level.get_children()))
        own |= {symbol.get_name() for symbol in level.get_symbols() if symbol.is_assigned() or symbol.is_imported()}
    return uses


def _of_table(table):
    """(sets, uses) of a symbol table and those in it."""
    sets, uses = set(), set()
    for symbol in table.get_symbols():
        if symbol.is_global() or table.get_type() == "module":
            sets |= {symbol.get_name()} if symbol.is_assigned() or symbol.is_imported() else set()
            uses |= {symbol.get_name()} if symbol.is_referenced() else set()
    for inner in map(_of_table, table.get_children()):
        sets, uses = sets | inner[0], uses | inner[1]
    return sets, uses


def _table(node):
    return symtable.symtable(ast.unparse(node), "", "exec")


class _AsGenerators(ast.NodeTransformer):
    """Makes generators of comprehensions, whose names newer Pythons list among those of what is around them."""

    def visit(self, node):
        node = self.generic_visit(node)
        if not isinstance(node, ast.ListComp | ast.SetComp | ast.DictComp):
            return node
        parts = [node.key, node.value] if isinstance(node, ast.DictComp) else [node.elt]
        return ast.GeneratorExp(ast.Tuple(parts, ast.Load()), node.generators)


def _is_name(node):
    return isinstance(node, ast.Name)


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


def plain(source: str) -> str:
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

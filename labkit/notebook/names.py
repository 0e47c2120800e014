"""Which of a notebook's names a statement makes, changes and looks up, without running it."""

import ast
import symtable
from dataclasses import dataclass, field
from typing import TypeGuard


@dataclass
class Names:
    """Of one statement: the global names that it sets, and those that it may look up.

    changes     objects that it may change: an attribute or item is set, a method called, a decorator given it
    passes      (function, name) of each call that may change what it is given
    calls       functions that it calls
    inside      of a function: what a call of it sets or changes
    anything    whether it may set names that cannot be told, as `from x import *` does
    path        whether it changes where modules are looked for
    """

    sets: set[str]
    uses: set[str]
    changes: set[str] = field(default_factory=set)
    passes: set[tuple[str, str]] = field(default_factory=set)
    calls: set[str] = field(default_factory=set)
    inside: set[str] = field(default_factory=set)
    anything: bool = False
    path: bool = False


UNSEEN = {"exec", "eval", "globals", "locals", "vars", "run_line_magic"}
FILLS = {  # what libraries have to change what they are given
    *("fill_diagonal", "copyto", "put", "place", "putmask", "put_along_axis", "shuffle", "update_wrapper"),
    *("heappush", "heapify", "heappop", "heapreplace", "heappushpop", "insort", "insort_left", "insort_right"),
}


def names(node: ast.stmt) -> Names:
    """The Names of a statement."""
    plain = ast.fix_missing_locations(_Plain().visit(ast.parse(ast.unparse(node)).body[0]))
    sets, uses = _of_table(_table(plain))
    if isinstance(plain, ast.ClassDef):
        uses = _used_by_class(plain)
    changed = {part.target.id for part in ast.walk(plain) if isinstance(part, ast.AugAssign) and _is_name(part.target)}
    found = Names(set() if isinstance(plain, ast.Delete) else sets, uses | changed & sets)  # x += 1 looks x up
    _effects(plain, found)
    if isinstance(plain, ast.FunctionDef):
        body = Names(set(), set())
        for part in plain.body:
            _effects(part, body)
        stored = (_root(part) for part in ast.walk(plain) if _is_stored(part))
        given = {name for function, name in body.passes if function == "setattr"}
        found.inside = (found.sets - {plain.name}).union(given, *stored)
    return found


def _effects(node, found):
    """Add what running a statement may change; the bodies of functions do not run yet."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        for decorator in node.decorator_list:
            found.changes |= _root(getattr(decorator, "func", decorator))  # @f.register
            if isinstance(decorator, ast.Call):
                found.changes |= {arg.id for arg in decorator.args if _is_name(arg)}
    if isinstance(node, ast.FunctionDef | ast.Lambda):
        return
    if _is_stored(node):
        found.changes |= _root(node)
    if isinstance(node, ast.Attribute) and (_root(node), node.attr) in (({"sys"}, "path"), ({"os"}, "chdir")):
        found.path = True
    if isinstance(node, ast.ImportFrom) and node.names[0].name == "*":
        found.anything = True
    if isinstance(node, ast.Call):
        called = getattr(node.func, "id", getattr(node.func, "attr", ""))
        found.changes |= {arg.id for arg in node.args if _is_name(arg) and called in FILLS}
        found.calls |= {called} if _is_name(node.func) else set()
        found.anything = found.anything or called in UNSEEN
        found.passes |= {(called, arg.id) for arg in node.args if _is_name(arg)} if _is_name(node.func) else set()
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):  # a method that is called for what it changes
        found.changes |= _root(node.value.func)
    for child in ast.iter_child_nodes(node):
        _effects(child, found)
    if isinstance(node, ast.For) and _is_name(node.target):  # what is done to each of them is done by another name
        each, name = {part.id for part in ast.walk(node.iter) if _is_name(part)}, node.target.id
        found.changes |= each if name in found.changes else set()
        found.passes |= {(function, one) for function, given in found.passes if given == name for one in each}


def _is_stored(node):
    """Whether it is an attribute or an item that gets a value."""
    return isinstance(node, ast.Attribute | ast.Subscript) and isinstance(node.ctx, ast.Store)


def _root(node):
    """The name that `a` is in a.b[c].d, and nothing for a name alone."""
    start = node
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return {node.id} if _is_name(node) and node is not start else set()


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


class _Plain(ast.NodeTransformer):
    """Leaves the names as they are, and takes away what a symbol table cannot take in or counts as its surroundings'.

    Newer Pythons list a comprehension's own names among those of what is around it: it becomes a generator.
    Jupyter lets a cell wait at its top (`await`), which Python does not.
    """

    def visit(self, node):
        node = self.generic_visit(node)
        if isinstance(node, ast.Await):
            return node.value
        if isinstance(node, ast.AsyncFor):
            return ast.For(node.target, node.iter, node.body, node.orelse, lineno=1)
        if isinstance(node, ast.AsyncWith):
            return ast.With(node.items, node.body, lineno=1)
        if isinstance(node, ast.AsyncFunctionDef):
            return ast.FunctionDef(node.name, node.args, node.body, node.decorator_list, node.returns, lineno=1)
        if not isinstance(node, ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp):
            return node
        for part in node.generators:
            part.is_async = 0
        parts = [node.key, node.value] if isinstance(node, ast.DictComp) else [node.elt]
        return ast.GeneratorExp(ast.Tuple(parts, ast.Load()), node.generators)


def _is_name(node: ast.AST) -> TypeGuard[ast.Name]:
    return isinstance(node, ast.Name)

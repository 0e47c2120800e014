"""Slips of Python in a function or in the methods of a class: each a sentence that is true as it stands."""

import ast
import builtins
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias

from .operands import Matrices

Outside: TypeAlias = Callable[[str, bool], bool]
KEPT = {"append", "concatenate", "vstack", "hstack", "stack", "delete", "insert", "transpose", "reshape", "dot"}
KEPT |= {"matmul", "add", "subtract", "multiply", "divide", "wrap", "inv", "block_diag"}  # change nothing in place
BARE = {"append", "concatenate", "vstack", "hstack", "wrap", "inv", "block_diag"}  # by such a name nobody means another
LIBRARIES = {"np", "numpy", "np.linalg", "numpy.linalg", "linalg", "scipy.linalg"}


class Method(NamedTuple):
    """A function, and whether it is a class's."""

    node: ast.FunctionDef
    bound: bool

    def say(self, node: ast.stmt | ast.expr, text: str) -> str:
        """The sentence about a place in it."""
        return f"In `{_cut(self.node.name)}`, line {node.lineno}: {text}"

    @property
    def arguments(self) -> list[str]:
        """The names of its arguments, without `self`."""
        a = self.node.args
        names = [one.arg for one in [*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg] if one]
        return names[self.bound :]

    def all(self, *kinds: type) -> Iterator:
        """The nodes of these kinds in it."""
        return (node for node in ast.walk(self.node) if isinstance(node, kinds))

    def names(self, context: type) -> Counter[str]:
        """{name: how often} it is looked up (ast.Load) or set (ast.Store) in it."""
        return Counter(node.id for node in self.all(ast.Name) if isinstance(node.ctx, context))


def slips(methods: Sequence[Method], is_outside: Outside) -> Iterator[str]:
    """Sentences, what matters most first. is_outside: whether a cell gives this name a value that belongs in an
    argument or a field; it is told whether a field has that name.
    """
    for look in (_matrix_class, _entry_by_entry, _gain_order, _dropped, _first_pass, _kept_default, _in_place):
        for method in methods:
            yield from look(method)
    stored = [kept for method in methods if method.bound for kept in _kept(method)]
    fields = {name: field for field, names, _ in stored for name in [*names, field] if len(names) == 1}
    for method in methods:
        yield from _outside(method, is_outside, fields)
    yield from _never_read(methods, stored)


def odd(methods: Sequence[Method]) -> Iterator[str]:
    """Sentences about what may well be right, for where there are no others."""
    for look in (_unused, _float_equal):
        for method in methods:
            yield from look(method)


def _called(node):
    """The last word of the name of what is called, or ''."""
    return getattr(node.func, "attr", getattr(node.func, "id", "")) if isinstance(node, ast.Call) else ""


def _field(node):
    """F of `self.F`, or ''."""
    own = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self"
    return node.attr if own else ""


def _short(node):
    return _cut(" ".join(ast.unparse(node).split()))


def _cut(text, most=40):
    return text if len(text) <= most else f"{text[: most - 3]}..."


def _matrix_class(method):
    for node in method.all(ast.Attribute):
        if node.attr in ("matrix", "mat", "asmatrix") and getattr(node.value, "id", "") in ("np", "numpy"):
            yield method.say(node, f"`{_short(node)}` makes another type, with shapes of its own: use `np.array`.")
        elif node.attr == "I" and not _field(node):
            yield method.say(node, f"`{_short(node)}`: an array has no `.I`. The inverse is `np.linalg.inv(...)`.")


def _entry_by_entry(method):
    are = Matrices(method.node, method.arguments)
    for node in method.all(ast.BinOp):
        left, right = node.left, node.right
        if isinstance(node.op, ast.Mult) and are.matrix(left) and are.matrix(right):
            says = f"multiplies entry by entry. The matrix product is {_product(left, right)}."
        elif isinstance(node.op, ast.Div) and are.matrix(right) and are.matrix(left):
            says = f"divides entry by entry. With the inverse it is {_product(left, _inverse(right))}."
        elif isinstance(node.op, ast.Div) and are.matrix(right):
            says = f"divides entry by entry. The inverse is `{_short(_inverse(right))}`."
        elif isinstance(node.op, ast.Pow) and are.matrix(left) and ast.unparse(right) in ("-1", "-1.0"):
            says = f"inverts entry by entry. The inverse is `{_short(_inverse(left))}`."
        else:
            continue
        yield method.say(node, f"`{_short(node)}` {says}")


def _product(left, right):
    return f"`{_cut(ast.unparse(ast.BinOp(left, ast.MatMult(), right)), 60)}`"


def _inverse(node):
    return ast.Call(ast.parse("np.linalg.inv", mode="eval").body, [node], [])


def _gain_order(method):
    products = [node for node in method.all(ast.BinOp) if isinstance(node.op, ast.MatMult)]
    if not any(getattr(node.left, "id", "") == "K" for node in products):  # it may be kept transposed
        return
    for node in method.all(ast.Assign):
        parts = _factors(node.value)
        is_gain = getattr(node.targets[0], "id", "") == "K" and len(parts) > 2
        if is_gain and _called(parts[0]) in ("inv", "pinv") and getattr(parts[0].args[0], "id", "") == "S":
            right = "P @ H.T @ np.linalg.inv(S)"
            yield method.say(node, f"`{_short(node)}` begins with the inverse of S, which is last in `{right}`.")


def _factors(node):
    parts = []
    while isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
        parts.append(node.right)
        node = node.left
    return [node, *reversed(parts)]


def _dropped(method):
    for node in method.all(ast.Expr):
        value = node.value
        if isinstance(value, ast.Compare) and isinstance(value.ops[0], ast.Eq):
            yield method.say(node, f"`{_short(value)}` compares and stores nothing: `=` stores.")
        elif isinstance(value, ast.BinOp) or (
            _called(value) in KEPT
            and (
                _called(value) in BARE
                if isinstance(value.func, ast.Name)
                else ast.unparse(value.func.value) in LIBRARIES
            )
            and not any(keyword.arg == "out" for keyword in value.keywords)
        ):
            yield method.say(node, f"what `{_short(value)}` gives is not kept: no `=` stores it.")


def _first_pass(method):
    for loop in method.all(ast.For, ast.While):
        ends = [node for node in loop.body if isinstance(node, ast.Return)]
        if ends and not any(isinstance(node, ast.Continue) for node in ast.walk(loop)):
            yield method.say(ends[0], "this `return` ends the loop in its first pass. Perhaps it is indented too far?")


def _kept_default(method):
    a = method.node.args
    names = [one.arg for one in [*a.posonlyargs, *a.args][-len(a.defaults) :]] if a.defaults else []
    for name, value in [
        *zip(names, a.defaults),
        *((one.arg, value) for one, value in zip(a.kwonlyargs, a.kw_defaults)),
    ]:
        if isinstance(value, ast.List | ast.Dict | ast.Set) and any(
            getattr(getattr(node, "func", None), "value", None) and getattr(node.func.value, "id", "") == name
            for node in method.all(ast.Call)
        ):
            text = f"`{_cut(name)}={_short(value)}` is made once, and all calls go on with the same one: "
            yield method.say(value, text + "make it inside the function.")


def _in_place(method):
    inner = Counter(node.arg for node in method.all(ast.arg))
    added = [node for node in method.all(ast.AugAssign) if isinstance(node.target, ast.Name)]
    again = method.names(ast.Store) - Counter(node.target.id for node in added)
    callers = {name for name in method.arguments if inner[name] == 1 and not again[name]}
    for node in method.all(ast.AugAssign, ast.Assign):
        for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
            part = isinstance(target, ast.Subscript)
            name = getattr(target.value if part else target, "id", "")
            if name in callers and (part or isinstance(node, ast.AugAssign)):
                where = "" if part else ", where that is an array"
                yield method.say(node, f"`{_short(node)}` changes the caller's `{_cut(name)}` too{where}.")


def _outside(method, is_outside: Outside, fields: Mapping[str, str]):
    local = {*method.names(ast.Store), *dir(builtins), *(node.arg for node in method.all(ast.arg))}
    local |= {node.name for node in method.all(ast.FunctionDef, ast.ClassDef, ast.ExceptHandler)}
    local |= {alias.asname or alias.name for node in method.all(ast.Import, ast.ImportFrom) for alias in node.names}
    local |= {getattr(node.func, "id", "") for node in method.all(ast.Call)}  # a tool
    for node in method.all(ast.Name):
        name = node.id
        constant = name.isupper() and len(name) > 1 and name not in fields
        if name not in local and not constant and is_outside(name, name in fields):
            local.add(name)
            use = f"use `self.{_cut(fields[name])}`" if method.bound and name in fields else "take it from an argument"
            use += " or from `self`" if method.bound and name not in fields else ""
            yield method.say(node, f"`{_cut(name)}` is a global of the notebook: {use}.")


def _kept(method):
    """(F, the names of arguments in the value, statement) of each `self.F = ...` of a constructor."""
    given = set(method.arguments) if method.node.name == "__init__" else set()
    for node in method.all(ast.Assign) if given else ():
        used = {n.id for n in ast.walk(node.value) if isinstance(n, ast.Name)} & given
        for target in node.targets:
            if _field(target):
                yield _field(target), sorted(used - {"dt"} or used), node


def _never_read(methods, stored):
    uses = Counter(_field(node) for method in methods for node in method.all(ast.Attribute) if _field(node))
    whole = sum(method.names(ast.Load)["self"] for method in methods) > sum(uses.values())  # `self` was given away
    sets = Counter(
        _field(node)
        for method in methods
        for node in method.all(ast.Attribute)
        if _field(node) and isinstance(node.ctx, ast.Store)
    )
    looked = Counter(name for m in methods if m.node.name == "__init__" for name in m.names(ast.Load).elements())
    for method in methods:
        for field, names, node in stored if method.bound and method.node.name == "__init__" and not whole else ():
            if uses[field] == sets[field] and names and all(looked[name] == 1 for name in names):
                yield method.say(node, f"`self.{_cut(field)}` is set here, and no method reads it.")


def _unused(method):
    looked = method.names(ast.Load)
    hidden = {name for node in method.all(ast.Global, ast.Nonlocal) for name in node.names}
    hidden |= {node.target.id for node in method.all(ast.AugAssign) if isinstance(node.target, ast.Name)}
    if looked.keys() & {"locals", "eval", "exec", "vars"}:
        return
    for node in method.all(ast.Assign):
        name = getattr(node.targets[0], "id", "_")
        if not looked[name] and name not in hidden and not name.startswith("_"):
            yield method.say(node, f"`{_cut(name)}` gets a value that nothing uses.")


def _float_equal(method):
    for node in method.all(ast.Compare):
        values = [node.left, *node.comparators]
        near = any(isinstance(v, ast.Constant) and isinstance(v.value, float) and v.value for v in values)
        if near and isinstance(node.ops[0], ast.Eq | ast.NotEq):
            yield method.say(node, f"`{_short(node)}` looks at every digit: `np.isclose` allows for rounding.")

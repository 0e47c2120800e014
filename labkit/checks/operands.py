"""Which values in a student's function are matrices for sure, as far as its text tells."""

import ast
from collections.abc import Sequence

GIVEN = {"P0", "Q", "R"}  # what a filter's constructor is given as matrices
FIELDS = {"P", "Pk_k", "Q", "R"}  # what it keeps as such
ALWAYS = {"inv", "pinv", "eye", "identity", "block_diag", "vstack", "atleast_2d"}  # what these give has two dimensions
AS_FIRST = {"tile", "kron", "array", "asarray", "copy"}  # ... if their first argument has
SHAPED = {"zeros", "ones", "empty"}


class Matrices:
    """What one function says of its values. arguments: their names."""

    def __init__(self, function: ast.FunctionDef, arguments: Sequence[str]) -> None:
        self._known: dict[ast.AST | str, bool] = {}
        if function.name == "__init__":
            self._known.update({name: name in GIVEN for name in arguments})
        else:
            self._known.update({name: name == "P" for name in arguments})
        self._values: dict[str, list[ast.expr | None]] = {}
        for node in ast.walk(function):
            if isinstance(node, ast.Assign):
                for target in node.targets:
                    self._set(target, node.value)
            elif isinstance(node, ast.AugAssign | ast.For | ast.comprehension | ast.NamedExpr):
                self._set(node.target, None)

    def _set(self, target, value):
        if isinstance(target, ast.Name):
            self._values.setdefault(target.id, []).append(value)
            if target.id in self._known:  # an argument that gets another value
                self._known[target.id] = False
        elif isinstance(target, ast.Tuple | ast.List):
            for part in target.elts:
                # Of what a lab's function gives together, H is a matrix.
                self._set(part, value if getattr(part, "id", "") == "H" and isinstance(value, ast.Call) else None)

    def matrix(self, node: ast.expr) -> bool:
        """Whether a value has two dimensions."""
        key: ast.AST | str = node.id if isinstance(node, ast.Name) else node
        if key not in self._known:
            self._known[key] = False  # while it is looked up, so that x = x + y ends
            self._known[key] = self._name(node.id) if isinstance(node, ast.Name) else self._value(node)
        return self._known[key]

    def _name(self, name):
        values = self._values.get(name, [])
        return bool(values) and all(
            value is not None and (self.matrix(value) or name == "H" and _is_own_call(value)) for value in values
        )

    def _value(self, node):
        if isinstance(node, ast.Attribute):
            own = getattr(node.value, "id", "") == "self" and node.attr in FIELDS
            return own or node.attr == "T" and self.matrix(node.value)
        if isinstance(node, ast.BinOp):
            both = self.matrix(node.left), self.matrix(node.right)
            return all(both) if isinstance(node.op, ast.MatMult) else any(both)
        if isinstance(node, ast.UnaryOp):
            return self.matrix(node.operand)
        return isinstance(node, ast.Call) and self._call(node)

    def _call(self, node):
        called = getattr(node.func, "attr", getattr(node.func, "id", ""))
        first = node.args[0] if node.args else None
        if called in AS_FIRST and first:
            rows = isinstance(first, ast.List) and bool(first.elts) and isinstance(first.elts[0], ast.List)
            return rows or self.matrix(first)
        if called in SHAPED:
            return isinstance(first, ast.Tuple) and len(first.elts) == 2
        if called == "solve" and len(node.args) == 2:
            return self.matrix(node.args[1])
        if called == "copy" and not node.args and isinstance(node.func, ast.Attribute):
            return self.matrix(node.func.value)
        return called in ALWAYS


def _is_own_call(node):
    """Whether it is a call of a function by its bare name, as of the lab's `jacobian`."""
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id not in ("float", "abs")

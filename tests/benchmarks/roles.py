"""The quantity that a line of a solution stands for, and which quantities a check's report names."""

import ast
import re

PLACES = {  # of what a line sets, in `update` and in the functions: its quantity
    "h": ("innovation", "nu", "expected", "known", "off", "seen", "z", "dx", "r", "i"),
    "H": ("H", "here", "there", "change", "e"),
    "R": ("R", "sigma", "sigmas", "p"),
    "S": ("S",),
    "gain": ("K",),
    "estimate": ("xk_k", "x"),
    "covariance": ("Pk_k", "P", "I_KH"),
    "gate": ("keep", "d2", "block"),
}
OF_FUNCTIONS = {
    "h": "h",
    "stack": "h",
    "jacobian": "H",
    "jacobians": "H",
    "repeat_R": "R",
    "motion": "motion",
    "motion_jacobians": "Q",
    "predicted": "Q",
}
# Parts of labkit.checks.identify that name a quantity. What sums up more than one line names each of them.
NAMES = {
    "motion": {"motion", "heading in predict", "position in predict", "xk_k in __init__", "x in __init__"},
    "Q": {"Q in predict", "P in predict", "Q in __init__", "Pk_k in __init__", "P in __init__"},
    "h": {"h", "landmark", "measured", "innovation", "wrap", "sign", "several"},
    "wrap": {"wrap", "heading in predict", "heading in update", "position in update", "h"},
    "H": {"H", "sign", "measured", "several"},
    "R": {"R", "R in __init__", "measured", "several"},
    "S": {"R", "H P H'", "gain", "several"},
    "gain": {"gain", "estimate", "sign", "column", "entries", "H P H'"},
    "estimate": {"estimate", "gain", "sign", "innovation", "column", "entries", "heading in update"},
    "covariance": {"P"},
    "empty": {"empty"},
    "gate": {"gate", "d2", "d2 list", "d2 before", "d2 empty", "d2 of each", "d2 gated"},
    "start": {"xk_k in __init__", "x in __init__", "Pk_k in __init__", "P in __init__"},
}


def role(source: str, line: int) -> str:
    """The quantity of a line (by its number) of a solution's source: that of what its statement sets."""
    tree = ast.parse(source)
    inside = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef) and n.lineno <= line <= n.end_lineno]
    if not inside:
        return ""
    function = inside[-1]
    nodes = [n for n in ast.walk(function) if isinstance(n, ast.stmt) and n.lineno <= line <= n.end_lineno]
    statement = nodes[-1]
    sets = _set_by(statement)
    if re.match(r"\S+ = wrap\(", ast.unparse(statement)):
        return "wrap"
    if function.name == "__init__":
        return {"Q": "Q", "R": "R", "gate": "gate"}.get(sets, "start")
    if function.name == "predict":
        return "motion" if sets in ("xk_k", "x", "theta", "turn", "dx", "cos") else "Q"
    if isinstance(statement, ast.If | ast.Return) and function.name == "update":
        return "empty" if re.search(r"not y|len\(y\)", ast.unparse(statement)[:30]) else "gate"
    if isinstance(statement, ast.For):
        return "gate" if "range(" in ast.unparse(statement.iter) else "h"
    for quantity, names in PLACES.items():
        if sets in names and function.name in ("update", "stack"):
            return quantity
    return OF_FUNCTIONS.get(function.name, "h")


def _set_by(statement):
    targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
    target = targets[0]
    if isinstance(statement, ast.Expr):  # as by `nu.append(...)`
        target = getattr(getattr(statement.value, "func", None), "value", None)
    while isinstance(target, ast.Subscript | ast.Tuple):
        target = target.value if isinstance(target, ast.Subscript) else target.elts[0]
    return getattr(target, "attr", getattr(target, "id", ""))


def function(source: str, line: int) -> str:
    """The name of the function, outside a class, in which a line (by its number) of a source stands, or ''."""
    nodes = [n for n in ast.parse(source).body if isinstance(n, ast.FunctionDef)]
    return next((n.name for n in nodes if n.lineno <= line <= n.end_lineno), "")


def is_named(quantity: str, where: str, text: str, parts: set[str], roles: set[str], source: str) -> bool:
    """Whether a report names a quantity, or says that the function in which it stands is to be mended first.

    where: that function's name, or '';  parts: of what probing found, as far as it is said;
    roles: of the known mistakes whose sentences are said;  source: what the numbers of lines in the text belong to.
    """
    lines = {role(source, int(number)) for number in re.findall(r"line (\d+):", text)}
    sent = re.findall(r"`(\w+)`", text.partition("First mend ")[2].partition(":")[0])
    return bool(NAMES.get(quantity, {quantity}) & parts) or quantity in roles | lines or where in sent

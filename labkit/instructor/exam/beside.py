"""What is told beside a failed check: what to mend first, and slips that the student's text shows."""

import ast
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from ... import checks
from ...checks.causes import first_to_mend
from ...checks.feedback import safely
from ...checks.source import LONGEST, definitions, notes_in, parsed


@contextmanager
def beside(subject: str, cells: Sequence[Mapping[str, Any]], seen: Mapping[str, Any]) -> Iterator[None]:
    """Add to a CheckError what the notebook's own check adds, from a student's text alone: nothing of it runs.

    subject: the name of what is judged;  cells: the student's;  seen: {check: traces, or the exception in their place}.
    """
    try:
        yield
    except checks.CheckError as error:
        texts = [cell["source"] for cell in cells if cell["code"]]
        if sum(map(len, texts)) <= 3 * LONGEST:
            trees = [tree for text in texts if (tree := parsed(text))]
            error.add(safely(lambda: [*_first_to_mend(trees, subject, seen), *notes_in(trees, subject)], []))
        raise


def found_or_raised(found: Any) -> Any:
    """What was found, unless that is an exception, which is raised."""
    if isinstance(found, Exception):
        raise found
    return found


def _first_to_mend(trees, subject, seen):
    data = {check: checks.stored(check) for check in seen}

    def fails(name):
        mine = {check: what for check, what in seen.items() if checks.is_of(data[check], name)}
        return any(isinstance(what, Exception) or checks.wrong(data[check], what) for check, what in mine.items())

    return first_to_mend(_used(trees, subject), fails, lambda name: _used(trees, name))


def _used(trees: Sequence[ast.Module], subject: str) -> Iterable[str]:
    """The functions of the notebook that one of its definitions calls, also by way of others."""
    known, found, todo = definitions(trees), {subject: None}, [subject]
    while todo:
        names = [part for part in ast.walk(known.get(todo.pop(0), ast.Pass())) if isinstance(part, ast.Name)]
        local = {part.id for part in names if isinstance(part.ctx, ast.Store)}
        for name in (part.id for part in names):
            if name not in local and name not in found and isinstance(known.get(name), ast.FunctionDef):
                found[name] = None
                todo.append(name)
    return list(found)[1:]

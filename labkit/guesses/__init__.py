"""Predictions that a student makes before a cell is run, and what is said of them after it.

Of each lab, `NN_name.toml` beside this file holds {name: right, a, b, ...}: the letter that is right, and for each
letter why it was tempting. Nothing of it is graded.
"""

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from ..checks.feedback import LabError

UNMADE = "?"


@cache
def told() -> Mapping[str, Mapping[str, str]]:
    """{name: {'right': letter, letter: what is said of it}} of all labs."""
    files = sorted(Path(__file__).parent.glob("*.toml"))
    return {name: said for file in files for name, said in tomllib.loads(file.read_text(encoding="utf-8")).items()}


def letters(name: str) -> list[str]:
    """The letters that can be chosen. Raises LabError for a name that no lab has."""
    if name not in told():
        raise LabError(f"There is no prediction called {name!r}; the name stands in the cell as it was handed out.")
    return [letter for letter in told()[name] if letter != "right"]


def reveal(name: str, guess: str) -> None:
    """Say which of the choices was right, and of each why it was tempting; first of all, ask for one.

    Raises LabError for a name that no lab has.
    """
    choices = letters(name)
    chosen = guess.strip(" ()").lower() if isinstance(guess, str) else guess
    if chosen not in choices:
        quoted = [f'"{letter}"' for letter in choices]
        print(f"Choose first: write guess = {', '.join(quoted[:-1])} or {quoted[-1]}, and run the cell again.")
        return
    right = told()[name]["right"]
    print(
        f"You chose ({chosen}), and that is right." if chosen == right else f"You chose ({chosen}); ({right}) is right."
    )
    for letter in choices:
        print(f"({letter}) {told()[name][letter]}")

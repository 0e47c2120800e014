"""Who is in a course, from a table with a column `name` and, if there are numbers, a column `number`."""

from dataclasses import dataclass
from pathlib import Path

from ..records import CommandError
from ..report.lms import digits, name_key
from ..report.sheet import Sheet
from ..report.texts import clean, listed, squash


@dataclass(frozen=True)
class Pupil:
    """name, number: as the LMS has them, the number '' where there is none."""

    name: str
    number: str = ""

    @property
    def key(self) -> str:
        """What numbers of one's own are drawn from: the number, else the name."""
        return self.number or self.name


def read(path: Path | str) -> list[Pupil]:
    """The pupils of a table, in its order. Raises CommandError for a table without names, and for twins."""
    sheet = Sheet(path)
    titles = [title.strip().lower() for title in sheet.header]
    if "name" not in titles:
        raise CommandError(f"{path}: its first line should name a column 'name' (and 'number', if there are numbers).")
    rows = [(line, row) for line, row in sheet.lines() if any(map(str.strip, row))]
    pupils = [Pupil(*(_cell(row, titles, title) for title in ("name", "number"))) for _, row in rows]
    for (line, _), pupil in zip(rows, pupils):
        if not pupil.name:
            raise CommandError(f"{path}, line {line}: there is no name.")
    for key in ("key", "name"):
        seen: dict[tuple[str, ...], Pupil] = {}
        for pupil in pupils:
            same = name_key(getattr(pupil, key))
            if same in seen and not (key == "name" and pupil.number and seen[same].number):
                raise CommandError(
                    f"{path}: {getattr(pupil, key)!r} stands there twice; who has the same name needs a number each, "
                    "and no two have the same."
                )
            seen[same] = pupil
    if not pupils:
        raise CommandError(f"{path} names nobody.")
    return pupils


def _cell(row: list[str], titles: list[str], title: str) -> str:
    place = titles.index(title) if title in titles else len(row)
    return squash(clean(row[place])) if place < len(row) else ""


def keys(pupils: list[Pupil], people: list[tuple[str, str]], path: Path | str) -> dict[tuple[str, str], str]:
    """{(name, number) of who handed in: the key of the pupil}. Raises CommandError for who is not in the table."""
    numbers = {pupil.number: pupil.key for pupil in pupils if pupil.number}
    found: dict[tuple[str, str], str] = {}
    strange = []
    for name, number in people:
        same = [pupil.key for pupil in pupils if name_key(pupil.name) == name_key(name)]
        if number in numbers or digits(number) in numbers:
            found[name, number] = numbers.get(number) or numbers[digits(number)]
        elif len(same) == 1:
            found[name, number] = same[0]
        else:
            strange.append(f"{name} ({number})" if number else name)
    if strange:
        raise CommandError(
            f"{path} does not say which of its students {listed(sorted(strange))} is: each needs a line with the name, "
            "or the number, as the LMS has it. Nothing was graded."
        )
    return found

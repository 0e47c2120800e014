"""A rubric's lines that give points, as buttons: `- 1 point: the reason is named`."""

import re
from typing import NamedTuple

from ..report.texts import number

_LINE = re.compile(r"[-*+]\s+(\d+(?:[.,]\d+)?)\s*(?:points?|pts?\.?|p\.)(?!\w)\s*[:.–-]?\s*(\S.*)")


class Line(NamedTuple):
    """What gives how many points."""

    points: float
    text: str


def read(rubric: str) -> tuple[str, list[Line]]:
    """(the Markdown text around the lines that give points, these lines)."""
    around: list[str] = []
    lines: list[Line] = []
    within = False
    for line in rubric.splitlines():
        found = _LINE.fullmatch(line.strip())
        within = bool(found) or within and bool(re.match(r"\s+\S", line))
        if found:
            lines.append(Line(number(found[1]) or 0.0, found[2]))
        elif within:
            lines[-1] = lines[-1]._replace(text=f"{lines[-1].text} {line.strip()}")
        else:
            around.append(line)
    return "\n".join(around).strip(), lines

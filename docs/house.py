"""The picture of the house, drawn from the code's own imports: `python docs/house.py` writes docs/pictures/house.svg.

A room is a module or folder of labkit, or of labkit/instructor; an arrow goes from a room to one that it imports.
"""

import ast
from html import escape
from pathlib import Path
from textwrap import wrap

ROOT = Path(__file__).resolve().parents[1]
PICTURE, PAGE = ROOT / "docs" / "pictures" / "house.svg", ROOT / "docs" / "maintainers.md"
WING = "instructor"  # the folder of labkit that students do not get
BOX, GAP, LINE = (196, 76), (20, 40), 13  # [px] of a room, between rooms, of a line of text


def modules(root=ROOT):
    """{dotted name: path} of all modules of labkit; a package has the name of its folder."""
    found = {}
    for path in sorted((root / "labkit").rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 2 else parts)] = path
    return found


def imported(path, name, known):
    """The names of modules of labkit that a module imports, anywhere in it."""
    base = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    base = ["labkit"] if name == "labkit.__init__" else base
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            start = base[: len(base) + 1 - node.level] if node.level else []
            source = ".".join(start + ([node.module] if node.module else []))
            for alias in node.names:
                full = f"{source}.{alias.name}"
                target = full if full in known else "labkit.__init__" if source == "labkit" else source
                if target in known:
                    yield target


def room_of(name):
    """The room that a module stands in: a module or folder of labkit, or one of the instructors' wing."""
    parts = name.split(".")[1:]
    return "/".join(parts[:2]) if parts[0] == WING and len(parts) > 1 else parts[0]


def plan(root=ROOT):
    """({room: set of rooms that it imports}, {room: first line of its docstring})."""
    known = modules(root)
    arrows, words = {}, {}
    for name, path in known.items():
        room = room_of(name)
        arrows.setdefault(room, set()).update(room_of(target) for target in imported(path, name, known))
        if room == "/".join(name.split(".")[1:]):
            words[room] = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n")[0]
    arrows.pop(WING, None)  # its docstring only
    return {room: {other for other in targets if other not in (room, WING)} for room, targets in arrows.items()}, words


def back(arrows):
    """The pairs of rooms on a circle: each of the two reaches the other."""
    reach = {room: reached(room, arrows) for room in arrows}
    return sorted((a, b) for a in arrows for b in arrows[a] if a in reach[b])


def reached(room, arrows):
    """All rooms that can be reached from a room by its arrows."""
    seen, todo = set(), [room]
    while todo:
        for other in arrows.get(todo.pop(), ()):
            if other not in seen:
                seen.add(other)
                todo.append(other)
    return seen


def floors(arrows):
    """{room: its floor}: 0 for rooms that import none, else one above the highest of those that it imports."""
    level = {}

    def height(room):
        if room not in level:
            level[room] = -1  # a circle would come back here
            level[room] = 1 + max((height(other) for other in arrows.get(room, ())), default=-1)
        return level[room]

    return {room: height(room) for room in arrows}


def drawing(root=ROOT):
    """The picture as SVG: each wing from the ground floor up, the students' left, the instructors' right."""
    arrows, words = plan(root)
    spot, wings, left = {}, [], 20
    for theirs in (False, True):
        own = {room: to for room, to in arrows.items() if room.startswith(f"{WING}/") is theirs}
        inside = {room: {other for other in to if other in own} for room, to in own.items()}
        rows = _rows(inside)
        widest = max(map(len, rows))
        for floor, row in enumerate(rows):
            start = left + (widest - len(row)) * (BOX[0] + GAP[0]) / 2
            spot.update(
                {room: (start + n * (BOX[0] + GAP[0]), -floor * (BOX[1] + GAP[1])) for n, room in enumerate(row)}
            )
        wings.append(inside)
        left += widest * (BOX[0] + GAP[0]) + 50
    down = 60 - min(y for _, y in spot.values())
    spot = {room: (x, y + down) for room, (x, y) in spot.items()}
    size = left - 40, down + BOX[1] + 30
    uses = {room: sorted(to - wings[1].keys()) for room, to in arrows.items() if room in wings[1]}
    lines = [line for inside in wings for line in _lines(inside, spot)]
    return "\n".join([*_frame(size, wings, spot), *lines, *_boxes(spot, words, uses), "</svg>", ""])


def _rows(arrows):
    """The rooms of each floor, from the ground up, each row in the order of what it stands on."""
    level, rows, place = floors(arrows), [], {}
    for floor in range(1 + max(level.values())):
        row = sorted(room for room in arrows if level[room] == floor)
        # The sum in one order, and rounded: rooms that are as far left keep the order of their names.
        row.sort(key=lambda room: round(sum(place[r] for r in sorted(arrows[room])) / max(len(arrows[room]), 1), 6))
        place.update({room: (n + 0.5) / len(row) for n, room in enumerate(row)})
        rows.append(row)
    return rows


def _frame(size, wings, spot):
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]:.0f} {size[1]:.0f}" '
        'font-family="Helvetica, Arial, sans-serif" font-size="11" role="img" aria-labelledby="title">'
    )
    yield '<title id="title">labkit\'s rooms: who imports whom, from the ground floor up</title>'
    yield '<rect width="100%" height="100%" fill="white"/>'
    titles = ("labkit: what students get", f"labkit/{WING}: what instructors run")
    for rooms, color, text in zip(wings, ("#eef4fb", "#fdf3e7"), titles):
        x, y = zip(*(spot[room] for room in rooms))
        wide, high = max(x) - min(x) + BOX[0] + 24, max(y) - min(y) + BOX[1] + 50
        place = f'x="{min(x) - 12:.0f}" y="{min(y) - 38:.0f}" width="{wide:.0f}" height="{high:.0f}"'
        yield f'<rect {place} rx="8" fill="{color}"/>'
        yield f'<text x="{min(x):.0f}" y="{min(y) - 18:.0f}" font-size="15" font-weight="bold">{escape(text)}</text>'


def _lines(arrows, spot):
    """Arrows down to what is imported, without those that a longer way says already."""
    yield '<defs><marker id="tip" viewBox="0 0 6 6" refX="6" refY="3" markerWidth="6" markerHeight="6" orient="auto">'
    yield '<path d="M0 0 L6 3 L0 6 z" fill="#5b6b7b"/></marker></defs>'
    yield '<g fill="none" stroke="#5b6b7b" stroke-width="1" stroke-opacity="0.55">'
    for room in sorted(arrows):
        longer = set().union(*(reached(other, arrows) for other in arrows[room]))
        for other in sorted(arrows[room] - longer):
            (x1, y1), (x2, y2) = spot[room], spot[other]
            x1, x2, y1 = x1 + BOX[0] / 2, x2 + BOX[0] / 2, y1 + BOX[1]
            bend = max(30, (y2 - y1) / 2)
            way = f"M{x1:.0f} {y1:.0f} C{x1:.0f} {y1 + bend:.0f} {x2:.0f} {y2 - bend:.0f} {x2:.0f} {y2:.0f}"
            yield f'<path d="{way}" marker-end="url(#tip)"/>'
    yield "</g>"


def _boxes(spot, words, uses):
    """uses: of the instructors' rooms, which of the students' they import."""
    for room, (x, y) in sorted(spot.items()):
        yield f'<rect x="{x:.0f}" y="{y:.0f}" width="{BOX[0]}" height="{BOX[1]}" rx="4" fill="white" stroke="#33475b"/>'
        name = escape(room.split("/")[-1].replace("__init__", "labkit"))
        yield f'<text x="{x + 8:.0f}" y="{y + 16:.0f}" font-size="13" font-weight="bold">{name}</text>'
        told, of = words.get(room, ""), uses.get(room, ())
        lines = [(line, "#333") for line in wrap(told, 29, max_lines=2 if of else 3, placeholder=" ...")]
        lines += [
            (line, "#8a5a00") for line in wrap(f"uses {', '.join(of)}", 29, max_lines=2, placeholder=" ...") if of
        ]
        for number, (line, color) in enumerate(lines):
            yield f'<text x="{x + 8:.0f}" y="{y + 31 + LINE * number:.0f}" fill="{color}">{escape(line)}</text>'


if __name__ == "__main__":
    PICTURE.write_text(drawing(), encoding="utf-8", newline="\n")
    print(PICTURE)

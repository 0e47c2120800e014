"""What `labkit build` found out about the hidden checks, see `labkit.instructor.exam.bite`."""

import json
from pathlib import Path
from typing import Any

FILE = "bite.json"  # in solutions/checks


def recorded(root: Path) -> dict[str, dict[str, dict[str, Any]]]:
    """{lab: {check: what was found}}; empty where nothing has been measured yet."""
    path = root / "solutions" / "checks" / FILE
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}

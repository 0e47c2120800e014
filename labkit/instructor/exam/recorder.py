"""A pytest plugin: what nbval says of each check cell becomes a mark, told as soon as it is known.

Only a clean pass counts whole.  Why a check failed, and which parts of its filter are right all the same, comes from
the kernel's own notes; what these give does not.
"""

import json
from collections.abc import Callable, Generator, Mapping
from pathlib import Path
from typing import Any

import pytest

from .. import records
from .kernel import FILE


class Recorder:
    """folder: the batch's;  points: {check: its points};  news: a function that takes each mark as a dictionary;
    parts: {check: {part: per cent}} of those whose points are divided.
    """

    def __init__(
        self,
        folder: str | Path,
        points: Mapping[str, float],
        news: Callable[[dict], None],
        parts: Mapping[str, Mapping[str, int]] | None = None,
    ) -> None:
        self.file, self.points, self.news, self.parts = Path(folder) / FILE, points, news, parts or {}
        self.place = 0

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item, call: pytest.CallInfo) -> Generator[None, Any, None]:
        """Called by pytest for each stage of each cell."""
        outcome = yield
        report = outcome.get_result()
        about = getattr(item, "cell", {}).get("metadata", {}).get("grading")
        if about is None:
            return
        if report.when == "call" or report.when == "setup" and report.outcome != "passed":
            self._tell(about, report)

    def _tell(self, about, report):
        notes = [n for n in self._notes() if (n["number"], n["check"]) == (about["number"], about["check"])]
        if about["check"] not in self.points:
            return  # a figure
        note = notes[-1] if notes else {}
        clean = report.outcome == "passed" and not hasattr(report, "wasxfail")
        if clean and note.get("status") == records.PASSED:
            mark = {"status": records.PASSED, "points": self.points[about["check"]]}
        elif note.get("status") in (records.FAILED, records.NOT_RUN):
            mark = {**note, **self._divided(about["check"], note)}
        else:
            reason = note.get("reason") or _why(report, note)
            mark = {"status": records.ERROR, "points": 0.0, "reason": reason, "again": True}
        self.news({**mark, "number": about["number"], "check": about["check"]})

    def _divided(self, check, note):
        """What a check that failed gives for those parts of the filter that are right."""
        weights = self.parts.get(check, {})
        right = [part for part in records.PARTS if part in note.get("parts", ()) and part in weights and part != "runs"]
        points = records.points_of(self.points[check], weights, right)
        return {"status": records.PARTLY if points else note["status"], "points": points, "parts": right}

    def _notes(self):
        try:
            with open(self.file, encoding="utf-8") as file:
                file.seek(self.place)
                lines = file.readlines()
                self.place = file.tell()
        except OSError:
            return []
        return [json.loads(line) for line in lines]


def _why(report, note):
    if note.get("status") == records.PASSED:
        return "The check printed something else than in the solution notebook."
    last = str(report.longrepr or report.outcome).strip().splitlines()[-1:]
    return "The check itself could not be run." + (f" ({last[0].strip()[:200]})" if last else "")

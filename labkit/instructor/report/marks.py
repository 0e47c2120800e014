"""Which mark counts of those that the gradebook holds for one check."""

import json
from collections.abc import Mapping

from ..records import BLANK, BY_HAND, ERROR, NOT_RUN, OPEN, UNSHUT, Check, Mark, Result
from .texts import is_blank


def mark_of(check: Check, given: Mapping[str, tuple], hand: Mapping[str, tuple], result: Result) -> Mark:
    """The mark that counts: a person's before that of a run."""
    if check.id in hand:
        points, reason, answer = hand[check.id]
        if answer != result.answers.get(check.id):
            reason = f"{reason} (The answer has changed since it was marked.)".strip()
        return Mark(check.id, points, check.points, BY_HAND, reason)
    if check.hand:
        blank = is_blank(result.answers.get(check.id, ""))
        return Mark(check.id, 0.0 if blank else None, check.points, BLANK if blank else OPEN)
    if check.id not in given:
        return Mark(check.id, None, check.points, NOT_RUN, "Not graded yet.")
    points, status, reason, lines, mistake, parts = given[check.id]
    if result.level == 0:
        reason = f"{reason} {UNSHUT}".strip()
    points = None if status == ERROR else points  # the grader's trouble is no 0 of a student
    told = tuple(json.loads(lines)), mistake, tuple(json.loads(parts))
    return Mark(check.id, points, check.points, status, reason, *told)

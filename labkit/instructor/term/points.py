"""What counts in the term: points, and what each lab weighs. The one place that knows where they come from."""

from collections.abc import Iterable

from ..records import Result
from ..report.gradebook import Gradebook


def counting(book: Gradebook, lab: str) -> list[Result]:
    """The results of a lab with the points that count."""
    return [*book.results(lab)]


def weights(book: Gradebook, labs: Iterable[str]) -> dict[str, float]:
    """What each lab weighs in the total."""
    return dict.fromkeys(labs, 1.0)

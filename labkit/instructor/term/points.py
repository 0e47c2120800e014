"""What counts in the term: points, and what each lab weighs. The one place that knows where they come from."""

from collections.abc import Iterable

from .. import policy
from ..records import Result
from ..report.gradebook import Gradebook


def counting(book: Gradebook, lab: str) -> list[Result]:
    """The results of a lab with the points that count. Raises CommandError if the course's rules cannot be used."""
    return policy.ruled(book, lab)


def weights(book: Gradebook, labs: Iterable[str]) -> dict[str, float]:
    """What each lab weighs in the total. Raises CommandError if the course's rules cannot be used."""
    known = policy.read(book.path.with_name(policy.NAME), book.labs()).weights
    return {lab: known[lab] for lab in labs}

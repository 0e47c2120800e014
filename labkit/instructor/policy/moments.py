"""Due dates with their zones, and how many days late a hand-in is."""

import re
from datetime import UTC, date, datetime, time, timedelta, tzinfo

DAY = timedelta(days=1)
HINT = "write 2026-11-20T23:59, or 2026-11-20 for the end of that day"


def moment(value: object, zone: tzinfo | None) -> datetime:
    """The time, with a zone, that a value of the file says: a date or a time of TOML, or either as a text.

    A date alone is the end of that day; zone: of what names none, None for this machine's. Raises ValueError.
    """
    if isinstance(value, str):
        text = value.strip()
        day = re.fullmatch(r"\d{4}-\d\d-\d\d", text)
        try:
            if not re.match(r"\d{4}-\d\d-\d\d(?!\d)", text):  # 20261120 or a week would be the start of its day
                raise ValueError
            value = date.fromisoformat(text) if day else datetime.fromisoformat(text)
        except ValueError:
            raise ValueError(f"{value!r} is no date; {HINT}") from None
    if isinstance(value, date) and not isinstance(value, datetime):
        value = datetime.combine(value, time.max)
    if not isinstance(value, datetime):
        raise ValueError(f"{value} is no date; {HINT}")
    if not 1990 <= value.year <= 2200:
        raise ValueError(f"the year {value.year} is none of a course; {HINT}")
    return value if value.tzinfo else at(value, zone)


def at(value: datetime, zone: tzinfo | None) -> datetime:
    """A time of the clock in a zone, None for this machine's; of an hour that comes twice, the first."""
    return value.replace(tzinfo=zone) if zone else value.astimezone()


def shown(value: datetime, zone: tzinfo | None) -> str:
    """A time as clocks of the zone show it: '2026-11-20 23:59'. One without a zone is this machine's."""
    return f"{value.astimezone(zone):%Y-%m-%d %H:%M}"


def days_late(when: datetime, due: datetime, grace: timedelta, zone: tzinfo | None) -> int:
    """Days begun after `due` and the grace, 0 in time. when: without a zone it is this machine's, as files' times are.

    A day ends when clocks in the zone show the hour of the due date again, also where they are changed meanwhile.
    """
    if when.astimezone(UTC) - due.astimezone(UTC) <= grace:
        return 0
    beyond = when.astimezone(zone).replace(tzinfo=None) - due.astimezone(zone).replace(tzinfo=None) - grace
    return max(1, -(-beyond // DAY))

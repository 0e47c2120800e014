"""What being late costs: around the due date, with grace and cap, over the nights in which clocks are changed."""

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest

from labkit.instructor.policy import moments, penalty
from labkit.instructor.policy.course import Late

hypothesis = pytest.importorskip("hypothesis")
from hypothesis import given, strategies as st  # noqa: E402

MADRID = ZoneInfo("Europe/Madrid")
DUE = "2026-11-20T23:59"


def time(text, zone=MADRID):
    return moments.moment(text, zone)


@pytest.mark.parametrize(
    "due, when, grace, days",
    [
        (DUE, "2026-11-20T23:58", 0, 0),
        (DUE, "2026-11-20T23:59", 0, 0),
        (DUE, "2026-11-20T23:59:01", 0, 1),
        (DUE, "2026-11-21T23:59", 0, 1),
        (DUE, "2026-11-21T23:59:01", 0, 2),
        (DUE, "2026-11-27T23:59", 0, 7),
        (DUE, "2026-11-21T00:14", 15, 0),
        (DUE, "2026-11-21T00:14:01", 15, 1),
        (DUE, "2026-11-22T00:14", 15, 1),  # a day ends so much later too
        (DUE, "2026-11-22T00:14:01", 15, 2),
        ("2026-11-20", "2026-11-20T23:59:59", 0, 0),  # a date alone is the end of that day
        ("2026-11-20", "2026-11-21T00:00", 0, 1),
        ("2026-11-20T23:59+09:00", "2026-11-20T15:58", 0, 0),  # 14:59 in UTC, 15:59 in Madrid
        ("2026-11-20T23:59+09:00", "2026-11-20T16:00", 0, 1),
        # Clocks go back at 3:00 on October 25: that day has 25 hours.
        ("2026-10-24T23:00", "2026-10-25T23:00", 0, 1),
        ("2026-10-24T23:00", "2026-10-25T23:00:01", 0, 2),
        ("2026-10-25T02:30+02:00", "2026-10-25T02:30+01:00", 0, 1),  # 2:30 comes twice
        ("2026-10-25T02:30+01:00", "2026-10-25T02:45+02:00", 0, 0),  # which is before, though a clock shows more
        ("2026-10-25T02:45", "2026-10-25T02:30+01:00", 0, 1),
        # Clocks go forward at 2:00 on March 28, 2027: that day has 23 hours.
        ("2027-03-27T23:00", "2027-03-28T23:00", 0, 1),
        ("2027-03-27T23:00", "2027-03-28T23:00:01", 0, 2),
        ("2027-03-28T02:30", "2027-03-28T03:29", 0, 0),  # 2:30 never comes: it is when clocks show 3:30
        ("2027-03-28T02:30", "2027-03-28T03:31", 0, 1),
    ],
)
def test_days_begun(due, when, grace, days):
    assert moments.days_late(time(when), time(due), timedelta(minutes=grace), MADRID) == days


def test_times_without_a_zone_are_this_machines(monkeypatch):
    import time as clock

    monkeypatch.setenv("TZ", "America/New_York")
    clock.tzset()
    try:
        when = datetime(2026, 11, 20, 18)  # midnight in Madrid
        assert moments.days_late(when, time("2026-11-20"), timedelta(), MADRID) == 1
        assert moments.days_late(when, time("2026-11-20", None), timedelta(), None) == 0
        assert moments.shown(when, MADRID) == "2026-11-21 00:00"
        assert time("2026-11-20T18:00", None) == time("2026-11-21T00:00")
    finally:
        monkeypatch.undo()
        clock.tzset()


@pytest.mark.parametrize(
    "late, days, reached, less, rate",
    [
        (Late(), 3, 16, 0, "0 % a day"),
        (Late(percent=10), 1, 16, 1.6, "10 % a day"),
        (Late(percent=10), 2, 16, 3.2, "10 % a day"),
        (Late(percent=10, cap=50), 9, 16, 8, "10 % a day, at most 50 %"),
        (Late(percent=10), 99, 16, 16, "10 % a day"),
        (Late(percent=10, possible=True), 2, 16, 4, "10 % of all 20 points a day"),
        (Late(percent=50, possible=True), 1, 3, 3, "50 % of all 20 points a day"),
        (Late(percent=33.3), 1, 0.1, 0.03, "33.3 % a day"),  # what is less than a hundredth is the student's
        (Late(points=1), 2, 16, 2, "1 point a day"),
        (Late(points=1.5, cap=4), 3, 16, 4, "1.5 points a day, at most 4"),
        (Late(points=2), 2, 3, 3, "2 points a day"),
        (Late(percent=100), 1, 0, 0, "100 % a day"),
    ],
)
def test_what_it_costs(late, days, reached, less, rate):
    assert penalty.less(late, days, reached, 20) == less and penalty.rate(late, 20) == rate


amounts = st.floats(0, 100).map(lambda x: round(x, 2))
lates = st.builds(
    Late,
    points=amounts,
    percent=amounts,
    possible=st.booleans(),
    cap=st.none() | amounts,
    grace=st.timedeltas(timedelta(), timedelta(days=2)),
)
times = st.datetimes(datetime(2026, 1, 1), datetime(2027, 12, 31), timezones=st.just(MADRID))


@given(lates, amounts, amounts, st.integers(0, 400), st.integers(0, 400))
def test_later_never_costs_less_and_nothing_costs_more_than_there_is(late, reached, more, days, further):
    cost, later = (penalty.less(late, days + d, reached, reached + more) for d in (0, further))
    assert 0 <= cost <= later <= reached and abs(cost * 100 - round(cost * 100)) < 1e-6 or cost == reached
    if late.cap is not None and late.points:
        assert later <= late.cap


@given(times, times, st.timedeltas(timedelta(), timedelta(days=2)), st.timedeltas(timedelta(), timedelta(days=30)))
def test_days_grow_with_time_and_shrink_with_grace(due, when, grace, further):
    days = moments.days_late(when, due, grace, MADRID)
    gone = when.astimezone(UTC) - due.astimezone(UTC)
    assert (days == 0) == (gone <= grace)
    assert days <= moments.days_late(when, due, timedelta(), MADRID)
    later = (when.astimezone(UTC) + further).astimezone(MADRID)
    hour = timedelta(hours=1)  # by which clocks are changed
    assert moments.days_late(later + hour, due, grace, MADRID) >= days
    if days > 1:
        assert (days - 1) * moments.DAY - hour < gone - grace <= days * moments.DAY + hour

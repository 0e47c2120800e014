"""What instructors write on the command line is understood, or a sentence says what to write."""

import argparse
from datetime import UTC, datetime

import pytest

from labkit import cli
from labkit.instructor import options


def due(text):
    parser = argparse.ArgumentParser(exit_on_error=False)
    options.add(parser.add_subparsers())
    return parser.parse_args(["grade", "class", "--lab", "01_a", "--out", "out", "--due", text]).due


def test_a_date_alone_is_the_end_of_that_day():
    assert datetime(2026, 11, 20, 23, 59, 59) < due("2026-11-20") < datetime(2026, 11, 21)
    assert due("2026-11-20T10:00") == datetime(2026, 11, 20, 10)


@pytest.mark.parametrize("text", ["2026-11-20T23:59Z", "2026-11-20T23:59+00:00", "2026-11-21T05:29+05:30"])
def test_a_time_with_a_zone_becomes_local(text):
    assert due(text) == datetime(2026, 11, 20, 23, 59, tzinfo=UTC).astimezone().replace(tzinfo=None)


@pytest.mark.parametrize("text", ["tomorrow", "2026-02-30", "20.11.2026", "0001-01-01T00:00+14:00"])
def test_what_is_no_time_is_told_with_what_to_write(capsys, text):
    with pytest.raises(SystemExit):
        due(text)
    assert "write 2026-11-20T23:59, or 2026-11-20" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "values"),
    [
        ("--seed", ["-1", "1.5", "x", "9" * 40]),
        ("--call", ["0", "-3", "nan", "inf", "x", "1e9"]),
        ("--total", ["0", "nan", "inf", "-1"]),
        ("--jobs", ["0", "-1", "x"]),
    ],
)
def test_numbers_that_make_no_sense_are_refused(option, values, capsys):
    for value in values:
        with pytest.raises(SystemExit) as caught:
            cli.main(["grade", "class", "--lab", "01_cartesian_ekf", "--out", "out", f"{option}={value}"])
        assert caught.value.code == 2 and f"{value!r} is no " in capsys.readouterr().err

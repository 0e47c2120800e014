"""Limits of time: code is stopped where it computes too long, and nothing comes after the end."""

import threading
import time

import pytest

from labkit.notebook.limits import TimeUpError, cpu_limit


def busy(seconds):
    stop = time.process_time() + seconds
    while time.process_time() < stop:
        pass


def test_code_is_stopped_by_what_it_computes():
    with pytest.raises(TimeUpError), cpu_limit(0.1) as limit:
        busy(60)
    assert limit.reached and 0.1 <= limit.spent < 5


def test_waiting_costs_nothing():
    with cpu_limit(0.2) as limit:
        time.sleep(0.4)
    assert not limit.reached and limit.spent < 0.2


def test_who_catches_it_is_stopped_again():
    caught = []

    def stubborn():
        while len(caught) < 3:
            try:
                busy(60)
            except BaseException as error:
                caught.append(type(error))

    with cpu_limit(0.05) as limit:
        stubborn()
    assert caught == [TimeUpError] * 3 and limit.reached


def test_nothing_comes_after_the_end():
    for n in range(30):
        try:
            with cpu_limit(0.01):
                busy(0.0095 + n * 0.0001)
        except TimeUpError:
            pass
        busy(0.002)  # would meet one that came late


def test_without_a_thread_the_code_runs(monkeypatch):
    def none(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", none)
    with cpu_limit(0.01) as limit:
        busy(0.02)
    assert not limit.reached and limit.spent >= 0.02


def test_a_trace_function_is_no_trouble():
    import sys

    before = sys.gettrace()
    sys.settrace(lambda *about: None)
    try:
        with cpu_limit(1) as limit:
            repr(limit)
        assert repr(limit)
    finally:
        sys.settrace(before)

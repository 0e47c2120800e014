"""Front ends call back on whichever thread they like: ipykernel 7 on several at a time, beside the cell that runs."""

import threading
from concurrent.futures import ThreadPoolExecutor

from labkit.widgets import RunExplorer

from helpers.reference import record, solution


def explorer(KF):
    return RunExplorer(KF, record(), "xy", ("Q", "R"), "nees", 25, 2.5, 1, None, None, [0, 0], [[3, 0], [0, 3]])


def test_a_callback_waits_until_the_one_before_has_drawn():
    inside, second, together = threading.Event(), threading.Event(), []

    class Slow(solution("xy")):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            if inside.is_set():
                second.set()  # another callback has come in
            elif threading.current_thread() is not threading.main_thread():
                inside.set()
                together.append(second.wait(0.3))
                inside.clear()

    one = explorer(Slow)
    with ThreadPoolExecutor(2) as threads:
        first = threads.submit(setattr, one.controls["Q"], "value", 10)
        assert inside.wait(60)
        threads.submit(one.next_seed).result()
        first.result()
    assert together[0] is False


def test_what_is_shown_is_what_the_controls_say_whoever_moved_them():
    one, fresh = explorer(solution("xy")), explorer(solution("xy"))
    moves = [(name, value) for value in (0.01, 100, 0.1, 10) for name in ("Q", "R")]
    with ThreadPoolExecutor(4) as threads:
        done = [threads.submit(setattr, one.controls[name], "value", value) for name, value in moves]
    assert [move.exception() for move in done] == [None] * len(moves)
    for name in "QR":
        fresh.controls[name].value = one.controls[name].value
    one.controls["Q"].value, fresh.controls["Q"].value = 1, 1
    assert one.box.text.value == fresh.box.text.value and one.canvas.png() == fresh.canvas.png()

"""`labkit check` from the shell: lines, exit status, endless loops, and the same verdict as nbval."""

import queue
import subprocess
import sys

import pytest

from labkit import cli
from labkit.notebook import check

from helpers.notebooks import LAB1, LAB2, code, released, save

LOOP = "p = len(y)\n"


def run(capsys, *args):
    status = cli.main(["check", *map(str, args)])
    out, err = capsys.readouterr()
    return status, out.splitlines(), err.splitlines()


def test_a_filled_in_notebook_passes(tmp_path, capsys):
    path = save(tmp_path / f"{LAB1}.ipynb", released(LAB1, (LOOP, "p = len(y); print('garbled' * 99)\n")))
    status, out, err = run(capsys, path)
    assert (status, err) == (0, [])
    assert out[:3] == [f"PASS  {LAB1}  cartesian-{x}" for x in ("stack", "repeat", "kf")]
    assert out[3] == "3 of 3 checks passed." and len(out) == 4


def test_a_mistake_fails_and_an_unreadable_file_weighs_more(tmp_path, capsys):
    wrong = save(tmp_path / "wrong.ipynb", released(LAB1, ("repeat_R(self.R, p)\n", "self.R\n")))
    status, out, _ = run(capsys, wrong)
    assert status == 1 and out[-1] == "2 of 3 checks passed."
    first = next(i for i, line in enumerate(out) if line.startswith("FAIL"))
    assert out[first].startswith("FAIL  wrong  cartesian-kf  R is not repeated for each landmark")
    assert any("cell 'answer-kf', in update, line" in line for line in out)

    empty, bare = save(tmp_path / "empty.ipynb", ""), save(tmp_path / "bare.ipynb", '{"nbformat": 4, "cells": []}')
    status, out, err = run(capsys, tmp_path / "no.ipynb", wrong, empty, bare)
    assert status == 2 and out[-1] == "2 of 3 checks passed."
    assert [line.split("  ")[0] for line in err] == ["ERROR"] * 3
    assert "does not exist" in err[0] and "is empty" in err[1] and "holds no check" in err[2]


def test_an_unfilled_notebook_is_still_to_be_written(tmp_path, capsys):
    status, out, _ = run(capsys, save(tmp_path / f"{LAB2}.ipynb", released(LAB2, fill=False)))
    assert status == 1
    assert sum("FAIL" in line and "still to be written" in line for line in out) == 4
    assert out[-1] == "0 of 4 checks passed."


def test_an_endless_loop_is_named_with_its_line(tmp_path, capsys):
    endless = released(LAB1, (LOOP, LOOP + "        while p: p = abs(p)\n"))
    endless["cells"].append(code("while True: pass", "own"))
    status, out, _ = run(capsys, "--timeout", "2", save(tmp_path / "a.ipynb", endless))
    assert status == 1
    assert out[2] == "FAIL  a  cartesian-kf  It was still running when it was stopped: does a loop never end?"
    assert "cell 'answer-kf', in update, line" in out[3] and out[3].endswith("while p: p = abs(p)")
    assert out[4] == "2 of 3 checks passed."


@pytest.mark.parametrize(
    "source, seconds, says",
    [
        ("import os; os._exit(7)", 600, "Python itself ended here"),
        ("import re; re.match('(a+)+$', 'a' * 50 + 'b')", 3, "It was still running when it was stopped"),
    ],
)
def test_what_ends_or_blocks_python_itself(tmp_path, capsys, source, seconds, says):
    path = save(tmp_path / "a.ipynb", released(LAB1, (LOOP, f"{LOOP}        {source}\n")))
    status, out, _ = run(capsys, "--timeout", seconds, path)
    assert status == 1 and says in out[2] and out[2].startswith("FAIL  a  cartesian-kf")


def test_a_check_that_ends_python_does_not_take_the_others_along(tmp_path, capsys):
    ends = save(
        tmp_path / "a.ipynb",
        released(
            LAB1,
            ("p = len(y)\n", "p = len(y)\n"),
            ("def repeat_R(R, p):\n", "def repeat_R(R, p):\n    import os; os._exit(0)\n"),
        ),
    )
    status, out, _ = run(capsys, ends)
    assert status == 1 and [line[:4] for line in out[:2]] == ["PASS", "FAIL"]


def test_a_check_whose_cell_is_gone_runs_all_the_same(tmp_path, capsys):
    book = released(LAB1, ("seen - expected", "expected - seen"))
    book["cells"] = [cell for cell in book["cells"] if cell["id"] != "check-kf"]
    status, out, _ = run(capsys, save(tmp_path / "renamed.ipynb", book))
    assert status == 1 and out[2].startswith("FAIL  renamed  cartesian-kf")
    assert any(line.startswith('NOTE  renamed  No cell calls `check("cartesian-kf", ...)` any more') for line in out)
    assert out[-1] == "2 of 3 checks passed."


def test_a_stub_left_below_right_code_is_named_with_its_line(tmp_path, capsys):
    left = "    return np.kron(np.eye(p), R)\n"
    edit = (
        left,
        left.replace("return", "found =") + '    raise NotImplementedError("`repeat_R` is still to be written.")\n',
    )
    status, out, _ = run(capsys, save(tmp_path / "a.ipynb", released(LAB1, edit)))
    assert status == 1 and out[1].endswith(
        "The line `raise NotImplementedError` still stands below your code: delete it when that is complete."
    )
    assert "cell 'answer-repeat', in repeat_R, line 5:  raise NotImplementedError" in out[2]


def test_a_module_beside_the_notebook_is_used_and_told(tmp_path, capsys):
    book = released(LAB1, ("    return np.kron", "    return helping_hand.kron"), fill=True)
    book["cells"].insert(0, code("import helping_hand", "own"))
    path = save(tmp_path / "a.ipynb", book)
    (tmp_path / "helping_hand.py").write_text("from numpy import kron\n", encoding="utf-8")
    status, out, _ = run(capsys, path)
    assert status == 0 and "NOTE  a  It uses the file helping_hand.py beside it: hand that in too." in out
    book["cells"].insert(0, code("%%writefile helping_hand.py\nfrom numpy import kron\n", "writes"))
    status, out, _ = run(capsys, save(path, book))
    assert status == 0 and "hand that in too" not in "".join(out)


def test_the_command_runs_as_a_module():
    done = subprocess.run([sys.executable, "-m", "labkit", "check"], capture_output=True, text=True)
    assert done.returncode == 2 and "NOTEBOOK" in done.stderr


@pytest.mark.slow
def test_nbval_gives_the_same_verdict(tmp_path):
    good = save(tmp_path / "good.ipynb", released(LAB1))
    bad = save(tmp_path / "bad.ipynb", released(LAB1, ("seen - expected", "expected - seen")))
    command = [sys.executable, "-m", "pytest", "-q", "--nbval-lax", "-p", "no:cacheprovider", "--rootdir", tmp_path]
    nbval = subprocess.run([*command, good, bad], capture_output=True, text=True)
    failed = [line for line in nbval.stdout.splitlines() if line.startswith("FAILED")]
    assert nbval.returncode == 1 and failed and all("bad.ipynb" in line for line in failed)
    assert (cli.main(["check", str(good)]), cli.main(["check", str(bad)])) == (0, 1)


def test_a_process_that_ends_before_its_checks_are_known_is_no_notebook_without_checks(tmp_path, monkeypatch):
    news = queue.SimpleQueue()
    news.put(None)
    child = subprocess.Popen([sys.executable, "-c", "pass"])
    monkeypatch.setattr(check, "_child", lambda *about: (child, news))
    assert check.check_one("a.ipynb", 5).problem == "a.ipynb: Python itself ended here."


def test_patterns_and_folders_stand_for_their_notebooks(tmp_path, capsys):
    for name in ("b", "a"):
        save(tmp_path / f"{name}.ipynb", released(LAB1))
    for given in (tmp_path, tmp_path / "*.ipynb", tmp_path / "[ab].ipynb"):
        status, out, _ = run(capsys, given)
        assert status == 0 and out[-1] == "6 of 6 checks passed." and out[0].startswith("PASS  a ")
    status, _, err = run(capsys, tmp_path / "c*.ipynb")
    assert status == 2 and err == [f"ERROR  {tmp_path / 'c*.ipynb'} fits no file."]

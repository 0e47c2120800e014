"""`labkit term` and `labkit similar` on the command line."""

import pytest

from labkit.cli import main

from helpers.term import a_term


@pytest.mark.parametrize("command", [["term"], ["similar", "--lab", "01_cartesian_ekf"]])
def test_a_folder_without_a_gradebook_is_told_and_stays_as_it_was(command, tmp_path, capsys):
    assert main([command[0], str(tmp_path), *command[1:]]) == 2
    assert "holds no gradebook.db: name the folder that labkit grade wrote into" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_term_of_a_folder(tmp_path, capsys):
    a_term(tmp_path, 3, 2)
    assert main(["term", str(tmp_path)]) == 0
    assert "3 students: see" in capsys.readouterr().out
    (tmp_path / "term.csv").unlink()
    (tmp_path / "term.csv").mkdir()
    assert main(["term", str(tmp_path)]) == 2
    assert "term.csv cannot be written" in capsys.readouterr().err

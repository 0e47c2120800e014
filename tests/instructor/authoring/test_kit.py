"""The folded cell that gets the kit where there is none."""

import importlib.util
import subprocess
from types import SimpleNamespace

import pytest

from labkit.instructor.authoring import kit
from labkit.instructor.records import CommandError

from helpers.browser import cells
from helpers.reference import LABS, ROOT


def run(monkeypatch, source, says=""):
    """What the cell runs on a machine without the kit, where pip says this."""
    asked = []
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(subprocess, "run", lambda words, **_: asked.append(words[1:]) or SimpleNamespace(stderr=says))
    exec(source, {})
    return asked


@pytest.mark.parametrize("lab", LABS)
def test_it_comes_right_before_the_setup(lab):
    ids = list(cells(lab))
    assert ids.index("setup") - ids.index("kit") == 1


def test_where_the_kit_is_it_does_nothing(monkeypatch, capsys):
    monkeypatch.setattr(subprocess, "run", None)
    exec(cells(LABS[0])["kit"], {})
    assert capsys.readouterr().out == ""


def test_it_says_where_it_gets_the_kit_from_and_what_pip_says(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(kit, "PROJECT", tmp_path / "pyproject.toml")
    kit.PROJECT.write_text('[tool.labkit]\naddress = "https://example.org/a kit.whl"')
    assert run(monkeypatch, kit.cell().source) == [["-m", "pip", "install", "-q", "https://example.org/a kit.whl"]]
    assert capsys.readouterr().out.splitlines()[0].endswith("getting it from https://example.org/a kit.whl")
    monkeypatch.setenv("LABKIT_FROM", "here.whl")  # what the machine says goes first
    assert run(monkeypatch, kit.cell().source, "no such file") == [["-m", "pip", "install", "-q", "here.whl"]]
    assert "no such file" in capsys.readouterr().out


def test_without_an_address_it_says_what_to_do(monkeypatch, capsys):
    monkeypatch.delenv("LABKIT_FROM", raising=False)
    monkeypatch.setattr(kit, "address", lambda: "")
    assert run(monkeypatch, kit.cell().source) == []
    assert "%pip install ADDRESS" in capsys.readouterr().out


def test_an_address_that_is_none_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(kit, "PROJECT", tmp_path / "pyproject.toml")
    for text, says in (("[tool.labkit]\naddress = 3", "is one text, not 3"), ("[tool", "no TOML")):
        kit.PROJECT.write_text(text)
        with pytest.raises(CommandError, match=says):
            kit.address()


def test_the_notebooks_have_the_project_s_address():
    assert cells(LABS[0])["kit"] == kit.cell().source and (ROOT / "pyproject.toml") == kit.PROJECT

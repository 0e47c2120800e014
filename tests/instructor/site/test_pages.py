"""The site's pages as Markdown: links that lead somewhere, labs as students see them."""

import json
import re

import pytest

from labkit.instructor.authoring.leaks import leaks
from labkit.instructor.records import CommandError
from labkit.instructor.site import api, command, film, lab, links, pages

from helpers.reference import COURSE, ROOT

KNOWN = {"index.md", "docs/students.md", "notebooks/01_first.md", "licence.md", "api/labkit.legged.md"}


@pytest.mark.parametrize(
    "path, text, turned",
    [
        ("README.md", "[a](docs/students.md#start)", "[a](docs/students.md#start)"),
        ("README.md", "[lab](notebooks/01_first.ipynb)", "[lab](notebooks/01_first.md)"),
        ("docs/a.md", "[lab](../solutions/01_first.ipynb)", "[lab](../notebooks/01_first.md)"),
        ("docs/a.md", "[home](../README.md), [rights](../LICENSE)", "[home](../index.md), [rights](../licence.md)"),
        ("docs/a.md", "[`k`](../labkit/legged/kinds.py)", "[`k`](../api/labkit.legged.md)"),
        ("docs/a.md", "[`c`](../solutions/checks/c.py) knows", "`c` knows"),
        ("docs/a.md", "![p](pictures/none.png)", "p"),
        ("docs/a.md", "`x[0](p)` and [here](#below) and [out](https://a.org/b.md)", None),
    ],
)
def test_links_lead_to_the_sites_pages_or_are_words(path, text, turned):
    found = links.turned(text, path, KNOWN)
    assert found == (text if turned is None else turned)


@pytest.fixture
def still(monkeypatch):
    """Labs without their animations, which take seconds to make."""
    monkeypatch.setattr(film, "films", lambda executed: {})


@pytest.mark.usefixtures("still")
def test_labs_are_shown_as_students_get_them_with_pictures_and_without_an_answer(tmp_path):
    scripts = sorted((ROOT / "solutions").glob("[0-9]*_*.py"))
    shown = {}
    for name in COURSE:
        student, executed = (ROOT / folder / f"{name}.ipynb" for folder in ("notebooks", "solutions"))
        text = lab.page(student, executed, tmp_path / name)
        named = re.findall(rf"\]\({name}/([\w-]+\.png)\)", text)
        assert sorted(named) == sorted(path.name for path in (tmp_path / name).iterdir()) and len(named) > 1
        stub, released = "raise NotImplementedError", student.read_text(encoding="utf-8")
        assert text.count(stub) == sum("".join(c["source"]).count(stub) for c in json.loads(released)["cells"])
        shown |= {f"notebooks/{name}.ipynb": (released.encode(), 0o644), f"{name}.md": (text.encode(), 0o644)}
    assert list(leaks([script for script in scripts if script.stem in COURSE], shown)) == []


def test_the_overview_says_of_each_lab_how_long_it_takes_and_what_one_can_do_then():
    text = pages.overview({name: ROOT / "notebooks" / f"{name}.ipynb" for name in COURSE})
    assert text.count("\n## [Lab ") == len(COURSE) == 8
    assert text.count("**By the end you can**") == text.count("**You will write**") == 7
    assert text.count("\n- ") > 20 and "A robot drives a square" not in text


def test_a_notebook_that_cannot_be_read_gets_a_sentence(tmp_path):
    bad = tmp_path / "01_a.ipynb"
    bad.write_text("{")
    with pytest.raises(CommandError, match=r"01_a\.ipynb cannot be read as a notebook.*labkit build"):
        lab.head(bad)


def test_docstrings_keep_their_lines_and_nothing_in_them_is_markup():
    lines = ["Move x_ by *u*.", "", "x:  (3,) [m], as `kf.x_` has it", "    and more", "", "    a = b*c", ""]
    api.readable(None, "function", "f", None, None, lines)
    assert lines == [
        r"Move x\_ by \*u\*.",
        "",
        "| x:  (3,) [m], as ``kf.x_`` has it and more",
        "",
        "::",
        "",
        "    a = b*c",
        "",
    ]


def test_what_is_there_is_not_written_over(tmp_path, capsys):
    (tmp_path / "mine").touch()
    assert command.main(str(tmp_path)) == 2
    assert "is there already: name a new folder" in capsys.readouterr().err


def test_stopped_by_hand_it_says_so_and_leaves_nothing(tmp_path, capsys, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "NEEDS", {"site": ()})
    monkeypatch.setattr(pages, "write", stop)
    assert command.main(str(tmp_path / "out")) == 130
    assert "Nothing was written" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_what_is_missing_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(command, "NEEDS", {"site": ("no_such_sphinx",)})
    assert command.main(str(tmp_path / "out")) == 2
    assert "no_such_sphinx cannot be found" in capsys.readouterr().err


def test_a_signature_has_the_types_as_the_code_names_them():
    from labkit.geometry import compose
    from labkit.world import Map

    assert api.signature(None, "function", "f", compose, None, "(a)", "b")[1] == "Poses"
    assert api.signature(None, "method", "f", Map.append, None, "(x)", "b") == ("(landmark: Landmark)", "None")
    assert api.signature(None, "module", "m", api, None, "", "") is None

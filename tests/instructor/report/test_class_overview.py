"""The page about the whole class."""

import re
from urllib.parse import unquote

import pytest

from labkit.instructor import records
from labkit.instructor.records import Mark, Result
from labkit.instructor.report.class_overview import class_page
from labkit.instructor.report.names import file_name, labels

from helpers.graded import CHECKS, TITLE, classroom, sound


def make_class_page(results):
    taken = set()
    return class_page(results, CHECKS, TITLE, {label: file_name(label, taken) for label in labels(results)})


@pytest.mark.parametrize("size", [0, 1, 60, 1000])
def test_a_class_of_any_size(size):
    results = classroom(size)
    page = make_class_page(results)
    seen = sound(page)
    unfit = sum(bool(result.problem) for result in results)
    links = [unquote(value) for tag, name, value in seen.attributes if name == "href"]
    pages = [link for link in links if link.startswith("feedback/lab3/")]
    assert len(pages) == len(set(pages)) == size
    assert set(links) - set(pages) == ({"to-mark-lab3.html", "term.html"} if size else set())
    assert ("<details>" in page) == (size > 100)
    if not size:
        assert "Nobody has handed in anything yet." in seen.text
        return
    assert f"{size - unfit} student" in seen.text and seen.tags.count("svg") == 1
    if size == 60:
        assert "bearing innovation is not wrapped" in seen.text and "What to explain again next week" in seen.text
        assert "level 3 for" in seen.text and "level 2 for" in seen.text and "Late" in seen.text
        counts = [int(n) for n in re.findall(r'<tr><td class="n">(\d+)</td><td class="track">', page)]
        assert counts == sorted(counts, reverse=True)
        assert sum(map(int, re.findall(r"<text x=[^>]*>(\d+)</text>", page))) == size - unfit


def test_odd_classes():
    none = [Result("Ada", "1", "lab3", problem="No file.")]
    assert "0 students graded, 1 could not be graded" in sound(make_class_page(none)).text
    zero = [Result("Ada", "1", "lab3", level=0, marks=[Mark("h", 0, 0, records.PASSED)])]
    assert "Level 0 is no sandbox" in sound(make_class_page(zero)).text
    full = [Result("Ada", "1", "lab3", level=4, marks=[Mark("h", 2, 2, records.PASSED)])]
    text = sound(class_page(full, CHECKS, TITLE, {})).text
    assert "No known mistake" in text and "level 4" in text


def test_what_has_to_be_mended_first_is_counted_at_the_check_that_it_spoils():
    lines = (
        "In `update`, line 3: `S.I`: an array",
        "has no `.I`.",
        "First mend `h` and `jacobian`: their own checks",
        "do",
    )
    marks = [Mark("kf-one", 0, 3, records.FAILED, "Not yet right.", some) for some in (lines, lines, ("no",))]
    marks[1:1] = [Mark("kf-one", 0, 3, records.FAILED, "Not yet right.", ("First mend `jacobian`: its own",))]
    hidden = Mark("kf-map", 0, 4, records.FAILED, "No.", lines)
    seen = sound(make_class_page([Result(f"Ada {n}", marks=[mark, hidden]) for n, mark in enumerate(marks)]))
    assert re.search(r"KF: one landmark\s*first to mend: jacobian \(3\), h \(2\)", " ".join(seen.text.split()))
    assert seen.text.count("first to mend") == 1


def test_nothing_leaks_of_hidden_checks():
    shown = Mark("kf-map", 0, 4, records.FAILED, "It fails on another map.", ("SECRET-LINE",))
    assert "SECRET" not in make_class_page([Result("Ada", marks=[shown])])

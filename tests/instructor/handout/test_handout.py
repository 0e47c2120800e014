"""Labs on paper: what students get and no more, whole, with lines to write on."""

import os
import re

import pytest

from labkit import cli
from labkit.instructor.handout import command
from labkit.instructor.handout.page import page
from labkit.instructor.records import CommandError
from labkit.notebook.read import read

from helpers.reference import COURSE, LABS, ROOT, ci_only


@pytest.fixture(scope="module")
def pages():
    return {lab: page(lab, ROOT) for lab in LABS[:2]}


def test_each_question_has_lines_and_each_formula_is_read(pages):
    for lab, text in pages.items():
        questions = [cell for cell in read(ROOT / f"notebooks/{lab}.ipynb") if cell.role == "answer" and not cell.code]
        assert text.count('<div class="answer">') == len(questions) > 0
        assert text.count("points</div>") + text.count("1 point</div>") == len(questions)
        assert text.count('<div class="line">') >= 8 * len(questions)
        assert "<math" in text and "$" not in re.sub(r"(?s)<pre.*?</pre>|<style.*?</style>", "", text)
        assert not re.search(r"<code>[^<]*\\[a-z]", text)  # a formula that could not be read stays as it was typed
        assert "Write your answer here" not in text and "<details" not in text


def test_nothing_is_fetched_from_elsewhere(pages):
    for text in pages.values():
        assert not re.search(r'src="(?!data:)|<(script|link|iframe)|@import|url\(', text)


def test_pictures_are_those_that_need_no_answer(pages):
    """Lab 1 shows a bell and a walk before anything is written; all of lab 2 stands on the filter of lab 1."""
    before, after = pages[LABS[0]].split("Exercise 3")  # the filter
    assert before.count("<img") >= 4 and after.count("<img") == 0
    assert pages[LABS[1]].count("<img") == 0


def test_without_a_browser_the_pages_stay_and_a_sentence_says_what_to_do(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("LABKIT_CHROMIUM", "no such browser")
    out = tmp_path / "on paper"
    assert cli.main(["handout", LABS[0], LABS[1], str(out)]) == 1
    said = capsys.readouterr().err
    assert "LABKIT_CHROMIUM names 'no such browser'" in said and said.count("\n") == 1
    assert sorted(path.name for path in out.iterdir()) == [f"{lab}.html" for lab in LABS[:2]]


def test_a_lab_that_is_not_there_is_told_and_nothing_is_written(tmp_path, capsys):
    assert cli.main(["handout", "99_nothing", str(tmp_path)]) == 2
    assert "99_nothing.ipynb does not exist" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_was_forgotten_and_a_file_in_its_place_are_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["handout", LABS[0]]) == 2
    assert capsys.readouterr().err.startswith(f"labkit handout: {LABS[0]} is a lab: name the folder")
    (tmp_path / "paper").write_text("x")
    assert cli.main(["handout", LABS[0], "paper"]) == 2
    assert capsys.readouterr().err == "labkit handout: paper is a file: name a folder.\n"
    assert [path.name for path in tmp_path.iterdir()] == ["paper"]


@ci_only
@pytest.mark.browser
def test_nothing_is_wider_than_the_paper(browser):
    """At 174 mm, which is the width of the text."""
    view = browser.new_page(viewport={"width": 658, "height": 1000})
    view.emulate_media(media="print")
    for lab in COURSE:
        view.set_content(page(lab, ROOT))
        assert view.evaluate("document.documentElement.scrollWidth") == 658, lab


@pytest.mark.browser
def test_a_lab_is_printed(tmp_path):
    try:
        command.find()
    except CommandError as problem:
        if os.environ.get("LABKIT_REQUIRE_BROWSER") == "1":
            pytest.fail(str(problem))
        pytest.skip(str(problem))
    out = tmp_path / "auf Papier"
    assert cli.main(["handout", LABS[0], str(out)]) == 0
    assert [path.name for path in out.iterdir()] == [f"{LABS[0]}.pdf"]
    printed = (out / f"{LABS[0]}.pdf").read_bytes()
    assert printed.startswith(b"%PDF") and len(re.findall(rb"/Type ?/Page\b", printed)) > 8

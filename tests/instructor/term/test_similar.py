"""Whose code is alike: copies are found whatever was done to them, and right answers of one's own are not."""

import re
from contextlib import closing
from time import process_time

import numpy as np
import pytest

from labkit.cli import main
from labkit.instructor.intake.submission import Work
from labkit.instructor.report import code
from labkit.instructor.report.gradebook import Gradebook
from labkit.instructor.term import similar
from labkit.instructor.term.fingerprints import RUN, WINDOW, hashes, winnowed
from labkit.instructor.term.similar_page import LEFT, WIDTH, chart, similar_page
from labkit.instructor.term.stretches import pieces, stretches
from labkit.instructor.term.tokens import read

from helpers.graded import CHECKS, LAB, sound
from helpers.reference import ROOT
from helpers.term import INDEPENDENT, codes, disguised

LAB3 = "03_range_bearing_ekf"
NONE = np.zeros(0, np.uint64)


@pytest.fixture(scope="module")
def given():
    return {lab: similar.given(ROOT, lab) for lab in INDEPENDENT}


def of(texts):
    return {label: {"cell 1": text} for label, text in texts.items()}


def told(found):
    return [{pair.first.label, pair.second.label} for pair in found.pairs]


@pytest.mark.parametrize("lab", INDEPENDENT)
def test_right_forms_that_were_written_for_themselves_are_not_told(lab, given):
    every = codes(lab)
    assert len(every) > 5
    assert told(similar.compare(of(every), given[lab])) == []


@pytest.mark.parametrize(
    "lab, original", [(LAB, "loops and columns"), (LAB, "information form"), (LAB3, "sequential"), (LAB3, "loops")]
)
def test_a_copy_with_other_names_order_and_comments_is_found(lab, original, given):
    every = codes(lab)
    copy = disguised(every[original])
    assert "def my_" not in copy and "my own idea" in copy and not set(copy.splitlines()) & {every[original]}
    found = similar.compare(of({**every, "copy": copy}), given[lab])
    assert told(found) == [{original, "copy"}]
    (pair,) = found.pairs
    assert pair.first.same > 0.7 * pair.first.own and pair.alone > 10


@pytest.mark.parametrize("form", ["inverse", "joseph", "in place"])
def test_nearly_the_same_code_is_told_in_the_smallest_class_and_what_is_the_models_is_not(form, given):
    every = codes(LAB)
    six = {name: every[name] for name in ("model", form, "both signs", "sequential")}
    found = similar.compare(of({**six, "copy": disguised(every[form]), "again": every["model"]}), given[LAB])
    assert told(found) == [{form, "copy"}] and found.pairs[0].amount < found.threshold
    assert len(found.below) == 3 and not any({form, "copy"} == {*pair[:2]} for pair in found.below)
    page = sound(similar_page(LAB, found)).text
    assert "Below what is told" in page and "model" in page.split("Below what is told")[1]


def test_who_works_together_is_not_compared_with_each_other(given):
    every = codes(LAB)
    texts = of({**every, "copy": every["sequential"], "other": disguised(every["sequential"])})
    found = similar.compare(texts, given[LAB], [["sequential", "copy", ""]])
    assert {"sequential", "copy"} not in told(found) and {"sequential", "other"} in told(found)
    assert len(found.amounts) == len(texts) * (len(texts) - 1) // 2 - 1


def test_part_of_a_copy_in_code_of_ones_own_is_found(given):
    every = codes(LAB)
    part = disguised(every["loops and columns"].rsplit("\n\n", 1)[1])
    found = similar.compare(of({**every, "copy": every["joseph"] + "\n\n" + part}), given[LAB])
    assert {"loops and columns", "copy"} in told(found)


def test_what_came_with_the_labs_is_left_aside(given):
    """Two who fill in nothing, and one who changed a little of what was given."""
    cells = {f"cell {n}": source for n, source in enumerate(given[LAB].cells)}
    changed = {name: source.replace("1.5", "2.5") for name, source in cells.items()}
    found = similar.compare({"Ada": cells, "Bela": cells, "Ça": changed}, given[LAB])
    assert not found.pairs and max(found.amounts) < 1


def test_a_class_that_is_alike_throughout_raises_the_threshold():
    rng = np.random.default_rng(1)
    usual = rng.normal(5, 0.5, 1000) ** 2
    assert 40 < similar.likely(usual) < 60
    assert abs(similar.likely(np.append(usual, [300.0] * 20)) - similar.likely(usual)) < 2
    assert similar.likely(np.array([1.0, 2.0])) == similar.likely(np.zeros(500)) == similar.LEAST


def test_winnowing_keeps_its_promise():
    """Whatever two texts share for RUN + WINDOW - 1 tokens leaves a fingerprint that both have."""
    rng = np.random.default_rng(3)
    words = [f"f{n}" for n in rng.permutation(500)]
    length = RUN + WINDOW - 1
    for start in range(0, 100, 7):
        same = words[start : start + length]
        one, other = (" ".join([".", *words[400:430:2], *same, *words[n : n + 30]]) for n in (430, 460))
        both = [winnowed(hashes(read(text.replace(" ", "."))), NONE) for text in (one, other)]
        assert len(np.intersect1d(*both))


@pytest.mark.parametrize(
    "one, other",
    [
        ("total = left + right * 2  # why", "s=a+b*2"),
        ('def f(x):\n    """Says."""\n    return g(x)', "def h(value): return k(value)"),
        ("self.gain = np.linalg.inv(S)", "self.K1 = numpy.linalg.inv(innovation)"),
        ("print('a', \"b\")", "print('''c''', f'{d}')"),
    ],
)
def test_names_comments_and_layout_do_not_count(one, other):
    assert read(one).words.tolist() == read(other).words.tolist()


def test_what_is_computed_counts():
    forms = ["a + b", "a - b", "a + 2", "a.T + b", "f(a) + b", "self.xk_k + b"]
    assert len({tuple(read(form, {"xk_k"}).words) for form in forms}) == len(forms)


ODD = ["", "(", "'", '"""', "\\", "%%bash\nls $x", "def (:\n\t'''", '"\\' * 20000, "'''\"" * 20000, "[" * 50000]


@pytest.mark.parametrize("text", ODD, ids=range(len(ODD)))
def test_whatever_is_no_python_has_tokens_too_and_takes_no_longer(text):
    start, found = process_time(), read(text)
    assert "".join(piece.text for piece in pieces(found, [], np.zeros(len(found.words), bool))) == text
    assert process_time() - start < 5


LONG = "".join(f"x = f.g{n}(y)\n" for n in range(400))


@pytest.mark.parametrize("block, times", [("x = f.a(1)\n", 6000), (LONG, 15)], ids=["a line", "a block"])
def test_what_repeats_itself_takes_no_longer(block, times):
    """Each place of it fits each other one."""
    start, one = process_time(), read(block * times)
    stretches(one, read("y = 2\n" + block * times), NONE)
    assert process_time() - start < 20


def test_stretches_are_the_same_on_both_sides_and_do_not_overlap():
    first = "\n".join(f"a{n} = f.g{n}(x, y) + {n}" for n in range(20))
    lines = first.splitlines()
    second = "\n".join([*lines[12:], "z = 1", *lines[3:9], *lines[3:6]])
    one, other = read(first), read(second)
    found = stretches(one, other, NONE)
    assert [length for _, _, length in found] == [76, 96]  # the first goes on into the line below, which begins alike
    for start, at, length in found:
        assert (one.words[start : start + length] == other.words[at : at + length]).all()
    parts = pieces(other, [(at, length) for _, at, length in found], np.zeros(len(other.words), bool))
    assert "".join(part.text for part in parts) == second
    assert [part.number for part in parts if part.number] == [2, 1]


HOSTILE = "<script>alert(1)</script>"


def test_names_and_code_are_text_on_the_page(given):
    text = codes(LAB)["loops and columns"] + f"\n# {HOSTILE}\u202e\x1b[31m\nshown = '</pre>{HOSTILE}'\n"
    found = similar.compare(of({f"Ada {HOSTILE}": text, "Bela": text, "Ça": "x = 1"}), given[LAB])
    page = similar_page(LAB, found, without=2)
    seen = sound(page)
    assert "<script" not in page and "\x1b" not in page
    assert seen.text.count(HOSTILE) >= 5 and "Of 2 students the code is not here" in seen.text
    ids = {value for _, name, value in seen.attributes if name == "id"}
    led = {value[1:] for _, name, value in seen.attributes if name == "href" and value.startswith("#")}
    assert led and led <= ids


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_a_class_of_any_size(count, given):
    texts = dict(zip(("Ada", "Bela", "Ça"), [codes(LAB)["model"], "", "x"][:count]))
    found = similar.compare(of(texts), given[LAB])
    assert not found.pairs and "No pair" in sound(similar_page(LAB, found)).text


def test_the_chart_has_all_pairs_and_no_bar_on_both_sides():
    amounts = [0.0, 1.0, 2.5, 11.9, 12.0, 12.1, 47.0]
    drawn = chart(amounts, 12.0)
    assert sum(bar.pairs for bar in drawn.bars) == len(amounts)
    assert sum(bar.pairs for bar in drawn.bars if bar.left > drawn.threshold) == 2
    for few in (amounts, amounts[:2], []):  # the line is in the picture also where all is far below it
        assert LEFT < chart(few, 12.0).threshold <= LEFT + WIDTH
    assert not any(bar.left < drawn.threshold < bar.left + bar.width for bar in drawn.bars)


def test_the_command_compares_what_the_gradebook_keeps(tmp_path, capsys):
    texts = codes(LAB)
    with closing(Gradebook(tmp_path / "gradebook.db", seed=1)) as book:
        book.set_paper(LAB, "paper", CHECKS)
        for name, text in {**texts, "copy": disguised(texts["sequential"]), "older": None}.items():
            id = book.add(LAB, name, "", "f", name, "paper", None, False, [], {})
            book.choose(id, [], False)
            book.finish(id)
            if text:
                half = len(text) // 2
                files = {"m.py": text[half:].encode(), "d.csv": b"1"}
                code.keep(book, id, Work(sources={"cell 1": text[:half]}, files=files))
                code.keep(book, id, Work(sources={"cell 1": "something else"}))  # it is kept already
        assert {*code.kept(book, LAB)[1]} == {"cell 1", "m.py"}
        digest = [*book.db.iterdump()]
    (tmp_path / "course.toml").write_text('[[groups]]\nmembers = ["sequential", "copy"]\n')
    assert main(["similar", str(tmp_path), "--lab", LAB]) == 0
    assert "0 pairs to look at" in capsys.readouterr().out
    (tmp_path / "course.toml").unlink()
    assert main(["similar", str(tmp_path), "--lab", LAB]) == 0
    assert "1 pair to look at" in (said := capsys.readouterr().out) and "Some were graded before" in said
    page = (tmp_path / f"similar-{LAB}.html").read_text(encoding="utf-8")
    assert re.search("sequential.*–.*copy", sound(page).text) or re.search("copy.*–.*sequential", sound(page).text)
    assert f'href="similar-{LAB}.html"' in (tmp_path / "term.html").read_text(encoding="utf-8")
    with closing(Gradebook(tmp_path / "gradebook.db")) as book:
        assert digest == [*book.db.iterdump()]  # nothing of it enters a mark
    assert main(["similar", str(tmp_path), "--lab", "09_none"]) == 2
    assert f"holds no lab '09_none'; there are: {LAB}." in capsys.readouterr().err

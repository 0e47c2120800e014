"""The pages of grading: what they show, what they must not, and that no text and no number breaks them."""

import base64
import re
import time
from datetime import datetime
from html.parser import HTMLParser
from urllib.parse import unquote

import numpy as np
import pytest

from labkit.instructor import records
from labkit.instructor.records import Check, Mark, Result
from labkit.instructor.report.class_page import class_page
from labkit.instructor.report.figures import HEAVIEST, Drawer
from labkit.instructor.report.page import POLICY, STYLE, file_name
from labkit.instructor.report.pages import feedback_page, to_mark_page
from labkit.instructor.report.tables import labels

from helpers.reference import history, record

TITLE = "Lab 3: an EKF with range and bearing"
SECRET = {"question": "SECRET-Q", "rubric": "SECRET-R"}  # of a hidden check; neither may reach a student
CHECKS = [
    Check("h", "`h`: range and bearing of one landmark", 2),
    Check("jacobian", "`jacobian`: one landmark", 2),
    Check("kf-none", "`KF`: no landmark in view", 2),
    Check("kf-one", "`KF`: one landmark", 3),
    Check("kf-many", "`KF`: many landmarks, in another order", 3),
    Check("kf-map", "`KF`: a drive on another map", 4, hidden=True, **SECRET),
    Check("kf-behind", "`KF`: a landmark behind the robot", 4, hidden=True, **SECRET),
    Check(
        "q6",
        "Question Q6: the shape of the ellipse",
        3,
        hand=True,
        question="### Question Q6\nWhy is the ellipse long and thin when *one* landmark is in view?",
        rubric="SECRET-RUBRIC\n- 1 point: range is known better than bearing\n"
        "- 1 point: across grows with $r \\sigma_\\beta$\n"
        "- 1 point: it turns as the robot passes by",
    ),
    Check("q7", "Question Q7: noise told wrongly", 2.5, hand=True, question="What happens when R is too small?"),
]
MISTAKES = {
    "h": "The arguments of `arctan2` are swapped: it takes dy first, then dx.",
    "jacobian": "The second row lacks the division by the squared range.",
    "kf-one": "The bearing innovation is not wrapped: subtracting two bearings can give 359° where 1° is meant.",
    "kf-many": "R is that of one landmark; it must be repeated for all that are in view.",
}
LINES = (
    "  call      update([Landmark([2.236, 1.107], id=3), Landmark([1.414, -2.356], id=7), 2 more]) with dt=0.25",
    "  expected  xk_k = [1.234, -0.5678]",
    "  came      xk_k = [1.234, 5.715]",
    "  printed   innovation [0.01 6.27]",
)
ANSWERS = [
    "With one landmark, the range is known to 10 cm, but across it the bearing's error grows with the distance.\n"
    "So the ellipse is a sliver that points at the landmark, and it turns when we drive past.",
    "because of the noise",
    "I think the range sensor is better than the bearing sensor.",
    "",
]
NAMES = [
    "Ada",
    "Alan",
    "Grace",
    "Katherine",
    "Emmy",
    "José",
    "Søren",
    "Zoë",
    "Łukasz",
    "Νίκος",
    "Юлия",
    "小明",
    "يوسف",
    "Ngọc",
]
FAMILIES = [
    "Lovelace",
    "Turing",
    "Hopper",
    "Johnson",
    "Noether",
    "García",
    "Kierkegaard",
    "Müller",
    "Nowak",
    "Παπάς",
    "Иванова",
    "王",
    "حداد",
    "Trần",
]


@pytest.fixture(scope="module")
def drawer():
    return Drawer()


@pytest.fixture(scope="module")
def run():
    log = record(seed=2)
    h = history(log)
    return {"times": h.times, "x": h.x, "P": h.P, "truth": log.truth, "landmarks": log.map.positions}


def curve():
    x = np.geomspace(0.1, 10, 21)
    return {"x": x, "values": 2 * x**-1.3, "bounds": np.array([1.6, 2.4]), "label": "mean NEES", "xlabel": "Q told / Q"}


def classroom(size, seed=0):
    """A class in which most pass most, some fail alike, and a few cannot be graded."""
    rng = np.random.default_rng(seed)
    students = []
    for i in range(size):
        name = f"{NAMES[i % 14]} {FAMILIES[(i // 14 + i) % 14]}" if i != 15 else f"{NAMES[0]} {FAMILIES[0]}"
        handed = datetime(2026, 3, 2, 9 + i % 12, i % 60)
        result = Result(name, str(1000 + i), "lab3", f"{name}_{1000 + i}/lab3.ipynb", handed, level=3, id=i)
        students.append(result)
        if i % 19 == 7:
            result.problem = "The file is not a notebook: it is a PDF that was renamed."
            continue
        skill = rng.beta(3, 1.4)
        result.late, result.level = bool(i % 13 == 4), 3 - (i % 17 == 3)
        result.notes = ["Of 2 hand-ins the last one counts."] * (i % 9 == 2)
        for check in CHECKS:
            if check.hand:
                result.answers[check.id] = ANSWERS[rng.integers(4)]
                points = None if rng.random() < 0.6 else float(rng.integers(0, 6) / 2 % (check.points + 0.1))
                status = records.OPEN if points is None else records.BY_HAND
                result.marks.append(
                    Mark(check.id, points, check.points, status, "Say also why." if points == 1 else "")
                )
            elif rng.random() < skill:
                result.marks.append(Mark(check.id, check.points, check.points, records.PASSED))
            elif rng.random() < 0.15:
                reason = "Still to be written: `update` of lab 3."
                result.marks.append(Mark(check.id, 0, check.points, records.NOT_RUN, reason))
            else:
                mistake = MISTAKES.get(check.id, "") if rng.random() < 0.8 else ""
                title = "" if check.hidden else LINES
                reason = "Not yet right: one landmark. xk_k is off after the second `update`."
                result.marks.append(Mark(check.id, 0, check.points, records.FAILED, reason, title, mistake))
    return students


def make_class_page(results, **changes):
    taken = set()
    return class_page(results, CHECKS, TITLE, {label: file_name(label, taken) for label in labels(results)}, **changes)


class Balanced(HTMLParser):
    """Complains about tags that are not closed in order, and collects what is on the page."""

    VOID = {"meta", "img", "br"}

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.attributes, self.words = [], [], [], []
        self.feed(page)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes += [(tag, *pair) for pair in attributes]
        assert len(dict(attributes)) == len(attributes)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self):
        return " ".join("".join(self.words).split())


ALLOWED = set(
    [
        "html",
        "head",
        "meta",
        "title",
        "style",
        "body",
        "main",
        "header",
        "section",
        "h1",
        "h2",
        "h3",
        "p",
        "ol",
        "ul",
        "li",
        "span",
        "div",
        "b",
        "i",
        "code",
        "bdi",
        "br",
        "a",
        "img",
        "figure",
        "figcaption",
        "table",
        "thead",
        "tbody",
        "tr",
        "th",
        "td",
        "details",
        "summary",
        "svg",
        "rect",
        "text",
        "line",
    ]
)


def sound(page):
    """The page parsed, after all that must hold for every page."""
    page.encode("utf-8")
    seen = Balanced(page)
    assert set(seen.tags) <= ALLOWED
    assert f'content="{POLICY}"' in page and '<html lang="en">' in page and seen.tags.count("h1") == 1
    for tag, name, value in seen.attributes:
        assert not name.startswith("on")
        assert name not in ("href", "src") or (tag, name) in {("a", "href"), ("img", "src")}
        assert name != "src" or value.startswith("data:image/png;base64,")
        assert name != "href" or re.fullmatch(r"[\w./%~-]+\.html", value)
    assert not re.search("[\x00-\x08\x0b-\x1f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]", page)
    return seen


# -- the student's page


def test_a_student_sees_points_words_and_reasons(drawer, run):
    marks = [
        Mark("h", 2, 2, records.PASSED),
        Mark("jacobian", 0, 2, records.FAILED, "Not yet right: one landmark.", LINES, MISTAKES["jacobian"]),
        Mark("kf-none", 0, 2, records.NOT_RUN, "`KF` is still to be written."),
        Mark("kf-one", 0, 3, records.ERROR, "This check could not be run."),
        Mark("q6", None, 3, records.OPEN),
        Mark("q7", 1.5, 2.5, records.BY_HAND, "Well said."),
    ]
    result = Result(
        "Zoë Müller", "7", "lab3", "a/lab3.ipynb", datetime(2026, 3, 2, 9, 5), True, ["One cell is missing."]
    )
    result.marks, result.figure, result.answers = marks, run, {"q6": "two\nlines", "q7": "  "}
    page = feedback_page(result, CHECKS, TITLE, drawer)
    seen = sound(page)
    for told in (
        TITLE,
        "Zoë Müller",
        "3.5 of 14.5 points so far",
        "1 written answer still to be read",
        "One cell is missing.",
        "2026-03-02 09:05",
        "This was handed in late.",
        "✓passed",
        "✗not yet",
        "–not run",
        "!not graded",
        "…to be read",
        "✎by hand",
        "Well said.",
        "squared range",
        "came xk_k",
        "two lines",
        "You gave no answer.",
        "2 of 2",
        "– of 3",
        "1.5 of 2.5",
        "hidden check",
    ):
        assert told in seen.text, told
    order = [seen.text.index(re.sub("`", "", check.title)) for check in CHECKS]
    assert order == sorted(order)
    assert [value for _, name, value in seen.attributes if name == "alt"][0].startswith("Left, the map")


def test_what_could_not_be_graded_says_what_to_do():
    result = Result("Ada", problem="The file is not a notebook.")
    seen = sound(feedback_page(result, CHECKS, TITLE))
    assert "The file is not a notebook." in seen.text and "What to do" in seen.text and "Question" not in seen.text


def test_nothing_leaks_of_hidden_checks_and_of_rubrics():
    shown = Mark("kf-map", 0, 4, records.FAILED, "It fails on another map.", ("SECRET-LINE",), "SECRET-MISTAKE")
    result = Result("Ada", marks=[shown], answers={"q6": "mine", "kf-map": "SECRET-ANSWER"})
    page = feedback_page(result, CHECKS, TITLE)
    assert "SECRET" not in page and "It fails on another map." in page
    assert "SECRET-R" in to_mark_page([result], CHECKS, TITLE)
    assert "SECRET-LINE" not in make_class_page([result])


ODD = {
    "script": "<script>alert(1)</script>",
    "breaks out": "\"'></pre></style></title><img src=x onerror=alert(1)>",
    "comment": "<!-- --> ]]> <![CDATA[",
    "link": "javascript:alert(1)",
    "entity": "&lt;b&gt; &#0; &amp",
    "direction": "abc\u202egnp.exe\u202c \u2066x\u2069 \u200f",
    "control": "\x00\x07\x1b[31m\r\x85",
    "surrogate": "\ud800 and \udfff",
    "backticks": "`<b>` ``` `\n`",
    "long": "x" * 1_000_000,
    "long and odd": "<\u202e&`" * 250_000,
    "empty": "",
}


@pytest.mark.parametrize("odd", ODD.values(), ids=ODD)
def test_no_text_breaks_a_page(odd, drawer):
    check = Check("a", odd, 1, False, False, odd, odd)
    hidden, hand = Check("b", odd, 1, hidden=True), Check(odd, odd, 1, True, False, odd, odd)
    marks = [
        Mark("a", 0, 1, records.FAILED, odd, (odd,) * 3, odd),
        Mark("b", 0, 1, odd, odd, (odd,), odd),
        Mark(odd, None, 1, records.OPEN, odd),
    ]
    result = Result(
        odd, odd, odd, odd, None, True, [odd], 3, "", marks, {odd: odd}, {"x": odd, "values": odd, "bounds": odd}
    )
    unfit = Result(odd, odd, odd, odd, problem=odd or "?")
    checks = [check, hidden, hand]
    pages = [
        feedback_page(result, checks, odd, drawer),
        feedback_page(unfit, checks, odd, drawer),
        to_mark_page([result, unfit], checks, odd),
    ]
    results, taken = ([Result(odd, "7", "lab", marks=marks), Result(odd, "8", "lab", problem=odd or "?")], set())
    pages.append(class_page(results, checks, odd, {label: file_name(label, taken) for label in labels(results)}))
    for page in pages:
        sound(page)
        assert len(page) < 250_000 and "<script" not in page and "<img src=x" not in page


def test_a_long_answer_is_cut_and_says_so():
    result = Result("Ada", marks=[Mark("q6", None, 3, records.OPEN)], answers={"q6": "word " * 2000})
    assert "(cut here: 5,000 more characters)" in sound(feedback_page(result, CHECKS, TITLE)).text


def test_colours_can_be_read_in_both_themes_and_on_paper():
    def light(color):
        color = color * 2 if len(color) == 3 else color
        parts = np.array([int(color[i : i + 2], 16) for i in (0, 2, 4)]) / 255
        return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722]

    themes = [dict(re.findall(r"--(\w+): #(\w+)", part)) for part in re.findall(r":root \{.*?\}", STYLE, re.DOTALL)]
    assert len(themes) == 3
    for theme in themes:
        for fore in ("fore", "soft", "good", "bad", "wait"):
            for back in ("back", "card"):
                low, high = sorted([light(theme[fore]), light(theme[back])])
                assert (high + 0.05) / (low + 0.05) >= 4.5, (fore, back)


# -- the picture


def test_pictures_are_quick_and_light(drawer, run):
    result = Result("Ada", marks=[Mark("h", 2, 2, records.PASSED)], figure=run)
    for figure in (run, curve()):
        drawer.png(figure)
        spent = []
        for _ in range(5):
            start = time.process_time()
            image = drawer.png(figure)
            spent.append(time.process_time() - start)
        assert image.startswith(b"\x89PNG") and len(image) <= HEAVIEST and min(spent) < 0.06
    assert base64.b64encode(drawer.png(run)).decode() in feedback_page(result, CHECKS, TITLE, drawer)


def test_one_students_picture_leaves_nothing_on_the_next(run):
    drawer, other = Drawer(), {**run, "x": run["x"] + 0.5}
    first, between, again = drawer.png(run), drawer.png(other), drawer.png(run)
    assert first == again != between
    assert drawer.png({**run, "P": np.full_like(run["P"], np.nan)}) != first and drawer.png(run) == first


BAD = [np.nan, np.inf, -np.inf, 1e300, -1e300, 1e-300, 0.0]


@pytest.mark.parametrize("value", BAD)
@pytest.mark.parametrize("name", ["times", "x", "P", "truth", "landmarks", "values", "bounds"])
def test_no_number_stops_the_drawing(name, value, drawer, run):
    for figure in (run, curve()):
        if name not in figure:
            continue
        for where in (slice(None), slice(0, 1), slice(-1, None), slice(None, None, 2)):
            array = np.array(figure[name], dtype=float)
            array[where] = value
            start = time.process_time()
            image = drawer.png({**figure, name: array})
            assert image is None or image.startswith(b"\x89PNG") and len(image) <= HEAVIEST
            assert time.process_time() - start < 1


@pytest.mark.parametrize(
    "value",
    [
        None,
        "text",
        [],
        [[]],
        3.0,
        np.zeros((0, 2)),
        np.zeros((2, 0)),
        np.zeros((3, 3, 3, 3)),
        np.array([object()]),
        [[1], [1, 2]],
        {},
        np.zeros(2_000_000),
        np.array([1j]),
        np.zeros((161, 1)),
    ],
    ids=lambda value: str(np.shape(value) if isinstance(value, np.ndarray) else value),
)
def test_what_is_no_such_array_draws_nothing(value, drawer, run):
    for figure in (run, curve()):
        for name in figure:
            empty = name == "landmarks" and isinstance(value, (list, np.ndarray)) and str(value) in ("[]", "[[]]")
            if name not in ("label", "xlabel") and not empty:  # a map may have no landmark
                assert drawer.png({**figure, name: value}) is None, name
    for name in run:
        assert drawer.png({key: value for key, value in run.items() if key != name}) is None
    assert drawer.png({}) is None


def test_a_wild_filter_is_drawn_lightly(drawer, run):
    rng, n = np.random.default_rng(0), 5000
    t = np.linspace(0, 40, n)
    truth = np.stack([np.interp(t, run["times"], run["truth"][:, i]) for i in (0, 1)], axis=1)
    wild = {
        "times": t,
        "x": rng.uniform(-5, 5, (n, 2)),
        "P": np.eye(2) * rng.uniform(0, 2, (n, 1, 1)),
        "truth": truth,
        "landmarks": rng.uniform(-5, 5, (1000, 2)),
    }
    assert len(drawer.png(wild)) <= HEAVIEST


def test_labels_cannot_misbehave(drawer):
    for label in (r"$\frac{1}{$", "a" * 10**6, "\x00\ud800", "小明", None, 3, ["x"]):
        assert drawer.png({**curve(), "label": label, "xlabel": label})


# -- the instructor's pages


def test_the_same_answers_are_grouped_and_open_ones_come_first():
    def student(name, answer, points=None):
        status = records.OPEN if points is None else records.BY_HAND
        return Result(name, lab="lab3", marks=[Mark("q6", points, 3, status)], answers={"q6": answer})

    results = [student("Ada", "read", 2), student("Cem", " same\n"), student("Bo", "same"), student("Dee", "")]
    page = to_mark_page(results, CHECKS, TITLE)
    text = sound(page).text
    assert "2 students gave this same answer." in text and "Ada (2)" in text and "No answer: Dee" in text
    assert "3 answers, 3 still to be read" in text and "grades.csv" in text and "run the same command again" in text
    assert text.index("Bo, Cem") < text.index("Ada (2)")
    assert "$r \\sigma_\\beta$" in text and "Nobody has handed this in yet" in text
    sound(to_mark_page([], CHECKS, TITLE))
    assert "no written question" in to_mark_page(results, CHECKS[:3], TITLE)


@pytest.mark.parametrize("size", [0, 1, 60, 1000])
def test_a_class_of_any_size(size):
    results = classroom(size)
    page = make_class_page(results)
    seen = sound(page)
    unfit = sum(bool(result.problem) for result in results)
    links = [unquote(value) for tag, name, value in seen.attributes if name == "href"]
    assert len(links) == len(set(links)) == size
    assert all(link.startswith("feedback/lab3/") for link in links)
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
    sound(to_mark_page(results, CHECKS, TITLE))


def test_odd_classes():
    none = [Result("Ada", "1", "lab3", problem="No file.")]
    assert "0 students graded, 1 could not be graded" in sound(make_class_page(none)).text
    zero = [Result("Ada", "1", "lab3", level=0, marks=[Mark("h", 0, 0, records.PASSED)])]
    assert "Level 0 is no sandbox" in sound(make_class_page(zero)).text
    full = [Result("Ada", "1", "lab3", level=4, marks=[Mark("h", 2, 2, records.PASSED)])]
    text = sound(class_page(full, CHECKS, TITLE, {})).text
    assert "No known mistake" in text and "level 4" in text


# -- file names


@pytest.mark.parametrize(
    "label, found",
    [
        ("Ada Lovelace", "Ada-Lovelace.html"),
        ("../../etc/passwd", "etc-passwd.html"),
        ("a\\b:c*?", "a-b-c.html"),
        ("CON", "student-CON.html"),
        ("com1", "student-com1.html"),
        ("ＮＵＬ", "student-NUL.html"),
        ("", "student.html"),
        ("...", "student.html"),
        ("\ud800\x00\u202e", "student.html"),
        ("-rf", "rf.html"),
        ("J. R. (12)", "J-R-12.html"),
        ("小明 王", "小明-王.html"),
        ("Zoe\u0308 #2", "Zoë-2.html"),
        ("a%2e%2e/b", "a-2e-2e-b.html"),
        ("x.html", "x-html.html"),
    ],
)
def test_file_names(label, found):
    assert file_name(label, set()) == found


def test_file_names_differ_and_fit():
    taken = set()
    names = [file_name(label, taken) for label in ["Ada", "ada", "A/da", "A da", "Ada", "Ada", "x" * 300, "x" * 301]]
    names += [file_name("王" * 300, taken), file_name("e" + "\u0301" * 10**6, taken)]
    assert len({name.casefold() for name in names}) == len(names)
    assert all(len(name) <= 80 and len(name.encode()) <= 255 for name in names)

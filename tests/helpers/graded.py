"""Graded results of a made-up class, and what must hold for every page that is made of them."""

import csv
import io
import re
from datetime import datetime
from html.parser import HTMLParser

import numpy as np

from labkit.instructor import records
from labkit.instructor.records import Check, Mark, Result

LAB = "01_cartesian_ekf"
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
NAMES = re.split(" ", "Ada Alan Grace Katherine Emmy José Søren Zoë Łukasz Νίκος Юлия 小明 يوسف Ngọc")
FAMILIES = re.split(
    " ", "Lovelace Turing Hopper Johnson Noether García Kierkegaard Müller Nowak Παπάς Иванова 王 حداد Trần"
)


def curve():
    """A consistency curve for the picture of a page."""
    x = np.geomspace(0.1, 10, 21)
    return {"x": x, "values": 2 * x**-1.3, "bounds": np.array([1.6, 2.4]), "label": "mean NEES", "xlabel": "Q told / Q"}


def result(student, identifier="", first=2.0, written=None, **more):
    """A result of two checks (2 and 3 points; the first failed unless it gives 2) and a written question of 5."""
    code = (records.PASSED, "") if first == 2 else (records.FAILED, "The sign of K is wrong.")
    text = (records.OPEN, "") if written is None else (records.BY_HAND, "Good.")
    marks = [Mark("kf", first, 2.0, *code), Mark("map", 3.0, 3.0, records.PASSED), Mark("q1", written, 5.0, *text)]
    return Result(student, identifier, LAB, marks=marks, **more)


def whole():
    """Results without open answers: 10 and 8.5 of 10 points."""
    return [result("Ada Lovelace", "101", written=5.0), result("Łukasz Żak", "102", first=0.5, written=5.0)]


def table(path, delimiter=",", encoding="utf-8-sig"):
    """The cells of a CSV file."""
    return list(csv.reader(io.StringIO(path.read_bytes().decode(encoding), newline=""), delimiter=delimiter))


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


class Balanced(HTMLParser):
    """Complains about tags that are not closed in order, and collects what is on the page."""

    VOID = ("meta", "img", "br", "hr")

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
    re.findall(
        r"\w+",
        "html head meta title style body main header section h1 h2 h3 p ol ul li span div b i code bdi br a img figure "
        "figcaption table thead tbody tr th td details summary svg rect text line "
        "h4 h5 h6 blockquote pre em strong s hr math mrow mi mn mo mtext mspace mstyle mfrac msqrt msub msup msubsup "
        "mover munder munderover mtable mtr mtd nav",
    )
)
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def sound(page):
    """The page parsed, after all that must hold for every page."""
    page.encode("utf-8")
    seen = Balanced(page)
    assert set(seen.tags) <= ALLOWED
    assert f'content="{POLICY}"' in page and '<html lang="en">' in page and seen.tags.count("h1") == 1
    for tag, name, value in seen.attributes:
        assert not name.startswith("on")
        assert name not in ("href", "src") or (tag, name) in {("a", "href"), ("img", "src")}
        assert name != "src" or re.match(r"data:image/(png|jpe?g|gif);base64,", value)
        assert name != "href" or re.fullmatch(r"[\w./%~-]+\.html|#\w+", value)
    assert not re.search("[\x00-\x08\x0b-\x1f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]", page)
    return seen

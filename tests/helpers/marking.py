"""A gradebook with written answers, and `labkit mark` running on it, for tests, pictures and the benchmark."""

import http.client
import json
import os
import re
import signal
import subprocess
import sys
import uuid
from contextlib import closing, contextmanager

from labkit.instructor.exam.paper import read as read_paper
from labkit.instructor.report.gradebook import Gradebook

from helpers.classroom import LAB
from helpers.reference import ROOT

Q1 = "answer-q1"


def graded(out, answers, lab=LAB, check=Q1):
    """A folder as `labkit grade` leaves it: answers {student: text} to one written question, the others blank."""
    paper = read_paper(lab)
    out.mkdir(parents=True, exist_ok=True)
    with closing(Gradebook(out / "gradebook.db", seed=7)) as book, book:
        book.set_paper(lab, paper.digest, paper.checks)
        for number, (name, text) in enumerate(answers.items()):
            about = (lab, name, "", f"{name}.ipynb", str(number), paper.digest, None, False, [])
            id = book.add(*about, {**{c.id: "" for c in paper.checks if c.hand}, check: text})
            book.choose(id, [], False)
            for cell in paper.checks:
                if not cell.hand:
                    book.mark(id, cell.id, cell.points, "passed")
            book.finish(id)
    return out


class Marking:
    """`labkit mark` in a process of its own. address: as it was printed, without a reader's name."""

    def __init__(self, out, port=0):
        command = [sys.executable, "-m", "labkit", "mark", str(out), "--no-browser", "--port", str(port)]
        env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"}
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, encoding="utf-8", env=env
        )
        said = ""
        while not (found := re.search(r"http://127\.0\.0\.1:(\d+)/([\w-]+)/", said)):
            line = self.process.stdout.readline()
            assert line, f"labkit mark ended: {said}"
            said += line
        self.address, self.port, self.token = found[0], int(found[1]), found[2]

    def kill(self):
        """As when the power fails; a second time does nothing."""
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def end(self):
        """As by Ctrl-C; (exit status, what it said after its address)."""
        self.process.send_signal(signal.SIGINT)
        said, _ = self.process.communicate(timeout=600)
        return self.process.returncode, said


@contextmanager
def marking(out, port=0):
    """A running `Marking`, ended at the end whatever happens."""
    server = Marking(out, port)
    try:
        yield server
    finally:
        if server.process.poll() is None:
            server.kill()


def points(out, lab=LAB, check=Q1):
    """{student: points} as they are in the gradebook."""
    with closing(Gradebook(out / "gradebook.db")) as book:
        return {r.student: m.points for r in book.results(lab) for m in r.marks if m.check == check}


def ask(server, path, method="GET", body=None, **headers):
    """(status, text, headers) of a request as the page's script makes it, with other headers where they are given."""
    own = {"Origin": server.address.split(f"/{server.token}")[0], "Content-Type": "application/json"}
    own = {**(own if method == "POST" else {}), **{k.replace("_", "-"): v for k, v in headers.items()}}
    with closing(http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)) as line:
        line.request(method, path, body, {name: value for name, value in own.items() if value})
        answer = line.getresponse()
        return answer.status, answer.read().decode(), dict(answer.headers)


def next_of(server, reader):
    """(address of the page, {id: newest mark}) of what a reader is given to read first."""
    status, page, _ = ask(server, f"/{server.token}/{reader}/")
    assert status == 200
    key = page.split('class="questions"')[1].split(f"/{reader}/")[1].split("/")[0]
    _, _, headers = ask(server, f"/{server.token}/{reader}/{key}/")
    _, page, _ = ask(server, headers["Location"])
    boxes = [line for line in page.splitlines() if 'class="slot"' in line]
    return headers["Location"], {
        b.split('value="')[1].split('"')[0]: int(b.split('seen="')[1].split('"')[0]) for b in boxes
    }


def give(server, path, seen, points="1", **more):
    body = {"act": str(uuid.uuid4()), "seen": seen, "points": points, "comment": "", "ticks": [], **more}
    status, text, _ = ask(server, path, "POST", json.dumps(body))
    return status, json.loads(text)["said"]

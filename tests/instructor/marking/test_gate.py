"""Who is let in to `labkit mark`, what is refused, and what becomes of the marks when it ends."""

import contextlib
import http.client
import json
import socket
import sqlite3
import sys
import threading
import time
import uuid
from contextlib import closing

import pytest

from labkit import cli
from labkit.instructor.report.texts import plain

from helpers.graded import table
from helpers.marking import Marking, ask, give, graded, marking, next_of, points

pytestmark = pytest.mark.slow

ANSWERS = {"Ada": "It is inside.", "Bela": "It is inside.", "Cem": "It is outside.", "Dee": ""}


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    out = graded(tmp_path_factory.mktemp("marking") / "out", ANSWERS)
    with marking(out) as running:
        running.out = out
        yield running


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "evil.example:{port}"},
        {"Host": "127.0.0.1"},
        {"Origin": "http://evil.example"},
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "null"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
    ids=str,
)
def test_other_sites_and_other_names_of_this_machine_are_refused(server, headers):
    headers = {name: value.format(port=server.port) for name, value in headers.items()}
    for method, path in (("GET", ""), ("GET", "Emmy/"), ("GET", "page.js"), ("POST", "Emmy/undo"), ("PUT", "Emmy/")):
        status, text, _ = ask(server, f"/{server.token}/{path}", method, "{}" if method == "POST" else None, **headers)
        assert status == 403 and server.token not in text


def test_without_the_token_or_an_origin_nothing_is_shown_or_taken(server):
    _, address = next_of(server, "Emmy"), None
    wrong = "x" * len(server.token)
    for path in (
        "/",
        "/Emmy/",
        f"/{wrong}/",
        f"/{wrong}/Emmy/",
        f"/{wrong}/page.js",
        f"/{server.token}x/",
        "//",
        "/%00/",
    ):
        for method in ("GET", "POST", "DELETE"):
            status, text, headers = ask(server, path, method)
            assert status == 403 and "Ada" not in text and "Server" not in headers, (path, method)
    address, seen = next_of(server, "Emmy")
    body = json.dumps({"act": str(uuid.uuid4()), "seen": seen, "points": "1", "comment": "", "ticks": []})
    assert ask(server, address, "POST", body, Origin=None)[0] == 403
    assert ask(server, address, "POST", body, Content_Type="text/plain")[0] == 400  # what a form of another site sends
    assert set(points(server.out).values()) == {None, 0}


def test_every_answer_carries_the_policy_and_no_page_has_a_script_in_it(server):
    for path in ("", "Emmy/", next_of(server, "Emmy")[0].removeprefix(f"/{server.token}/"), "nothing/here"):
        _, text, headers = ask(server, f"/{server.token}/{path}")
        assert headers["Content-Security-Policy"].startswith("default-src 'none'; script-src 'self'; style-src 'self'")
        assert "unsafe" not in headers["Content-Security-Policy"] and headers["Referrer-Policy"] == "no-referrer"
        assert headers["X-Content-Type-Options"] == "nosniff" and headers["Cache-Control"] == "no-store"
        assert "<script>" not in text and " onclick=" not in text and " style=" not in text


def test_only_this_machine_is_listened_to(server):
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as out:
        try:
            out.connect(("203.0.113.1", 9))  # nothing is sent; it tells the address that others see
            outside = out.getsockname()[0]
        except OSError:
            pytest.skip("this machine has no other address")
    with closing(socket.socket()) as line:
        line.settimeout(10)
        assert line.connect_ex((outside, server.port)) != 0


def test_what_makes_no_sense_is_told_and_changes_nothing(server):
    path, seen = next_of(server, "Emmy")
    before = points(server.out)
    for wrong in ("-1", "2.5", "x", "", "nan", "1e9"):
        assert give(server, path, seen, wrong) == (400, "The points are to be a number from 0 to 2.")
    assert give(server, path, {**seen, "999": 0})[0] == give(server, path, {})[0] == 409
    for more in ({"act": "x"}, {"act": 1}, {"seen": []}, {"seen": {"x": 1}}, {"ticks": "x"}, {"ticks": None}):
        assert give(server, path, **{"seen": seen, **more})[0] == 400, more
    for body in ("", "[", "[]", "null", '"x"', "[" * 5000, "\x00"):
        assert ask(server, path, "POST", body)[0] == 400
    assert ask(server, path.rpartition("/")[0] + "/999", "GET")[0] == 404
    for name in ("grades.csv", "%20", "a%00b", "x" * 61, "%E2%80%AE"):
        assert ask(server, f"/{server.token}/{name}/")[0] == 404
    assert points(server.out) == before


def test_a_gradebook_in_use_is_told_and_the_mark_is_kept_when_it_is_free(server):
    path, seen = next_of(server, "Emmy")
    act = str(uuid.uuid4())
    with closing(sqlite3.connect(server.out / "gradebook.db", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        status, said = give(server, path, seen, "1,5", act=act)
        assert status == 503 and "locked" in said and "tried again" in said
        other.execute("ROLLBACK")
    for _ in range(2):
        assert give(server, path, seen, "1,5", act=act)[0] == 200
    assert {name for name, mark in points(server.out).items() if mark == 1.5} == {"Ada", "Bela"}
    with closing(sqlite3.connect(server.out / "gradebook.db")) as book:
        assert book.execute("SELECT count(*) FROM hand WHERE act = ?", (act,)).fetchone() == (2,)


def test_what_cannot_be_served_is_told(server, tmp_path, capsys):
    def told(*arguments):
        with pytest.raises(SystemExit) as caught:
            sys.exit(cli.main(["mark", *map(str, arguments), "--no-browser"]))
        assert caught.value.code == 2
        return capsys.readouterr().err

    said = told(server.out, "--port", server.port)
    assert f"Port {server.port} cannot be used: Address already in use. Perhaps another" in said
    assert f"--port {server.port + 1}" in said and said.count("\n") == 1
    where = (
        f"labkit mark: {tmp_path} holds no gradebook.db: name the folder that labkit grade wrote into (its --out).\n"
    )
    assert told(tmp_path) == where
    (tmp_path / "gradebook.db").write_text("no database " * 100)
    assert "cannot be used as a gradebook" in told(tmp_path)
    assert "no written answers" in told(graded(tmp_path / "empty", {}))
    assert "is no port" in told(server.out, "--port", "70000") and "--reader: write" in told(server.out, "--reader", "")


def test_at_its_end_tables_and_pages_have_the_marks(tmp_path):
    out = graded(tmp_path / "out", ANSWERS)
    with marking(out) as server:
        assert (out / "marking.html").stat().st_mode & 0o777 == 0o600
        assert give(server, *next_of(server, "Emmy"), "1.5")[0] == 200
        status, said = server.end()
    assert status == 0, said
    rows = {row[0]: row for row in table(out / "grades.csv") if row[2] == "answer-q1"}
    assert {name: row[3] for name, row in rows.items()} == {"Ada": "1.5", "Bela": "1.5", "Cem": "", "Dee": "0"}
    text = (out / "grades.csv").read_text(encoding="utf-8-sig")
    (out / "grades.csv").write_text(
        text.replace(",".join(rows["Cem"]), ",".join([*rows["Cem"][:3], "2", *rows["Cem"][4:]]))
    )
    with marking(out) as server:  # the table and the browser in turn
        said = server.end()[1]
    assert "Took 1 mark from grades.csv." in said and points(out)["Cem"] == 2
    page = (out / "feedback" / "01_cartesian_ekf" / "Cem.html").read_text(encoding="utf-8")
    assert plain(2) in page and "to be read" not in page
    with marking(out) as server:
        assert "No mark has changed" in server.end()[1]


def test_in_a_storm_of_readers_servers_and_kills_each_mark_is_kept_once(tmp_path):
    count = 16
    out = graded(tmp_path / "out", {f"Student {n}": f"Answer {n} is number {n * n}." for n in range(count)})
    servers, kept, ended = [Marking(out), Marking(out)], {}, threading.Event()

    def read(name, of):
        while not ended.is_set():
            with contextlib.suppress(OSError, http.client.HTTPException, KeyError):  # the server is killed just now
                address, seen = next_of(servers[of], name)
                if not seen and f"{count} of {count} read" in ask(servers[of], address)[1]:
                    ended.set()
                time.sleep(0 if seen else 0.05)  # somebody else has the rest
                act, status = str(uuid.uuid4()), 0
                while seen and status != 200 and status != 409:
                    with contextlib.suppress(OSError, http.client.HTTPException):
                        status, _ = give(servers[of], address, seen, act=act)
                kept.update({act: [*seen]} if status == 200 else {})

    readers = [
        threading.Thread(target=read, args=about, daemon=True) for about in (("Emmy", 0), ("Noor", 1), ("Lise", 0))
    ]
    try:
        for reader in readers:
            reader.start()
        while not kept:
            time.sleep(0.01)
        port = servers[0].port
        servers[0].kill()
        servers[0] = Marking(out, port)
        for reader in readers:
            reader.join(60)
    finally:
        ended.set()
        for server in servers:
            server.kill()
    with closing(sqlite3.connect(out / "gradebook.db")) as book:
        given = dict(book.execute("SELECT act, count(*) FROM hand GROUP BY act"))
    assert given == {act: len(ids) for act, ids in kept.items()}
    assert set(points(out).values()) == {1} and len(points(out)) == count

"""The server of `labkit mark`: on this machine only, for whoever knows the token in its address."""

import asyncio
import re
import socket

from tornado.httpserver import HTTPServer
from tornado.web import Application, Finish, HTTPError

from ..report.texts import number, plain, readable
from .desk import Desk, Group, Question
from .gate import Handler, Place, name_of
from .pages import Pages, looks, said, source, words

WHOLE = 250_000  # characters of an answer as plain text
BODY = 100_000  # bytes of what a page may send
FILES = {"page.js": ("text/javascript", lambda: source("page.js")), "page.css": ("text/css", looks)}


def serve(desk: Desk, listening: list[socket.socket], token: str, reader: str) -> None:
    """Answer until Ctrl-C, which raises KeyboardInterrupt."""
    port = listening[0].getsockname()[1]
    place = Place(desk, Pages(desk, f"/{token}/"), port, token, reader)
    asyncio.run(_run(place, listening))


async def _run(place, listening):
    routes = [
        (r"/([^/]+)/(page\.js|page\.css)", _File),
        (r"/([^/]+)/", _Ask),
        (r"/([^/]+)/([^/]+)/", _Overview),
        (r"/([^/]+)/([^/]+)/undo", _Undo),
        (r"/([^/]+)/([^/]+)/([0-9a-f]{10})/", _Next),
        (r"/([^/]+)/([^/]+)/([0-9a-f]{10})/all", _All),
        (r"/([^/]+)/([^/]+)/([0-9a-f]{10})/([0-9]{1,15})", _Mark),
    ]
    every = [(route, handler, {"place": place}) for route, handler in routes]
    app = Application(
        every, default_handler_class=Handler, default_handler_args={"place": place}, log_function=lambda _: None
    )
    server = HTTPServer(app, max_body_size=BODY, max_header_size=BODY)
    server.add_sockets(listening)
    await asyncio.Event().wait()


class _File(Handler):
    def get(self, _: str, name: str) -> None:
        kind, text = FILES[name]
        self.set_header("Content-Type", f"{kind}; charset=utf-8")
        self.set_header("Cache-Control", "no-cache")
        self.finish(text())


class _Ask(Handler):
    def get(self, _: str) -> None:
        asked = self.get_query_argument("reader", None)
        reader = name_of(self.place.reader if asked is None else asked)
        if reader:
            self.redirect(self.home(reader))
        else:
            self.finish(self.pages.ask())


class _Overview(Handler):
    def get(self, _: str, reader: str) -> None:
        self.finish(self.pages.overview(self.home(reader), reader))


class _All(Handler):
    def get(self, _: str, reader: str, key: str) -> None:
        self.finish(self.pages.every(self.home(reader), reader, self.question(key)))


class _Next(Handler):
    def get(self, token: str, reader: str, key: str) -> None:
        after = self.get_query_argument("after", "0")
        address, _ = self.next(reader, self.question(key), int(after) if re.fullmatch(r"\d{1,15}", after) else 0)
        self.redirect(address)


class _Mark(Handler):
    def get(self, _: str, reader: str, key: str, id: str) -> None:
        question, group = self._found(key, id)
        if self.get_query_arguments("whole"):
            text = next(answer.text for answer in group.answers if answer.id == int(id))
            self.set_header("Content-Type", "text/plain; charset=utf-8")
            raise Finish(readable(text)[:WHOLE])
        self.desk.book.hands.hold(reader, question.check.id, [answer.id for answer in group.answers])
        self.finish(self.pages.mark(self.home(reader), reader, question, group))

    def _found(self, key: str, id: str) -> tuple[Question, Group]:
        question = self.question(key)
        group = question.group(int(id))
        if not group:
            raise HTTPError(404)
        return question, group

    def post(self, _: str, reader: str, key: str, id: str) -> None:
        self.home(reader)
        question, told = self.question(key), self.sent()
        try:
            seen = {int(one): int(newest) for one, newest in told["seen"].items()}
            points, reason = number(str(told["points"])), str(told["comment"]).strip()
            ticks = [int(tick) for tick in told["ticks"]][:100]
        except (KeyError, ValueError, TypeError, AttributeError):
            raise HTTPError(400) from None
        most = question.check.points
        if points is None or not 0 <= points <= most:
            return self.say(f"The points are to be a number from 0 to {plain(most, 2)}.", 400)
        slots = self.desk.slots(question, seen)
        if not slots:
            return self.say("Somebody has handed in another answer meanwhile: load the page again to read it.", 409)
        before = self._before(question, seen)
        moved = self.desk.book.hands.give(told["act"], reader, slots, points, readable(reason), ticks)
        self.desk.refresh(anew=True)
        if moved:
            return self._taken(question, {slot.result.id for slot in moved})
        who = f"{len(slots)} students" if len(slots) > 1 else next(a.label for a in question.answers if a.id in seen)
        go, group = self.next(reader, question, int(id))
        about = self.home(reader), reader, question
        page = self.pages.mark(*about, group) if group else self.pages.every(*about)  # one way less to wait for
        return self.say(f"{plain(points, 2)} for {who}{before}.", go=go, page=page)

    def _before(self, question: Question, seen: dict[int, int]) -> str:
        """The marks in whose place another one is given, as words."""
        found = [self.desk.given(question, answer) for answer in question.answers if answer.id in seen]
        marks = [*{said(mark): None for mark in found if mark.points is not None and mark.number in seen.values()}]
        return f", in place of {', '.join(marks[:3])}{' and others' if len(marks) > 3 else ''}" if marks else ""

    def _taken(self, question: Question, ids: set[int]) -> None:
        """Tell of the marks that others have given meanwhile; nothing was given."""
        found = [(answer, self.desk.given(question, answer)) for answer in question.answers if answer.id in ids]
        if len(found) < len(ids):
            return self.say("Somebody has handed in another answer meanwhile: load the page again to read it.", 409)
        told = words([f"{answer.label}: {said(given)}." for answer, given in found])
        now = {answer.id: given.number for answer, given in found}
        text = f"Not given, since it was marked meanwhile. {told} To put yours in its place, give the same once more."
        return self.say(text, 409, seen=now)


class _Undo(Handler):
    def post(self, _: str, reader: str) -> None:
        home, act = self.home(reader), self.sent()["act"]
        undone = self.desk.book.hands.undo(act, reader)
        self.desk.refresh(anew=True)
        if not undone:
            return self.say("There is nothing of yours to take back.")
        go = ""
        done: list[str] = []
        kept: list[str] = []
        for lab, student, identifier, check, gone in undone:
            for question in self.desk.questions.values():
                for answer in question.answers if (question.lab, question.check.id) == (lab, check) else ():
                    if (answer.result.student, answer.result.identifier) == (student, identifier):
                        (done if gone else kept).append(answer.label)
                        go = go or (f"{home}{question.key}/{answer.id}" if gone else "")
        text = f"Taken back for {done[0] if len(done) == 1 else f'{len(done)} students'}."
        stays = f" Somebody else has marked {', '.join(kept[:3])} since, which stays." if kept else ""
        return self.say(text + stays, go=go)

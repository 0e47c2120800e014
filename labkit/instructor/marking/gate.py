"""Who is let in to the pages of `labkit mark`, and what each answer of the server carries."""

import hmac
import json
import re
import sqlite3
from typing import Any, NamedTuple
from urllib.parse import quote

from tornado.web import HTTPError, RequestHandler

from ..report.by_hand import TABLE
from ..report.schema import trouble
from ..report.texts import clean
from .desk import Desk, Group, Question
from .pages import Pages

NAME = 60  # characters of a reader's name
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
    "connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class Place(NamedTuple):
    """What all handlers share. reader: whose name is not asked for, '' to ask."""

    desk: Desk
    pages: Pages
    port: int
    token: str
    reader: str


class Handler(RequestHandler):
    """Refuses whoever does not know the token, comes from another site or by another name of this machine."""

    def initialize(self, place: Place) -> None:
        """What tornado calls first."""
        self.place, self.desk, self.pages = place, place.desk, place.pages

    def set_default_headers(self) -> None:
        """On every answer, also on errors."""
        self.clear_header("Server")
        for name, value in HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        """403 for whoever is not let in."""
        hosts = [f"{name}:{self.place.port}" for name in ("127.0.0.1", "localhost")]
        origin = self.request.headers.get("Origin")
        same = origin == f"http://{self.request.host}" or origin is None and self.request.method == "GET"
        site = self.request.headers.get("Sec-Fetch-Site", "none")
        if self.request.method == "GET" and self.request.headers.get("Sec-Fetch-Mode") == "navigate":
            site = "none"  # a link that was followed, which has the token; no site can see the page that it leads to
        token = self.path_args[0] if self.path_args else ""
        known = hmac.compare_digest(token.encode("utf-8", "replace"), self.place.token.encode())
        if self.request.host not in hosts or not same or site not in ("none", "same-origin") or not known:
            raise HTTPError(403)
        self.desk.refresh()

    def home(self, reader: str) -> str:
        """The address of a reader's pages; 404 for what cannot be a name."""
        if not reader or reader != name_of(reader):
            raise HTTPError(404)
        return f"/{self.place.token}/{quote(reader, safe='')}/"

    def question(self, key: str) -> Question:
        """The question with this key; 404 if there is none."""
        if key not in self.desk.questions:
            raise HTTPError(404)
        return self.desk.questions[key]

    def next(self, reader: str, question: Question, after: int) -> tuple[str, Group | None]:
        """(address, answers) of what a reader reads next; all answers where nothing is left."""
        group = self.desk.next(reader, question, after)
        return f"{self.home(reader)}{question.key}/{group.id if group else 'all'}", group

    def say(self, text: str, status: int = 200, **more: Any) -> None:
        """Answer a page's script."""
        self.set_status(status)
        self.finish({"said": text, **more})

    def sent(self) -> dict[str, Any]:
        """What a page's script has sent; 400 if it is not of that kind."""
        try:
            told = json.loads(self.request.body)
            if (
                re.fullmatch(r"[0-9a-f-]{36}", told["act"])
                and self.request.headers["Content-Type"] == "application/json"
            ):
                return told
        except (ValueError, TypeError, KeyError, RecursionError):
            pass
        raise HTTPError(400)

    def write_error(self, status_code: int, **kwargs: Any) -> None:
        """A sentence for whatever went wrong."""
        error = kwargs.get("exc_info", (None, None))[1]
        text = TOLD.get(status_code, "That went wrong: see the terminal in which labkit mark runs.")
        if isinstance(error, sqlite3.Error):
            text = f"The gradebook: {trouble(error)}."
            text = f"Not kept yet. {text} It is tried again." if self.request.method == "POST" else text
            self.set_status(503)
        if self.request.method == "POST":
            self.finish({"said": text})
        else:
            self.set_header("Content-Type", "text/plain; charset=utf-8")
            self.finish(text)

    def log_exception(self, kind: Any, value: Any, trace: Any) -> None:
        """In the terminal: what is nobody's mistake but ours."""
        if not isinstance(value, HTTPError | sqlite3.Error):
            super().log_exception(kind, value, trace)


TOLD = {
    403: "Refused: use the whole address that labkit mark has printed.",
    404: "There is no such page (any more): go back to all questions.",
    400: "That was not understood: load the page again.",
}


def name_of(text: str) -> str:
    """A reader's name as it is kept, '' for what is none."""
    name = clean(text)[:NAME].strip()
    return "" if name == TABLE else name

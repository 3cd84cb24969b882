"""A class whose answers in words wait to be scored, the page on it, and a browser's requests without a browser."""

from __future__ import annotations

import asyncio
import contextlib
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from checkout import ROOT
from gradebooks import graded, mark, prose, record, report_text
from made_courses import OURS

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.overview import as_page, class_overview
from labcourse.grading.scoring.desk import Desk
from labcourse.grading.scoring.guards import TOKEN_HEADER, Scorer, Site, while_it_runs
from labcourse.grading.scoring.rubric import RubricItem
from labcourse.grading.scoring.server import application
from labcourse.grading.scoring.start import on_loopback
from labcourse.grading.settings import LevelSettings
from labcourse.student_id import GRADEBOOK_FILE
from rotflex.course.questions import CATALOGUE

WORDS = ("2.11", "explanation")  #: 1 point
COMPARED = ("2.16", "comparison")  #: 2 points
LEVELS = LevelSettings()
RUBRIC = {
    WORDS: RubricItem(
        **{
            "look_for": "Says why the measured peak is not where the formula has it.",
            "4": "Names the cause, says in which direction it moves the peak, and shows it in the own recording.",
            "3": "Names the cause and the direction.",
            "2": "Names the cause only.",
            "1": "Names none, or one that cannot be.",
            "remarks": ("In which direction does it move the peak?", "Show it in your own recording."),
        }
    )
}
#: No two nearly the same.
OPENINGS = ("Friction", "The joint", "My recording", "The formula", "Looking at it again, the curve", "A heavier beam")
MIDDLES = ("takes energy at each swing", "bends like a spring", "was noisy at the end", "leaves out what is lost")
ENDINGS = ("so the peak is where I saw it.", "which the second plot tells.", "and that is all I can say of it.")


def texts(count: int) -> list[str]:
    """Answers of which no two are nearly the same."""
    made = []
    for n in range(count):
        one, two, three = OPENINGS[n % 6], MIDDLES[n // 6 % 4], ENDINGS[n // 24 % 3]
        made.append(f"{one} {two}, {three} I measured {10 + n} times, at {3 * n + 1} Hz.")
    return made


def fill(book: Gradebook, answers: list[str], **run: Any) -> list[str]:
    """A student for each answer to WORDS, who wrote it; their IDs."""
    students = [f"student-{n:03}" for n in range(len(answers))]
    for student, text in zip(students, answers, strict=True):
        record(book, graded(student, mark(), prose(given=text), report_text(given=f"Of {student}: {text}"), **run))
    return students


def desk(book: Gradebook, **more: Any) -> Desk:
    """Where such a class is scored."""
    return Desk(book, CATALOGUE, RUBRIC, LEVELS, **more)


@dataclass
class Client:
    """Sends what a browser sends, to an application that is guarded for a site; as one scorer, or as nobody."""

    app: Any
    scorer: Scorer | None = None
    home: str = "http://127.0.0.1:8765"  #: address of the site, as its browser has it
    peer: str = "127.0.0.1"  #: whose connection it is
    cookies: dict[str, str] = field(default_factory=dict)

    def enter(self) -> Client:
        """Exchange the token of the scorer's address for the cookie."""
        reply = self.sign_in(self.scorer.token)
        name, _, value = reply.headers["set-cookie"].partition(";")[0].partition("=")
        self.cookies[name] = value
        return self

    def sign_in(self, token: str, **headers: str | None) -> Any:
        """What the page of an address sends; a header that is None is left out."""
        return self.request("POST", "/enter", self._sent({TOKEN_HEADER: token, **headers}))

    def get(self, path: str, **headers: str) -> Any:
        """A page."""
        return self.request("GET", path, headers)

    def act(self, name: str, sent: Any = None, **headers: str | None) -> Any:
        """An act as the page sends it; a header that is None is left out."""
        token = self.scorer.token if self.scorer else None
        return self.request("POST", f"/act/{name}", self._sent({TOKEN_HEADER: token, **headers}), json=sent or {})

    def _sent(self, headers: dict[str, str | None]) -> dict[str, str]:
        given = {key.replace("_", "-"): value for key, value in {"origin": self.home, **headers}.items()}
        return {key: value for key, value in given.items() if value is not None}

    def request(self, method: str, path: str, headers: Any, **more: Any) -> Any:
        """Any request; headers that come twice are a list of pairs."""
        import httpx

        async def sending(headers: Any) -> Any:
            transport = httpx.ASGITransport(self.app, client=(self.peer, 123))
            async with httpx.AsyncClient(transport=transport) as client:
                cookie = "; ".join(f"{name}={value}" for name, value in self.cookies.items())
                if isinstance(headers, dict):
                    headers = {"cookie": cookie, **headers}.items()
                return await client.request(method, self.home + path, headers=[*headers], **more)

        with ThreadPoolExecutor(1) as alone:  # a browser that is open in this thread has a loop of its own
            return alone.submit(asyncio.run, sending(headers)).result()


def app_of(made: Desk, site: Site, find: Any, results: Path | None = None) -> Any:
    """The application of this course."""
    return application(made, site, find, OURS, lambda link: as_page(class_overview(made.book, OURS), link), results)


def clients(made: Desk, *names: str, site: Site | None = None, results: Path | None = None) -> list[Client]:
    """A client for each scorer, let in."""
    scorers = [Scorer(name) for name in names]
    app = app_of(made, site or on_loopback(8765), while_it_runs(scorers), results)
    return [Client(app, one, **({"home": site.url} if site else {})).enter() for one in scorers]


def shown(reply: Any) -> list[dict[str, str]]:
    """Key and what was seen of the answers on a card."""
    found = re.findall(r'data-key="(\w+)" data-seen="(\w+)"', reply.json()["html"])
    return [{"key": key, "seen": seen} for key, seen in found]


@contextlib.contextmanager
def serving(
    folder: Path, *names: str, options: tuple[str | Path, ...] = ()
) -> Iterator[tuple[subprocess.Popen[str], list[str]]]:
    """`rotflex score`, until the block ends: the process, and an address for each name."""
    words = [sys.executable, "-m", "rotflex.cli", "score", str(folder), "--solutions", str(ROOT / "solutions")]
    words += [*(word for name in names for word in ("--by", name)), "--no-browser", *options]
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    process.stdin.write("yes\n")  # with --url, the host serves nothing else
    process.stdin.close()
    try:
        lines = [process.stdout.readline() for _ in names]
        yield process, [line.strip().partition(": ")[2] for line in lines]
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


def new_class(folder: Path, answers: list[str]) -> Path:
    """A folder as `rotflex grade` leaves it, with such a class in its gradebook."""
    with Gradebook(folder / GRADEBOOK_FILE) as book:
        fill(book, answers)
    return folder

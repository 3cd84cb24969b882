"""The scoring page as a server: its pages, and the acts that they send."""

from __future__ import annotations

import socket
import ssl
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp

from labcourse import program
from labcourse.errors import GradebookError, GradingError
from labcourse.grading.gradebook import Answer
from labcourse.grading.graded_run import facts_of
from labcourse.grading.reports.result import points as shown_points
from labcourse.grading.reports.result import worth as in_points
from labcourse.grading.reports.templating import templates
from labcourse.grading.scoring import cards, progress
from labcourse.grading.scoring.desk import Desk, Done, Pick, Where, key_of, seen, state
from labcourse.grading.scoring.guards import ACTOR, Find, Guard, Scorer, refusal
from labcourse.grading.scoring.site import Site

LONGEST_REMARK = 2000  #: characters; a page
MOST_ANSWERS = 50  #: in one act; a page shows several times fewer
#: Of a student's PDF, which nothing here opens. "sandbox" allows it nothing: no script, no form, an origin of its own.
REPORT_POLICY = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; sandbox"
_MOST_POINTS = 1e6  # the gradebook knows how many there are for an answer
_FOLDER = Path(__file__).parents[1]
_ASSETS = {
    "scoring.js": _FOLDER / "scoring/page/scoring.js",
    "scoring.css": _FOLDER / "scoring/page/scoring.css",
    "drawn.css": _FOLDER / "reports/templates/drawn.css",
}
_Text = Annotated[str, Field(max_length=LONGEST_REMARK)]
_Name = Annotated[str, Field(min_length=1, max_length=LONGEST_REMARK)]


class Sent(BaseModel):
    """What a page sends with an act.

    Attributes
    ----------
    question, part : which answers
    key : of the answer to show, or to hold
    skip : key of the answer that is put off
    answers : those that are ticked
    shown : keys of all, in their order
    level, points, remark : to give
    """

    model_config = ConfigDict(strict=True)

    question: _Name
    part: _Name
    key: _Text = ""
    skip: _Text = ""
    answers: Annotated[list[Pick], Field(max_length=MOST_ANSWERS)] = []
    shown: Annotated[list[_Text], Field(max_length=MOST_ANSWERS)] = []
    level: int | None = None
    points: Annotated[float, Field(ge=-_MOST_POINTS, le=_MOST_POINTS)] | None = None
    remark: _Text = ""

    @property
    def where(self) -> Where:
        """Question and part."""
        return self.question, self.part


class Pages:
    """What the server answers.

    Parameters
    ----------
    desk : where the class is scored
    title : of the course
    """

    def __init__(self, desk: Desk, title: str) -> None:
        self.desk, self.title = desk, title
        self._acts = {act.__name__: act for act in (self.next, self.give, self.ask, self.undo, self.renew, self.leave)}

    # --- pages --------------------------------------------------------------------------------------------------------

    def overview(self, request: Request) -> Response:
        """Show all parts, how far each is, and what waits for the instructor."""
        scores = self.desk.book.scores
        by_part: dict[Where, list[Answer]] = {}
        for answer in scores.answers():
            by_part.setdefault(answer.where, []).append(answer)
        rows, asked = [], []
        for where in self.desk.in_order(list(by_part)):
            question, held = self.desk.catalogue.marked.get(where[0]), scores.claimed(where)
            readers = sorted({actor for actor, _until in held.values()})
            rows.append((where, question.title if question else "", progress.tally(by_part[where]), readers))
            asked += [(one, held.get(one.student, ("",))[0]) for one in by_part[where] if one.asked]
        return self._page("overview.html", request, rows=rows, asked=asked)

    def scoring(self, request: Request) -> Response:
        """Show the page on which one part is scored; what changes on it comes by acts."""
        where = _where(request)
        question, item = self.desk.catalogue.marked.get(where[0]), self.desk.rubric.get(where)
        part = next((one for one in (question.parts if question else ()) if one.name == where[1]), None)
        key = request.query_params.get("key", "")
        return self._page("scoring.html", request, where=where, key=key, question=question, part=part, item=item)

    def _page(self, template: str, request: Request, **values: Any) -> Response:
        about = {"course": self.title, "program": program.name(), "scorer": request.scope[ACTOR]}
        return HTMLResponse(self._rendered(template, **about, **values))

    def _rendered(self, template: str, **values: Any) -> str:
        helpers = {"points": shown_points, "key_of": key_of, "state": state, "label": self.desk.label}
        helpers["left_text"] = progress.time_text
        return templates("scoring/page").get_template(template).render(**values, **helpers)

    def report(self, request: Request) -> Response:
        """Send the PDF that belongs to an answer. It is found by the answer, never by a name or a path."""
        answer = self.desk.find(_where(request), request.query_params.get("key", ""))
        graded = self.desk.book.current(answer.student) if answer is not None else None
        about = cards.report_of(self.desk, graded.run, answer.where) if answer and graded else None
        if answer and graded and about:
            # Of a pair, what only the partner handed in is stored as theirs.
            for student in dict.fromkeys((answer.student, facts_of(graded.run).bench_of or answer.student)):
                content = self.desk.book.content(student, about.name, about.digest)
                if content is not None:
                    headers = {
                        "content-security-policy": REPORT_POLICY,
                        "content-disposition": f"inline; filename*=UTF-8''{quote(about.name)}",
                    }
                    return Response(content, media_type="application/pdf", headers=headers)
        raise HTTPException(404, "There is no such report any more: open the answer again.")

    async def act(self, request: Request) -> Response:
        """Do what a page asks for, and answer with what it shows next."""
        act = self._acts.get(request.path_params["name"])
        if act is None:
            raise HTTPException(404, "There is no such act.")
        try:
            sent = Sent.model_validate_json(await request.body())
            return JSONResponse(await run_in_threadpool(act, request.scope[ACTOR], sent))
        except ValidationError as error:
            fault = error.errors()[0]
            place = ".".join(map(str, fault["loc"])) or "the act"
            raise HTTPException(400, f"{place}: {fault['msg']}. Nothing was done.") from None

    # --- acts ---------------------------------------------------------------------------------------------------------

    def next(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Show the next answer, or that of a key."""
        if sent.skip:
            self.desk.put_off(scorer.name, sent.where, sent.skip)
        if not sent.key:
            return self._reply(scorer, sent.where)
        answer = self.desk.find(sent.where, sent.key)
        if answer is None:
            return self._reply(scorer, sent.where, ["That answer is not there any more; here is the next one."])
        problem = self.desk.renew(scorer.name, sent.where, sent.key)
        return self._reply(scorer, sent.where, [problem], [answer], trouble=bool(problem))

    def give(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Score what was shown and ticked."""
        if not sent.answers or (sent.level is None) == (sent.points is None):
            raise HTTPException(400, "Tick at least one answer, and give either a level or points.")
        if sent.level is not None and sent.level not in self.desk.levels.shares:
            raise HTTPException(400, f"There is no level {sent.level}.")
        done = self.desk.give(
            scorer.name, sent.where, sent.answers, level=sent.level, points=sent.points, remark=sent.remark.strip()
        )
        return self._after(scorer, sent, done)

    def ask(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Leave what was shown and ticked to the instructor."""
        if not sent.answers:
            raise HTTPException(400, "Tick at least one answer.")
        return self._after(scorer, sent, self.desk.ask(scorer.name, sent.where, sent.answers, sent.remark.strip()))

    def undo(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Take back what was done last, and show it again with its remark."""
        done = self.desk.undo(scorer.name)
        messages, answers, again = list(done.problems), [], {}
        if done.acts:
            act = done.acts[0]
            labels = ", ".join(self.desk.label(one.student, one.where) for one in done.acts)
            messages.append(f"Taken back: {labels}, {act.question} {act.part}.")
            if act.where == sent.where:
                students = [one.student for one in done.acts]
                answers = [one for one in self.desk.due(sent.where) if one.student in students]
                again = {"remark": act.remark}
        if answers:
            self.desk.renew(scorer.name, sent.where, key_of(answers[0].student, sent.where))
        return self._reply(scorer, sent.where, messages, answers, again, trouble=bool(done.problems))

    def renew(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Hold on to what is shown."""
        return {"message": self.desk.renew(scorer.name, sent.where, sent.key) or ""}

    def leave(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Let others have what is shown."""
        self.desk.book.scores.let_go(scorer.name)
        return {}

    def _after(self, scorer: Scorer, sent: Sent, done: Done) -> dict[str, Any]:
        """Show what comes next; if nothing was written, the same answers as they are now, with all that was typed."""
        messages = list(dict.fromkeys(done.problems))
        if len(done.acts) > 1:
            messages.insert(0, f"{len(done.acts)} answers in one go; u takes them all back.")
        for act in done.acts if len(done.acts) == 1 else ():
            level = "" if act.level is None else f"level {act.level}, "
            given = "left to the instructor" if act.asked else f"{level}{in_points(act.points or 0.0)}"
            messages.insert(0, f"{self.desk.label(act.student, act.where)}: {given}.")
        ticked = {pick.key: pick.seen for pick in sent.answers}
        found = [] if done.acts else [self.desk.find(sent.where, key) for key in sent.shown or ticked]
        now = {key_of(one.student, one.where): one for one in found if one is not None}
        if not ticked.keys() & now.keys():
            return self._reply(scorer, sent.where, messages, trouble=bool(done.problems))
        if any(seen(now[key]) != ticked[key] for key in ticked.keys() & now.keys()):
            messages.append("Here it is as it is now: what you give replaces that, s leaves it.")
        again = {"ticked": set(ticked), "remark": sent.remark, "points": sent.points}
        return self._reply(scorer, sent.where, messages, list(now.values()), again, trouble=True)

    def _reply(
        self,
        scorer: Scorer,
        where: Where,
        messages: Sequence[str | None] = (),
        answers: Sequence[Answer] = (),
        again: dict[str, Any] | None = None,
        trouble: bool = False,
    ) -> dict[str, Any]:
        """Return the next card, how far the part is, and messages.

        Parameters
        ----------
        scorer : who scores
        where : question and part
        messages : for the scorer
        answers : to show; the next ones unless given
        again : what was ticked and typed before, to show it again
        trouble : whether a message is on something that failed
        """
        found = answers or self.desk.next(scorer.name, where)
        tally = progress.tally(self.desk.book.scores.answers([where]))
        left = len(self.desk.due(where))
        seconds = progress.time_left(self.desk.book.scores.acts([where], scorer.name), where, left) if left else None
        card = cards.card(self.desk, found) if found else None
        after = None if found else self.desk.part_after(where)
        values = {"card": card, "again": again or {}, "left": left, "asked": tally.asked, "after": after}
        return {
            "html": self._rendered("card.html", **values),
            "state": self._rendered("tally.html", tally=tally, seconds=seconds),
            "message": " ".join(filter(None, messages)),
            "trouble": trouble,
        }


def _where(request: Request) -> Where:
    question, part = (request.query_params.get(name, "") for name in ("question", "part"))
    if not question or not part:
        raise HTTPException(400, "Say which question and part.")
    return question, part


def _asset(request: Request) -> Response:
    if request.path_params["name"] not in _ASSETS:
        raise HTTPException(404, "Not found.")
    return FileResponse(_ASSETS[request.path_params["name"]])


# --- the server -------------------------------------------------------------------------------------------------------


def application(desk: Desk, site: Site, find: Find, title: str = "") -> ASGIApp:
    """Return the application, guarded.

    Parameters
    ----------
    desk : where the class is scored
    site : where browsers find it
    find : who is let in
    title : of the course
    """
    pages = Pages(desk, title)
    routes = [
        Route("/", pages.overview),
        Route("/score", pages.scoring),
        Route("/report", pages.report),
        Route("/act/{name}", pages.act, methods=["POST"]),
        Route("/{name}", _asset),
    ]
    handlers = dict.fromkeys((HTTPException, GradebookError), refusal)
    return Guard(Starlette(routes=routes, exception_handlers=handlers), site, find)


def listening(port: int, everywhere: bool = False) -> socket.socket:
    """Return a socket of the loopback interface, or of all interfaces.

    Raises
    ------
    GradingError
        If the port is taken.
    """
    both = everywhere and socket.has_dualstack_ipv6()
    host, family = ("" if everywhere else "127.0.0.1"), socket.AF_INET6 if both else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, dualstack_ipv6=both)
    except OSError as error:
        raise GradingError(
            f"Port {port} cannot be used: {error.strerror}. Name another one by --port; without it a free one, or that "
            "of --url, is taken."
        ) from None


def check_certificate(certificate: Path, private_key: Path | None) -> None:
    """Raise GradingError if a certificate cannot be used."""
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(certificate, private_key)
    except OSError as error:
        raise GradingError(f"The certificate {certificate} or its private key cannot be used: {error}.") from None


def serve(
    app: ASGIApp, listener: socket.socket, certificate: Path | None = None, private_key: Path | None = None
) -> None:
    """Serve until it is interrupted; by TLS if there is a certificate."""
    import uvicorn

    # No log of requests: what is read would be in it. Whom to believe about who asks, the site decides.
    config = uvicorn.Config(
        app,
        log_level="error",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        lifespan="off",
        ws="none",
        workers=1,
        ssl_certfile=certificate,
        ssl_keyfile=private_key,
    )
    uvicorn.Server(config).run(sockets=[listener])

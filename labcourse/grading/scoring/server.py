"""The scoring page as a server on the loopback interface: its pages, and the acts that they send."""

from __future__ import annotations

import socket
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING, Any

from labcourse import program
from labcourse.errors import GradebookError, GradingError
from labcourse.grading.gradebook import Act, Answer
from labcourse.grading.reports.result import points as shown_points
from labcourse.grading.reports.result import worth as in_points
from labcourse.grading.reports.templating import templates
from labcourse.grading.scoring import cards, documents, progress
from labcourse.grading.scoring.desk import Desk, Done, Where, key_of, seen, state
from labcourse.grading.scoring.guards import ACTOR, Guard, Scorer
from labcourse.grading.scoring.sent import BadRequest, Sheet, sent_sheet, sent_text, sent_where

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.types import ASGIApp

_MOST_POINTS = 1e6  # how many there are for an answer, the gradebook knows
_PAGE, _REPORTS = "scoring/page", "reports/templates"  # in labcourse/grading
_ASSETS = {
    "scoring.js": (_PAGE, "text/javascript"),
    "scoring.css": (_PAGE, "text/css"),
    "drawn.css": (_REPORTS, "text/css"),
}


@dataclass(frozen=True)
class Again:
    """What a scorer took back in one go, or could not give: to be shown as it was.

    Attributes
    ----------
    ticked : keys of answers
    remark, points : as they were typed
    """

    ticked: frozenset[str]
    remark: str
    points: str = ""


class Pages:
    """What the server answers.

    Parameters
    ----------
    desk : where the class is scored
    title : of the course
    """

    def __init__(self, desk: Desk, title: str) -> None:
        self.desk, self.title = desk, title
        self._again: dict[tuple[str, Where], dict[str, Again]] = {}

    # --- pages --------------------------------------------------------------------------------------------------------

    def overview(self, scorer: Scorer, query: Mapping[str, str]) -> str:
        """All parts, how far each is, and what waits for the instructor."""
        asked = [one for one in self.desk.book.scores.answers() if one.asked]
        held = {where: self.desk.book.scores.claimed(where) for where in {one.where for one in asked}}
        return self._page(
            "overview.html",
            scorer,
            rows=progress.rows(self.desk),
            asked=[
                (
                    one.where,
                    key_of(one.student, one.where),
                    self._label(one),
                    state(one),
                    held[one.where].get(one.student, ("",))[0],
                )
                for one in asked
            ],
        )

    def scoring(self, scorer: Scorer, query: Mapping[str, str]) -> str:
        """The page on which one part is scored; what changes on it comes by acts."""
        where = sent_where(query)
        question = self.desk.catalogue.marked.get(where[0])
        part = next((one for one in (question.parts if question else ()) if one.name == where[1]), None)
        item = self.desk.rubric.get(where)
        return self._page(
            "scoring.html",
            scorer,
            where=where,
            key=query.get("key", ""),
            title=question.title if question else "",
            prompt=part.prompt if part else "",
            look_for=item.look_for if item else "",
        )

    def _page(self, template: str, scorer: Scorer, **values: Any) -> str:
        return (
            templates(_PAGE)
            .get_template(template)
            .render(course=self.title, program=program.name(), scorer=scorer, points=shown_points, **values)
        )

    def _label(self, answer: Answer) -> str:
        return self.desk.label(answer.student, answer.where)

    # --- acts ---------------------------------------------------------------------------------------------------------

    def next(self, scorer: Scorer, sent: Mapping[str, Any]) -> dict[str, Any]:
        """The next answer; the one of a key if there is one."""
        where = sent_where(sent)
        key = sent_text(sent, "key")
        if sent_text(sent, "skip"):
            self.desk.put_off(scorer.name, where, sent_text(sent, "skip"))
        if not key:
            return self._reply(scorer, where)
        answer = self.desk.find(where, key)
        if answer is None:
            return self._reply(scorer, where, ["That answer is not there any more; here is the next one."])
        told = self.desk.renew(scorer.name, where, key)
        return self._reply(scorer, where, [told] if told else (), [answer], trouble=bool(told))

    def give(self, scorer: Scorer, sent: Mapping[str, Any]) -> dict[str, Any]:
        """Score what was shown and ticked."""
        where, sheet = sent_where(sent), sent_sheet(sent)
        level, points = sent.get("level"), sent.get("points")
        if (level is None) == (points is None):
            raise BadRequest("Give either a level or points.")
        if level is not None and not (type(level) is int and level in self.desk.levels.shares):
            raise BadRequest(f"There is no level {level!r}.")
        if points is not None and not (type(points) in (int, float) and abs(points) <= _MOST_POINTS):
            raise BadRequest("Points are a number, and not as large.")
        done = self.desk.give(scorer.name, where, sheet.picks, level=level, points=points, remark=sheet.remark)
        return self._after(scorer, where, sheet, done)

    def ask(self, scorer: Scorer, sent: Mapping[str, Any]) -> dict[str, Any]:
        """Leave what was shown and ticked to the instructor."""
        where, sheet = sent_where(sent), sent_sheet(sent)
        done = self.desk.ask(scorer.name, where, sheet.picks, sheet.remark)
        return self._after(scorer, where, sheet, done)

    def undo(self, scorer: Scorer, sent: Mapping[str, Any]) -> dict[str, Any]:
        """Take back what was done last, and show it again."""
        where = sent_where(sent)
        done = self.desk.undo(scorer.name)
        told = list(done.problems)
        again = None
        if done.acts:
            act = done.acts[0]
            told.append(
                "Taken back: {labels}, {question} {part}.".format(
                    labels=", ".join(self.desk.label(one.student, one.where) for one in done.acts),
                    question=act.question,
                    part=act.part,
                )
            )
            keys = {key_of(one.student, one.where) for one in done.acts}
            again_there = self._again.setdefault((scorer.name, act.where), {})
            again_there |= dict.fromkeys(keys, Again(frozenset(keys), act.remark))
            if act.where == where:
                there = [one for one in self.desk.due(where) if key_of(one.student, where) in keys]
                again = there or None
                if there:
                    self.desk.renew(scorer.name, where, key_of(there[0].student, where))
        return self._reply(scorer, where, told, again, trouble=bool(done.problems))

    def renew(self, scorer: Scorer, sent: Mapping[str, Any]) -> dict[str, Any]:
        """Hold on to what is shown."""
        return {"message": self.desk.renew(scorer.name, sent_where(sent), sent_text(sent, "key"))}

    def leave(self, scorer: Scorer, sent: Mapping[str, Any]) -> dict[str, Any]:
        """Let others have what is shown."""
        self.desk.book.scores.let_go(scorer.name)
        return {}

    def _after(self, scorer: Scorer, where: Where, sheet: Sheet, done: Done) -> dict[str, Any]:
        """What comes next; if nothing was written, the same answers as they are now, with all that was typed."""
        told = list(dict.fromkeys(done.problems))
        again = self._again.setdefault((scorer.name, where), {})
        for act in done.acts:
            again.pop(key_of(act.student, where), None)
        there = self._there(where, sheet) if not done.acts else []
        if there:
            ticked = frozenset(pick.key for pick in sheet.picks)
            again |= dict.fromkeys(ticked, Again(ticked, sheet.remark, sheet.points))
            now = {key_of(one.student, where): seen(one) for one in there}
            if any(now.get(pick.key, pick.seen) != pick.seen for pick in sheet.picks):
                told.append("Here it is as it is now: what you give replaces that, s leaves it.")
            return self._reply(scorer, where, told, there, trouble=True)
        if len(done.acts) > 1:
            told.insert(0, f"{len(done.acts)} answers in one go; u takes them all back.")
        elif done.acts:
            told.insert(0, self._said(done.acts[0]))
        return self._reply(scorer, where, told, trouble=bool(done.problems))

    def _there(self, where: Where, sheet: Sheet) -> list[Answer]:
        """Find what a page showed, if what was ticked is still there."""
        known = {key_of(one.student, where): one for one in self.desk.book.scores.answers([where])}
        ticked = any(pick.key in known for pick in sheet.picks)
        return [known[key] for key in sheet.shown if key in known] if ticked else []

    def _said(self, act: Act) -> str:
        label = self.desk.label(act.student, act.where)
        if act.asked:
            return f"{label}: left to the instructor."
        given = in_points(act.points or 0.0)
        if act.level is None:
            return f"{label}: {given}."
        return f"{label}: level {act.level}, {given}."

    def _reply(
        self,
        scorer: Scorer,
        where: Where,
        told: Sequence[str] = (),
        answers: Sequence[Answer] | None = None,
        trouble: bool = False,
    ) -> dict[str, Any]:
        """The next card, how far the part is, and what there is to say."""
        found = self.desk.next(scorer.name, where) if answers is None else answers
        card = cards.card(self.desk, found) if found else None
        before = self._again.get((scorer.name, where), {})
        again = next((before[one.key] for one in card.answers if one.key in before), None) if card else None
        tally = progress.tally(self.desk.book.scores.answers([where]))
        left = len(self.desk.due(where))
        time = progress.time_left(self.desk.book.scores.acts([where], scorer.name), where, left)
        html = (
            templates(_PAGE)
            .get_template("card.html")
            .render(
                card=card,
                again=again,
                points=shown_points,
                left=left,
                asked=tally.asked,
                after=None if card else self.desk.part_after(where),
            )
        )
        state = (
            templates(_PAGE)
            .get_template("tally.html")
            .render(tally=tally, left=left, time=progress.in_words(time) if left else "")
        )
        return {"html": html, "state": state, "message": " ".join(told), "trouble": trouble}


# --- the server -------------------------------------------------------------------------------------------------------


def application(desk: Desk, scorers: Sequence[Scorer], port: int, title: str = "") -> ASGIApp:
    """The application, guarded.

    Parameters
    ----------
    desk : where the class is scored
    scorers : who is let in
    port : where the server listens
    title : of the course
    """
    from starlette.applications import Starlette
    from starlette.routing import Route

    pages = Pages(desk, title)
    routes = [
        Route("/", _shown(pages.overview)),
        Route("/score", _shown(pages.scoring)),
        Route("/report", documents.endpoint(desk)),
        *(Route(f"/{name}", _asset(name, *where)) for name, where in _ASSETS.items()),
        *(
            Route(f"/act/{act.__name__}", _done(act), methods=["POST"])
            for act in (pages.next, pages.give, pages.ask, pages.undo, pages.renew, pages.leave)
        ),
    ]
    return Guard(Starlette(routes=routes), scorers, port)


def listening(port: int) -> socket.socket:
    """A socket of the loopback interface.

    Raises
    ------
    GradingError
        If the port is taken.
    """
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", port))
    except OSError as error:
        listener.close()
        raise GradingError(
            f"Port {port} cannot be used: {error.strerror}. Leave --port out, and a free one is taken."
        ) from None
    return listener


def serve(app: ASGIApp, listener: socket.socket) -> None:
    """Serve until it is interrupted."""
    import uvicorn

    # No log of requests: their addresses would be in it.
    config = uvicorn.Config(
        app, log_level="warning", access_log=False, server_header=False, lifespan="off", ws="none", workers=1
    )
    uvicorn.Server(config).run(sockets=[listener])


def _shown(page: Callable[[Scorer, Mapping[str, str]], str]) -> Callable[[Request], Response]:
    def endpoint(request: Request) -> Response:
        from starlette.responses import HTMLResponse, PlainTextResponse

        try:
            return HTMLResponse(page(request.scope[ACTOR], request.query_params))
        except BadRequest as error:
            return PlainTextResponse(str(error), 400)

    return endpoint


def _done(act: Callable[[Scorer, Mapping[str, Any]], dict[str, Any]]) -> Callable[[Request], Any]:
    async def endpoint(request: Request) -> Response:
        from starlette.concurrency import run_in_threadpool
        from starlette.responses import JSONResponse

        try:
            sent = await request.json()
            if not isinstance(sent, dict):
                raise BadRequest("An act is an object.")
            return JSONResponse(await run_in_threadpool(act, request.scope[ACTOR], sent))
        except (ValueError, RecursionError):
            return JSONResponse({"problem": "That is no JSON. Nothing was done."}, 400)
        except BadRequest as error:
            return JSONResponse({"problem": str(error)}, 400)
        except GradebookError as error:
            return JSONResponse({"problem": str(error)}, 500)

    return endpoint


def _asset(name: str, folder: str, kind: str) -> Callable[[Request], Response]:
    def endpoint(request: Request) -> Response:
        from starlette.responses import Response

        content = resources.files("labcourse.grading").joinpath(folder, name).read_text(encoding="utf-8")
        return Response(content, media_type=kind)

    return endpoint

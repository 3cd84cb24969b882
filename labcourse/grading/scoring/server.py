"""The scoring page as an application: its pages, and the acts that they send."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote, urlencode

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp

from labcourse import program
from labcourse.errors import GradebookError
from labcourse.grading.accounts import worth as in_points
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Act, Answer, StudentRecord
from labcourse.grading.reports import feedback
from labcourse.grading.reports.grades import EXECUTED_FOLDER
from labcourse.grading.reports.result import result_in
from labcourse.grading.reports.templating import templates
from labcourse.grading.scoring import cards
from labcourse.grading.scoring.desk import Desk, Done, Pick, key_of, link, seen, state, tally
from labcourse.grading.scoring.guards import ACTOR, Find, Guard, Scorer, Site, refusal
from labcourse.messages import listed, number_of
from labcourse.problems import Where
from labcourse.student_id import caseless

LONGEST_REMARK = 2000  #: characters; a page
MOST_ANSWERS = 50  #: in one act, and shown at a time
#: Of a student's PDF, which nothing here opens. "sandbox" allows it nothing: no script, no form, an origin of its own.
REPORT_POLICY = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; sandbox"
#: Of a page that stands as a file elsewhere, with its style inside: nothing else on it may be styled or run.
COPY_POLICY = (
    "default-src 'none'; style-src 'sha256-{}'; img-src data:; "
    "form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
)
_MOST_POINTS = 1e6  # the gradebook knows how many there are for an answer
_FOLDER = Path(__file__).parents[1]
_ASSETS = {name: _FOLDER / "scoring/page" / name for name in ("acts.js", "answer.js", "scoring.js", "scoring.css")}
_ASSETS["drawn.css"] = _FOLDER / "reports/templates/drawn.css"
_Text = Annotated[str, Field(max_length=LONGEST_REMARK)]
ClassPage = Callable[[Callable[[str, str, str], str]], str]  #: from links to answers, the page of the class
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
    seen : with a key, what the page showed of the answer
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
    seen: _Text = ""

    @property
    def where(self) -> Where:
        """Question and part."""
        return self.question, self.part


class Pages:
    """What the server answers.

    Parameters
    ----------
    desk : where the class is scored
    course : its course
    class_page : the page of the class
    results : the folder of results; None if it is not known
    """

    def __init__(self, desk: Desk, course: Course, class_page: ClassPage, results: Path | None = None) -> None:
        self.desk, self.course, self._class_page, self._results = desk, course, class_page, results
        acts = (self.next, self.give, self.ask, self.undo, self.renew, self.leave)
        self._acts = {act.__name__: act for act in (*acts, self.decide, self.note, self.same, self.back)}

    # --- pages --------------------------------------------------------------------------------------------------------

    def overview(self, request: Request) -> Response:
        """Show all parts, how far each is, and what waits for the instructor."""
        scores = self.desk.book.scores
        by_part: dict[Where, list[Answer]] = {}
        for answer in self.desk.answers():
            by_part.setdefault(answer.where, []).append(answer)
        rows, asked = [], []
        for where in self.desk.in_order(list(by_part)):
            question, held = self.desk.catalogue.marked.get(where[0]), scores.claimed(where)
            readers = sorted({actor for actor, _until in held.values()})
            rows.append((where, question.title if question else "", tally(by_part[where]), readers))
            asked += [(one, held.get(one.student, ("",))[0]) for one in by_part[where] if one.referred]
        return self._page("overview.html", request, rows=rows, asked=asked)

    def scoring(self, request: Request) -> Response:
        """Show the page on which one part is scored; what changes on it comes by acts."""
        where = _where(request)
        key = request.query_params.get("key", "")
        return self._page("scoring.html", request, where=where, key=key, **self._asked(where))

    def _asked(self, where: Where) -> dict[str, Any]:
        """Return the question and the part of an answer, and what to look for."""
        question, item = self.desk.catalogue.marked.get(where[0]), self.desk.rubric.get(where)
        part = next((one for one in (question.parts if question else ()) if one.name == where[1]), None)
        return {"question": question, "part": part, "item": item}

    def _page(self, template: str, request: Request, **values: Any) -> Response:
        about = {"course": self.course.title, "program": program.name(), "scorer": request.scope[ACTOR]}
        return HTMLResponse(self._rendered(template, **about, **values))

    def _rendered(self, template: str, **values: Any) -> str:
        helpers: dict[str, Any] = {"key_of": key_of, "label": self.desk.label, "link": link, "state": state}
        values |= helpers | {"names": self.desk.names}
        return templates("scoring/page").get_template(template).render(**values)

    # --- pages by name ------------------------------------------------------------------------------------------------

    def class_page(self, _request: Request) -> Response:
        """Show the class, with links to students and answers."""
        return _copy(self._class_page(link))

    def student(self, request: Request) -> Response:
        """Show an instructor's copy of a student's feedback; if not exactly one student fits, a list of those who do.

        Raises HTTPException (404) if nothing of the student has been graded.
        """
        wanted = request.query_params.get("id", "").strip()
        found = self._look_up(wanted)
        if len(found) != 1:
            return self._page("by_name.html", request, students=found, wanted=wanted)
        (about,) = found
        graded = self.desk.book.current(about.student)
        if graded is None:
            raise HTTPException(404, f"Nothing of {about.student!r} has been graded.")
        result, executed = result_in(self.desk.book, self.course, graded, about), self._executed_links(about.student)
        return _copy(feedback.page(result, self.course, link, executed))

    def executed(self, request: Request) -> Response:
        """Show what a student's notebook showed when it was run again. Raises HTTPException (404) if it was not."""
        found = self._look_up(request.query_params.get("id", ""))
        pages = self._executed(found[0].student) if len(found) == 1 else {}
        if (page := pages.get(request.query_params.get("notebook", ""))) is None:
            raise HTTPException(404, f"There is no such page. {program.name()} rerun writes it.")
        return _copy(page.read_text(encoding="utf-8"))

    def _executed(self, student: str) -> dict[str, Path]:
        """Return notebook without ending → the page of what it showed when it was run again."""
        pages = () if self._results is None else (self._results / student / EXECUTED_FOLDER).glob("*.html")
        return {page.stem: page for page in sorted(pages)}

    def _executed_links(self, student: str) -> dict[str, str]:
        """Return notebook without ending → address of what it showed when it was run again."""
        return {name: f"executed?{urlencode({'id': student, 'notebook': name})}" for name in self._executed(student)}

    def answer(self, request: Request) -> Response:
        """Show any answer of a student, why it has its mark, and what a person can do about it. Nothing is claimed.

        Raises HTTPException: 400 without question or part, 404 without the answer.
        """
        where, wanted = _where(request), request.query_params.get("student", "")
        about = next((one for one in self.desk.book.students() if caseless(one.student) == caseless(wanted)), None)
        key = "" if about is None else key_of(about.student, where)
        answer = self.desk.find(where, key)
        if about is None or answer is None:
            raise HTTPException(404, f"There is no answer of {wanted!r} to {where[0]}, {where[1]}.")
        card = self._card(request.scope[ACTOR], answer) | {"executed": self._executed_links(about.student)}
        return self._page("answer.html", request, where=where, key=key, about=about, **self._asked(where), **card)

    def _look_up(self, wanted: str) -> list[StudentRecord]:
        """Return the student with an ID; without one, those with the text in ID or name."""
        everybody, text = self.desk.book.students(), caseless(wanted)
        same = [one for one in everybody if caseless(one.student) == text]
        return same or [one for one in everybody if text in caseless(f"{one.student}\n{one.name}")]

    def _card(self, scorer: Scorer, answer: Answer, again: Sent | None = None) -> dict[str, Any]:
        """Return what the card of an answer that was opened by name needs, with what was typed before."""
        same = self.desk.alike(answer)
        return {
            "card": cards.opened(self.desk, self.course, answer),
            "alike": cards.alike(self.desk, same[:MOST_ANSWERS]),
            "count": len(same),
            "last": self.desk.last_acts(scorer.name),
            "again": again or {"remark": "", "points": None},
        }

    def report(self, request: Request) -> Response:
        """Send the PDF that belongs to an answer. It is found by the answer, never by a name or a path.

        Raises HTTPException: 400 without question or part, 404 without the answer or its PDF.
        """
        answer = self.desk.find(_where(request), request.query_params.get("key", ""))
        graded = self.desk.book.current(answer.student) if answer is not None else None
        about = cards.report_of(self.desk, graded.run, answer.where) if answer and graded else None
        found = self.desk.book.contents(answer.student, [about.digest]) if answer and about else {}
        if about and (content := found.get(about.digest)) is not None:
            headers = {
                "content-security-policy": REPORT_POLICY,
                "content-disposition": f"inline; filename*=UTF-8''{quote(about.name)}",
            }
            return Response(content, media_type="application/pdf", headers=headers)
        raise HTTPException(404, "There is no such report any more: open the answer again.")

    async def act(self, request: Request) -> Response:
        """Do what a page asks for, and respond with what it shows next.

        Raises HTTPException: 404 if there is no such act, or the answer is gone; 400 if what was sent is not valid.
        """
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
        """Claim the next answer, or that of a key, and show it; that of a key also if another scorer has it."""
        if sent.skip:
            self.desk.put_off(scorer.name, sent.skip)
        if not sent.key:
            return self._reply(scorer, sent.where)
        answer = self.desk.find(sent.where, sent.key)
        if answer is None:
            return self._reply(scorer, sent.where, ["That answer is not there any more; here is the next one."])
        problem = self.desk.hold(scorer.name, sent.where, sent.key)
        return self._reply(scorer, sent.where, [problem], [answer], trouble=bool(problem))

    def give(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Score what was shown and ticked.

        Raises HTTPException (400) if nothing is ticked, or unless there are either points or a level that exists.
        """
        if not sent.answers or (sent.level is None) == (sent.points is None):
            raise HTTPException(400, "Tick at least one answer, and give either a level or points.")
        if sent.level is not None and sent.level not in self.desk.levels.shares:
            raise HTTPException(400, f"There is no level {sent.level}.")
        done = self.desk.give(
            scorer.name, sent.where, sent.answers, level=sent.level, points=sent.points, remark=sent.remark.strip()
        )
        return self._after(scorer, sent, done)

    def ask(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Leave what was shown and ticked to the instructor. Raises HTTPException (400) if nothing is ticked."""
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
            self.desk.hold(scorer.name, sent.where, key_of(answers[0].student, sent.where))
        return self._reply(scorer, sent.where, messages, answers, again, trouble=bool(done.problems))

    def decide(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Give points to an answer that was opened by name.

        Raises HTTPException: 400 unless it is one answer, with points and a remark; 404 if the answer is gone.
        """
        if len(sent.answers) != 1 or sent.points is None or not sent.remark.strip():
            raise HTTPException(400, "Give points to one answer, with a remark: it says to the student why.")
        done = self.desk.give(scorer.name, sent.where, sent.answers, points=sent.points, remark=sent.remark.strip())
        given = [f"Given: {in_points(act.points or 0.0)}." for act in done.acts]
        return self._opened(scorer, sent, sent.answers[0].key, given or done.problems, None if given else sent)

    def note(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Write a comment on an answer that was opened by name, and leave the points; nothing if it has changed.

        Raises HTTPException: 400 unless it is one answer, with a remark; 404 if the answer is gone.
        """
        remark = sent.remark.strip()
        if len(sent.answers) != 1 or not remark:
            raise HTTPException(400, "Write a remark: it is the note to the student.")
        answer = self.desk.find(sent.where, sent.answers[0].key)
        if answer is None or seen(answer) != sent.answers[0].seen:
            problems = [] if answer is None else [self.desk.conflict(answer)]
            return self._opened(scorer, sent, sent.answers[0].key, problems, again=sent)
        self.desk.book.comment(answer.student, remark, scorer.name, *answer.where)
        return self._opened(scorer, sent, sent.answers[0].key, ["Noted. The points are as they were."])

    def same(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Give other answers, which were shown and ticked, what was decided for one."""
        if not sent.answers:
            raise HTTPException(400, "Tick at least one answer.")
        done = self.desk.give_same(scorer.name, sent.where, Pick(sent.key, sent.seen), sent.answers)
        given = f"The same was given to {number_of(len(done.acts), 'answer')}; u takes all of it back."
        messages = [given, *done.problems] if done.acts else done.problems
        return self._opened(scorer, sent, sent.key, messages, trouble=bool(done.problems))

    def back(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Take back what was done last, and show the answer that was opened by name as it is then."""
        done = self.desk.undo(scorer.name)
        labels = [f"{self.desk.label(act.student, act.where)} ({' '.join(act.where)})" for act in done.acts]
        messages = [f"Taken back: {listed(labels, 3)}."] if done.acts else []
        return self._opened(scorer, sent, sent.key, [*messages, *done.problems], trouble=bool(done.problems))

    def _opened(
        self,
        scorer: Scorer,
        sent: Sent,
        key: str,
        messages: Sequence[str],
        again: Sent | None = None,
        trouble: bool = False,
    ) -> dict[str, Any]:
        """Return the card of an answer that was opened by name, and messages; with what was typed if that failed.

        Raises HTTPException (404) if there is no such answer.
        """
        answer = self.desk.find(sent.where, key)
        if answer is None:
            raise HTTPException(404, " ".join([*messages, "This answer is not there any more."]))
        card, failed = self._card(scorer, answer, again), trouble or again is not None
        if card["count"] and not failed:
            messages = [*messages, "Below are answers to which the machine gave the same for the same reason."]
        message, html = " ".join(messages), self._rendered("answer_card.html", **card)
        return {"html": html, "state": "", "message": message, "trouble": failed}

    def renew(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Extend the claim of what is shown; return a message if that fails."""
        return {"message": self.desk.hold(scorer.name, sent.where, sent.key) or ""}

    def leave(self, scorer: Scorer, sent: Sent) -> dict[str, Any]:
        """Let others have what is shown."""
        self.desk.book.scores.let_go(scorer.name)
        return {}

    def _after(self, scorer: Scorer, sent: Sent, done: Done) -> dict[str, Any]:
        """Show what comes next; if nothing was written, the same answers as they are now, with all that was typed."""
        problems = [*dict.fromkeys(done.problems)]
        if done.acts:
            return self._reply(scorer, sent.where, [self._given(done.acts), *problems], trouble=bool(problems))
        ticked = {pick.key: pick.seen for pick in sent.answers}
        found = (self.desk.find(sent.where, key) for key in sent.shown or ticked)
        now = {key_of(one.student, one.where): one for one in found if one is not None}
        if not ticked.keys() & now.keys():
            return self._reply(scorer, sent.where, problems, trouble=bool(problems))
        if any(seen(now[key]) != ticked[key] for key in ticked.keys() & now.keys()):
            problems.append("Here it is as it is now: what you give replaces that, s leaves it.")
        again = {"ticked": set(ticked), "remark": sent.remark, "points": sent.points}
        return self._reply(scorer, sent.where, problems, list(now.values()), again, trouble=True)

    def _given(self, acts: Sequence[Act]) -> str:
        """Say what was given to one answer, or to how many."""
        if len(acts) > 1:
            return f"{len(acts)} answers in one go; u takes them all back."
        (act,) = acts
        level = "" if act.level is None else f"level {act.level}, "
        given = "left to the instructor" if act.referred else f"{level}{in_points(act.points or 0.0)}"
        return f"{self.desk.label(act.student, act.where)}: {given}."

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
        so_far = tally(self.desk.answers([where]))
        card = cards.card(self.desk, found) if found else None
        after = None if found else self.desk.part_after(where)
        left = len(self.desk.due(where))
        values = {"card": card, "again": again or {}, "left": left, "asked": so_far.referred, "after": after}
        return {
            "html": self._rendered("card.html", **values),
            "state": self._rendered("tally.html", tally=so_far),
            "message": " ".join(filter(None, messages)),
            "trouble": trouble,
        }


def _copy(page: str) -> Response:
    """Return a page that has its style inside, which is allowed by its digest."""
    style = re.search(r"<style>(.*?)</style>", page, re.DOTALL)
    digest = hashlib.sha256((style[1] if style else "").encode()).digest()
    return HTMLResponse(
        page, headers={"content-security-policy": COPY_POLICY.format(base64.b64encode(digest).decode())}
    )


def _where(request: Request) -> Where:
    """Return question and part in a request's address. Raises HTTPException (400) without one of them."""
    question, part = (request.query_params.get(name, "") for name in ("question", "part"))
    if not question or not part:
        raise HTTPException(400, "Say which question and part.")
    return question, part


def _asset(request: Request) -> Response:
    if request.path_params["name"] not in _ASSETS:
        raise HTTPException(404, "Not found.")
    return FileResponse(_ASSETS[request.path_params["name"]])


def application(
    desk: Desk, site: Site, find: Find, course: Course, class_page: ClassPage, results: Path | None = None
) -> ASGIApp:
    """Return the application, guarded.

    Parameters
    ----------
    desk : where the class is scored
    site : where browsers find it
    find : who is let in
    course : its course
    class_page : the page of the class
    results : the folder of results; None if it is not known
    """
    pages = Pages(desk, course, class_page, results)
    routes = [
        Route("/", pages.overview),
        Route("/score", pages.scoring),
        Route("/report", pages.report),
        Route("/class", pages.class_page),
        Route("/student", pages.student),
        Route("/answer", pages.answer),
        Route("/executed", pages.executed),
        Route("/act/{name}", pages.act, methods=["POST"]),
        Route("/{name}", _asset),
    ]
    handlers = dict.fromkeys((HTTPException, GradebookError), refusal)
    return Guard(Starlette(routes=routes, exception_handlers=handlers), site, find)

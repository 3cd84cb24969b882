"""A report as it was handed in, as PDF, for the person who scores it: a stranger's file, which nothing here opens.

It is found by the answer that is scored, never by a name or a path. It goes to the browser with a policy of its own:
it may load nothing, run no script, and has no origin. Whatever a viewer of PDFs makes of it, it is not this page.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from labcourse.answers.report_files import PDF, ReportFile
from labcourse.grading.graded_run import facts_of
from labcourse.grading.scoring.cards import report_of
from labcourse.grading.scoring.desk import Desk
from labcourse.grading.scoring.sent import BadRequest, sent_text, sent_where

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response

#: "sandbox" without anything allowed: no script, no form, no pop-up, an origin that nothing else has.
POLICY = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; sandbox"


def found(desk: Desk, question: str, part: str, key: str) -> tuple[ReportFile, bytes] | None:
    """The PDF that belongs to an answer, as it counts now; None if there is no such answer, or no PDF.

    Parameters
    ----------
    desk : where the class is scored
    question, part, key : of the answer, as a page has them
    """
    answer = desk.find((question, part), key)
    graded = desk.book.current(answer.student) if answer is not None else None
    if answer is None or graded is None:
        return None
    about = report_of(desk, graded.run, answer.where)
    if about is None:
        return None
    # Of a pair, what only the partner handed in is kept as theirs.
    for student in dict.fromkeys((answer.student, facts_of(graded.run).bench_of or answer.student)):
        content = desk.book.content(student, about.name, about.digest)
        if content is not None:
            return about, content
    return None


def endpoint(desk: Desk) -> Callable[[Request], Response]:
    """What answers a request for a report."""

    def answered(request: Request) -> Response:
        from starlette.responses import PlainTextResponse, Response

        try:
            question, part = sent_where(request.query_params)
            there = found(desk, question, part, sent_text(request.query_params, "key"))
        except BadRequest as error:
            return PlainTextResponse(str(error), 400)
        if there is None:
            return PlainTextResponse("There is no such report any more: open the answer again.", 404)
        about, content = there
        headers = {
            "content-security-policy": POLICY,
            "x-content-type-options": "nosniff",
            # Its name is the course's, and not one that a student chose.
            "content-disposition": f'inline; filename="{_plain(about.name)}"',
        }
        return Response(content, media_type="application/pdf", headers=headers)

    return answered


def _plain(name: str) -> str:
    """A file name of letters that every header takes."""
    return "".join(sign for sign in name if sign.isascii() and (sign.isalnum() or sign in "_-.")) or f"report{PDF}"

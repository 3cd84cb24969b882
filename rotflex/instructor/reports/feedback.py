"""The page that a student gets back: one HTML file, no scripts, nothing loaded from anywhere, all text escaped."""

from __future__ import annotations

from itertools import groupby

from rotflex.courseware.catalogue import Catalogue
from rotflex.instructor.reports.result import Result
from rotflex.instructor.reports.safe_text import no_escapes
from rotflex.instructor.verdicts import Status

#: Style classes; the words are there as well, for who cannot see colours.
_LOOK = {
    Status.RIGHT: "right",
    Status.FOLLOW_THROUGH: "follow",
    Status.PARTLY: "partly",
    Status.WRONG: "wrong",
    Status.MISSING: "missing",
    Status.FOR_A_PERSON: "person",
    Status.BY_A_PERSON: "person",
}


def points(number: float) -> str:
    """Points for people: "2", "1.5"."""
    return f"{round(number, 2):g}"


def page(result: Result, catalogue: Catalogue) -> str:
    """The feedback for a student as HTML; questions bear the catalogue's titles."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("rotflex.instructor.reports"),
        autoescape=True,
        finalize=_plain,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    questions = [
        (number, catalogue.find(number).title, list(marks))
        for number, marks in groupby(result.marks, key=lambda mark: mark.question)
    ]
    template = environment.get_template("feedback.html")
    return template.render(result=result, questions=questions, points=points, look=_LOOK) + "\n"


def _plain(value: object) -> object:
    """Whatever is put into the page, without what would turn the direction of the words that come after it."""
    return no_escapes(value) if isinstance(value, str) else value

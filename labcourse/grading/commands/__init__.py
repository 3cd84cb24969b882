"""The instructor's commands. ``rotflex.cli`` adds them where this package is.

=============  ==========================================================================
``course``     release, notebooks, check-course
``grade``      grade; doctor, which ``rotflex.cli`` has, for it looks at benches as well
``marks``      regrade, report, mark, comment, history, roster
``score``      score: the page on which persons score, and scores by a table
``day``        class, publish, request, answer, requests
``outcomes``   outcomes, sheets
``export``     export: marks into other platforms' files
``person``     forget, copy: a person's data is erased, or given to them
``options``    what several of them take, their exit codes, and how a gradebook is opened
=============  ==========================================================================
"""

from __future__ import annotations

import typer

from labcourse.grading.commands import course, day, export, grade, marks, outcomes, person, score

_COMMANDS = (
    *(course.release, course.notebooks, course.check_course),
    grade.grade,
    *(marks.regrade, marks.report, marks.mark, marks.comment, marks.history, marks.roster),
    score.score,
    *(day.publish, day.request, day.answer, day.requests),
    *(outcomes.outcomes, outcomes.sheets),
    export.export,
    *(person.forget, person.copy),
)


def register(app: typer.Typer) -> None:
    """Add the instructor's commands to the application."""
    for command in _COMMANDS:
        app.command()(command)
    app.command("class")(day.at_a_glance)

"""The instructor's commands. ``rotflex.cli`` adds them where this package is.

===========  ==========================================================================
``course``   release, notebooks, check-course
``grade``    grade; doctor, which ``rotflex.cli`` has, for it looks at benches as well
``marks``    regrade, report, mark, comment, history, roster
``options``  what several of them take, their exit codes, and how a gradebook is opened
===========  ==========================================================================
"""

from __future__ import annotations

import typer

from rotflex.instructor.commands import course, grade, marks

_COMMANDS = (
    *(course.release, course.notebooks, course.check_course),
    grade.grade,
    *(marks.regrade, marks.report, marks.mark, marks.comment, marks.history, marks.roster),
)


def register(app: typer.Typer) -> None:
    """Add the instructor's commands to the application."""
    for command in _COMMANDS:
        app.command()(command)

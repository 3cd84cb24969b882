"""The instructor's commands, in the order of use. The command line adds them where this package is.

=============  ===========================================================================
``course``     new, make-notebooks, check-course, release
``grade``      doctor, grade
``marks``      roster, regrade, report, mark, comment, history
``score``      score: the page on which persons score, and scores by a table
``day``        status, publish; requests add, list, answer
``outcomes``   outcomes report, outcomes sheets
``export``     export: marks into other platforms' files
``person``     person copy, person erase: a person's data is given to them, or erased
``options``    what several of them take, their exit codes, and how a gradebook is opened
=============  ===========================================================================
"""

from __future__ import annotations

import typer

from labcourse.grading.commands import course, day, export, grade, marks, outcomes, person, score

_PANELS = {  # groups come after commands
    "Course": (course.new, course.make_notebooks, course.check_course, course.release),
    "Class": (
        *(grade.doctor, marks.roster, grade.grade, day.status, score.score, marks.regrade, marks.report, day.publish),
        *(export.export, outcomes.outcomes),
    ),
    "Person": (marks.mark, marks.comment, marks.history, day.requests, person.person),
}


def register(app: typer.Typer) -> None:
    """Add the instructor's commands to the application."""
    for panel, commands in _PANELS.items():
        for command in commands:
            if isinstance(command, typer.Typer):
                app.add_typer(command, rich_help_panel=panel)
            else:
                app.command(rich_help_panel=panel)(command)

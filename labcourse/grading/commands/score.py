"""The command with which persons score what they must read: a page in the browser, or a table for a way without one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labcourse import program
from labcourse.errors import GradingError
from labcourse.grading import course as courses
from labcourse.grading.commands.options import SOME_TROUBLE, CourseFolder, Force, Marks, open_existing
from labcourse.messages import plural
from labcourse.safe_text import say

if TYPE_CHECKING:
    from labcourse.grading.scoring.desk import Desk


def score(
    marks: Marks,
    course: CourseFolder = None,
    by: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Your name, for the record; once for each person who scores."),
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page; 0: any free port.")] = 0,
    show_names: Annotated[bool, typer.Option("--names", help="Show students' names instead of numbers.")] = False,
    browser: Annotated[bool, typer.Option(help="Open a browser for the first scorer.")] = True,
    write: Annotated[Path | None, typer.Option(help="Only write all answers into this table (.xlsx or .csv).")] = None,
    read: Annotated[
        Path | None, typer.Option(help="Read scores from this table, written by --write.", dir_okay=False)
    ] = None,
    force: Force = False,
) -> None:
    """Score the answers that a person must read: in a browser, or in a table (--write, --read).

    Exit code: 0 all well, 1 some rows of a table were not read, 2 nothing done.
    """
    from labcourse.grading.scoring import rubric
    from labcourse.grading.scoring.desk import Desk

    found = courses.find(course)
    with open_existing(marks) as book:
        items = rubric.read(found.folder, found.catalogue)
        desk = Desk(book, found.catalogue, items, found.settings.levels, show_names)
        if write is not None and read is not None:
            raise GradingError("Give --write or --read, and not both at once.")
        if write is not None:
            _write(desk, write, force)
        elif read is not None:
            _read(desk, read, by or [])
        else:
            _serve(desk, by or [], port, browser, found.title)


def _serve(desk: Desk, names: list[str], port: int, browser: bool, title: str) -> None:
    import webbrowser

    from labcourse.grading.scoring import server
    from labcourse.grading.scoring.guards import Scorer

    given = [name.strip() for name in names]
    if not given or not all(given):
        raise GradingError("Say who scores: --by NAME, once for each. The gradebook keeps who gave which points.")
    if len({name.casefold() for name in given}) < len(given):
        raise GradingError("Two of those who score have one name; the gradebook could not tell them apart.")
    scorers = [Scorer(name) for name in given]
    with server.listening(port) as listener:
        listener.listen()
        there = listener.getsockname()[1]
        for one in scorers:
            typer.echo(f"{one.name}: {one.address(there)}")
        typer.echo("Each opens their own address, in a browser on this computer. Ctrl-C ends it; nothing is lost.")
        if browser:
            webbrowser.open(scorers[0].address(there))
        server.serve(server.application(desk, scorers, there, title), listener)


def _write(desk: Desk, path: Path, force: bool) -> None:
    from labcourse.grading.scoring import tables

    if path.exists() and not force:
        raise GradingError(
            f"{path} is there already, and scores may stand in it: take them by --read first, name another file, "
            "or add --force to write over it."
        )
    count, asked = tables.write(desk, path)
    typer.echo(
        f"{plural(count, '{count} answer', '{count} answers')}: {path}. "
        f"{program.name()} score --read takes it in again."
    )
    if asked:
        typer.echo(
            f"Of {plural(asked, '{count} answer', '{count} answers')} the instructor is asked: the column "
            "“state” says by whom, and what."
        )


def _read(desk: Desk, path: Path, by: list[str]) -> None:
    from labcourse.grading.scoring import tables

    if len(by) != 1 or not by[0].strip():
        raise GradingError("Say who scored in the table: --by NAME, once.")
    taken = tables.read(desk, path, by[0].strip())
    typer.echo(str(taken))
    say(*taken.replaced)
    say(*taken.problems, err=True)
    if taken.changed:
        typer.echo(f"Pages and tables are as they were until {program.name()} report writes them anew.")
    if taken.problems:
        raise typer.Exit(SOME_TROUBLE)

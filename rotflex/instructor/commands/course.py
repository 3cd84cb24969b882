"""Commands about a course: release, notebooks, check-course."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotflex.courseware import messages
from rotflex.courseware.messages import _, plural
from rotflex.instructor import course as courses
from rotflex.instructor.commands.options import SOME_TROUBLE, CourseFolder


def release(
    out: Annotated[Path, typer.Argument(help="Folder for the release; made if needed.", file_okay=False)],
    course: CourseFolder = None,
    with_data: Annotated[bool, typer.Option("--with-data", help="Hand out the sample recordings, too.")] = False,
    replace: Annotated[bool, typer.Option("--replace", help="Delete an earlier release in OUT.")] = False,
    keep: Annotated[
        bool, typer.Option("--keep/--no-keep", help="Keep the zip beside the course, for work begun under it.")
    ] = True,
) -> None:
    """Make the students' folder and zip: no solutions, no key, none of the instructor's modules."""
    from rotflex.instructor.release import releases
    from rotflex.instructor.release.student_course import release as make

    found = courses.find(course)
    made = make(found, out, with_data, replace)
    _tell_translations(found)
    count = plural(len(made.notebooks), "{count} notebook", "{count} notebooks")
    typer.echo(f"{count}: {', '.join(made.notebooks)}")
    typer.echo(f"{made.folder}\n{made.archive}")
    if keep:
        typer.echo(_("Release {name}, kept as {file}").format(name=made.id, file=releases.keep(found, made)))
    else:
        typer.echo(
            _("Release {name}, not kept: what is done with it is run with the course as it is.").format(name=made.id)
        )


def notebooks(course: CourseFolder = None) -> None:
    """Derive the student notebooks in notebooks/ from the course's anew."""
    from rotflex.instructor.release.student_course import write_notebooks

    found = courses.find(course)
    for path in write_notebooks(found):
        typer.echo(str(path))
    _tell_translations(found)


def _tell_translations(course: courses.Course) -> None:
    """How far the notebooks are in the course's language, where it has translations."""
    from rotflex.instructor.translation import po_files, translated

    language = course.settings.language
    if language not in messages.languages():
        typer.echo(
            _("There are no messages in the language {language}: they are in English.").format(language=language)
        )
    if not po_files.folder(course.folder, language).is_dir():
        if language != messages.ENGLISH:
            typer.echo(_("There are no notebooks in the language {language}.").format(language=language))
        return
    there = translated.of_course(course.notebooks, course.folder, language)
    done, cells = sum(one.done for one in there), sum(one.cells for one in there)
    typer.echo(
        _("Language {language}: {done} of {cells} text cells are translated; the others are as in the source.").format(
            language=language, done=done, cells=cells
        )
    )
    for one in there:
        if one.done < one.cells:
            typer.echo(f"    {one}")
        for fault in one.refused:
            typer.echo(f"        {fault}", err=True)


def check_course(
    course: CourseFolder = None,
    run: Annotated[
        bool, typer.Option("--run/--no-run", help="Run the notebooks with solutions, and mark what they answer.")
    ] = True,
) -> None:
    """Say what is missing in a course, or contradicts itself: questions, key, cells, numbers in texts.

    Exit code: 0 everything fits, 1 something does not.
    """
    from rotflex.instructor.course_check import check

    found = courses.find(course)
    count = 0
    for finding in check(found, run):
        count += 1
        typer.echo(str(finding))
    asked = len(found.catalogue.everything)
    if count:
        typer.echo(_("{count} found.").format(count=count), err=True)
        raise typer.Exit(SOME_TROUBLE)
    typer.echo(
        _("{asked} questions, tables and reports in {notebooks}: everything fits.").format(
            asked=asked, notebooks=plural(len(found.notebooks), "{count} notebook", "{count} notebooks")
        )
    )

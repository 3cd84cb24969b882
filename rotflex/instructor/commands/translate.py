"""The command for who translates a course's notebooks: translate."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotflex.courseware.messages import _
from rotflex.instructor import course as courses
from rotflex.instructor.commands.options import SOME_TROUBLE, CourseFolder


def translate(
    language: Annotated[str, typer.Argument(help="As de, or pt_BR.")],
    course: CourseFolder = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Write the notebooks in that language into this folder, to be looked at.", file_okay=False),
    ] = None,
) -> None:
    """Write what is to be translated of the course's notebooks into locale/LANGUAGE, and say how far it is.

    What is translated already stays. Where a text was changed, its earlier translation is marked as fuzzy, with the
    text as it was. Exit code: 0 all well, 1 some translations are refused.
    """
    from rotflex.courseware import files
    from rotflex.instructor.translation import po_files
    from rotflex.instructor.translation.translated import translated

    found = courses.find(course)
    po_files.check_language(language)
    cells = done = refused = 0
    for path in found.notebooks:
        notebook = json.loads(path.read_text(encoding="utf-8"))
        po_files.update(notebook, path.name, found.folder, language)
        made, progress = translated(notebook, path.name, found.folder, language)
        typer.echo(str(progress))
        for fault in progress.refused:
            typer.echo(f"    {fault}", err=True)
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            files.write(out / path.name, json.dumps(made, indent=1, ensure_ascii=False) + "\n")
        cells, done, refused = cells + progress.cells, done + progress.done, refused + bool(progress.refused)
    typer.echo(
        _("{done} of {cells} text cells are in {language}. The translations are in {folder}.").format(
            done=done, cells=cells, language=language, folder=po_files.folder(found.folder, language)
        )
    )
    if refused:
        typer.echo(
            _("A cell with a translation that is refused stays as it is. Mend it, and say this again."), err=True
        )
        raise typer.Exit(SOME_TROUBLE)

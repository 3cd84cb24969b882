"""The instructor's commands. ``rotflex.cli`` takes them in where this room is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from rotflex.grading.grades import Batch, Result

Source = Annotated[
    Path, typer.Option(help="A checkout of the course, with solutions/.", file_okay=False, show_default="here")
]

_REFUSAL = (
    "[bold]Not graded.[/bold] This version cannot run students' code in isolation. It would run with your own rights: "
    "it could read and change your files (the key and other students' work among them), and use the network.\n\n"
    "With [bold]--unsafe-no-isolation[/bold] it is run all the same. Do that only where nothing of value can be "
    "reached, as on a machine or an account kept for it. Every report then says so."
)


def register(app: typer.Typer) -> None:
    """Add the instructor's commands to the application."""
    app.command()(release)
    app.command()(notebooks)
    app.command()(grade)


def release(
    out: Annotated[Path, typer.Argument(help="Folder for the release; made if needed.", file_okay=False)],
    source: Source = Path(),
    with_data: Annotated[bool, typer.Option("--with-data", help="Hand out the sample recordings, too.")] = False,
    replace: Annotated[bool, typer.Option("--replace", help="Delete an earlier release in OUT.")] = False,
) -> None:
    """Make the students' folder and zip: no solutions, no key, none of the instructor's rooms."""
    from rotflex.grading.release import release as make

    made = make(source, out, with_data, replace)
    typer.echo(f"{len(made.notebooks)} notebooks: {', '.join(made.notebooks)}")
    typer.echo(f"{made.folder}\n{made.archive}")


def notebooks(source: Source = Path()) -> None:
    """Derive the student notebooks in notebooks/ from solutions/ anew."""
    from rotflex.grading.release import write_notebooks

    for name in write_notebooks(source):
        typer.echo(f"notebooks/{name}")


def grade(
    submissions: Annotated[
        Path, typer.Argument(help="Holds a folder or a zip for each student, named by their ID.", file_okay=False)
    ],
    out: Annotated[Path, typer.Option(help="Folder for grades.csv and the feedback; made if needed.", file_okay=False)],
    source: Source = Path(),
    jobs: Annotated[int, typer.Option(min=1, help="Submissions to run at a time.")] = 1,
    cell_timeout: Annotated[int, typer.Option(min=1, help="Seconds that a cell may take.")] = 60,
    deadline: Annotated[float, typer.Option(min=1, help="Seconds that a submission may take.")] = 600,
    probe_seed: Annotated[
        int | None, typer.Option(min=0, help="For the inputs of students' functions.", show_default="drawn anew")
    ] = None,
    unsafe_no_isolation: Annotated[
        bool, typer.Option("--unsafe-no-isolation", help="Run students' code with your own rights.")
    ] = False,
) -> None:
    """Run and mark a class.

    Exit code: 0 all graded, 1 there was trouble with some submissions (they score what they earned), 2 nothing graded.
    """
    from rich.console import Console

    if not unsafe_no_isolation:
        Console(stderr=True).print(_REFUSAL)
        raise typer.Exit(2)
    from rotflex.grading.grades import Batch
    from rotflex.grading.runner import Limits

    if not math.isfinite(deadline):
        raise typer.BadParameter("It should be a number of seconds.", param_hint="--deadline")
    batch = Batch(submissions, out, source, Limits(cell_timeout, deadline), jobs, probe_seed)
    console = Console()
    for word in batch.ignored:
        console.print(word, style="yellow", markup=False)
    results = sorted(_with_progress(batch, console), key=lambda result: result.student)
    console.print(_summary(results))
    console.print(f"{out / 'grades.csv'} · {results[0].stamp}", markup=False, soft_wrap=True)
    if batch.ignored or any(result.problems for result in results):
        raise typer.Exit(1)


def _with_progress(batch: Batch, console: Console) -> list[Result]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("Grading", total=len(batch))
        results = []
        for result in batch.grade():
            results.append(result)
            progress.advance(task)
    return results


def _summary(results: list[Result]) -> Table:
    from rich.table import Table
    from rich.text import Text

    from rotflex.grading.feedback import points

    table = Table(title="Marks")
    table.add_column("student")
    table.add_column("points", justify="right")  # question by question they are in grades.csv
    table.add_column("awaiting", justify="right")
    table.add_column("trouble")
    for result in results:
        # Text: what looks like markup in a name or a message is none.
        table.add_row(
            Text(result.student),
            f"{points(result.total)} of {points(result.out_of)}",
            points(result.awaiting) if result.awaiting else "",
            Text("\n".join(result.problems)),
        )
    return table

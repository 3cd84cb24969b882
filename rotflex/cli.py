"""The command ``rotflex``: the command line of this course, and the commands of a bench.

Modules load when a command needs them, so that ``rotflex --help`` is quick.
"""

from __future__ import annotations

import importlib.util
import os
from typing import Annotated

import typer

from rotflex import __version__, bench_commands

_NAME = "rotflex"
_HAS_COURSE = importlib.util.find_spec("labcourse") is not None  # or the bench's commands are all there is


def _command_line() -> typer.Typer:
    if not _HAS_COURSE:
        return typer.Typer(help="A bench of the rotary flexible joint.", no_args_is_help=True, add_completion=False)
    from labcourse.command_line import command_line

    return command_line(_NAME, __version__, "Laboratory course: the rotary flexible joint.", "rotflex.course")


app = _command_line()


@app.command(rich_help_panel="Class" if _HAS_COURSE else "Bench")
def doctor(
    bench: Annotated[
        str, typer.Option("--bench", help="Look at this bench: bench.toml, or an address, as 'quanser:q2_usb/0'.")
    ] = "",
    seconds: Annotated[float, typer.Option(min=0.1, max=60, help="With --bench: sample it so long.")] = 3,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for scripts: one object per line.")] = False,
) -> None:
    """Check that students' code can be isolated on this computer; with --bench, that a bench works.

    The first looks at each layer, and tries to break out of eight. The second never drives the motor. Exit code: 0 it
    can, or nothing has failed; 1 something at the bench has failed; 2 it cannot be opened; 3 students' code cannot be
    isolated.
    """
    if bench:
        with bench_commands.errors_as_messages():
            bench_commands.print_checks(bench, seconds, as_json)
        return
    if not _HAS_COURSE:
        raise typer.BadParameter("Name the bench: --bench bench.toml.")
    from labcourse.grading import commands

    commands.doctor(as_json)


app.add_typer(bench_commands.app, name="bench", no_args_is_help=True, rich_help_panel="Bench")


def run() -> None:
    """Run the command, as a program of its own."""
    os.environ["PYTHONSAFEPATH"] = "1"  # programs that it starts import nothing from the folder they are started in
    app(prog_name=_NAME)


if __name__ == "__main__":
    run()

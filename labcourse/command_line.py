"""The command line of a course. Modules load when a command needs them, so that ``--help`` is quick."""

from __future__ import annotations

import gc
import importlib.util
import io
import os
import re
import shutil
import sys
from typing import Any

import typer
import typer.core
from typer import Option

from labcourse import __version__, courses, lab_command, program
from labcourse.errors import CourseError
from labcourse.messages import DISK_FULL, FREE_SPACE
from labcourse.run import commands as students_commands
from labcourse.safe_text import no_escapes

STUDENT_PANEL = "Student"  #: panel of ``--help``; the instructor's commands add theirs
_TEMPORARY = re.compile(r"\.([^/\\]+)\.\d+-\d+\.tmp$")  # files.write writes under such a name first
_GRADING = "labcourse.grading"  # the instructor's part: a release has none


class _Commands(typer.core.TyperGroup):
    """Shows an error that was raised on purpose, or is the system's, as a message, with exit code 2."""

    def main(self, *arguments: Any, **options: Any) -> Any:
        for stream in (sys.stdout, sys.stderr):  # where Windows writes to a file, not every sign can be
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")
        gc.set_threshold(50_000, 20, 20)  # a class has a million small objects, and hardly a circle among them
        return super().main(*arguments, **options)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except CourseError as error:
            raise _stopped(str(error)) from error
        except BrokenPipeError:  # who reads our output has gone: typer sees to it
            raise
        except OSError as error:  # a full disk, a read-only place, a folder where a file should be, ...
            name = _TEMPORARY.sub(r"\1", str(error.filename2 or error.filename or ""))
            where = f"{name}: " if name else ""
            todo = f" {FREE_SPACE}" if error.errno in DISK_FULL else ""
            # An error from copying a folder lists all of its files; the reason for the first one is enough.
            reason = error.args[0][0][-1] if type(error) is shutil.Error else error.strerror or error
            raise _stopped(f"{where}{reason}.{todo}") from error
        except ModuleNotFoundError as error:
            if (error.name or "").partition(".")[0] == "labcourse" and error.name != _GRADING:
                raise
            raise _stopped(
                f"this command needs {error.name}, which comes with the instructor's extra: pip install "
                '"labcourse[grading]" (in a checkout: pip install -e "./labcourse[grading]").'
            ) from error


def _stopped(message: str) -> typer.Exit:
    typer.secho(no_escapes(f"{program.name()}: {message}"), err=True, fg="red")
    return typer.Exit(2)


def command_line(name: str, version: str, title: str = "", course: str = "") -> typer.Typer:
    """Return the command line of a course; the instructor's commands are in it where they are installed.

    Parameters
    ----------
    name : of the program, as messages mention it
    version : as ``--version`` shows it
    title : of the course, for the first line of ``--help``
    course : import name of the package of the course that it is for; without it, the option ``--course`` names one
    """

    def show_version(wanted: bool) -> None:
        if wanted:
            typer.echo(f"{name} {version}")
            raise typer.Exit

    def choose(
        named: str = Option(
            "", "--course", metavar="NAME", help="The installed course, if there are several.", hidden=bool(course)
        ),
        _version: bool = Option(
            False, "--version", help="Show the version and stop.", is_eager=True, callback=show_version
        ),
    ) -> None:
        program.use(name)
        courses.requested = named
        if named or course:
            courses.use(named or course)

    app = typer.Typer(
        cls=_Commands,
        help=title or "Run a laboratory course: work in it as a student, or mark a class.",
        callback=choose,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_show_locals=False,
    )
    app.command(cls=lab_command.LabCommand, rich_help_panel=STUDENT_PANEL)(lab_command.lab)
    students_commands.register(app, STUDENT_PANEL)
    if importlib.util.find_spec(_GRADING) is not None:
        instructors = importlib.import_module(f"{_GRADING}.commands").app
        app.registered_commands += instructors.registered_commands
        app.registered_groups += instructors.registered_groups
    return app


def run() -> None:
    """Run the command ``labcourse``, as a program of its own."""
    # Python programs that it starts, as those that mark, import nothing from the folder in which they are started.
    os.environ["PYTHONSAFEPATH"] = "1"
    command_line("labcourse", __version__)(prog_name="labcourse")

"""The command ``rotflex``. Modules load when a command needs them, so that ``rotflex --help`` is quick."""

from __future__ import annotations

import errno
import importlib.metadata
import importlib.util
import io
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
import typer.core

from labcourse import benches, course_file, course_place, courses, files, hub, student_id
from labcourse.errors import ConfigurationError, CourseError, StudentIDError
from labcourse.files import COURSE_FILE
from labcourse.jupyterlab import open_jupyterlab
from labcourse.messages import DISK_FULL, FREE_SPACE
from labcourse.run import commands as students_commands
from labcourse.safe_text import no_escapes, say
from rotflex import __version__, bench_commands
from rotflex.errors import RotflexError

_INSTRUCTORS = "rotflex-instructor"  # the distribution that the instructor's commands come with


class _Commands(typer.core.TyperGroup):
    """Shows an error that was raised on purpose, or is the system's, as a message, with exit code 2."""

    def main(self, *arguments: Any, **options: Any) -> Any:
        for stream in (sys.stdout, sys.stderr):  # where Windows writes to a file, not every sign can be
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")
        return super().main(*arguments, **options)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except (CourseError, RotflexError) as error:
            typer.secho(no_escapes(f"rotflex: {error}"), err=True, fg="red")
            raise typer.Exit(2) from error
        except OSError as error:  # a full disk, a read-only place, a folder where a file should be, ...
            if error.errno == errno.EPIPE:  # who reads our output has gone: typer sees to it
                raise
            where = f"{error.filename}: " if error.filename else ""
            todo = f" {FREE_SPACE}" if error.errno in DISK_FULL else ""
            typer.secho(no_escapes(f"rotflex: {where}{error.strerror or error}.{todo}"), err=True, fg="red")
            raise typer.Exit(2) from error
        except ModuleNotFoundError as error:
            if _is_installed(_INSTRUCTORS):
                raise
            needed = (
                f"rotflex: this command needs {error.name}, which comes with the instructor's distribution: pip "
                f"install {_INSTRUCTORS} (in a checkout: pip install -e distributions/instructor)."
            )
            typer.secho(needed, err=True, fg="red")
            raise typer.Exit(2) from error


def _is_installed(distribution: str) -> bool:
    try:
        importlib.metadata.distribution(distribution)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_show_locals=False,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"rotflex {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and stop.", is_eager=True, callback=_show_version)
    ] = False,
) -> None:
    """Courseware for the rotary flexible joint laboratory."""


@app.command()
def lab(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FOLDER] [-- OPTIONS OF JUPYTERLAB]",
            help="The folder to work in. Unless given: the course around you, that of last time, or 'notebooks'.",
        ),
    ] = None,
    student: Annotated[str | None, typer.Option(help="Your student ID: it makes your own virtual bench.")] = None,
) -> None:
    """Open JupyterLab on the course's notebooks.

    Notebooks that are not in FOLDER yet are copied there; what you wrote there stays as it is. If you began with an
    earlier release of the course, the course's own cells become those of the installed one. On a JupyterHub, where
    JupyterLab runs already, that is all.
    """
    given = list(words or [])
    named = Path(given.pop(0)) if given and not given[0].startswith("-") else None
    if given and not given[0].startswith("-"):
        raise typer.BadParameter(f"One folder, please; {given[0]!r} is another. Put JupyterLab's options after --.")
    if student is not None:
        student = student_id.normalised(student)
    folder, said = course_place.choose(named, _names())
    for line in said:
        say(line)
    if student is None:
        student = _asked(folder)
    for line in fill(folder, student):
        say(line)
    if not _is_source(folder):
        course_place.remember(folder)
        if told := hub.another(course_file.student(folder)):
            typer.echo(told)
    if hub.is_here():
        typer.echo(f"JupyterLab runs here already, as the hub's: open {folder} in its file browser.")
        raise typer.Exit
    raise typer.Exit(open_jupyterlab(folder, given))


def _names() -> list[str]:
    """File names of the course's notebooks."""
    return [path.name for path in (courses.current().notebooks).glob("*.ipynb")]


def _is_source(folder: Path) -> bool:
    """Whether a folder is that of a checkout's own notebooks, where nobody works as a student."""
    course = courses.current().notebooks
    return _is_home(folder, course) and not _is_release(course)


def _is_home(folder: Path, course: Path) -> bool:
    return folder.resolve() == (course).resolve()


def _is_release(course: Path) -> bool:
    return course_file.RELEASE in _begun(course)


def _asked(folder: Path) -> str | None:
    """The ID of whoever sits at the terminal, or of the hub's user, where the folder does not know it; None if nobody
    gives one.
    """
    try:
        known = (course_file.read(folder) or {}).get(course_file.STUDENT)
    except ConfigurationError:  # it may name a student: filling the folder says so
        return None
    if known or _is_source(folder):
        return None
    if named := _hubs_user():
        told = "The hub knows you as {named}: that is your student ID. Is it another? Give it by --student YOUR-ID."
        typer.echo(told.format(named=named))
        return named
    while _at_a_terminal():
        prompt = "Your student ID, by which your instructor knows you (Enter: later)"
        given = typer.prompt(prompt, default="", show_default=False).strip()
        if not given:
            break
        try:
            return student_id.normalised(given)
        except StudentIDError as error:
            typer.secho(no_escapes(str(error)), fg="red")
    typer.echo("There is no student ID yet, and the bench is nobody's: give your ID by --student YOUR-ID.")
    return None


def _hubs_user() -> str:
    try:
        return hub.user()
    except ConfigurationError as error:  # no ID, but whoever sits at the terminal may have one
        typer.secho(no_escapes(str(error)), fg="red")
        return ""


def _at_a_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


def fill(folder: Path, student: str | None = None) -> list[str]:
    """Copy into a folder what is not there yet of the course, and write down the student. No answer is overwritten.

    A folder that was begun under another release is brought to the installed one.

    Parameters
    ----------
    folder : to work in; made if needed
    student : ID for ``course.json``; None leaves the file as it is

    Returns
    -------
    list
        What was done, a line each.

    Raises
    ------
    ConfigurationError
        If the ID cannot be one, there are no notebooks to copy, or ``course.json`` cannot be written.
    """
    if student is not None:
        student = student_id.normalised(student)
    course = courses.current().notebooks
    if folder.exists() and not folder.is_dir():
        raise ConfigurationError(f"{folder} is not a folder.")
    folder.mkdir(parents=True, exist_ok=True)
    at_home = _is_home(folder, course)
    lines = [] if at_home else [*_brought_up_to_date(folder, course, student), *_copied(folder, course)]
    if student is not None:
        _write_course(folder, {**(_begun(folder) or _as_of_now(course)), course_file.STUDENT: student})
        lines.append(f"Student: {student}")
    return lines


def _copied(folder: Path, course: Path) -> list[str]:
    """Copy what is not there yet, and say so."""
    wanted = {path.name: path for path in sorted((course).glob("*.ipynb"))}
    if _is_release(course):  # a checkout always has recordings; students have those that their release hands out
        wanted |= {f"data/{path.name}": path for path in sorted((course.parent / "data").glob("*.mat"))}
    linked = [name for name in wanted if (folder / name).is_symlink() or (folder / name.partition("/")[0]).is_symlink()]
    copied = [name for name in wanted if name not in linked and not (folder / name).exists()]
    for name in copied:
        (folder / name).parent.mkdir(exist_ok=True)
        files.write(folder / name, wanted[name].read_bytes())
    if copied and len(copied) == len(wanted):
        from labcourse.messages import plural

        notebooks = plural(sum(name.endswith(".ipynb") for name in copied), "{count} notebook", "{count} notebooks")
        return [f"The course was copied to {folder}: {notebooks}."]
    lines = [f"Copied to {folder}: {', '.join(copied)}"] if copied else []
    if linked:
        lines.append(f"Links are not followed, in {folder}: {', '.join(linked)}. Put the files themselves there.")
    return lines


def _brought_up_to_date(folder: Path, released: Path, student: str | None) -> list[str]:
    """Bring a folder that was begun under another release to the installed one, and say so."""
    about = course_file.read(released) or {}
    release = about.get(course_file.RELEASE)
    try:
        begun = _begun(folder) if student else course_file.read(folder) or {}
    except ConfigurationError as error:  # it may name a student: whoever knows who should mend it
        return [str(error)]
    if not release or begun.get(course_file.RELEASE) == release:  # a checkout is no release
        return []
    lines: list[str] = []
    if any((folder / path.name).exists() for path in released.glob("*.ipynb")):
        from labcourse.run.update import update

        lines, whole = update(folder, released, release)
        if not whole:  # to be tried again
            return lines
        if not _same_bench(begun, about):
            lines.append("The course gives you another bench now: run your notebooks again, to measure on that one.")
    _write_course(folder, {**begun, **about, course_file.STUDENT: begun.get(course_file.STUDENT, "")})
    return lines


def _same_bench(begun: dict[str, Any], about: dict[str, Any]) -> bool:
    try:
        return benches.policy_of(begun) == benches.policy_of(about)
    except ConfigurationError:
        return False


def _begun(folder: Path) -> dict[str, Any]:
    """What a folder's ``course.json`` says; nothing, if it is broken."""
    try:
        return course_file.read(folder) or {}
    except ConfigurationError:
        return {}


def _as_of_now(course: Path) -> dict[str, Any]:
    """What ``course.json`` says of work that begins in a checkout, which is no release: benches as they are drawn now.

    Without it, the file would be one of those that name the student alone, whose benches are the first draw's.
    """
    if _is_release(course):
        return {}
    from rotflex.hil.student_benches import DRAW

    return {"draw": DRAW}


def _write_course(folder: Path, course: dict[str, Any]) -> None:
    try:
        files.write(folder / COURSE_FILE, course_file.text(course))
    except OSError as error:
        raise ConfigurationError(f"{folder / COURSE_FILE} cannot be written: {error.strerror}.") from None


@app.command()
def doctor(
    bench: Annotated[
        str, typer.Option("--bench", help="Look at this bench: bench.toml, or an address, as 'quanser:q2_usb/0'.")
    ] = "",
    seconds: Annotated[float, typer.Option(min=0.1, max=60, help="With --bench: sample it so long at each rate.")] = 3,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for scripts: an object a line.")] = False,
) -> None:
    """Say whether students' code can be run in isolation here; or, with --bench, whether a bench works.

    The first tries to break out, layer by layer. The second never drives the motor. Exit code: 0 it can, or nothing
    has failed; 1 something at the bench has failed; 3 students' code cannot be isolated.
    """
    if bench:
        bench_commands.examine(bench, seconds, as_json)
        return
    from labcourse.grading.commands import grade

    grade.doctor(as_json)


students_commands.register(app)
app.add_typer(bench_commands.app, name="bench", no_args_is_help=True)

if importlib.util.find_spec("labcourse.grading") is not None:
    from labcourse.grading import commands

    commands.register(app)


def run() -> None:
    """Run the command, as a program of its own."""
    # Python programs that it starts, as those that mark, import nothing from the folder in which they are started.
    os.environ["PYTHONSAFEPATH"] = "1"
    courses.use("rotflex.course")
    app(prog_name="rotflex")


if __name__ == "__main__":
    run()

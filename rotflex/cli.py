"""The command ``rotflex``. Modules load when a command needs them, so that ``rotflex --help`` is quick."""

from __future__ import annotations

import errno
import importlib.metadata
import importlib.util
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
import typer.core

from rotflex import __version__
from rotflex.courseware import benches, course_file, files, student_id
from rotflex.courseware.files import COURSE_FILE
from rotflex.courseware.messages import _
from rotflex.courseware.released import course_folder
from rotflex.courseware.run import commands as students_commands
from rotflex.errors import ConfigurationError, RotflexError

_ENDINGS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]  # Windows has no SIGHUP
_PATIENCE = 15  # s for JupyterLab to end its kernels and go


_INSTRUCTORS = "rotflex-instructor"  # the distribution that the instructor's commands come with


class _Commands(typer.core.TyperGroup):
    """Shows an error that was raised on purpose, or is the system's, as a message, with exit code 2."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except RotflexError as error:
            typer.secho(f"rotflex: {error}", err=True, fg="red")
            raise typer.Exit(2) from error
        except OSError as error:  # a full disk, a read-only place, a folder where a file should be, ...
            if error.errno == errno.EPIPE:  # who reads our output has gone: typer sees to it
                raise
            where = f"{error.filename}: " if error.filename else ""
            typer.secho(f"rotflex: {where}{error.strerror or error}.", err=True, fg="red")
            raise typer.Exit(2) from error
        except ModuleNotFoundError as error:
            if _is_installed(_INSTRUCTORS):
                raise
            needed = _(
                "rotflex: this command needs {library}, which comes with the instructor's distribution: pip install "
                "{distribution} (in a checkout: pip install -e distributions/instructor)."
            ).format(library=error.name, distribution=_INSTRUCTORS)
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
    help="Courseware for the rotary flexible joint laboratory.",
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
    pass


@app.command()
def lab(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FOLDER] [-- OPTIONS OF JUPYTERLAB]", help="The folder to work in; 'notebooks' unless given."
        ),
    ] = None,
    student: Annotated[str | None, typer.Option(help="Your student ID: it makes your own virtual bench.")] = None,
) -> None:
    """Open JupyterLab on the course's notebooks.

    Notebooks that are not in FOLDER yet are copied there; what you wrote there stays as it is. If you began with an
    earlier release of the course, the course's own cells become those of the installed one.
    """
    given = list(words or [])
    folder = Path(given.pop(0) if given and not given[0].startswith("-") else "notebooks")
    if given and not given[0].startswith("-"):
        raise typer.BadParameter(
            _("One folder, please; {other!r} is another. Put JupyterLab's options after --.").format(other=given[0])
        )
    for line in fill(folder, student):
        typer.echo(line)
    raise typer.Exit(open_jupyterlab(folder, given))


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
    course = course_folder()
    if folder.exists() and not folder.is_dir():
        raise ConfigurationError(_("{folder} is not a folder.").format(folder=folder))
    folder.mkdir(parents=True, exist_ok=True)
    at_home = folder.resolve() == (course / "notebooks").resolve()
    lines = [] if at_home else [*_brought_up_to_date(folder, course / "notebooks", student), *_copied(folder, course)]
    if student is not None:
        _write_course(folder, {**(_begun(folder) or _as_of_now(course)), course_file.STUDENT: student})
        lines.append(_("Student: {student}").format(student=student))
    return lines


def _copied(folder: Path, course: Path) -> list[str]:
    """Copy what is not there yet, and say so."""
    wanted = {path.name: path for path in sorted((course / "notebooks").glob("*.ipynb"))}
    wanted |= {f"data/{path.name}": path for path in sorted((course / "data").glob("*.mat"))}
    copied = [name for name in wanted if not (folder / name).exists()]
    for name in copied:
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copyfile(wanted[name], folder / name)
    return [_("Copied to {folder}: {copied}").format(folder=folder, copied=", ".join(copied))] if copied else []


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
        from rotflex.courseware.run.update import update

        lines, whole = update(folder, released, release)
        if not whole:  # to be tried again
            return lines
        if not _same_bench(begun, about):
            lines.append(_("The course gives you another bench now: run your notebooks again, to measure on that one."))
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
    if course_file.RELEASE in (course_file.read(course / "notebooks") or {}):
        return {}
    from rotflex.hil.student_benches import DRAW

    return {"draw": DRAW}


def _write_course(folder: Path, course: dict[str, Any]) -> None:
    try:
        files.write(folder / COURSE_FILE, course_file.text(course))
    except OSError as error:
        raise ConfigurationError(
            _("{file} cannot be written: {why}.").format(file=folder / COURSE_FILE, why=error.strerror)
        ) from None


_CONNECTION = "rotflex.server.PromptConnection"  # by name: the server is another program


def open_jupyterlab(folder: Path, options: list[str]) -> int:
    """Run JupyterLab until it ends or is interrupted, and return its exit code."""
    command = [sys.executable, "-m", "jupyterlab", f"--ServerApp.root_dir={folder.resolve()}"]
    command += [f"--ServerApp.kernel_websocket_connection_class={_CONNECTION}", *options]
    # In a session of its own, JupyterLab hears Ctrl-C from us only: it would ask, and be ended before it has ended its
    # kernels. Whatever ends this program, then, has to end JupyterLab, too: a closed terminal as well.
    previous = {number: signal.signal(number, _interrupt) for number in _ENDINGS}
    child = subprocess.Popen(command, start_new_session=True)
    try:
        return child.wait()
    except KeyboardInterrupt:
        typer.echo(_("Stopping JupyterLab."))
        return 0
    finally:
        _stop(child)
        for number, handler in previous.items():
            signal.signal(number, handler)


def _interrupt(*_: Any) -> None:
    raise KeyboardInterrupt


def _stop(child: subprocess.Popen[bytes]) -> None:
    """End a child that is still running, kindly first: it has kernels to end."""
    if child.poll() is not None:
        return
    # Another Ctrl-C while it is going is for nobody.
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        child.terminate()
        try:
            child.wait(timeout=_PATIENCE)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
    finally:
        signal.signal(signal.SIGINT, previous)


students_commands.register(app)

if importlib.util.find_spec("rotflex.instructor") is not None:
    from rotflex.instructor import commands

    commands.register(app)


if __name__ == "__main__":
    app()

"""The command ``rotflex``. Modules load when a command needs them, so that ``rotflex --help`` is quick."""

from __future__ import annotations

import errno
import importlib.metadata
import importlib.util
import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
import typer.core

from rotflex import __version__
from rotflex.courseware import files, student_id
from rotflex.courseware.files import COURSE_FILE
from rotflex.courseware.messages import _
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

    Notebooks that are not in FOLDER yet are copied there; what is there stays as it is.
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


def course_folder() -> Path:
    """Where the notebooks as handed out are: in the installed package, or in the folder that it is run from.

    Raises
    ------
    ConfigurationError
        If there are none.
    """
    package = Path(__file__).resolve().parent
    for place in (package / "_course", package.parent):
        if any((place / "notebooks").glob("*.ipynb")):
            return place
    raise ConfigurationError(
        _("This installation of rotflex comes without notebooks: install it from the course's folder.")
    )


def fill(folder: Path, student: str | None = None) -> list[str]:
    """Copy into a folder what is not there yet of the course, and write down the student. Nothing is overwritten.

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
    wanted = {path.name: path for path in sorted((course / "notebooks").glob("*.ipynb"))}
    wanted |= {f"data/{path.name}": path for path in sorted((course / "data").glob("*.mat"))}
    if folder.exists() and not folder.is_dir():
        raise ConfigurationError(_("{folder} is not a folder.").format(folder=folder))
    folder.mkdir(parents=True, exist_ok=True)
    at_home = folder.resolve() == (course / "notebooks").resolve()
    copied = [name for name in wanted if not at_home and not (folder / name).exists()]
    for name in copied:
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copyfile(wanted[name], folder / name)
    lines = [_("Copied to {folder}: {copied}").format(folder=folder, copied=", ".join(copied))] if copied else []
    if student is not None:
        content = json.dumps({"student": student}, ensure_ascii=False) + "\n"
        try:
            files.write(folder / COURSE_FILE, content)
        except OSError as error:
            raise ConfigurationError(
                _("{file} cannot be written: {why}.").format(file=folder / COURSE_FILE, why=error.strerror)
            ) from None
        lines.append(_("Student: {student}").format(student=student))
    return lines


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


if importlib.util.find_spec("rotflex.instructor") is not None:
    from rotflex.instructor import commands

    commands.register(app)


if __name__ == "__main__":
    app()

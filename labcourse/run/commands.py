"""The commands by which a student looks at their work, packs it, and puts notebooks in order: for everybody."""

from __future__ import annotations

import contextlib
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from labcourse import program
from labcourse.errors import CheckError
from labcourse.run import by_program
from labcourse.run.from_notebook import nothing_here
from labcourse.safe_text import say

if TYPE_CHECKING:  # modules load when a command needs them
    from labcourse.run.check import Checked

FINE, LOOK, STOPPED = 0, 1, 130  #: exit codes, besides 2 for what cannot be done
_ENDINGS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]  # Windows has no SIGHUP

_Folder = Annotated[
    Path | None,
    typer.Argument(metavar="FOLDER", help="With the notebooks in it; this one, or 'notebooks' in it, unless given."),
]
_Student = Annotated[str, typer.Option(help="Your student ID; as your folder says unless given.")]


def register(app: typer.Typer, panel: str) -> None:
    """Add the commands to a panel of the help."""
    for command in (check, submit, restore):
        app.command(rich_help_panel=panel)(command)


def check(folder: _Folder = None, student: _Student = "") -> None:
    """Run your notebooks as they will be run for marking, and show which answers are recorded.

    Your notebooks, as you saved them, are run from the first cell to the last, in a copy of the folder. Nothing is
    marked, and nothing of yours is changed.

    Exit codes: 0 all is recorded, 1 there is something to look at, 2 it cannot be checked.
    """
    with _a_run("check"):
        checked = _checked(_place(folder), student)
        typer.echo("")
        _show(checked)
    raise typer.Exit(FINE if checked.good else LOOK)


def submit(
    folder: _Folder = None,
    student: _Student = "",
    partners: Annotated[
        list[str] | None, typer.Option("--with", help="ID of a partner who hands in the same work; once for each.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Where to put the zip; above the folder unless given.")] = None,
    no_check: Annotated[bool, typer.Option("--no-check", help="Pack it unseen; the receipt says so.")] = False,
) -> None:
    """Check your work and pack it into one zip file to upload, with a receipt.

    Exit codes: 0 packed, 1 packed, and there is something to look at, 2 it cannot be packed.
    """
    from labcourse import released
    from labcourse.run import student_folder
    from labcourse.run import submit as packing

    with _a_run("submit"):
        place = _place(folder)
        masters = released.masters()
        student = packing.owner(student_folder.read(place, list(masters)), student)
        checked = None if no_check else _checked(place, student)
        if checked is not None:
            typer.echo("")
            _show(checked)
            typer.echo("")
        done = packing.submit(
            place,
            list(masters),
            student=student,
            partners=partners or (),
            out=out,
            checked=checked,
            modules=released.packages_of(masters),
            catalogue=released.catalogue_of(masters),
        )
        for line in done.lines:
            say(line)
        say(f"Your receipts are kept in {done.receipts}.")
    raise typer.Exit(FINE if checked is None or checked.good else LOOK)


def restore(
    notebooks: Annotated[
        list[str] | None, typer.Argument(metavar="NOTEBOOK", help="As 02, or its whole name; all unless given.")
    ] = None,
    folder: Annotated[Path | None, typer.Option(help="With the notebooks in it.")] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what would be given back, and change nothing.")
    ] = False,
) -> None:
    """Get back the course's own cells and texts that you changed or deleted; your answers stay."""
    from labcourse import courses, released
    from labcourse.run import restore as restoring

    with _a_run("restore"):
        masters = released.masters()
        place = _place(folder)
        if place == courses.current().notebooks.resolve():
            raise CheckError(
                f"The notebooks in {place} are the only ones that this installation has: it has nothing to give "
                "back. Install the course anew (pip install .), from the zip that you got."
            )
        changed, failed = False, []
        for name in restoring.named(notebooks or [], list(masters)):
            try:
                done = restoring.restore(place, name, masters[name], dry_run)
            except CheckError as error:  # restore the others first
                failed.append(str(error))
                continue
            changed = changed or bool(done.lines)
            for line in _of_restored(done, dry_run):
                say(line)
        if changed and not dry_run:
            typer.echo(
                "A notebook that is open in JupyterLab still shows its old state: choose File → Reload Notebook "
                "from Disk there, before you save it."
            )
        if failed:
            raise CheckError("\n".join(failed))


def _of_restored(done: Any, dry_run: bool) -> Iterator[str]:
    if not done.lines:
        yield f"{done.notebook}: all that is the course's is there."
        return
    kept = f" As it was, it is kept as {done.kept}." if done.kept else ""
    head = "{name}, if you ask for it:" if dry_run else "{name}:{kept}"
    yield head.format(name=done.notebook, kept=kept)
    yield from (f"  {line}" for line in done.lines)


def _place(folder: Path | None) -> Path:
    from labcourse import released
    from labcourse.run import student_folder

    return student_folder.find(folder, released.masters())


def _checked(folder: Path, student: str) -> Checked:
    from labcourse import courses, released
    from labcourse.run import check as checking

    masters = released.masters()
    if folder.resolve() == courses.current().notebooks.resolve():  # texts would be compared with themselves
        raise CheckError(
            "Here your own notebooks stand for the course's, and none of your texts would be found. This happens "
            f"with python -m {program.name()} in the course's folder, or after pip install -e. Install the course once "
            f"(pip install .), and say {program.name()} check as its README does. ({program.name()} submit --no-check "
            "packs unseen.)"
        )
    progress = _Progress(len(masters))
    try:
        return checking.check(
            folder, masters, released.asked_of(masters, folder), student=student, report=progress.report
        )
    finally:
        progress.close()


def _show(checked: Checked) -> None:
    from labcourse.run import check_words

    for line in check_words.lines(checked):
        say(line)


class _Progress:
    """Where the run is: one line that changes, in a terminal; else a line for each notebook."""

    def __init__(self, notebooks: int) -> None:
        self._line = sys.stdout.isatty()
        self._notebooks, self._begun, self._name = notebooks, 0, ""

    def report(self, name: str, done: int, of: int) -> None:
        """Show how many cells of a notebook have been run."""
        if name != self._name:
            self._name, self._begun = name, self._begun + 1
            if not self._line:
                typer.echo(self._where(name))
        if self._line:
            cell = f"cell {done} of {of}"
            typer.echo(f"\r\x1b[K{self._where(name)}  {cell}", nl=False)

    def _where(self, name: str) -> str:
        return f"Running {self._begun} of {self._notebooks}: {name}"

    def close(self) -> None:
        """Leave a clean line."""
        if self._line:
            typer.echo("\r\x1b[K", nl=False)


@contextlib.contextmanager
def _a_run(command: str) -> Iterator[None]:
    """Do it, unless a program runs the notebooks that ask for it; end in order when it is stopped."""
    if by_program():
        typer.echo(nothing_here(command))
        raise typer.Exit(FINE)
    previous = {number: signal.signal(number, _interrupt) for number in _ENDINGS}
    try:
        yield
    except KeyboardInterrupt:
        typer.echo("Stopped.")
        raise typer.Exit(STOPPED) from None
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _interrupt(*_arguments: Any) -> None:
    for number in _ENDINGS:  # it is heard: what ends now is not to be disturbed
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt

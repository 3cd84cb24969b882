"""The commands by which a student checks their work, packs it, and puts notebooks in order."""

from __future__ import annotations

import contextlib
import importlib
import itertools
import os
import signal
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from labcourse import course_file, courses, files, program
from labcourse.errors import CheckError, ConfigurationError
from labcourse.messages import number_of
from labcourse.run import by_program
from labcourse.run.from_notebook import nothing_here
from labcourse.safe_text import say
from labcourse.sentences import sentence, sentences

if TYPE_CHECKING:  # modules load when a command needs them
    from labcourse.problems import Problem
    from labcourse.run.check import Checked, CheckedPart, CheckState

_MOST_NOTES, _MOST_LINES = 5, 18  # lines of a block of a check's result
FINE, LOOK, STOPPED = 0, 1, 130  #: exit codes, besides 2 for what cannot be done
_ENDINGS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]  # Windows has no SIGHUP

_Folder = Annotated[
    Path | None,
    typer.Argument(metavar="FOLDER", help="With the notebooks in it; this one, or 'notebooks' in it, unless given."),
]
_Notebook = Annotated[str, typer.Option(help="As 02: show what is missing in this notebook alone.")]
_Student = Annotated[str, typer.Option(help="Your student ID; as your folder says unless given.")]


def register(app: typer.Typer, panel: str) -> None:
    """Add the commands to a panel of the help."""
    for command in (check, submit, make_report, restore):
        app.command(rich_help_panel=panel)(command)


def use_course_of(folder: Path) -> None:
    """Work on the course of a folder. If it may be of several, ask which, and write that into its ``course.json``.

    Raises
    ------
    ConfigurationError
        If it is of another course than the requested one, of one that is not installed, or if nobody can be asked.
    """
    fitting, requested = course_file.courses_of(folder), courses.name_of(courses.requested)
    possible = [requested] if requested else list(courses.installed())
    if fitting and not {*fitting} & {*possible, os.environ.get(courses.COURSE_VARIABLE)}:
        raise ConfigurationError(
            f"{folder.resolve()} is a folder of the course {' or '.join(fitting)}, and this command is for "
            f"{' or '.join(possible)}. Name another folder, or install that course if it is missing here."
        )
    if fitting:
        courses.use(requested or (fitting[0] if len(fitting) == 1 else _ask_for_course(folder, fitting)))
    if len(fitting) > 1 and (about := course_file.read(folder)) is not None:
        named = {**about, course_file.COURSE_KEY: courses.name_of(courses.current().package)}
        files.write(folder / files.COURSE_FILE, course_file.text(named))


def _ask_for_course(folder: Path, fitting: Sequence[str]) -> str:
    for course in fitting if at_a_terminal() else ():
        if typer.confirm(f"Is {folder.resolve()} a folder of the course {course}?"):
            return course
    raise ConfigurationError(
        f"Of which course is the folder {folder.resolve()}, {' or '.join(fitting)}? Say it once: {program.name()} "
        "--course NAME, and then the command."
    )


def at_a_terminal() -> bool:
    """Check whether a person can be asked."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def check(
    folder: _Folder = None,
    student: _Student = "",
    notebook: _Notebook = "",
    everything: Annotated[bool, typer.Option("--everything", help="Show all, however long it is.")] = False,
) -> None:
    """Run your notebooks as they will be run for marking, and show which answers are recorded.

    Your notebooks, as you saved them, are run from the first cell to the last, in a copy of the folder. Nothing is
    marked, and nothing of yours is changed.

    Exit codes: 0 all is recorded, 1 there is something to look at, 2 it cannot be checked.
    """
    with _a_run("check"):
        checked = _checked(*_found(folder), student, notebook, everything)
    raise typer.Exit(FINE if checked.good else LOOK)


def submit(
    folder: _Folder = None,
    student: _Student = "",
    partners: Annotated[
        list[str] | None, typer.Option("--with", help="ID of a partner who hands in the same work; once for each.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Where to put the zip; above the folder unless given.")] = None,
    notebook: _Notebook = "",
    no_check: Annotated[bool, typer.Option("--no-check", help="Pack it unseen; the receipt says so.")] = False,
) -> None:
    """Check your work and pack it into one zip file to upload, with a receipt.

    Exit codes: 0 packed, 1 packed, and there is something to look at, 2 it cannot be packed.
    """
    from labcourse.answers import notebooks
    from labcourse.run import student_folder
    from labcourse.run import submit as packing

    with _a_run("submit"):
        place, masters = _found(folder, is_packed=no_check)
        student = packing.owner(student_folder.read(place, list(masters)), student)
        checked = None if no_check else _checked(place, masters, student, notebook)
        if checked is not None:
            typer.echo("")
        catalogue = notebooks.catalogue_of(masters)
        options: dict[str, Any] = {"student": student, "partners": partners or (), "out": out, "checked": checked}
        packed = packing.submit(place, masters, catalogue, **options)
        say(*packed.new, f"Your receipts are stored in {packing.shown(packed.receipts)}.")
    raise typer.Exit(FINE if checked is None or checked.good else LOOK)


def make_report(name: Annotated[str, typer.Argument(metavar="NAME", help="Of the report, or how it begins.")]) -> None:
    """Make a report of your saved notebooks, as PDF and as a web page. Run it in the course's folder, or below."""
    with _a_run("make-report"):
        os.chdir(_found(None, is_packed=True)[0])
        importlib.import_module(f"{courses.current().package}.lab").start().report(name)


def restore(
    notebooks: Annotated[
        list[str] | None, typer.Argument(metavar="NOTEBOOK", help="As 02, or its whole name; all unless given.")
    ] = None,
    folder: Annotated[Path | None, typer.Option(help="With the notebooks in it.")] = None,
) -> None:
    """Get back the course's own cells and texts, as the installed release has them; your answers stay.

    These are cells that you changed or deleted. If you began with another release of the course, all your notebooks are
    brought to the installed one.
    """
    from labcourse.run import restore as restoring

    with _a_run("restore"):
        place, masters = _found(folder)
        for line in restoring.restore(place, masters, restoring.named(notebooks or [], list(masters))):
            say(line)


def _found(given: Path | None, is_packed: bool = False) -> tuple[Path, dict[str, dict[str, Any]]]:
    """Return the student's folder, the given one or the one around this place, and the masters of its course.

    Raises
    ------
    CheckError
        If none of the course's notebooks is there; or if they are the only ones that this installation has, unless they
        are packed as they are.
    """
    from labcourse.answers import notebooks

    folder = (given or course_file.around(Path()) or Path()).resolve()
    use_course_of(folder)
    masters = notebooks.masters()
    if not any((folder / name).is_file() for name in masters):
        named = next(iter(masters))
        similar = sorted(f"{path.name}" for name in masters for path in folder.glob(f"*{Path(name).stem}*"))
        rename = f" There is {similar[0]}: if it is your work, rename it to the notebook's name." if similar else ""
        raise CheckError(f"{named} and the other notebooks are not in the folder {folder}: name their folder.{rename}")
    if folder == courses.current().notebooks.resolve() and not is_packed:
        raise CheckError(
            f"The notebooks in {folder} are the only ones of the course here: no others to compare them with, or "
            f"to restore them from. Install the course (pip install .), and say {program.name()} as its README does. "
            f"({program.name()} submit --no-check packs unseen.)"
        )
    return folder, masters


def _checked(
    folder: Path, masters: Mapping[str, dict[str, Any]], student: str, notebook: str, everything: bool = False
) -> Checked:
    """Check a folder, and show what was found."""
    from labcourse.answers import notebooks
    from labcourse.run import check as checking
    from labcourse.run import restore as restoring

    asks = restoring.named([notebook], list(masters))[0] if notebook else ""
    count = itertools.count(1)
    checked = checking.check(
        folder,
        masters,
        notebooks.asked_of(masters, folder),
        student=student,
        report=lambda name: typer.echo(f"Running {next(count)} of {len(masters)}: {name}"),
    )
    typer.echo("")
    say(*lines(checked, asks, everything))
    return checked


def lines(checked: Checked, notebook: str = "", everything: bool = False) -> Iterator[str]:
    """Yield the result of a check as text that fits a screen.

    Parameters
    ----------
    checked : the result
    notebook : file name of the one that asks; what is missing in others is then counted only
    everything : cut nothing
    """
    from labcourse.run.check import GOOD

    yield f"Checked in {checked.seconds:.0f} s, as your work is run for marking. Nothing was marked."
    yield f"Student {checked.student}, folder {checked.folder}"
    yield from ("", checked.summary)
    counts = Counter(part.state for part in checked.parts if part.state in GOOD)
    if counts:
        yield f"Well done, these answers are there: {', '.join(f'{count} {state}' for state, count in counts.items())}."
    blocks = {
        "Look at this first": (_MOST_NOTES, sentences(checked.advice)),
        "By notebook": (_MOST_LINES, [*_by_notebook(checked, "" if everything else notebook)]),
        "Worth knowing": (_MOST_NOTES, sentences(checked.notes)),
    }
    for title, (most, content) in blocks.items():
        shown = content if everything else content[:most]
        if content:
            yield from ("", title, *(f"  {line}" for line in shown))
        if more := len(content) - len(shown):
            text = number_of(more, "more line")
            yield f"  … {text}: {program.name()} check --everything, or lab.check(everything=True), shows all."


def _by_notebook(checked: Checked, asks: str) -> Iterator[str]:
    from labcourse.run.check import GOOD, CheckState

    notebooks = {name: list(parts) for name, parts in itertools.groupby(checked.parts, lambda part: part.notebook)}
    done = [name for name, parts in notebooks.items() if all(part.state in GOOD for part in parts)]
    empty = [name for name, parts in notebooks.items() if all(part.state is CheckState.EMPTY for part in parts)]
    begun = [name for name in notebooks if name not in (*done, *empty)]
    if done:
        yield f"complete: {_stems(done)}"
    for name in begun:
        if name == (asks or name):
            yield from _missing(checked, name, notebooks[name])
    if others := [name for name in begun if name != (asks or name)]:
        yield f"something is missing: {_stems(others)} (press Check there to see what)"
    if empty:
        yield f"nothing yet: {_stems(empty)}"


def _missing(checked: Checked, name: str, parts: Sequence[CheckedPart]) -> Iterator[str]:
    """Yield what is recorded of a notebook that is begun, and what is missing, each part once."""
    from labcourse.run.check import GOOD, CheckState

    there = [number for number in dict.fromkeys(part.question for part in parts) if checked.questions[number]]
    yield f"{_stems([name])}: " + (f"complete: {', '.join(there)}" if there else "no question is complete")
    texts = {CheckState.DIFFERENT: "recorded, but different from your page", CheckState.MISSING: "not recorded. "}
    causes: dict[tuple[CheckState, Problem | None], dict[str, list[str]]] = {}
    for part in parts:
        if part.state not in GOOD:
            causes.setdefault((part.state, part.why), {}).setdefault(part.question, []).append(part.name)
    for (state, why), questions in causes.items():
        lost = "; ".join(" ".join((number, ", ".join(names))) for number, names in questions.items())
        yield f"  {lost}: {texts.get(state, state)}{sentence(why) if why else ''}"


def _stems(names: Sequence[str]) -> str:
    return ", ".join(name.removesuffix(".ipynb") for name in names)


@contextlib.contextmanager
def _a_run(command: str) -> Iterator[None]:
    """Run a command, unless a program runs the notebooks that ask for it; end in order when it is stopped."""
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
    for number in _ENDINGS:  # another one must not disturb what ends now
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt

"""The command ``lab``: a student's folder is filled with the course, and JupyterLab opens on it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from labcourse import benches, course_file, course_place, courses, files, hub, program, student_id
from labcourse.errors import ConfigurationError, StudentIDError
from labcourse.files import COURSE_FILE
from labcourse.jupyterlab import open_jupyterlab
from labcourse.safe_text import no_escapes, say


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
    """Open JupyterLab on the course's notebooks, in a folder of your own.

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
    return [path.name for path in courses.current().notebooks.glob("*.ipynb")]


def _is_source(folder: Path) -> bool:
    """Whether a folder is that of a checkout's own notebooks, where nobody works as a student."""
    course = courses.current().notebooks
    return _is_home(folder, course) and not _is_release(course)


def _is_home(folder: Path, course: Path) -> bool:
    return folder.resolve() == course.resolve()


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
    installed = courses.current()
    course = installed.notebooks
    if folder.exists() and not folder.is_dir():
        raise ConfigurationError(f"{folder} is not a folder.")
    folder.mkdir(parents=True, exist_ok=True)
    at_home = _is_home(folder, course)
    begun = _begun(folder).get(course_file.RELEASE)
    lines = [] if at_home else _brought_up_to_date(folder, course, student)
    if begun is not None and begun == _begun(course).get(course_file.RELEASE):
        lines += _missing(folder, course)
    elif not at_home:
        lines += _copied(folder, course)
    if student is not None:
        # In a checkout, the bench is as it is drawn now: a file that names the student alone is of the first draw.
        now = {} if _is_release(course) else {"draw": installed.draw}
        _write_course(folder, {**(_begun(folder) or now), course_file.STUDENT: student})
        lines.append(f"Student: {student}")
    return lines


def _missing(folder: Path, course: Path) -> list[str]:
    """Name the notebooks that are not in a folder of this release: some hand out a course week by week."""
    names = [path.stem for path in sorted(course.glob("*.ipynb")) if not (folder / path.name).exists()]
    return [f"Not in {folder}: {', '.join(names)}. {program.name()} restore NAME brings one."] if names else []


def _copied(folder: Path, course: Path) -> list[str]:
    """Copy what is not there yet, and say so."""
    wanted = {path.name: path for path in sorted(course.glob("*.ipynb"))}
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


def _write_course(folder: Path, course: dict[str, Any]) -> None:
    try:
        files.write(folder / COURSE_FILE, course_file.text(course))
    except OSError as error:
        raise ConfigurationError(f"{folder / COURSE_FILE} cannot be written: {error.strerror}.") from None

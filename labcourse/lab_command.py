"""The command ``lab``: fill a student's folder with the course, and open JupyterLab on it."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
import typer.core

from labcourse import course_file, courses, files, program, student_id
from labcourse.courses import NOTEBOOKS
from labcourse.errors import CheckError, ConfigurationError, StudentIDError
from labcourse.files import COURSE_FILE
from labcourse.messages import number_of
from labcourse.run import commands
from labcourse.safe_text import no_escapes, say


class LabCommand(typer.core.TyperCommand):
    """The command ``lab``, which says where JupyterLab's options go."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; an unknown option is refused with an example."""
        known = {"--help", *(name for parameter in self.params for name in parameter.opts)}
        for text in itertools.takewhile(lambda text: text != "--", args):
            if text.startswith("-") and text.partition("=")[0] not in known:
                example = f"{program.name()} lab -- {text}"
                raise typer.BadParameter(
                    f"There is no option {text}. If it is JupyterLab's, write it after --: {example}"
                )
        return super().parse_args(ctx, args)


def lab(
    folder_and_options: Annotated[
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
    arguments = list(folder_and_options or [])
    given = Path(arguments.pop(0)) if arguments and not arguments[0].startswith("-") else None
    if arguments and not arguments[0].startswith("-"):
        raise typer.BadParameter(f"One folder, please; {arguments[0]!r} is another. Put JupyterLab's options after --.")
    if student is not None:
        student = student_id.normalised(student)
    folder, messages = choose(given)
    commands.use_course_of(folder)
    installed = courses.current()
    say(*messages)
    is_source = _is_home(folder, installed.notebooks) and not _release_of(installed.notebooks)
    if student is None and not is_source:
        student = _ask_for_student(folder)
    say(*fill(folder, student))
    if not is_source:
        remember(folder)
        if message := course_file.other_hub_user(course_file.student(folder)):
            typer.echo(message)
    if course_file.on_hub():
        typer.echo(f"JupyterLab runs here already, as the hub's: open {folder} in its file browser.")
    else:
        open_jupyterlab(folder, arguments)


def open_jupyterlab(folder: Path, options: list[str]) -> None:
    """Run JupyterLab on a folder; nothing is imported from there, or from the folder in which the command is run."""
    here = (Path.cwd(), folder.resolve())
    sys.path[:] = [path for path in sys.path if path and Path(path).resolve() not in here]  # as python -P
    from labcourse import server

    server.run(folder, options)


def _is_home(folder: Path, course: Path) -> bool:
    return folder.resolve() == course.resolve()


def _ask_for_student(folder: Path) -> str | None:
    """Ask the hub, or the person at the terminal, for the student's ID, if the folder has none; None if unknown."""
    try:
        known = (course_file.read(folder) or {}).get(course_file.STUDENT_KEY)
    except ConfigurationError:  # it may name a student: filling the folder says so
        return None
    if known:
        return None
    try:
        if user := course_file.hub_user():
            typer.echo(
                f"The hub knows you as {user}: that is your student ID. Is it another? Give it by --student YOUR-ID."
            )
            return user
    except ConfigurationError as error:  # no ID, but a person at the terminal may have one
        typer.secho(no_escapes(str(error)), fg="red")
    while commands.at_a_terminal():
        prompt = "Your student ID, by which your instructor knows you (Enter: later)"
        answer = typer.prompt(prompt, default="", show_default=False).strip()
        if not answer:
            break
        try:
            return student_id.normalised(answer)
        except StudentIDError as error:
            typer.secho(no_escapes(str(error)), fg="red")
    typer.echo("There is no student ID yet: give yours by --student YOUR-ID.")
    return None


def fill(folder: Path, student: str | None = None) -> list[str]:
    """Copy the course's files that a folder lacks, and write down the student. No answer is overwritten.

    A folder that was begun with another release is restored: it is brought to the installed one.

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
        If the ID is not valid, or there are no notebooks to copy.
    OSError
        If a file cannot be written.
    """
    if student is not None:
        student = student_id.normalised(student)
    installed = courses.current()
    course = installed.notebooks
    if folder.exists() and not folder.is_dir():
        raise ConfigurationError(f"{folder} is not a folder.")
    folder.mkdir(parents=True, exist_ok=True)
    lines, begun, release = list[str](), course_file.about(folder).get(course_file.RELEASE_KEY), _release_of(course)
    if student is not None:
        # In a checkout, the file says how the bench was drawn, so that a later draw changes nothing in silence.
        now = {} if release else {"draw": installed.draw}
        named = {course_file.COURSE_KEY: courses.name_of(installed.package), course_file.STUDENT_KEY: student}
        files.write(folder / COURSE_FILE, course_file.text({**(course_file.about(folder) or now), **named}))
    if not _is_home(folder, course):
        if release and begun != release:
            from labcourse.answers import notebooks
            from labcourse.run.restore import restore

            try:
                for line in restore(folder, notebooks.masters()):
                    lines.append(line)
            except CheckError as error:  # the next one tries again
                lines.append(str(error))
        if begun is None or begun != release:
            lines += _copied(folder, course)
        elif names := [path.stem for path in sorted(course.glob("*.ipynb")) if not (folder / path.name).exists()]:
            # Some hand out a course week by week.
            lines.append(f"Not in {folder}: {', '.join(names)}. {program.name()} restore NAME brings one.")
    return lines if student is None else [*lines, f"Student: {student}"]


def _copied(folder: Path, course: Path) -> list[str]:
    """Copy the files that a folder lacks, and return messages about it."""
    wanted = {path.name: path for path in sorted(course.glob("*.ipynb"))}
    if _release_of(course):  # a checkout always has recordings; students have those that their release hands out
        wanted |= {f"data/{path.name}": path for path in sorted((course.parent / "data").glob("*.mat"))}
    linked = [name for name in wanted if (folder / name).is_symlink() or (folder / name.partition("/")[0]).is_symlink()]
    copied = [name for name in wanted if name not in linked and not (folder / name).exists()]
    for name in copied:
        (folder / name).parent.mkdir(exist_ok=True)
        files.write(folder / name, wanted[name].read_bytes())
    if copied and len(copied) == len(wanted):
        notebooks = number_of(sum(name.endswith(".ipynb") for name in copied), "notebook")
        return [f"The course was copied to {folder}: {notebooks}."]
    lines = [f"Copied to {folder}: {', '.join(copied)}"] if copied else []
    if linked:
        lines.append(f"Links are not followed, in {folder}: {', '.join(linked)}. Put the files themselves there.")
    return lines


def _release_of(folder: Path) -> Any:
    return course_file.about(folder).get(course_file.RELEASE_KEY)


# --- the folder to work in: the given one, the course around it, or the last one -------------------------------------
# The last folder of each course is saved in a small file beside Jupyter's settings; the student who works in a folder,
# in the folder's ``course.json``.

SETTINGS_VARIABLE = "LABCOURSE_CONFIG_DIR"  #: environment variable: the folder of the user's settings
_LAST = "lab.json"  # there: {name of a course: "its last folder"}; of earlier versions {"folder": "..."}, of any course


def choose(given: Path | None) -> tuple[Path, list[str]]:
    """Return the folder to work in, and messages about it.

    No course is begun inside another: that one is opened.

    Parameters
    ----------
    given : by the user; None if they gave none

    Raises
    ------
    ConfigurationError
        If a course is to be begun, and it is not known which.
    """
    if given is None:
        return _default_folder()
    for folder in (given, *given.resolve().parents):
        if course_file.courses_of(folder):
            inside = f"{given} is inside the course in {folder}: that one is opened, and no second one begun."
            return folder, [inside] if folder != given else []
    if course_file.courses_of(given / NOTEBOOKS):
        return given / NOTEBOOKS, [f"The course in {given / NOTEBOOKS} is opened."]
    if not os.environ.get(courses.COURSE_VARIABLE) and (beside := course_file.around(Path())):
        commands.use_course_of(beside)  # several may be installed: the new folder is of the course in which it is begun
    last = remembered()
    if last is not None and last != given.resolve():
        return given, [f"A new course is begun in {given}. The last one is in {last}."]
    return given, []


def _default_folder() -> tuple[Path, list[str]]:
    """Return the folder to work in if the user gave none, and messages about it."""
    default = Path(NOTEBOOKS)
    if folder := course_file.around(Path()):
        return (default, []) if folder == default.resolve() else (folder, [f"The course in {folder} is opened."])
    if last := remembered():
        return last, [f"The course in {last} is opened, as last time."]
    return Path(_name()) if course_file.courses_of(default) else default, []  # that is another course's


def remember(folder: Path) -> None:
    """Save the folder that the student works in, so that it need not be given next time."""
    place = settings()
    last = {**_last(), _name(): str(folder.resolve())}
    with contextlib.suppress(OSError):  # a home that cannot be written: next time, the folder has to be given
        place.mkdir(parents=True, exist_ok=True)
        files.write(place / _LAST, json.dumps(last) + "\n")


def remembered() -> Path | None:
    """Return the last folder of the course that is worked on; None if it is not known, or no longer there."""
    name, last = _name(), _last()
    folders = (Path(folder) for folder in (last.get(name), last.get("folder")) if isinstance(folder, str))
    return next((folder for folder in folders if course_file.courses_of(folder) == [name]), None)


def _name() -> str:
    return courses.name_of(courses.current().package)


def _last() -> dict[str, Any]:
    try:
        return files.object_in((settings() / _LAST).read_bytes())
    except OSError:
        return {}


def settings() -> Path:
    """Return the folder of the user's settings; it may not be there yet."""
    from jupyter_core.paths import jupyter_config_dir

    return Path(os.environ.get(SETTINGS_VARIABLE) or Path(jupyter_config_dir(), "labcourse"))

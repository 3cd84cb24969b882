"""The instructor's commands, in the order of use: each calls the engine and prints what was done.

A command's docstring is its help. Errors become messages in :mod:`labcourse.command_line`. Modules load when a command
needs them, so that ``--help`` is quick.
"""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from datetime import UTC, tzinfo
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from labcourse import clock, files, program
from labcourse.errors import GradebookError, GradingError, IsolationError
from labcourse.grading import course as courses
from labcourse.messages import number_of, shortened
from labcourse.safe_text import say
from labcourse.sentences import sentences
from labcourse.student_id import GRADEBOOK_FILE, GRADES_FILE, INTAKE_FILE

if TYPE_CHECKING:
    from labcourse.grading.course_check import CourseFault
    from labcourse.grading.gradebook import Erased, Gradebook

ALL_WELL, SOME_TROUBLE, NO_ISOLATION = 0, 1, 3  #: exit codes; 2 is for any error that stops the command
_COURSE, _CLASS, _PERSON = "Course", "Class", "Person"  # panels of --help
_ANSWER_LENGTH = 60  # characters of an answer that are shown when it is marked
LONGEST_NAME = 80  #: characters of a person's name, in the record and on pages

app = typer.Typer()
outcomes = typer.Typer(help="Show the class's levels in each outcome, and fill in scoring sheets.")
person = typer.Typer(help="Copy or erase all that is stored about a student.")
app.add_typer(outcomes, name="outcomes", no_args_is_help=True, rich_help_panel=_CLASS)
app.add_typer(person, name="person", no_args_is_help=True, rich_help_panel=_PERSON)

_SOLUTIONS = "The folder of course.py; solutions/ here."
SolutionsOption = Annotated[
    str | None, Option("--solutions", envvar=courses.SOLUTIONS_VARIABLE, metavar="FOLDER", help=_SOLUTIONS)
]
_MARKS = "The folder with the marks and results of the class; or its gradebook: a file, or a database's URL."
MarksArgument = Annotated[str, Argument(metavar="MARKS", help=_MARKS)]
OutOption = Annotated[
    Path | None, Option(help="Folder for the results.", file_okay=False, show_default="the gradebook's folder")
]


def _name(given: str) -> str:
    """Return a person's name without spaces around it. Raises BadParameter unless it is plain text on one line."""
    name = given.strip()
    if not name.isprintable() or len(name) > LONGEST_NAME:
        raise typer.BadParameter(f"{name!a}: a name is one line of at most {LONGEST_NAME} printable characters.")
    return name


ByOption = Annotated[str, Option(metavar="NAME", parser=_name, help="Your name, for the record.")]
StudentArgument = Annotated[str, Argument(metavar="STUDENT", help="The student's ID.")]
_AGAIN = "Accept a person who was erased, as a new student; may be given several times."
AgainOption = Annotated[list[str] | None, Option(metavar="ID", help=_AGAIN)]
JobsOption = Annotated[int, Option(min=1, help="Number of submissions to work on in parallel.")]
DryRunOption = Annotated[bool, Option("--dry-run", help="Show what would be done, but change nothing.")]
JsonOption = Annotated[bool, Option("--json", help="Print JSON for scripts: one object per line.")]
NewNameArgument = Annotated[str, Argument(metavar="NAME", help="Name of the course's folder and of its package.")]
RunOption = Annotated[bool, Option(help="Run the notebooks without and with solutions, and mark these.")]
StudentsOption = Annotated[list[str] | None, Option(help="Only those of this student; may be given several times.")]
SectionsOption = Annotated[bool, Option(help="Show the sections of the class side by side.")]
ReasonOption = Annotated[str, Option(help="The reason, for the student and for the record.")]
OneQuestionOption = Annotated[str | None, Option(help="Only this question, as 1.11.")]
StudentsArgument = Annotated[str | None, Argument(metavar="STUDENT", help="The student's ID; all students without it.")]
AskOption = Annotated[bool, Option("--ask", help="Note what a student asks; then --question and --part are needed.")]


def _file_of(marks: str) -> Path | None:
    """Return the gradebook's file; None for a database's URL. A new name without an ending is that of a folder."""
    from labcourse.grading.gradebook.database import is_address

    path = Path(marks)
    if is_address(marks):
        return None
    return path if path.is_file() or (path.suffix and not path.is_dir()) else path / GRADEBOOK_FILE


def _gradebook(marks: str, make: bool = False) -> Gradebook:
    """Open a gradebook. Only ``make`` makes one that does not exist: a slip in its name should not.

    Raises GradingError if it does not exist, and GradebookError if it cannot be opened.
    """
    from labcourse.grading.gradebook import Gradebook

    file = _file_of(marks)
    if file is not None and make:
        file.parent.mkdir(parents=True, exist_ok=True)
    elif file is not None and not file.exists():
        raise GradingError(f"There is no gradebook {file}. ({program.name()} grade makes one.)")
    return Gradebook(marks if file is None else str(file))


def _results(marks: str, out: Path | None) -> Path:
    """Return the folder of results; raise GradingError if the gradebook is a database and no folder is named."""
    if (folder := _results_or_none(marks, out)) is None:
        raise GradingError("Say by --out into which folder it is to be written.")
    return folder


def _results_or_none(marks: str, out: Path | None) -> Path | None:
    """Return the folder of results: the named one, or that of the gradebook's file; None if it is a database's URL."""
    file = _file_of(marks) if out is None else None
    return out if file is None else file.parent


# --- the course -------------------------------------------------------------------------------------------------------


@app.command(rich_help_panel=_COURSE)
def new(name: NewNameArgument) -> None:
    """Make a folder with a small complete course, as a start for your own."""
    from labcourse.grading.new import make

    folder = make(name, Path.cwd())
    typer.echo(f"{folder}\nGo on there: {program.name()} make-notebooks, then {program.name()} check-course.")


@app.command(rich_help_panel=_COURSE)
def make_notebooks(solutions: SolutionsOption = None) -> None:
    """Make the student notebooks in notebooks/ from the notebooks with solutions."""
    from labcourse.grading.release.student_course import write_notebooks

    for path in write_notebooks(courses.find(solutions, with_optional=True)):
        typer.echo(str(path))


@app.command(rich_help_panel=_COURSE)
def check_course(solutions: SolutionsOption = None, run: RunOption = True) -> None:
    """Find what is missing or contradictory in a course: questions, key, cells, numbers in texts.

    Exit code: 0 no problems, 1 some problems.
    """
    from labcourse.grading.course_check import check

    course = courses.find(solutions)
    _say_faults(course, check(course, run))


@app.command(rich_help_panel=_COURSE)
def rehearse(
    solutions: SolutionsOption = None,
    benches: Annotated[int, Option(min=1, help="Number of made-up students, each with their own bench.")] = 20,
) -> None:
    """Find what would go wrong in a class: install the release anew, and mark answers on many benches.

    It begins with check-course, and takes some minutes. Exit code: 0 no problems, 1 some problems.
    """
    from labcourse.grading.rehearse import rehearse as rehearsed

    course = courses.find(solutions)
    _say_faults(course, rehearsed(course, benches, lambda what: typer.echo(f"… {what}", err=True)))


def _say_faults(course: courses.Course, found: Iterable[CourseFault]) -> None:
    """Print faults of a course as they come, and how many; raise Exit if there are any besides notes."""
    faults = 0
    for fault in found:
        faults += not fault.is_note
        say(str(fault))
    if faults:
        typer.echo(f"{faults} found.")
        raise typer.Exit(SOME_TROUBLE)
    notebooks, asked = number_of(len(course.notebooks), "notebook"), len(course.catalogue.everything)
    typer.echo(f"{asked} questions, tables and reports in {notebooks}: everything fits.")


@app.command(rich_help_panel=_COURSE)
def release(
    out: Annotated[Path, Argument(metavar="OUT", help="Folder for it; made if needed.", file_okay=False)],
    solutions: SolutionsOption = None,
    with_data: Annotated[bool, Option("--with-data", help="Include the sample recordings.")] = False,
    replace: Annotated[bool, Option("--replace", help="Delete an earlier release in OUT.")] = False,
    keep: Annotated[bool, Option(help="Store the zip; grading needs it for work begun with it.")] = True,
) -> None:
    """Make the folder and zip that students get, without solutions, key and the instructor's modules."""
    from labcourse.grading.release import releases, student_course

    course = courses.find(solutions)
    made = student_course.release(course, out, with_data=with_data, replace=replace)
    count = number_of(len(made.notebooks), "notebook")
    typer.echo(f"{count}: {', '.join(made.notebooks)}\n{made.folder}\n{made.archive}")
    if keep:
        typer.echo(f"Release {made.id}, stored as {releases.store(course, made.archive, made.id)}")
    else:
        typer.echo(f"Release {made.id}, not stored: what is done with it is run with the course as it is.")


@app.command(rich_help_panel=_COURSE)
def make_lite(
    out: Annotated[Path, Argument(metavar="OUT", help="Folder for it, which is not there yet.", file_okay=False)],
    solutions: SolutionsOption = None,
    pyodide: Annotated[str, Option(help="Folder or address of Pyodide's files, if not the public one.")] = "",
) -> None:
    """Make a site with the whole course in a browser, for students who cannot install it. Needs pip's index.

    Any static server can hand it out, by https. The site holds a release, no solution and no key.
    """
    from labcourse.grading.release import lite

    stored = lite.make(courses.find(solutions), out, pyodide or lite.TESTED.address)
    typer.echo(f"{out}\nIts release is stored as {stored}")


# --- the class --------------------------------------------------------------------------------------------------------


@app.command(rich_help_panel=_CLASS)
def doctor(as_json: JsonOption = False) -> None:
    """Check that students' code can be isolated on this computer: look at each layer, and try to break out of eight.

    Exit code: 0 it can, 3 it cannot.
    """
    from labcourse.grading.running import isolation_report

    examined = isolation_report.examine()
    if as_json:
        typer.echo(json.dumps(examined.as_data()))
    else:
        isolation_report.print_state(examined)
    raise typer.Exit(ALL_WELL if examined.good else NO_ISOLATION)


@app.command(rich_help_panel=_CLASS)
def roster(
    marks: MarksArgument,
    file: Annotated[Path | None, Argument(metavar="FILE", help="A CSV, a line for each.", dir_okay=False)] = None,
    remove: Annotated[list[str] | None, Option(metavar="ID", help="Remove this student; once for each.")] = None,
    again: AgainOption = None,
) -> None:
    """Read the names of a class from a CSV file into the gradebook, which is made if needed.

    The columns id, name, email, section and group are read, and other names by which platforms know a student.
    Lists of several platforms add up: names, numbers and addresses are added. An empty cell changes nothing; a cell
    with - deletes the stored value. Students who are not in the file stay: --remove removes an ID that was mistyped, if
    nothing was handed in, graded or written under it.

    Exit code: 0 all read, 1 some lines were not read, or a student was not removed, 2 nothing read.
    """
    if file is None and not remove:
        raise GradingError("Name the roster, a CSV file; or by --remove the students to remove.")
    problems: list[str] = []
    with _gradebook(marks, make=file is not None) as book:
        if file is not None:
            read = book.import_roster(file, again or ())
            say(f"{read.added} added, {read.changed} changed, {read.unchanged} as they were.", *read.notes)
            problems += read.problems
        for student in remove or ():
            try:
                say(f"{book.remove(student).student} is no longer in the gradebook.")
            except GradebookError as error:
                problems.append(str(error))
    say(*problems, err=True)
    raise typer.Exit(SOME_TROUBLE if problems else ALL_WELL)


_SUPPLY = "Supply a missing answer. It earns nothing; later answers can. An empty VALUE takes it back."
_FOR = "The submissions are for this assignment: if one cannot be read, nothing else becomes undecided."
_PLATFORM = "The learning platform that named the submissions, where their names leave it open; none: they are IDs."
_CLUSTER = "Run on the workers of this dask.distributed scheduler, as tcp://host:8786."
_UNSAFE = "Run code with your own rights."


@app.command(rich_help_panel=_CLASS)
def grade(
    marks: MarksArgument,
    submissions: Annotated[Path, Argument(metavar="SUBMISSIONS", help="A folder or zip, as a platform gives it.")],
    out: OutOption = None,
    solutions: SolutionsOption = None,
    jobs: JobsOption = 1,
    scheduler: Annotated[str | None, Option(help=_CLUSTER)] = None,
    cell_timeout: Annotated[int, Option(min=1, help="Seconds that a cell may take.")] = 60,
    deadline: Annotated[int, Option(min=1, help="Seconds that a submission may take.")] = 600,
    memory: Annotated[int, Option(min=256, help="Megabytes that a submission may take.")] = 2048,
    processes: Annotated[int, Option(min=8, help="Processes that a submission may have.")] = 100,
    probe_seed: Annotated[
        int | None,
        Option(min=0, max=2**53, help="Seed for the inputs of functions.", show_default="the gradebook's secret"),
    ] = None,
    supply: Annotated[list[str] | None, Option(metavar="STUDENT:QUESTION.PART=VALUE", help=_SUPPLY)] = None,
    times: Annotated[Path | None, Option(help="A CSV with names and times of receipt.", dir_okay=False)] = None,
    time_zone: Annotated[str, Option(help="Of times without one, for example Europe/Berlin.")] = "UTC",
    again: AgainOption = None,
    assignment: Annotated[str | None, Option(metavar="NAME", help=_FOR)] = None,
    platform: Annotated[str | None, Option(metavar="NAME", help=_PLATFORM)] = None,
    as_json: JsonOption = False,
    unsafe_no_isolation: Annotated[bool, Option("--unsafe-no-isolation", help=_UNSAFE)] = False,
) -> None:
    """Run and mark the submissions of a class. Unchanged submissions are not run again.

    If SUBMISSIONS is a gradebook of an earlier version, the files that are stored in it are graded once more.
    MARKS is made if needed. Marks, grades.csv and all students' feedback are written there.

    Exit code: 0 all graded, 1 trouble with some submissions (they get the points that they earned), 2 nothing graded,
    3 nothing graded, because students' code cannot be isolated here.
    """
    folder, zone = _check_submissions(submissions, _results(marks, out)), _zone(time_zone)
    from labcourse.grading.isolation import unisolated
    from labcourse.grading.running import isolation_report

    check = unisolated.check_allowed if unsafe_no_isolation else isolation_report.check
    # Try to break out before any submission can. This mostly waits; meanwhile libraries are imported.
    isolation = ThreadPoolExecutor(1).submit(check) if unsafe_no_isolation or scheduler is None else None
    from labcourse.grading.assignments import find
    from labcourse.grading.batch import Batch, Settings
    from labcourse.grading.intake.platforms import read_times
    from labcourse.grading.reports import intake_table
    from labcourse.grading.reports.changes import changes_since
    from labcourse.grading.reports.grades import Reports, make_folder
    from labcourse.grading.reports.live_report import JsonLines, Screen
    from labcourse.grading.running import supplied
    from labcourse.grading.running.runner import RunLimits

    when, problems = read_times(times, zone) if times else ({}, [])
    limits = RunLimits(cell=cell_timeout, submission=deadline, memory=memory * 2**20, processes=processes)
    try:
        course = courses.find(solutions)
        values = tuple(supplied.read(text, course.catalogue) for text in supply or ())
        if isolation is not None:  # on a cluster it is the workers' isolation that counts
            isolation.result()
        make_folder(folder)
        decided = intake_table.read(folder / INTAKE_FILE)
        decisions = {row.key: text for row, text in decided.items() if text}
        with _gradebook(marks, make=True) as book:
            only = find(course, assignment) if assignment else None
            earlier = _taken_over(marks, submissions)
            settings = Settings(
                limits=limits,
                jobs=jobs,
                scheduler=scheduler,
                probe_seed=probe_seed,
                isolated=not unsafe_no_isolation,
                supplied=values if earlier is None else (*supplied.of_earlier(earlier), *values),
                times=when,
                zone=zone,
                again=tuple(again or ()),
                decisions=decisions,
                only=only,
                platform=platform or "",
            )
            batch = Batch(submissions if earlier is None else earlier, course, book, settings)
            if not batch.students:  # nothing is graded until somebody decides
                intake_table.write(folder / INTAKE_FILE, batch.doubts, decided, batch.sources)
                raise GradingError(
                    " ".join([f"Nothing was graded. Decide it in {folder / INTAKE_FILE}.", *sentences(batch.ignored)])
                )
            show = JsonLines if as_json else Screen
            progress = show(len(batch.students), [*batch.ignored, *problems], batch.absent)
            with Reports(folder, course, book, batch.students) as reports, progress:
                try:
                    for step in batch.grade():
                        progress.add(step.has_run, step.graded, changes_since(step.before, step.graded))
                finally:
                    rows = intake_table.write(folder / INTAKE_FILE, batch.doubts, decided, batch.sources)
    except IsolationError as error:
        isolation_report.print_refusal(error)
        raise typer.Exit(NO_ISOLATION) from None
    doubts = (
        f"What cannot be known for certain is in {folder / INTAKE_FILE}, with what was assumed "
        f"({number_of(rows, 'row')}): write what is right under decision and grade again."
    )
    say(*reports.notices(), *([doubts] if rows else []), err=True)
    raise typer.Exit(SOME_TROUBLE if progress.trouble else ALL_WELL)


def _taken_over(marks: str, submissions: Path) -> dict[str, dict[str, Any]] | None:
    """Take over the gradebook of an earlier version that is named in place of submissions; None for submissions.

    Raises GradingError if MARKS is a database's URL.
    """
    from labcourse.grading.gradebook.earlier import is_gradebook, take_over

    if not is_gradebook(submissions):
        return None
    if (file := _file_of(marks)) is None:
        raise GradingError("An earlier gradebook is graded into a file: name a folder as MARKS.")
    return take_over(file, submissions)


def _check_submissions(submissions: Path, results: Path) -> Path:
    """Return the folder of results. Raise GradingError if SUBMISSIONS cannot be those of a class.

    They cannot if they do not exist, are an empty folder or a class's results, or if the results would lie among them.
    """
    if not submissions.exists() or (submissions.is_dir() and not any(submissions.iterdir())):
        raise GradingError(f"There is nothing in {submissions}.")
    if (submissions / GRADEBOOK_FILE).is_file():
        raise GradingError(f"{submissions} is a class's folder of marks. Name that first, then the submissions.")
    if results.resolve().is_relative_to(submissions.resolve()):
        raise GradingError(f"{results} lies among the submissions: choose another folder for the results.")
    return results


def _zone(name: str) -> tzinfo:
    """Return the time zone of a name. Raises GradingError if there is none."""
    from zoneinfo import ZoneInfo

    try:
        return UTC if name == "UTC" else ZoneInfo(name)
    except (ValueError, OSError, LookupError):
        raise GradingError(f"There is no time zone {name!r}; write --time-zone as Europe/Berlin.") from None


@app.command(rich_help_panel=_CLASS)
def status(marks: MarksArgument, solutions: SolutionsOption = None, out: OutOption = None) -> None:
    """Show what you must do today, each with its command, and where the class is in the term.

    The same is written to class.html in the folder of results. This page names students: do not publish it.

    Exit code: 0 all shown, 2 something could not be read or written.
    """
    from labcourse.grading.overview import OVERVIEW_FILE, as_page, as_text, class_overview

    course, folder = courses.find(solutions), _results_or_none(marks, out)
    with _gradebook(marks) as book:
        overview = class_overview(book, course, folder)
    typer.echo(as_text(overview))
    if folder is None:
        typer.echo("\nNo page was written: say where by --out.")
        return
    folder.mkdir(parents=True, exist_ok=True)
    files.write(folder / OVERVIEW_FILE, as_page(overview))
    typer.echo(f"\nThe same as a page: {folder / OVERVIEW_FILE}")


_EACH_NAME = "Your name, for the record; once for each."
_URL = "The page's address for other computers, as https://marks.school.edu: a host that serves nothing else."
_PROXY = "IP address of the proxy that serves --url: 127.0.0.1 if it runs on this computer."
_NEW_TOKEN = "Only make and print a new address for NAME; the former one ends at once."


@app.command(rich_help_panel=_CLASS)
def score(
    marks: MarksArgument,
    solutions: SolutionsOption = None,
    by: Annotated[list[str] | None, Option(metavar="NAME", parser=_name, help=_EACH_NAME)] = None,
    port: Annotated[int, Option(min=0, max=65535, help="Port of the page; 0: any free port.")] = 0,
    show_names: Annotated[bool, Option("--names", help="Show students' names instead of numbers.")] = False,
    browser: Annotated[bool, Option(help="Open a browser for the first scorer; never with --url.")] = True,
    url: Annotated[str | None, Option(metavar="URL", help=_URL)] = None,
    proxy: Annotated[str | None, Option(metavar="ADDRESS", help=_PROXY)] = None,
    certificate: Annotated[Path | None, Option(help="Certificate (PEM), if no proxy encrypts.")] = None,
    private_key: Annotated[Path | None, Option(help="Its key, if that is in another file.")] = None,
    new_token: Annotated[str | None, Option(metavar="NAME", parser=_name, help=_NEW_TOKEN)] = None,
    revoke: Annotated[str | None, Option(metavar="NAME", help="Only end the address of NAME, at once.")] = None,
) -> None:
    """Score the answers that a person must read, in a browser.

    With --url, assistants score at their own computers, and their addresses stay valid when the command ends.

    Exit code: 0 all well, 2 nothing done.
    """
    from labcourse.grading.overview import as_page, class_overview
    from labcourse.grading.scoring import rubric, start
    from labcourse.grading.scoring.desk import Desk

    site = start.find_site(url, proxy, certificate, private_key, only_address=new_token is not None)
    if new_token is not None or revoke is not None:
        with _gradebook(marks) as book:
            start.change_tokens(book, site, new_token, revoke)
        return
    names = by or []
    # Names must be non-empty, and differ by more than capitals.
    if not (names or site) or len({*map(str.casefold, names), ""}) <= len(names):
        raise GradingError("Say who scores: --by NAME, once for each. Two scorers need two names.")
    course = courses.find(solutions)
    with _gradebook(marks) as book:
        items = rubric.read(course.folder, course.catalogue)
        desk = Desk(book, course.catalogue, items, course.settings.levels, show_names)
        folder = _results_or_none(marks, None)
        start.serve(
            desk,
            names,
            site,
            port=port,
            browser=browser,
            course=course,
            class_page=lambda link: as_page(class_overview(book, course, folder), link),
            results=folder,
            certificate=certificate,
            private_key=private_key,
        )


@app.command(rich_help_panel=_CLASS)
def regrade(
    marks: MarksArgument,
    solutions: SolutionsOption = None,
    question: Annotated[list[str] | None, Option(help="Mark only this question; may be given several times.")] = None,
    out: OutOption = None,
    jobs: JobsOption = 1,
) -> None:
    """Mark all answers again with the present key, and show what changed. No notebook is run.

    Marks that a person gave stay; if the key would give other points, they are listed. grades.csv and the feedback are
    written anew; if MARKS is a database's URL, --out names the folder for them.

    Exit code: 0 all marked, 1 some could not be marked (their marks stay), 2 nothing marked.
    """
    from labcourse.grading import counting, graded_run
    from labcourse.grading.accounts import points
    from labcourse.grading.reports.changes import changes
    from labcourse.grading.reports.grades import Reports

    course, folder = courses.find(solutions), _results_or_none(marks, out)
    changed, failed, faults = Counter[bool](), False, dict[str, None]()
    with _gradebook(marks) as book, ExitStack() as stack:
        reports = None if folder is None else stack.enter_context(Reports(folder, course, book))
        for done in counting.regrade(book, course, question or (), jobs=jobs):
            change = changes(done.before, done.after)
            changed[bool(change.parts)] += 1
            failed |= bool(done.problem)
            faults |= dict.fromkeys(sentences(graded_run.key_faults(done.after).values()))
            if done.problem:
                say(f"{change.student}: {done.problem} The marks stay as they were.", err=True)
            say(*([str(change)] if change.parts else []))
            for one in done.unchanged:
                text = f"{points(one['points'])} points, given by a person, stay; the key gives {points(one['by_key'])}"
                say(f"{change.student}, {one['question']}, {one['part']}: {text}.")
    say(*faults, *(reports.notices() if reports else ()), err=True)
    say(f"Other marks than before: {number_of(changed[True], 'student')}. The same: {changed[False]}.")
    raise typer.Exit(SOME_TROUBLE if failed or faults else ALL_WELL)


@app.command(rich_help_panel=_CLASS)
def report(marks: MarksArgument, out: OutOption = None, solutions: SolutionsOption = None) -> None:
    """Write grades.csv and all students' feedback from the gradebook. Nothing is run or marked.

    Exit code: 0 all written, 2 something could not be written.
    """
    from labcourse.grading.reports.grades import Reports

    course, folder = courses.find(solutions), _results(marks, out)
    with _gradebook(marks) as book:
        reports = Reports(folder, course, book)
        count = reports.write_all()
    say(f"Pages of {number_of(count, 'student')}: {folder}", *reports.notices())


_SOME_ASSIGNMENTS = "Give back only this assignment; may be given several times."


@app.command(rich_help_panel=_CLASS)
def publish(
    marks: MarksArgument,
    by: ByOption,
    note: Annotated[str, Option(help="A remark for the record, for example: without the reports.")] = "",
    assignment: Annotated[list[str] | None, Option("--assignment", metavar="NAME", help=_SOME_ASSIGNMENTS)] = None,
    yes: Annotated[bool, Option("--yes", help="Record it, and write the pages.")] = False,
    undo: Annotated[bool, Option("--undo", help="Take the last one back, and say who may have read it.")] = False,
    solutions: SolutionsOption = None,
    out: OutOption = None,
) -> None:
    """Show what would be given back to whom; with --yes, write all students' pages and record the time.

    It lists who gets what, which answers lost points without a remark, what was handed in and does not count, and what
    is not ready. From the first --assignment on, pages and marks.json show only the assignments that were given back.
    Your platform delivers the pages to students (export --feedback writes the zip that it takes). If feedback opens
    later by course.toml, the pages show only this date and problems with the submission, and nothing is recorded.

    Exit code: 0 shown, published or taken back, 1 the pages are not open yet, 2 something could not be written.
    """
    from labcourse.grading import assignments
    from labcourse.grading.gradebook.records import NEW, Publication
    from labcourse.grading.outcomes import ATTAINMENT_FILE
    from labcourse.grading.overview import to_give_back
    from labcourse.grading.reports.changes import changed_in
    from labcourse.grading.reports.grades import Reports
    from labcourse.grading.reports.result import moment
    from labcourse.grading.sheets import SHEETS_PAGE

    course, folder = courses.find(solutions), _results(marks, out)
    if undo and assignment:
        raise GradingError("--undo takes back what was given back last: say it without --assignment.")
    given = [assignments.find(course, name) for name in assignment or ()]
    notebooks = tuple(name for one in given for name in one.notebooks)
    begun = clock.now()  # a change while pages are written may be on none of them; it is reported the next time
    publication = Publication(NEW, by, note, begun, notebooks)
    is_open = course.settings.feedback.is_open(begun)
    with _gradebook(marks) as book:
        if undo:
            last = book.unpublish()
            Reports(folder, course, book).write_all()
            readers = ", ".join(one.run.student for one in book.all_current())
            what = ", ".join(last.notebooks) or "all assignments"
            say(f"Taken back: {what}, which {last.actor} gave back on {moment(last.when)}. Pages are written anew.")
            say(f"Whoever got a page since then may have read it. These had one: {readers}.")
            return
        reports = Reports(folder, course, book, publication=publication if is_open else None)
        changed = changed_in(book, course)
        say(*to_give_back(book, course, notebooks, folder))
        if yes:
            say(f"Pages of {number_of(reports.write_all(), 'student')}: {folder}")
            if is_open:
                book.publish(by, note, when=begun, notebooks=notebooks)
    for name, command in ((ATTAINMENT_FILE, "report"), (SHEETS_PAGE, "sheets")):
        if (folder / name).exists():
            say(f"{name} is as it was before: {program.name()} outcomes {command} writes it anew.")
    for student, changes in groupby(sorted(changed) if is_open else (), key=lambda change: change.student):
        moved = ", ".join(str(change) for change in changes)
        say(f"Other marks than were given back before; tell {student}: {moved}")
    if not is_open:
        raise typer.Exit(SOME_TROUBLE)
    what = ", ".join(one.title for one in given) or "all assignments"
    if yes:
        say(f"Recorded: {by} gave back {what} on {moment(begun)}.")
        say(f"No page was sent to a student: {program.name()} export --feedback writes the zip for your platform.")
    else:
        say(f"Nothing was given back now: say it again with --yes to give back {what}.")


_ONE_ASSIGNMENT = "Only this assignment: its title, or the name or number of a notebook in it."


@app.command(rich_help_panel=_CLASS)
def export(
    marks: MarksArgument,
    into: Annotated[
        Path,
        Option(help="The file that you exported from Canvas, Moodle, Blackboard or Brightspace.", dir_okay=False),
    ],
    column: Annotated[str | None, Option(help="The column for the marks, if several can take marks.")] = None,
    write: Annotated[
        Path | None, Option(help="The file to write.", dir_okay=False, show_default="beside theirs, with-marks")
    ] = None,
    out_of: Annotated[float | None, Option(metavar="POINTS", help="Maximum, if the file does not say it.")] = None,
    decimals: Annotated[int, Option(min=0, max=5, help="Decimals of a mark; rounded half up.")] = 2,
    unfinished: Annotated[bool, Option("--unfinished", help="Write the points decided so far.")] = False,
    cap: Annotated[bool, Option("--cap", help="Write the maximum for marks above it.")] = False,
    feedback: Annotated[Path | None, Option(help="Write a zip of feedback pages here.", dir_okay=False)] = None,
    submissions: Annotated[
        Path | None, Option(help="The platform's zip of submissions: --feedback needs names.", dir_okay=False)
    ] = None,
    all_pages: Annotated[bool, Option("--all", help="Pack all pages, not only those that changed.")] = False,
    assignment: Annotated[str | None, Option("--assignment", metavar="NAME", help=_ONE_ASSIGNMENT)] = None,
    dry_run: DryRunOption = False,
    solutions: SolutionsOption = None,
) -> None:
    """Put marks into a file that you exported from Canvas, Moodle, Blackboard or Brightspace.

    One column is filled, and nothing else is changed.

    Exit code: 0 nobody has to act, 1 somebody has to (a mark waits, a student or row is found nowhere, or the column
    seems to be another assignment's), 2 nothing written.
    """
    from labcourse.grading import assignments, feedback_zip, platforms

    if submissions is not None and feedback is None:
        raise GradingError("--submissions gives names for --feedback: say where that is to be written.")
    target = write or into.with_stem(f"{into.stem}-with-marks")
    paths = [path.resolve() for path in (into, submissions, target, feedback) if path is not None]
    if len({*paths}) < len(paths):
        raise GradingError("Two of the files are the same. What is read is not written over: name another file.")
    course = courses.find(solutions)
    only = assignments.find(course, assignment) if assignment else None
    content = into.read_bytes()
    options: dict[str, Any] = {"decimals": decimals, "unfinished": unfinished, "cap": cap}
    with _gradebook(marks) as book:
        students, earned = book.students(), platforms.earned(book, course, only)
        try:
            theirs = platforms.read(content)
            place = theirs.column(column)
            maximum = theirs.maximum(place, out_of)
            matches = platforms.match(theirs, students)
            cells = ([cell.text for cell in theirs.table.rows[row]] for row in matches.unknown)
            strangers = [row for row in cells if not book.persons.erased(row)]
            maxima, own = platforms.maxima(course), only.title if only else ""
            other = platforms.misplaced(maxima, own, place, maximum, into.stem)
            data, entries = platforms.fill(theirs, place, maximum, matches, earned, **options)
        except GradingError as error:
            raise GradingError(f"{into}: {error}") from None
        contents, messages = {target: data}, list[str]()
        if feedback is not None:  # what cannot be is refused while nothing is written
            names = [] if submissions is None else feedback_zip.names_in(submissions)
            pages = feedback_zip.places(theirs, matches, names)
            record = (_results_or_none(marks, None) or feedback.parent) / feedback_zip.PACKED_FILE
            packed, recorded, messages = feedback_zip.pack(book, course, *pages, record, all_pages)
            contents |= {feedback: packed, record: recorded} if packed else {}
    messages += [f"Look: it seems to be the column of {other}, not of {own or 'all points'}."] if other else []
    for path, new in contents.items() if not dry_run else ():
        files.write(path, new)
    scaled = f" ({own}: {float(maxima[own]):g}; the points are scaled)" if own and maxima[own] != maximum else ""
    say(f"{theirs.platform.name}, column {place.heading!r}, out of {maximum:f}{scaled}:")
    say(*platforms.summary(theirs, entries, matches, dry=dry_run), *messages)
    typer.echo("Nothing was written (--dry-run)." if dry_run else f"Written: {target}")
    with_work = (*platforms.WAITING, assignments.State.MARKED)
    lost = [who for who in matches.missing if earned[who].state in with_work]
    waits = [who for who, entry in entries.items() if entry.waits]
    raise typer.Exit(SOME_TROUBLE if waits or lost or other or strangers or matches.refused else ALL_WELL)


@outcomes.command("report")
def outcomes_report(
    marks: MarksArgument, out: OutOption = None, solutions: SolutionsOption = None, sections: SectionsOption = True
) -> None:
    """Write levels as tables: attainment.csv, of the class in each code and outcome; levels.csv, of each student.

    Groups smaller than course.toml allows are not shown. levels.csv has names: do not publish it.

    Exit code: 0 all written, 2 something could not be written.
    """
    from labcourse.grading.outcomes import ATTAINMENT_FILE, LEVELS_FILE, write_report

    course, folder = courses.find(solutions), _results(marks, out)
    with _gradebook(marks) as book:
        count, notes = write_report(folder, course, book, by_section=sections)
    say(f"{number_of(count, 'student')}: {folder / ATTAINMENT_FILE}", *notes)
    say(f"{LEVELS_FILE} has names: it is for you, and not for an accreditation.")


@outcomes.command()
def sheets(
    marks: MarksArgument, out: OutOption = None, solutions: SolutionsOption = None, student: StudentsOption = None
) -> None:
    """Write scoring sheets as pages to be printed: sheets.html for the class, and one in each student's folder.

    Exit code: 0 all written, 2 something could not be written.
    """
    from labcourse.grading import sheets as scoring_sheets

    course, folder = courses.find(solutions), _results(marks, out)
    with _gradebook(marks) as book:
        count, notes = scoring_sheets.write(folder, course, book, student or ())
    say(f"{number_of(count, 'student')}: {folder / scoring_sheets.SHEETS_PAGE}", *notes)


# --- a person ---------------------------------------------------------------------------------------------------------


@app.command(rich_help_panel=_PERSON)
def mark(
    marks: MarksArgument,
    student: StudentArgument,
    question: Annotated[str, Argument(metavar="QUESTION", help="The number of the question, for example 1.11.")],
    part: Annotated[str, Argument(metavar="PART", help="The part of the question, for example explanation.")],
    points: Annotated[float, Argument(metavar="POINTS", min=0, help="Points to give.")],
    reason: ReasonOption,
    by: ByOption,
    expect: Annotated[float | None, Option(help="The points that are replaced; needed if a person gave them.")] = None,
) -> None:
    """Give points to one answer by hand. They stay until the answer changes.

    Points that a person gave are replaced only if --expect states them. So if two persons mark the same answer, the
    second one gets a message with the name of the first.
    """
    from labcourse.grading.accounts import points as shown_points
    from labcourse.grading.marks import Status

    with _gradebook(marks) as book:
        graded = book.current(student)
        seen = next((entry for entry in (graded.marks if graded else ()) if entry.where == (question, part)), None)
        expected = seen
        if seen and expect is not None and shown_points(expect) != shown_points(seen.points):  # 1/3 is shown as 0.33
            expected = dataclasses.replace(seen, points=expect)
        elif seen and expect is None and seen.status == Status.BY_A_PERSON:
            expected = dataclasses.replace(seen, status=Status.FOR_A_PERSON)
        book.set_mark(student, question, part, points, reason=reason, actor=by, expected=expected)
    shown = shortened(seen.given if seen else "", _ANSWER_LENGTH)
    say(f"{student}, {question}, {part}: {points:g}, for the answer {shown!r}. {program.name()} report writes it down.")


@app.command(rich_help_panel=_PERSON)
def excuse(
    marks: MarksArgument,
    student: StudentArgument,
    assignment: Annotated[
        str, Argument(metavar="ASSIGNMENT", help="Its title, or name or number of a notebook in it.")
    ],
    reason: ReasonOption,
    by: ByOption,
    undo: Annotated[bool, Option("--undo", help="Take an earlier excuse back.")] = False,
    solutions: SolutionsOption = None,
) -> None:
    """Excuse a student from an assignment: it counts neither in their points nor in what these are out of."""
    from labcourse.grading import assignments

    excused = assignments.find(courses.find(solutions), assignment)
    with _gradebook(marks) as book:
        book.excuse(student, excused.notebooks, reason=reason, actor=by, excused=not undo)
    what = "not excused from" if undo else "excused from"
    say(f"{student} is {what} {excused.title}. {program.name()} report writes it down.")


@app.command(rich_help_panel=_PERSON)
def take(
    marks: MarksArgument,
    student: StudentArgument,
    notebook: Annotated[str, Argument(metavar="NOTEBOOK", help="Its name or number, as 02.")],
    version: Annotated[int | None, Argument(metavar="VERSION", help="Its number; none: list all.")] = None,
    reason: Annotated[str, Option(help="The reason, for the student and for the record.")] = "",
    by: Annotated[str, Option(metavar="NAME", parser=_name, help="Your name, for the record.")] = "",
    undo: Annotated[bool, Option("--undo", help="Let the rule decide again.")] = False,
    out: OutOption = None,
    solutions: SolutionsOption = None,
) -> None:
    """Take a version of a student's notebook, whatever else is worth more; without VERSION, list all versions.

    The version is run if it was not run yet. Marks and pages are written anew.
    """
    from labcourse.grading import assignments, counting
    from labcourse.grading.batch import Batch, Settings
    from labcourse.grading.reports.grades import Reports
    from labcourse.grading.running import isolation_report

    course, folder = courses.find(solutions), _results(marks, out)
    name = assignments.notebook(course, notebook)
    with _gradebook(marks) as book:
        versions = counting.listed(book, student, name)
        if not versions:
            raise GradingError(f"{student!r} has handed in nothing of {name}.")
        if version is None and not undo:
            say(*(text for _hand_in, text in versions))
            return
        if not (by and reason):
            raise GradingError("Say who decides it and why: --by and --reason.")
        if not undo and not 1 <= (version or 0) <= len(versions):
            raise GradingError(f"There is no version {version} of {name}: {student!r} has {len(versions)}.")
        source, received = ("", None) if undo else versions[(version or 0) - 1][0].key
        isolation_report.check()
        with Reports(folder, course, book):
            book.take(student, name, source, received, reason=reason, actor=by)
            for done in Batch([student], course, book, Settings()).grade():
                say(*sentences(done.graded.run.problems), err=True)
        say(*(text for _hand_in, text in counting.listed(book, student, name)))


@app.command(rich_help_panel=_PERSON)
def rerun(
    marks: MarksArgument,
    student: StudentArgument,
    notebook: Annotated[str | None, Argument(metavar="NOTEBOOK", help="Its name or number; all without it.")] = None,
    version: Annotated[int | None, Argument(metavar="VERSION", help="Its number, as 'take' lists it.")] = None,
    out: OutOption = None,
    solutions: SolutionsOption = None,
) -> None:
    """Run a student's notebooks once more in isolation, and write what they showed; marks stay as they are.

    Each notebook is written with its pictures and text, and a page of it, into STUDENT/executed in the folder of
    results. On top stands which answers are not those that were marked.
    """
    from labcourse.grading import assignments, executed
    from labcourse.grading.running import isolation_report

    course, folder = courses.find(solutions), _results(marks, out)
    name = None if notebook is None else assignments.notebook(course, notebook)
    with _gradebook(marks) as book:
        isolation_report.check()
        for page in executed.write(book, course, student, folder, name, version):
            say(str(page))


@app.command(rich_help_panel=_PERSON)
def comment(
    marks: MarksArgument,
    student: StudentArgument,
    text: Annotated[str, Argument(metavar="TEXT", help="The text; it is shown in the student's feedback.")],
    by: ByOption,
    question: OneQuestionOption = None,
    part: Annotated[str | None, Option("--part", help="Only this part of the question, as explanation.")] = None,
    ask: AskOption = False,
) -> None:
    """Write a comment into a student's feedback, on one answer, on one question or on the whole work.

    With --ask, the text is a student's request to look at an answer again. It stays open until a person gives a mark to
    that answer, or comments on it (--question and --part).
    """
    if (ask or part is not None) and (question is None or part is None):
        raise GradingError("Say on which answer: --question and --part.")
    with _gradebook(marks) as book:
        graded = book.current(student)
        if question is not None and graded is not None and question not in {entry.question for entry in graded.marks}:
            raise GradingError(
                f"{student!r} has no marks for a question {question!r}: nobody would see a comment on it."
            )
        book.comment(student, text, actor=by, question=question, part=part, asks=ask)
    say(f"{student}: noted. {program.name()} report writes it down.")


@app.command(rich_help_panel=_PERSON)
def history(
    marks: MarksArgument,
    student: StudentsArgument = None,
    question: OneQuestionOption = None,
    solutions: SolutionsOption = None,
) -> None:
    """Show how marks came about: what persons decided, when late work came, and what the program gave, with reasons."""
    from labcourse.grading.reports import result

    with _gradebook(marks) as book:
        for heading, lines in result.history(book, courses.find(solutions), student, question).items():
            say(*_section(heading, lines))


@person.command()
def copy(
    marks: MarksArgument,
    student: StudentArgument,
    into: Annotated[Path, Argument(metavar="FILE", help="The JSON file to write.", dir_okay=False)],
    force: Annotated[bool, Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write all that the gradebook has of a student into one JSON file: records, and each file that they handed in.

    It holds the names of the scorers. It does not hold the records of class-mates.
    """
    if into.suffix.lower() == ".zip":
        raise GradingError(f"A copy is one JSON file: call it {into.with_suffix('.json')}.")
    if into.exists() and not force:
        raise GradingError(f"{into} is there already; add --force to write over it.")
    with _gradebook(marks) as book:
        files.write(into, book.persons.copy(student))
    say(f"All that the gradebook has of {student}: {into}")


@person.command()
def erase(
    marks: MarksArgument,
    student: StudentArgument,
    by: ByOption,
    out: OutOption = None,
    dry_run: DryRunOption = False,
    yes: Annotated[bool, Option("--yes", help="Do not ask.")] = False,
    solutions: SolutionsOption = None,
) -> None:
    """Erase all that is stored about a student. This cannot be undone.

    The gradebook records who erased somebody, but not who was erased. What 'report' wrote is written anew; other files
    about the class are deleted. The names of scorers stay: this command is for students.

    Exit code: 0 erased (or shown), 1 erased, but you have to do what is printed at the end, 2 nothing erased, or
    interrupted: then say it again.
    """
    from labcourse.grading import erasure
    from labcourse.grading.reports.grades import Reports

    course, folder = courses.find(solutions), _results_or_none(marks, out)
    with _gradebook(marks) as book:
        paths = [] if folder is None else erasure.results_of(folder, student)
        erased = erasure.erase(book, course, student, by, dry_run=True)
        say(*_to_be_erased(erased, paths))
        if dry_run:
            say(*_remaining(erased, []), "Nothing was erased: --dry-run.")
            return
        if not yes and not typer.confirm("Erase all of it? It cannot be taken back."):
            raise GradingError("Nothing was erased.")
        for path in paths:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        erased = erasure.erase(book, course, student, by)
        say(f"{student} is erased.")
        if folder is not None and (folder / GRADES_FILE).is_file():
            (folder / GRADES_FILE).unlink()
            Reports(folder, course, book).write_all()
    named = [] if folder is None else [*erasure.still_named_in(folder, erased.about)]
    say(*_remaining(erased, named))
    unseen = (
        "PDFs and pictures, what they handed in, course.toml, backups, copies, the platform, e-mails; texts with only "
        "a first name"
    )
    say(f"Look yourself where this command cannot: {unseen}{'' if folder else '; the folder of results'}.")
    raise typer.Exit(SOME_TROUBLE if named or erased.still_named else ALL_WELL)


def _to_be_erased(erased: Erased, paths: Sequence[Path]) -> Iterator[str]:
    about = erased.about
    yield f"Rows of the gradebook about {', '.join(filter(None, (about.student, about.name, about.email)))}:"
    yield from (f"{count:8}  {kind}" for kind, count in erased.counts.items())
    what = "To be deleted ('status', 'outcomes report' and 'outcomes sheets' write files about the class anew):"
    yield from _section(what, [*map(str, paths)])
    yield from _section("The name is removed from texts about others:", erased.redacted)


def _remaining(erased: Erased, named: Sequence[str]) -> Iterator[str]:
    what = "The name stays in what others wrote themselves, or as the name of who decided:"
    yield from _section(what, erased.still_named)
    yield from _section("The name is still here; delete it yourself:", named)
    yield from _section("Too short to be looked for in texts of others:", erased.too_short)


def _section(heading: str, lines: Sequence[str]) -> Iterator[str]:
    """Yield a heading and the lines below it; nothing without lines."""
    yield from (heading, *(f"  {line}" for line in lines)) if lines else ()

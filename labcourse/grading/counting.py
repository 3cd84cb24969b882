"""What counts of a student: each notebook is taken from the run of the version that is worth most.

:mod:`labcourse.grading.versions` says which versions there are. Here their worth is computed, and what counts is put
together from their runs. It is done again when persons give points, or the key changes (:func:`recount`).
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from datetime import datetime
from fractions import Fraction
from functools import partial
from typing import Any

from labcourse.answers.cell_reports import CellReports
from labcourse.errors import AnswerError, CourseError, GradingError
from labcourse.grading import graded_run
from labcourse.grading.assignments import exact, lateness
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Arrival, GivenMark, Gradebook, Graded, RunRecord, StudentRecord, with_given
from labcourse.grading.marking.marking_processes import Marker, marking_digest
from labcourse.grading.marks import UNDECIDED, Status
from labcourse.grading.running.prepared import content_digest
from labcourse.grading.versions import Folder, Lateness, NotebookVersion, StoredHandIn, Versions, in_order
from labcourse.problems import Code, Problem, Reason, Where

#: A version as :attr:`RunRecord.versions` stores it: "notebook" without ending; "source", "received", "clock" of the
#: hand-in; "bench_of"; "run" (the key of its run; "" if it was not run); whether it "counts"; and "why", if not by its
#: worth: "taken" by an instructor, it came after marks were "given back", or it is "to be run", as it may win now. The
#: first entry is about no notebook: it has the run for what has no version, "rules" (the digest of the settings that
#: were used) and "absent": notebooks of that run that only a partner handed in.
Entry = Mapping[str, Any]
TO_BE_RUN = "to be run"
#: What an entry's "why" is called on the student's page.
_WHY = {"given back": Code.VERSION_AFTER_GIVEN_BACK, TO_BE_RUN: Code.VERSION_TO_BE_RUN}
_ABOUT_VERSIONS = (*_WHY.values(), Code.ARRIVED, Code.VERSION_WORTH_LESS, Code.VERSION_NOT_RUN, Code.VERSION_TAKEN)


# --- what a version is worth ------------------------------------------------------------------------------------------


#: What persons gave for a student's answers, as :meth:`Gradebook.given_marks` returns it.
Given = Mapping[tuple[Where, str], GivenMark]


def worth(course: Course, graded: Graded, given: Given, notebook: str) -> Fraction:
    """Return the points of a notebook (without ending), before lateness, as its assignment counts them.

    Marks by persons are among them. What is not decided has all its points.
    """
    return sum(
        (
            _weight(course, mark.question, mark.part) * exact(mark.out_of if mark.status in UNDECIDED else mark.points)
            for mark in with_given(graded.marks, given)
            if course.notebook_of(mark.question) == notebook
        ),
        Fraction(0),
    )


def possible(course: Course) -> dict[str, Fraction]:
    """Return the points that each notebook (file name) is out of."""
    points = defaultdict[str, Fraction](Fraction)
    for number, question in course.catalogue.marked.items():
        for part in question.parts:
            points[f"{question.notebook}.ipynb"] += _weight(course, number, part.name) * exact(part.points)
    return points


def _weight(course: Course, question: str, part: str) -> Fraction:
    marks = course.settings.marks
    return Fraction(0) if marks.dropped_as(question, part) else exact(marks.weight(question, part))


def how_late(course: Course, student: StudentRecord, notebook: str, arrival: Arrival) -> Lateness:
    """Return the lateness of a version of a notebook (without ending). What only a student's computer says waits."""
    settings = course.settings
    timing = lateness(settings, student, notebook, arrival)
    if timing is None:
        return False, Fraction(0)
    return bool(timing.waits and settings.late.per_day), timing.lost_share


# --- entries ----------------------------------------------------------------------------------------------------------


def holds(course: Course, graded: Graded, version: NotebookVersion) -> bool:
    """Return whether the run of a later folder may stand for a version: no later notebook recorded its answers."""
    content, cells = graded_run.answers_of(graded.run), graded_run.submission_of(graded.run).cell_reports.cells
    recorded = content.get("cells", {})
    notebook_of = {one.cell: one.notebook for one in cells}
    return all(
        notebook_of.get(cell, version.notebook) <= version.notebook
        for question, parts in recorded.items()
        if f"{course.notebook_of(question)}.ipynb" == version.notebook
        for cell in parts.values()
    )


def rules_of(course: Course) -> str:
    """Return a digest of the settings by which versions are late; entries of others have to be made anew."""
    settings = course.settings
    return content_digest([settings.late, settings.dues, settings.extensions])


def entries_of(
    course: Course,
    ran: Mapping[str, Sequence[tuple[NotebookVersion, Graded]]],
    versions: Versions,
    base: str,
    folder: Folder,
) -> list[Entry]:
    """Return the entries of all versions, before it is decided which of them count.

    Parameters
    ----------
    course : with its settings
    ran : notebook's file name → its versions that were run, each with its run
    versions : of the student's notebooks
    base, folder : key and folder of the run for what has no version
    """
    absent = [name.removesuffix(".ipynb") for name in versions.of_others(folder)]
    entries: list[Entry] = [{"notebook": "", "run": base, "why": "", "rules": rules_of(course), "absent": absent}]
    for name, results in sorted(ran.items()):
        runs = {id(version): graded.run.key for version, graded in results}
        for version in (*versions.of(name), *(late := versions.after_given_back(name))):
            hand_in = version.hand_in
            entries.append(
                {
                    "notebook": name.removesuffix(".ipynb"),
                    "source": hand_in.source,
                    "received": hand_in.received.isoformat(),
                    "clock": hand_in.clock,
                    "bench_of": version.folder.bench_of,
                    "run": runs.get(id(version), ""),
                    "why": "given back" if version in late else "taken" if versions.is_taken(version) else "",
                }
            )
    return entries


def arrival_of(entry: Entry) -> Arrival:
    """Return when the hand-in of a version was received, and how that is known."""
    return Arrival(datetime.fromisoformat(entry["received"]), entry["clock"])


def received(book: Gradebook, student: str, graded: Graded | None) -> dict[str, Arrival]:
    """Return file name → when the version of each notebook that counts was received; without a run, the newest one."""
    counting = [] if graded is None else [entry for entry in graded.run.versions if entry.get("counts")]
    return book.received(student) | {f"{entry['notebook']}.ipynb": arrival_of(entry) for entry in counting}


def listed(book: Gradebook, student: str, notebook: str) -> list[tuple[StoredHandIn, str]]:
    """Return the hand-ins of a student from the first one with a notebook (no ending) on, each with a numbered line."""
    graded = book.current(student)
    entries = [] if graded is None else [one for one in graded.run.versions if one["notebook"] == notebook]
    is_taken = any(one["why"] == "taken" for one in entries)
    found: list[tuple[StoredHandIn, str]] = []
    for hand_in in in_order(book.stored(student)):
        if found or f"{notebook}.ipynb" in hand_in.files:
            known = (one for one in entries if (one["source"], arrival_of(one).received) == hand_in.key)
            state = next((_state(one) for one in known), "not taken" if is_taken else "nothing new for it")
            when = f"{hand_in.received:%Y-%m-%d %H:%M} UTC"
            found.append((hand_in, f"{len(found) + 1}  {when}  {hand_in.source}  {state}"))
    return found


def _state(entry: Entry) -> str:
    """Describe a version to an instructor."""
    if entry["counts"]:
        return "counts, taken by an instructor" if entry["why"] == "taken" else "counts"
    if entry["why"] == "given back":
        return "came after marks were given back"
    if entry["why"] == TO_BE_RUN:
        return "not run yet: it may be worth more"
    return "worth less" if entry["run"] else "not run: it is too late to be worth more"


def bench_of(run: RunRecord, notebook: str) -> str:
    """Return the ID of the student with the bench of the version of a notebook (without ending) that counts."""
    counting = (one["bench_of"] for one in run.versions if one["notebook"] == notebook and one["counts"])
    return next(counting, graded_run.submission_of(run).bench_of)


# --- what counts ------------------------------------------------------------------------------------------------------


def assembled(
    course: Course, student: StudentRecord, entries: Sequence[Entry], runs: Mapping[str, Graded], given: Given
) -> Graded:
    """Put together what counts of a student from the runs of their versions.

    Parameters
    ----------
    course : with its settings
    student : as the roster has them
    entries : of all versions
    runs : key → run with its marks, as the software made them
    given : what persons gave for the student's answers
    """
    best: dict[str, tuple[Fraction, Entry]] = {}
    to_do: list[Entry] = []
    most = possible(course)

    def late(entry: Entry) -> Lateness:
        return how_late(course, student, entry["notebook"], arrival_of(entry))

    for entry in sorted((one for one in entries[1:] if one["why"] != "given back"), key=late):
        name, left = entry["notebook"], 1 - late(entry)[1]
        if entry["run"] not in runs:
            to_do += [entry] if name in best and most[f"{name}.ipynb"] * left > best[name][0] else []
        elif name not in best or worth(course, runs[entry["run"]], given, name) * left > best[name][0]:
            best[name] = worth(course, runs[entry["run"]], given, name) * left, entry
    counting = [entry for _points, entry in best.values()]
    chosen = {entry["notebook"]: runs[entry["run"]] for entry in counting}
    made = _composed(course, runs[entries[0]["run"]], chosen, entries[0]["absent"])
    why = [TO_BE_RUN if one in to_do else one["why"] if one["why"] != TO_BE_RUN else "" for one in entries]
    decided = [{**one, "counts": one in counting, "why": new} for one, new in zip(entries, why, strict=True)]
    former = (note for note in made.run.notes if not (isinstance(note, Problem) and note.code in _ABOUT_VERSIONS))
    notes = dict.fromkeys((*former, *_from_where(decided), *_not_counted(decided)))
    return replace(made, run=replace(made.run, versions=tuple(decided), notes=tuple(notes)))


def _from_where(entries: Sequence[Entry]) -> Iterator[Problem]:
    """Yield a note for each hand-in with a version that counts, if there are several hand-ins."""
    names = defaultdict[tuple[str, str], list[str]](list)
    for entry in entries[1:]:
        names[_time(entry), entry["source"]] += [f"{entry['notebook']}.ipynb"] if entry["counts"] else []
    for (time, source), own in sorted(names.items() if len(names) > 1 else ()):
        if own:
            yield Problem.of(Code.ARRIVED, time=time, source=source, names=own)


def _not_counted(entries: Sequence[Entry]) -> Iterator[Problem]:
    """Yield a note for each version that does not count beside one that does, and for each that was taken."""
    counting = {entry["notebook"]: entry for entry in entries if entry["counts"]}
    for entry in entries:
        counts = counting.get(entry["notebook"], entry)
        if counts is not entry:
            code = _WHY.get(entry["why"]) or (Code.VERSION_WORTH_LESS if entry["run"] else Code.VERSION_NOT_RUN)
            yield Problem.of(code, f"{entry['notebook']}.ipynb", time=_time(entry), counts=_time(counts))
        elif entry["why"] == "taken":
            yield Problem.of(Code.VERSION_TAKEN, f"{entry['notebook']}.ipynb", time=_time(entry))


def _time(entry: Entry) -> str:
    return f"{arrival_of(entry).received:%Y-%m-%d %H:%M}"


def _composed(course: Course, base: Graded, chosen: Mapping[str, Graded], absent: Collection[str]) -> Graded:
    """Return a run with its marks, put together of several: each notebook of its own, the rest of ``base``.

    Parameters
    ----------
    course : which says what belongs to a notebook
    base : for what has no version
    chosen : notebook without ending → the run of its version
    absent : notebooks without ending that ``base`` has, and that are not the student's
    """
    runs = {graded.run.key: graded for graded in (base, *chosen.values())}
    if len(runs) == 1 and not absent:
        return base
    submissions = {key: graded_run.submission_of(graded.run) for key, graded in runs.items()}

    def key_of(notebook: str) -> str:
        """Return the key of the run that a notebook, with or without ending, is taken from; "" if it is absent."""
        name = notebook.removesuffix(".ipynb")
        return "" if name in absent else chosen.get(name, base).run.key

    def of_question(number: str) -> str:
        return key_of(course.notebook_of(number))

    def messages(attribute: str, of: Mapping[str, Any]) -> list[Any]:
        """Return problems or notes of runs or submissions, those about a notebook from its own run only."""
        return [
            message
            for key, one in of.items()
            for message in getattr(one, attribute)
            if (name := notebook_of(message, course)) is None or key_of(name) == key
        ]

    def by_question(attribute: str, of: Mapping[str, Any] = submissions) -> dict[Any, Any]:
        """Return what runs or submissions know by question, or by question and part."""
        return {
            where: value
            for key, one in of.items()
            for where, value in getattr(one, attribute).items()
            if of_question(where if isinstance(where, str) else where[0]) == key
        }

    def own(attribute: str, key_for: Callable[[Any], str], of: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return the entries of lists, each list without those that belong to other runs."""
        return tuple(entry for key, one in of.items() for entry in getattr(one, attribute) if key_for(entry) == key)

    reports = {key: submission.cell_reports for key, submission in submissions.items()}
    asked = {key: submission.asked for key, submission in submissions.items()}
    asked[""] = asked[base.run.key]
    everything = [(number, part) for number, question in course.catalogue.marked.items() for part in question.names]
    not_there = {
        (number, part): Problem.of(Code.NOTEBOOK_OF_IT_ABSENT, f"{course.notebook_of(number)}.ipynb")
        for number, part in everything
        if of_question(number) == ""
    }
    whole = replace(
        submissions[base.run.key],
        problems=messages("problems", submissions),
        notes=messages("notes", submissions),
        ended=tuple(messages("ended", submissions)),
        cell_reports=CellReports(
            own("cells", lambda cell: key_of(cell.notebook), reports),
            own("refusals", lambda refusal: of_question(refusal.question), reports),
            own("unused", lambda entry: key_of(entry[0]), reports),
        ),
        missing=by_question("missing") | not_there,
        words=by_question("words"),
        documents=by_question("documents"),
        asked=None
        if all(given is None for given in asked.values())
        else [where for where in everything if (of_run := asked[of_question(where[0])]) is None or where in of_run],
        untouched=own("untouched", key_of, submissions),
    )
    marks = {mark.where: mark for mark in own("marks", lambda mark: of_question(mark.question), runs)}
    for mark in (one for one in base.marks if one.where in not_there):
        marks[mark.where] = replace(mark, status=Status.MISSING, points=0.0, reason=not_there[mark.where], given="")
    order = [(number, part) for number, checks in course.key.items() for part in checks]
    records = {key: one.run for key, one in runs.items()}  # with the messages of marking
    digests = {name: graded.run.submission for name, graded in sorted(chosen.items())}
    run = replace(
        base.run,
        key=content_digest(
            ["composed", base.run.key, {name: one.run.key for name, one in sorted(chosen.items())}, [*absent]]
        ),
        submission=content_digest([base.run.submission, digests]),
        ran="",
        answers=_answers(course, runs, of_question, base.run.key),
        problems=tuple(dict.fromkeys(messages("problems", records))),
        notes=tuple(dict.fromkeys(messages("notes", records))),
        cells=graded_run.facts_as_json(whole),
        claim=by_question("claim", records),
        words=graded_run.words_as_json(whole.words),
    )
    return Graded(run, tuple(marks[where] for where in order if where in marks), base.key_digest)


def _answers(course: Course, runs: Mapping[str, Graded], of_question: Callable[[str], str], base: str) -> bytes | None:
    """Return an ``answers.json`` with what each run recorded of its own questions; None if no run left any."""
    contents = {key: graded_run.answers_of(graded.run) for key, graded in runs.items()}
    whole = next((contents[key] for key in (base, *contents) if contents[key]), None)
    if whole is None:
        return None
    sections = {name for name, section in whole.items() if isinstance(section, dict)} - {"bench"}
    for name in ("answers", *sections):
        entries = {
            question: entry
            for key, content in contents.items()
            for question, entry in content.get(name, {}).items()
            if of_question(question) == key
        }
        whole = {**whole, name: entries}
    return json.dumps(whole).encode()


def notebook_of(message: Reason, course: Course) -> str | None:
    """Return the notebook that a problem is about; None if it is about the whole, or a text."""
    if not isinstance(message, Problem):
        return None
    about = message.parameters.get("notebook") or message.where
    if about.endswith(".ipynb"):
        return str(about)
    return course.notebook_of(message.parameters.get("question") or about) or None


# --- again, from what is stored ---------------------------------------------------------------------------------------


def is_choice(entries: Sequence[Entry]) -> bool:
    """Return whether what counts was chosen among versions, or put together of several runs or of a part of one."""
    names, runs = [entry["notebook"] for entry in entries], {entry["run"] for entry in entries} - {""}
    return len(names) > len({*names}) or len(runs) > 1 or any(entry.get("absent") for entry in entries)


def to_be_run(entries: Iterable[Entry]) -> list[str]:
    """Return the notebooks, without ending, with a version that was not run and may be worth most now."""
    return [entry["notebook"] for entry in entries if entry["why"] == TO_BE_RUN]


def recount(book: Gradebook, course: Course, graded: Graded, mark: Callable[[Graded], Graded] | None = None) -> Graded:
    """Choose again what counts of a student among the runs that are stored, as when a person gave points.

    Parameters
    ----------
    book, course : the gradebook and its course
    graded : what counts until now
    mark : function that marks a run by the present key; None if its marks stay
    """
    if not is_choice(graded.run.versions):
        return graded if mark is None else mark(graded)
    runs = {one["run"]: found for one in graded.run.versions if (found := book.find_made(one["run"])) is not None}
    if mark is not None:
        runs = {key: mark(found) for key, found in runs.items()}
        for one in runs.values():
            book.keep(one)
    if graded.run.versions[0]["run"] not in runs:
        return graded
    (about,) = (one for one in book.students() if one.student == graded.run.student)
    made = assembled(course, about, graded.run.versions, runs, book.given_marks(graded.run.student))
    return replace(made, run=replace(made.run, prepared_from=graded.run.prepared_from, supplied=graded.run.supplied))


def recount_all(book: Gradebook, course: Course) -> None:
    """Choose again what counts of each student with several versions, since persons may have given points."""
    for student, entries in book.versions().items():
        if is_choice(entries) and (graded := book.current(student)):
            new = recount(book, course, graded)
            if new.run.versions != graded.run.versions:
                graded_run.store(book, new, "labcourse", "another version is worth more now")


# --- by the key as it is now ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Regraded:
    """A student's marks before and after.

    Attributes
    ----------
    before, after : as in the gradebook
    problem : why the answers could not be marked again; "" if they could, or if there is nothing to mark
    unchanged : marks by persons, which stay, where the key gives other points: "question", "part", "points" (the
        person's) and "by_key" (the key's)
    """

    before: Graded
    after: Graded
    problem: str = ""
    unchanged: tuple[dict[str, Any], ...] = ()


def regrade(gradebook: Gradebook, course: Course, questions: Collection[str] = (), jobs: int = 1) -> Iterator[Regraded]:
    """Mark all students' stored answers by the key as it is now, and store the marks.

    If the answers of a student cannot be marked, their marks stay.

    Parameters
    ----------
    gradebook : with the answers
    course : the course, with its key
    questions : numbers of the questions to mark again; all if there are none
    jobs : number of submissions to mark at a time

    Raises
    ------
    GradingError
        If the gradebook has no answers, or the key does not have one of the questions.

    Yields
    ------
    Regraded
        Each student's marks before and after, stored.
    """
    for number in questions:
        try:
            course.catalogue.find_marked(number)
        except AnswerError as error:
            raise GradingError(str(error)) from None
        if number not in course.key:
            raise GradingError(f"The key has no question {number}.")
    with Marker(course, jobs) as marker, ThreadPoolExecutor(jobs) as threads:
        current = list(gradebook.all_current())
        if not current:
            raise GradingError("There is nothing in the gradebook to mark again.")
        digest = marking_digest(course)
        again = partial(_marked_again, gradebook, course, marker=marker, questions=questions, digest=digest)
        for regraded in threads.map(again, current):
            yield regraded if regraded.problem else _store_regraded(gradebook, regraded, questions)


def _marked_again(
    book: Gradebook, course: Course, graded: Graded, marker: Marker, questions: Collection[str], digest: str
) -> Regraded:
    """Mark a student's stored answers anew, without changing what counts. Parameters as for :func:`regrade`.

    Only the marks of the chosen questions change; ``digest`` is that of the key as it is now.
    """
    run = graded.run
    if graded_run.is_failed(run):
        return Regraded(graded, graded)  # it could not be run, so no key gives it other marks

    def again(one: Graded) -> Graded:
        """Mark one run anew."""
        new = graded_run.mark(one.run, marker, digest)
        if not questions:
            return new
        chosen = {mark.where: mark for mark in new.marks if mark.question in questions}
        marks = [chosen.pop(mark.where, mark) for mark in one.marks]
        # The other marks are still by the earlier key, so its digest stays: the next grading marks them again.
        return replace(one, marks=(*marks, *chosen.values()))

    try:
        return Regraded(graded, recount(book, course, graded, again))
    except CourseError as error:
        return Regraded(graded, graded, str(error))


def _store_regraded(gradebook: Gradebook, regraded: Regraded, questions: Collection[str]) -> Regraded:
    """Store the new marks. Return them as they count, and the marks by persons where the key gives other points."""
    reason = f"marked again: {', '.join(questions) or 'all questions'}"
    after = graded_run.store(gradebook, regraded.after, "labcourse regrade", reason)
    by_key = {mark.where: mark.points for mark in regraded.after.marks if mark.status not in UNDECIDED}
    unchanged = tuple(
        {"question": mark.question, "part": mark.part, "points": mark.points, "by_key": by_key[mark.where]}
        for mark in after.marks
        if mark.status == Status.BY_A_PERSON and by_key.get(mark.where, mark.points) != mark.points
    )
    return replace(regraded, after=after, unchanged=unchanged)

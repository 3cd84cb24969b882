"""Who handed in what, and who is in trouble: in words, from the gradebook and its roster."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median

from labcourse import program
from labcourse.grading.gradebook import Arrival, Graded, MarkRecord, StudentRecord
from labcourse.grading.graded_run import facts_of, key_faults
from labcourse.grading.overview.section import Section, Table, moment, named
from labcourse.grading.reports.result import lapse, points, worth
from labcourse.grading.verdicts import UNDECIDED, Status
from labcourse.messages import listed, plural
from labcourse.student_id import caseless

MUCH = 1 / 3  #: of the points; whoever misses more is in trouble
FAR_BELOW = 1 / 2  #: of the class's median share of points
FEWEST = 5  #: students that make a class of which one may be far below
_MOST_TOLD = 3  # problems of one student; all of them are in their feedback


@dataclass(frozen=True)
class Student:
    """A student, as the gradebook knows them.

    Attributes
    ----------
    about : what the roster says
    graded : the run that counts; None where nothing was graded
    received : notebook's file name → when what counts of it was handed in, and how that is known
    unread : file names of notebooks that were handed in and could not be read, where none from before counts
    late : notebook, without ending → by how many days it is late, those that have begun counted as whole
    overdue : notebooks, without ending, that were due for this student and are not there
    """

    about: StudentRecord
    graded: Graded | None = None
    received: Mapping[str, Arrival] = field(default_factory=dict)
    unread: tuple[str, ...] = ()
    late: Mapping[str, int] = field(default_factory=dict)
    overdue: tuple[str, ...] = ()

    @property
    def handed_in(self) -> bool:
        """Whether there is anything of them."""
        return bool(self.received) or self.graded is not None


# --- who handed in ----------------------------------------------------------------------------------------------------


def handed_in(everybody: Sequence[Student], notebooks: Sequence[str]) -> Section:
    """Who handed in which notebooks, and when; who nothing.

    Parameters
    ----------
    everybody : by ID
    notebooks : file names of the course's
    """
    there = [one for one in everybody if one.handed_in]
    nothing = [one for one in everybody if not one.handed_in]
    waiting = [one.about.student for one in there if one.graded is None]
    due = [name for name in notebooks if any(name in one.received or name in one.unread for one in there)]
    more = [f"Handed in and not graded yet: {listed(waiting, 20)}."] if waiting else []
    if any(one.about.enrolled for one in everybody):
        unknown = [one.about.student for one in there if not one.about.enrolled]
        more += [f"Not on the roster: {listed(unknown, 20)}."] if unknown else []
    else:
        more.append(
            f"The gradebook has no roster, so nobody is missed here who handed in nothing ({program.name()} roster)."
        )
    if due and len(due) < len(notebooks):
        nobody = [_short(name) for name in notebooks if name not in due]
        more.append(f"Notebooks that nobody handed in: {', '.join(nobody)}.")
    first = "{there} of {all} handed something in; {nothing} nothing.".format(
        there=len(there), all=plural(len(everybody), "{count} student", "{count} students"), nothing=len(nothing)
    )
    if behind := [one for one in everybody if one.late or one.overdue]:
        first += " Late: {late}; something is missing after its deadline: {overdue}.".format(
            late=plural(sum(bool(one.late) for one in behind), "{count} student", "{count} students"),
            overdue=plural(sum(bool(one.overdue) for one in behind), "{count} student", "{count} students"),
        )
    return Section(
        "Handed in",
        first,
        tuple(more),
        (
            Table(("Student",), tuple((named(one.about),) for one in nothing), caption="Nothing handed in"),
            Table(
                ("Student", "Notebooks", "Not handed in", "Last at"),
                tuple(_row(one, due) for one in there),
                caption="Handed in, of the notebooks that anybody did",
            ),
            Table(
                ("Student", "Late", "Missing after the deadline"),
                tuple((named(one.about), ", ".join(_late(one)), ", ".join(map(_short, one.overdue))) for one in behind),
                caption="After the deadline, with extensions and hours of grace",
            ),
        ),
        urgent=bool(waiting),
    )


def _row(one: Student, due: Sequence[str]) -> tuple[str, ...]:
    if not one.received and not one.unread:
        return named(one.about), "not known", "", ""
    there = [_short(name) for name in due if name in one.received]
    missing = [_short(name) for name in due if name not in one.received and name not in one.unread]
    missing += [f"{_short(name)} not readable" for name in due if name in one.unread]
    latest = max(one.received.values(), default=None, key=lambda one: one.received)
    last = f"{moment(latest.received)}{'?' if latest.clock == '' else ''}" if latest else ""
    return named(one.about), ", ".join(there), ", ".join(missing), last


def _late(one: Student) -> list[str]:
    """As "02: 1 day"."""
    return [f"{_short(name)}: {plural(days, '{count} day', '{count} days')}" for name, days in one.late.items()]


def _short(notebook: str) -> str:
    """A notebook's number, where it has one: "02" of "02_speed.ipynb"."""
    number = notebook.partition("_")[0]
    return number if number.isdigit() else notebook.removesuffix(".ipynb")


# --- who is in trouble ------------------------------------------------------------------------------------------------


def in_trouble(everybody: Sequence[Student]) -> Section:
    """Who is in trouble, and why; those with the most reasons first."""
    usual = _median([one for one in everybody if one.graded is not None])
    found = [(one, why) for one in everybody if one.graded is not None for why in [reasons(one.graded, usual)] if why]
    found.sort(key=lambda item: (-len(item[1]), caseless(item[0].about.student)))
    first = (
        "{students} to look at: a run that stopped, problems, much missing, or far below the class.".format(
            students=plural(len(found), "{count} student", "{count} students")
        )
        if found
        else "Nobody is in trouble, as far as marks and runs tell."
    )
    rows = tuple((named(one.about), "\n".join(why)) for one, why in found)
    return Section("In trouble", first, (), (Table(("Student", "Why"), rows),), urgent=bool(found))


def reasons(graded: Graded, usual: float | None = None) -> list[str]:
    """Why a student is in trouble, in sentences.

    Parameters
    ----------
    graded : their run that counts
    usual : the class's median share of the points that are decided; None where there is no class to compare with
    """
    run, ended = graded.run, facts_of(graded.run).ended
    faults = key_faults(graded)  # the key's, and not the student's
    problems = [line for line in run.problems if line not in (*faults, *ended)]
    found = [f"Their run stopped: {why}" for why in ended]
    found += problems[:_MOST_TOLD]
    left = len(problems) - _MOST_TOLD
    found += [f"{plural(left, '{count} problem', '{count} problems')} more, in their feedback."] if left > 0 else []
    missing = [one for one in graded.marks if one.status == Status.MISSING]
    lost, all_points = _sum(missing), _sum(graded.marks)
    if all_points and lost > MUCH * all_points:
        found.append(
            "Missing: {parts}, worth {lost} of {all}.".format(
                parts=plural(len(missing), "{count} part", "{count} parts"), lost=points(lost), all=worth(all_points)
            )
        )
    if run.supplied:
        found.append(f"Values were supplied for them: {', '.join(run.supplied)}.")
    found += [lapse(one) for one in graded.lapsed]
    own = decided_share(graded.marks)
    if usual is not None and own is not None and own < FAR_BELOW * usual:
        found.append(
            f"Far below the class: {100 * own:.0f} % of the points that are decided; the median is {100 * usual:.0f} %."
        )
    return found


def decided_share(marks: Sequence[MarkRecord]) -> float | None:
    """How much was earned of the points that are decided; None where none are."""
    decided = [one for one in marks if one.out_of and one.status not in UNDECIDED]
    return sum(one.points for one in decided) / _sum(decided) if decided else None


def _median(everybody: Sequence[Student]) -> float | None:
    found = [decided_share(one.graded.marks) for one in everybody if one.graded is not None]
    known = [one for one in found if one is not None]
    return median(known) if len(known) >= FEWEST else None


def _sum(marks: Sequence[MarkRecord]) -> float:
    return sum(one.out_of for one in marks)

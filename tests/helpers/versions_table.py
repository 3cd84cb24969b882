"""A term as one table: what was handed in, when it was received, and what it comes to, with the arithmetic.

Nothing here is computed from the program. Each row has students of its own, so that rows can be read one by one. All
times are UTC. What is late loses 10 % a day, at most 50 %.
"""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

# --- the course -------------------------------------------------------------------------------------------------------

#: Students of one group, who may hand in together.
PAIR = ("f1", "f2")
#: Assignment → its notebook, what it is out of, and when it is due.
ASSIGNMENTS = {
    "Lab 01": ("01_spring", 10, "11-06 18:00"),
    "Lab 02": ("02_stiffness", 20, "11-13 18:00"),
    "Lab 03": ("03_motion", 25, "11-20 18:00"),
    "Lab 04": ("04_report", 10, "11-27 18:00"),
}
#: Part → question that asks for it. 1.1 is worth 6 points, 1.2 is 4; 2.1 is 12, 2.2 is 8; 3.1 is 15, 3.2 is 10; 4.1 is
#: 6, and the report as a whole is 4.
QUESTION = {"a": "1.1", "why": "1.2", "k": "2.1", "m": "2.2", "load": "3.1", "rest": "3.2", "total": "4.1"}

SETTINGS = '[marks]\ndrop = ["Report"]\nweights = {{"Report, as a whole" = 4}}\n\n'
SETTINGS += "[late]\nper_day = {per_day}\ncap = 50\n" + "".join(
    f'\n[[assignment]]\ntitle = "{title}"\nnotebooks = ["{notebook}"]\ndue = 2026-{due.replace(" ", "T")}:00Z\n'
    for title, (notebook, _out_of, due) in ASSIGNMENTS.items()
)
SETTINGS += '\n[[extension]]\nuntil = 2026-11-16T18:00:00Z\nstudents = ["k2"]\nassignments = ["Lab 02"]\n'

CATALOGUE = """\
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, ReportItem, number, prose
from labcourse.grading.course import Course

from .key import KEY


def value(name, points):
    return number(name, "N", None, "", "A number.", points)


CATALOGUE = Catalogue(
    [
        Question("1.1", "1", "01_spring", "Length", (), (value("a", 6),)),
        Question("1.2", "1", "01_spring", "Why", (), (prose("why", "", "Why does it bend?", 4),)),
        Question("2.1", "2", "02_stiffness", "Stiffness", (), (value("k", 12),)),
        Question("2.2", "2", "02_stiffness", "Mass", (), (value("m", 8),)),
        Question("3.1", "3", "03_motion", "Load", (), (value("load", 15),)),
        Question("3.2", "3", "03_motion", "Rest", (), (value("rest", 10),)),
        Question("4.1", "4", "04_report", "Total", (), (value("total", 6),)),
    ],
    report_items=[
        ReportItem("Report", "1", "Procedure", "What was done?", ("reports",), (("4.1", ""),), part="procedure"),
        ReportItem("Report", "2", "As a whole", "Is it clear?", ("reports",), judged="clarity"),
    ],
    reports={"Report": ("4", "04_report", "A report")},
    outcomes={"reports": "writes reports"},
)
COURSE = Course(
    name="versions",
    title="A term of versions",
    catalogue=CATALOGUE,
    key=KEY,
    bench=lambda student, policy: 60.0 if student == "f1" else 50.0,
    package="labcourse",
    packages=(),
    imports=("labcourse.session",),
)
"""

#: The bench is its stiffness. The load follows from it, and so does the load of an own stiffness.
KEY = """\
from labcourse.grading.marking.checks import ForAPerson, Number


def exactly(what, right, follow=None):
    return Number(what, right, rtol=1e-9, follow=follow, follow_rtol=1e-9)


KEY = {
    "1.1": {"a": exactly("the length", lambda bench: 50.0)},
    "1.2": {"why": ForAPerson()},
    "2.1": {"k": exactly("the stiffness", lambda bench: bench)},
    "2.2": {"m": exactly("the mass", lambda bench: 2.0)},
    "3.1": {"load": exactly("the load", lambda bench: bench + 20, lambda own: own("2.1", "k") + 20)},
    "3.2": {"rest": exactly("the rest", lambda bench: 5.0)},
    "4.1": {"total": exactly("the total", lambda bench: 7.0)},
    "Report": {"procedure": ForAPerson()},
    "Report, as a whole": {"clarity": ForAPerson()},
}
"""

#: Notebook → its text, in the percent format.
NOTEBOOKS = {
    "01_spring": "# %% [markdown]\n# # Spring\n\n# %% answer 1.1\na = 50\n\n# %% [markdown]\n# Say why.\n\n"
    "# %% words 1.2 why [markdown]\n# It is soft.\n",
    "02_stiffness": "# %% [markdown]\n# # Stiffness\n\n# %% answer 2.1\nk = 50\n\n# %% [markdown]\n# Its mass.\n\n"
    "# %% answer 2.2\nm = 2\n",
    "03_motion": "# %% [markdown]\n# # Motion\n\n# %% answer 3.1\nload = 70\n\n# %% [markdown]\n# At rest.\n\n"
    "# %% answer 3.2\nrest = 5\n",
    "04_report": "# %% [markdown]\n# # Report\n\n# %% answer 4.1\ntotal = 7\n\n# %% [markdown]\n# ## Procedure\n\n"
    "# %% words Report procedure [markdown]\n# It was measured.\n",
}
#: The same of the next release: a text of the second notebook was mended.
NEXT = {**NOTEBOOKS, "02_stiffness": NOTEBOOKS["02_stiffness"].replace("Its mass.", "The mass of it.")}

# --- hand-ins ---------------------------------------------------------------------------------------------------------

#: A notebook in a hand-in that is as it was handed out; that has only an ID typed into it; and one that is no notebook.
UNTOUCHED, ONLY_ID, UNREADABLE = "untouched", "only the ID", "unreadable"
#: A file that stands for the report's PDF.
PDF = "%PDF-1.4 a report"


def at(text: str) -> datetime:
    """Read "11-06 18:00" as a time of the term."""
    return datetime.strptime(f"2026-{text}", "%Y-%m-%d %H:%M").replace(tzinfo=UTC)


@dataclass(frozen=True)
class HandIn:
    """What came at one time.

    Attributes
    ----------
    students : its owners, as its name says: "s1", or "s1+s2" of a pair
    when : time of receipt; when its files were saved, if ``clock`` is False
    notebooks : the first two digits of a notebook's name → what is written in it by name, as code, or how it is
    files : further files by name
    bench : student whom its course.json names; "" if it has none
    partners : partners whom its course.json names
    clock : whether its time of receipt is known
    assignment : for which assignment the instructor collected it; "" if they do not say
    release : 2 if its notebooks are of the next release
    """

    students: str
    when: str
    notebooks: dict[str, Any]
    files: dict[str, str] = field(default_factory=dict)
    bench: str = ""
    partners: tuple[str, ...] = ()
    clock: bool = True
    assignment: str = ""
    release: int = 1


@dataclass(frozen=True)
class Act:
    """What a person did: points for an answer, or an excuse, or giving back an assignment."""

    when: str
    verb: str
    about: tuple[str, ...]


@dataclass(frozen=True)
class Row:
    """A row of the table.

    Attributes
    ----------
    title : what it is about
    hand_ins : in the order in which they came
    counts : student and assignment → the points that count, as arithmetic; "" while nothing is decided
    acts : what persons did
    states : student and assignment → its state, where that is of interest
    """

    title: str
    hand_ins: tuple[HandIn, ...]
    counts: dict[tuple[str, str], str]
    acts: tuple[Act, ...] = ()
    states: dict[tuple[str, str], str] = field(default_factory=dict)


ALL_OF_02 = {"k": "50", "m": "2"}
ALL_OF_03 = {"load": "70", "rest": "5"}
#: The load and the rest are computed from the stiffness that was recorded before.
FROM_K = {"load": "lab.value('2.1', 'k') + 20", "rest": "5"}
CRASHES = {"k": "1 / 0", "m": "2"}
FROM_FILE = {"k": "float(read('data.csv'))", "m": "2"}
FROM_TOOLS = {"k": "float(read('tools.py'))", "m": "2"}
FROM_NOTES = {"k": "float(read('notes/q2-1.txt'))", "m": "float(read('notes/q2-2.txt'))"}

TABLE = (
    Row(
        "A: a typo mended, sent with 03 a week later",
        (
            HandIn("a1", "11-13 10:00", {"02": ALL_OF_02}),
            HandIn("a1", "11-20 10:00", {"02": {**ALL_OF_02, "m": "2.0"}, "03": ALL_OF_03}),
        ),
        # As it was in time: 12 + 8. With the typo mended it would be 7 days late: 20 × 0.5.
        {("a1", "Lab 02"): "20", ("a1", "Lab 03"): "25"},
    ),
    Row(
        "B: Lab 01's folder holds a begun 02; 02 is solved a day late",
        (
            HandIn("b1", "11-06 10:00", {"01": {"a": "50"}, "02": {"m": "1"}}),
            HandIn("b1", "11-14 10:00", {"01": {"a": "50"}, "02": ALL_OF_02}),
        ),
        {("b1", "Lab 01"): "6", ("b1", "Lab 02"): "20 * 0.9"},
    ),
    Row(
        "C: 02 untouched in time; 02 and 03 are solved and sent with 03",
        (
            HandIn("c1", "11-13 10:00", {"02": UNTOUCHED, "03": UNTOUCHED}),
            HandIn("c1", "11-20 10:00", {"02": ALL_OF_02, "03": ALL_OF_03}),
        ),
        # 02 is 7 days late.
        {("c1", "Lab 02"): "20 * 0.5", ("c1", "Lab 03"): "25"},
    ),
    Row(
        "D: 02's stiffness crashes; both are sent again two days after 03 was due, 03 the same bytes",
        (
            HandIn("d1", "11-13 10:00", {"02": CRASHES}),
            HandIn("d1", "11-20 10:00", {"03": FROM_K}),
            HandIn("d1", "11-22 10:00", {"02": ALL_OF_02, "03": FROM_K}),
        ),
        # 02: 8 in time, or 9 days late 20 × 0.5. 03: 10 in time, or 2 days late 25 × 0.8.
        {("d1", "Lab 02"): "20 * 0.5", ("d1", "Lab 03"): "25 * 0.8"},
    ),
    Row(
        "D, where 03 in time is worth more",
        (
            HandIn("d2", "11-13 10:00", {"02": CRASHES}),
            HandIn("d2", "11-20 10:00", {"03": {"load": "70", "rest": "lab.value('2.1', 'k') / 10"}}),
            HandIn("d2", "11-27 10:00", {"02": ALL_OF_02, "03": {"load": "70", "rest": "lab.value('2.1', 'k') / 10"}}),
        ),
        # 15 in time; 7 days late 25 × 0.5 = 12.5.
        {("d2", "Lab 02"): "20 * 0.5", ("d2", "Lab 03"): "15"},
    ),
    Row(
        "E: data.csv is forgotten, and sent the next day",
        (
            HandIn("e1", "11-13 10:00", {"02": FROM_FILE}),
            HandIn("e1", "11-14 10:00", {}, {"data.csv": "50"}, bench="e1"),
        ),
        {("e1", "Lab 02"): "20 * 0.9"},
    ),
    Row(
        "F: 02 each by themselves; 03 by a pair, on the bench of one of them",
        (
            HandIn("f1", "11-13 10:00", {"02": {"k": "60", "m": "2"}}, bench="f1"),
            HandIn("f2", "11-13 11:00", {"02": {"k": "50", "m": "3"}}, bench="f2"),
            # f1's stiffness is 60: on the other bench the load would be 70.
            HandIn("f1", "11-20 10:00", {"03": {"load": "80", "rest": "5"}}, bench="f1", partners=("f2",)),
        ),
        {("f1", "Lab 02"): "20", ("f2", "Lab 02"): "12", ("f1", "Lab 03"): "25", ("f2", "Lab 03"): "25"},
    ),
    Row(
        "G: two versions in time, with opposite guesses",
        (
            HandIn("g1", "11-12 10:00", {"02": {"k": "50", "m": "9"}}),
            HandIn("g1", "11-13 10:00", {"02": {"k": "40", "m": "2"}}),
        ),
        # The newer, although the older has 12.
        {("g1", "Lab 02"): "8"},
    ),
    Row(
        "H: tools.py is changed for 03, and 02 would break with it",
        (
            HandIn("h1", "11-13 10:00", {"02": FROM_TOOLS}, {"tools.py": "50"}),
            HandIn(
                "h1",
                "11-20 10:00",
                {"02": FROM_TOOLS, "03": {"load": "float(read('tools.py'))", "rest": "5"}},
                {"tools.py": "70"},
            ),
        ),
        {("h1", "Lab 02"): "20", ("h1", "Lab 03"): "25"},
    ),
    Row(
        "I: only the ID is typed into each notebook",
        (HandIn("i1", "11-13 10:00", {"01": ONLY_ID, "02": ONLY_ID}),),
        {("i1", "Lab 01"): "0", ("i1", "Lab 02"): "0"},
        states={("i1", "Lab 01"): "untouched", ("i1", "Lab 02"): "untouched"},
    ),
    Row(
        "an extension of one of a pair",
        (
            HandIn("k1", "11-14 10:00", {"02": ALL_OF_02}, bench="k1", partners=("k2",)),
            # The partner confirms it with the same folder, an hour later.
            HandIn("k2", "11-14 11:00", {}, bench="k1", partners=("k2",)),
        ),
        # k2 has until 11-16.
        {("k1", "Lab 02"): "20 * 0.9", ("k2", "Lab 02"): "20"},
    ),
    Row(
        "an excuse, and 03 handed in although",
        (HandIn("l1", "11-13 10:00", {"02": ALL_OF_02}), HandIn("l1", "11-20 10:00", {"03": ALL_OF_03})),
        {("l1", "Lab 02"): "20", ("l1", "Lab 03"): ""},
        (Act("11-18 10:00", "excuse", ("l1", "Lab 03")),),
        {("l1", "Lab 03"): "excused"},
    ),
    Row(
        "a new release between 02 and 03",
        (
            HandIn("m1", "11-13 10:00", {"02": ALL_OF_02}, bench="m1"),
            HandIn("m1", "11-20 10:00", {"02": ALL_OF_02, "03": FROM_K}, bench="m1", release=2),
        ),
        {("m1", "Lab 02"): "20", ("m1", "Lab 03"): "25"},
    ),
    Row(
        "a report of 04, after which 02 is corrected",
        (
            HandIn("n1", "11-13 10:00", {"02": CRASHES}),
            HandIn("n1", "11-27 10:00", {"04": {"total": "7"}}, {"report.pdf": PDF}),
            HandIn("n1", "11-29 10:00", {"02": ALL_OF_02, "04": {"total": "7"}}, {"report.pdf": PDF}),
        ),
        # 02: 16 days late. 04 and its report as they were in time; with the new 02 they would be 2 days late.
        {("n1", "Lab 02"): "20 * 0.5", ("n1", "Lab 04"): "6 + 4 * 0.75"},
        (Act("11-28 10:00", "mark", ("n1", "Report, as a whole", "clarity", "0.75")),),
    ),
    Row(
        "a report that is sent a day after its notebook",
        (
            HandIn("n2", "11-27 10:00", {"04": {"total": "7"}}),
            HandIn("n2", "11-28 10:00", {}, {"report.pdf": PDF}, bench="n2"),
        ),
        # Without the report it is 6; with it, (6 + 4 × 1) × 0.9.
        {("n2", "Lab 04"): "10 * 0.9"},
        (Act("11-29 10:00", "mark", ("n2", "Report, as a whole", "clarity", "1")),),
    ),
    Row(
        "a wrong clock: only the student's computer says that it was in time",
        (
            HandIn("o1", "11-13 10:00", {"02": {"k": "50"}}),
            HandIn("o1", "11-13 11:00", {"02": ALL_OF_02}, clock=False),
        ),
        # 12 in time; 20 if a person says that it was in time.
        {("o1", "Lab 02"): ""},
        states={("o1", "Lab 02"): "waits for a person"},
    ),
    Row(
        "a wrong clock, and nothing to be gained by it",
        (
            HandIn("o2", "11-13 10:00", {"02": ALL_OF_02}),
            HandIn("o2", "11-13 11:00", {"02": {"k": "50"}}, clock=False),
        ),
        {("o2", "Lab 02"): "20"},
    ),
    Row(
        "late own files: the answers of 02 come with the next assignment",
        (
            HandIn("p1", "11-13 10:00", {"02": FROM_NOTES}),
            HandIn("p1", "11-20 10:00", {"03": ALL_OF_03}, {"notes/q2-1.txt": "50", "notes/q2-2.txt": "2"}),
        ),
        # Nothing in time; 7 days late 20 × 0.5.
        {("p1", "Lab 02"): "20 * 0.5", ("p1", "Lab 03"): "25"},
    ),
    Row(
        "a zip that cannot be read, handed in for Lab 02",
        (
            HandIn("r1", "11-13 10:00", {"02": UNREADABLE}, assignment="Lab 02"),
            HandIn("r1", "11-20 10:00", {"03": ALL_OF_03}, assignment="Lab 03"),
        ),
        {("r1", "Lab 01"): "0", ("r1", "Lab 02"): "", ("r1", "Lab 03"): "25"},
        states={("r1", "Lab 01"): "missing", ("r1", "Lab 02"): "could not be graded"},
    ),
    Row(
        "a text that is replaced, late, and both are scored",
        (
            HandIn("t1", "11-06 10:00", {"01": {"a": "50", "why": "It is soft."}}),
            HandIn("t1", "11-07 10:00", {"01": {"a": "50", "why": "It is long."}}),
        ),
        # 6 + 1 in time. Late, the new text could have been (6 + 4) × 0.9; it has (6 + 0) × 0.9.
        {("t1", "Lab 01"): "6 + 1"},
        (Act("11-06 20:00", "mark", ("t1", "1.2", "why", "1")), Act("11-07 20:00", "mark", ("t1", "1.2", "why", "0"))),
    ),
    Row(
        "02 is untouched in a folder from another computer",
        (
            HandIn("v1", "11-13 10:00", {"02": ALL_OF_02}),
            HandIn("v1", "11-20 10:00", {"02": UNTOUCHED, "03": FROM_K}),
        ),
        {("v1", "Lab 02"): "20", ("v1", "Lab 03"): "25"},
    ),
    Row(
        "the whole folder each week, by a student who works ahead",
        (
            HandIn("u1", "11-06 10:00", {"01": {"a": "50"}, "02": UNTOUCHED, "03": {"rest": "5"}}),
            HandIn("u1", "11-13 10:00", {"01": {"a": "50"}, "02": ALL_OF_02, "03": {"rest": "5"}}),
            HandIn("u1", "11-20 10:00", {"01": {"a": "50"}, "02": ALL_OF_02, "03": FROM_K, "04": UNTOUCHED}),
        ),
        {("u1", "Lab 01"): "6", ("u1", "Lab 02"): "20", ("u1", "Lab 03"): "25", ("u1", "Lab 04"): "0"},
    ),
)

#: With no points for lateness: what is corrected after it was given back does not count by itself.
FREE = (
    Row(
        "J: 02 is corrected after marks were given back",
        (HandIn("j1", "11-13 10:00", {"02": CRASHES}), HandIn("j1", "11-20 10:00", {"02": ALL_OF_02})),
        {("j1", "Lab 02"): "8"},
        (Act("11-15 10:00", "publish", ("Lab 02",)),),
    ),
    Row(
        "nothing of 02 counted when it was given back",
        (HandIn("j2", "11-13 10:00", {"02": UNTOUCHED}), HandIn("j2", "11-20 10:00", {"02": ALL_OF_02})),
        {("j2", "Lab 02"): "20"},
    ),
    Row(
        "lateness costs nothing: the newest counts",
        (HandIn("j3", "11-14 09:00", {"02": {"k": "50"}}), HandIn("j3", "11-14 10:00", {"02": {"m": "2"}})),
        {("j3", "Lab 02"): "8"},
    ),
    Row(
        "lateness costs nothing, and only the student's computer says when",
        (
            HandIn("j4", "11-14 09:00", {"02": {"k": "50"}}, clock=False),
            HandIn("j4", "11-14 10:00", {"02": {"m": "2"}}, clock=False),
        ),
        {("j4", "Lab 02"): "8"},
    ),
)

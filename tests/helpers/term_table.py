"""A term by the calendar, as data: the course, the class, and what happens until each of six dates.

Nothing here is computed. ``term_by_hand.py`` works out what every page and file must say, ``term_class.py`` does the
same with the program. A maintainer can check a number with this table and a pencil. All times are UTC.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

# --- the course -------------------------------------------------------------------------------------------------------

#: Notebook → its parts that count → their points as they count: 2.2 ``unit`` is dropped, and 4.1 counts twice.
PARTS = {
    "01_spring": {"k": 2, "why": 3},
    "02_mass": {"m": 4},
    "03_motion": {"load": 4, "remark": 2},
    "04_report": {"total": 10},
}
#: Parts that a person reads.
WORDS = ("why", "remark")
#: Part → question that asks for it.
QUESTION = {"k": "1.1", "why": "1.2", "m": "2.1", "unit": "2.2", "load": "3.1", "remark": "3.2", "total": "4.1"}
#: Assignment → its notebooks, and what its column is out of.
ASSIGNMENTS = {
    "Lab A": (("01_spring", "02_mass"), 20),
    "Lab B": (("03_motion",), 6),
    "04 report": (("04_report",), 10),
}

SETTINGS = """\
[marks]
drop = ["2.2"]
weights = {"4.1" = 2}

[late]
per_day = 10
cap = 35
grace_hours = 2

[[assignment]]
title = "Lab A"
notebooks = ["01_spring", "02_mass"]
due = 2026-11-06T18:00:00Z
out_of = 20

[[assignment]]
title = "Lab B"
notebooks = ["03_motion"]
due = 2026-11-20T18:00:00Z

[[deadline]]
due = 2026-11-08T18:00:00Z
section = "B"
assignments = ["Lab A"]

[[extension]]
until = 2026-11-27T18:00:00Z
students = ["s5"]
assignments = ["Lab B"]

[[extension]]
until = 2026-11-13T18:00:00Z
students = ["s6"]
notebooks = ["02_mass"]
"""

CATALOGUE = """\
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, number, prose
from labcourse.grading.course import Course

from .key import KEY


def value(name, points):
    return number(name, "N", None, "", "A number.", points)


CATALOGUE = Catalogue(
    [
        Question("1.1", "1", "01_spring", "Stiffness", (), (value("k", 2),)),
        Question("1.2", "1", "01_spring", "Why", (), (prose("why", "", "Why does it bend?", 3),)),
        Question("2.1", "2", "02_mass", "Mass", (), (value("m", 4),)),
        Question("2.2", "2", "02_mass", "Unit", (), (value("unit", 1),)),
        Question("3.1", "3", "03_motion", "Load", (), (value("load", 4),)),
        Question("3.2", "3", "03_motion", "Remark", (), (prose("remark", "", "What did you see?", 2),)),
        Question("4.1", "4", "04_report", "Total", (), (value("total", 5),)),
    ],
)
COURSE = Course(
    name="term",
    title="A term",
    catalogue=CATALOGUE,
    key=KEY,
    bench=lambda student, policy: None,
    package="labcourse",
    packages=(),
    imports=("labcourse.session",),
)
"""

#: The key has two faults until it is mended: 2.1 does not follow from an own ``k``, and 3.1 cannot be marked.
KEY = """\
from labcourse.grading.marking.checks import ForAPerson, Number

KEY = {{
    "1.1": {{"k": Number("the stiffness", lambda bench: 50.0, rtol=1e-9)}},
    "1.2": {{"why": ForAPerson()}},
    "2.1": {{"m": Number("the mass", lambda bench: 2.0, rtol=1e-9, follow={mass}, follow_rtol=1e-9)}},
    "2.2": {{"unit": Number("the unit", lambda bench: 1.0, rtol=1e-9)}},
    "3.1": {{
        "load": Number(
            "the load",
            lambda bench: {load},
            rtol=1e-9,
            follow=lambda own: own("1.1", "k") + 10 * own("2.1", "m"),
            follow_rtol=1e-9,
        )
    }},
    "3.2": {{"remark": ForAPerson()}},
    "4.1": {{"total": Number("the total", lambda bench: 7.0, rtol=1e-9)}},
}}
"""
FAULTY = KEY.format(mass="None", load="70.0 + None")
MENDED = KEY.format(mass='lambda own: own("1.1", "k") / 25', load="70.0")

#: Notebook → its text, in the percent format.
NOTEBOOKS = {
    "01_spring": "# %% [markdown]\n# # Spring\n\n# %% answer 1.1\nk = 50\n\n# %% [markdown]\n# Say why.\n\n"
    "# %% words 1.2 why [markdown]\n# It is soft.\n",
    "02_mass": "# %% [markdown]\n# # Mass\n\n# %% answer 2.1\nm = 2\n\n# %% [markdown]\n# Its unit.\n\n"
    "# %% answer 2.2\nunit = 1\n",
    "03_motion": "# %% [markdown]\n# # Motion\n\n# %% answer 3.1\nload = 70\n\n# %% [markdown]\n# Say what.\n\n"
    "# %% words 3.2 remark [markdown]\n# It moves.\n",
    "04_report": "# %% [markdown]\n# # Report\n\n# %% answer 4.1\ntotal = 7\n",
}

# --- the class --------------------------------------------------------------------------------------------------------

#: Student → name and section.
CLASS = {
    "s1": ("Ada Ash", "A"),
    "s2": ("Ben Birch", "A"),
    "s3": ("Cem Cedar", "B"),
    "s4": ("Dora Dale", "A"),
    "s5": ("Emil Elm", "A"),
    "s6": ("Fay Fern", "B"),
    "s7": ("Gus Gorse", "A"),
    "s8": ("Hana Hazel", "B"),
}

# --- what happens -----------------------------------------------------------------------------------------------------

#: A notebook in a hand-in that is as it was handed out; and one that is no notebook.
UNTOUCHED, UNREADABLE = "untouched", "unreadable"


def at(text: str) -> datetime:
    """Read "11-06 18:00" as a time of the term."""
    return datetime.strptime(f"2026-{text}", "%Y-%m-%d %H:%M").replace(tzinfo=UTC)


@dataclass(frozen=True)
class HandIn:
    """A zip that came.

    Attributes
    ----------
    students : whose it is, as its name says: "s1", or "s5+s8" of a pair
    when : time of receipt
    notebooks : the first two digits of a notebook's name → what is written in it by name, or how it is
    """

    students: str
    when: str
    notebooks: dict[str, Any]


@dataclass(frozen=True)
class Day:
    """A date: what came until then and is graded then, and what persons do after that.

    Attributes
    ----------
    title : what the date is about
    now : the time
    hand_ins : what came since the date before
    acts : in order, each a verb and what it is about
    lost : student at whom the grading breaks off, as the sandbox is lost; "" for nobody
    """

    title: str
    now: str
    hand_ins: tuple[HandIn, ...]
    acts: tuple[tuple[str, ...], ...] = ()
    lost: str = ""


ADA_1 = {"k": 50, "why": "It is soft."}
ADA_2 = {"m": 2, "unit": 1}
HANA = HandIn("s8", "11-16 10:00", {"01": {"k": 50}})

TERM = (
    Day(
        "before anything is due",
        "11-03 12:00",
        (
            # All of the course's folder, of which one notebook is done.
            HandIn("s1", "11-02 10:00", {"01": ADA_1, "02": UNTOUCHED, "03": UNTOUCHED, "04": UNTOUCHED}),
            # Ben's stiffness is wrong.
            HandIn("s2", "11-03 08:00", {"01": {"k": 80, "why": "It gives way."}}),
        ),
    ),
    Day(
        "after the first due, which is not yet that of section B",
        "11-07 09:00",
        (
            HandIn("s1", "11-05 10:00", {"01": ADA_1, "02": ADA_2, "03": UNTOUCHED, "04": UNTOUCHED}),
            # 80 / 25 = 3.2: right, given the own stiffness. The key does not know that yet.
            HandIn("s2", "11-06 17:00", {"02": {"m": 3.2}}),
            HandIn("s3", "11-06 12:00", {"01": {"k": 50}, "02": {"m": 9}}),
            # Within the two hours of grace.
            HandIn("s4", "11-06 19:30", {"01": {"k": 80, "why": "It is steel."}}),
            HandIn("s6", "11-06 10:00", {"01": {"k": 50, "why": "It is thin."}, "02": UNREADABLE}),
        ),
        (("mark", "s1", "why", "2.5"), ("mark", "s2", "why", "1.5")),
    ),
    Day(
        "after late hand-ins and an excuse; Lab A is given back",
        "11-13 19:00",
        (
            # Section B has until 11-08 18:00, and two hours of grace.
            HandIn("s3", "11-08 19:59", {"01": {"k": 50, "why": "It is long."}, "02": {"m": 9, "unit": 1}}),
            # 64 h after the grace: 3 days, 30 %.
            HandIn("s4", "11-09 12:00", {"02": {"m": 3.2, "unit": 1}}),
            # 132 h after the grace: 6 days would be 60 %, of which 35 % are taken.
            HandIn("s5", "11-12 08:00", {"01": {"k": 50, "why": "It is hot."}, "02": {"m": 2}}),
            # In time by the extension of that notebook.
            HandIn("s6", "11-10 09:00", {"02": {"m": 2}}),
            HandIn("s2", "11-11 09:00", {"03": {"load": 112, "remark": "It swings."}}),
        ),
        (
            ("excuse", "s7", "Lab A"),
            ("mark", "s4", "why", "1"),
            ("mark", "s6", "why", "3"),
            ("request", "s4", "why"),
            ("publish", "Lab A"),
        ),
    ),
    Day(
        "after a resubmission of what was given back, and a grading that broke off",
        "11-17 12:00",
        (
            # The first two are as they were, and so they are not late.
            HandIn("s1", "11-14 10:00", {"01": ADA_1, "02": ADA_2, "03": {"load": 70, "remark": "It sags."}}),
            # It came after Lab A was given back, and does not count by itself.
            HandIn("s2", "11-16 21:00", {"01": {"k": 80, "why": "It is soft, and long."}}),
            # From another computer, where the first two are as they were handed out: they replace nothing.
            HandIn("s6", "11-15 09:00", {"01": UNTOUCHED, "02": UNTOUCHED, "03": {"load": 70, "remark": "It stops."}}),
            HANA,
        ),
        (("mark", "s5", "why", "2"), ("mark", "s3", "why", "2")),
        lost="s8",
    ),
    Day(
        "after the key is mended and all is marked again; Lab B is given back",
        "11-23 09:00",
        (
            HandIn("s1", "11-20 12:00", {"04": {"total": 7}}),
            # No deadline names the report: it is due with the last notebook that one names, and never late.
            HandIn("s2", "11-22 12:00", {"04": {"total": 7}}),
            # 13 h after the grace: a day, 10 %. 50 + 10 × 9 = 140: right, given the own mass.
            HandIn("s3", "11-21 09:00", {"03": {"load": 140}, "04": UNTOUCHED}),
            # 80 + 10 × 3.2 = 112: right, given the own stiffness and mass.
            HandIn("s4", "11-20 17:00", {"03": {"load": 112, "remark": "It hums."}, "04": UNREADABLE}),
            # A pair for the report alone: what Emil handed in before is not Hana's.
            HandIn("s5+s8", "11-22 20:00", {"04": {"total": 7}}),
            HandIn("s6", "11-20 18:30", {"04": {"total": 8}}),
            HandIn("s7", "11-19 10:00", {"03": {"load": 70, "remark": "It is still."}}),
            HANA,
        ),
        (
            ("regrade",),
            ("mark", "s1", "remark", "2"),
            ("mark", "s2", "remark", "1"),
            ("mark", "s6", "remark", "0.5"),
            ("answer", "s4", "why"),
            ("excuse", "s8", "Lab B"),
            ("publish", "Lab B"),
        ),
    ),
    Day(
        "after the last due; all is given back",
        "11-30 09:00",
        (
            # Within the grace of an extension.
            HandIn("s5", "11-27 19:00", {"03": {"load": 70, "remark": "It is loud."}}),
        ),
        (
            ("undo", "s8", "Lab B"),
            ("mark", "s4", "remark", "1.5"),
            ("mark", "s5", "remark", "1"),
            ("publish",),
        ),
    ),
)

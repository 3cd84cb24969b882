"""A small class with trouble of many kinds; its notebooks run in a moment.

The course is a mass on a spring (``tests/courses/spring``) with other questions: a stiffness, words about it, a mass
that builds on the stiffness, a load that the key cannot mark, and a report.
"""

import csv
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from checkout import ROOT

from labcourse.grading import course as courses
from labcourse.grading.release import student_course

SPRING, MASS = "01_spring.ipynb", "02_mass.ipynb"
REPORT = "report.pdf"
ROSTER = ("right", "broken", "stopped", "refused", "home", "friend", "absent")
#: When something was handed in; of who is not here, only their own computer says it.
_TIMES = {"right": "2026-11-08 12:00", "broken": "2026-11-06 12:00", "stopped": "2026-11-06 12:00"}
_TIMES |= {"refused": "2026-11-07 12:00", "copies": "2026-11-06 12:00"}

_CATALOGUE = """
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, ReportItem, number, prose

CATALOGUE = Catalogue(
    [
        Question("1.1", "1", "01_spring", "Stiffness", (), (number("k", "N/m", None, "", "Of the spring.", 2),)),
        Question("1.2", "1", "01_spring", "Why", (), (prose("why", "", "Why does it bend?", 2),)),
        Question("2.1", "1", "02_mass", "Mass", (), (number("m", "kg", None, "", "Of the mass.", 3),)),
        Question("2.2", "1", "02_mass", "Load", (), (number("load", "N", None, "", "Of both.", 1),)),
    ],
    reports={"Report": ("1", "02_mass", "Report")},
    outcomes={"reports": "reports clearly"},
    report_items=[
        ReportItem("Report", "1", "Procedure", "What was done?", ("reports",), (("1.1", ""),), part="procedure"),
        ReportItem("Report", "2", "As a whole", "Is it clear?", ("reports",), judged="clarity"),
    ],
)
"""
_KEY = """
from labcourse.grading.marking.checks import ForAPerson, Number

KEY = {
    "1.1": {"k": Number("the stiffness", lambda bench: 50.0, rtol=0.01)},
    "1.2": {"why": ForAPerson()},
    "2.1": {
        "m": Number(
            "the mass", lambda bench: 2.0, rtol=0.01, follow=lambda own: own("1.1", "k") / 25, follow_what="your own k"
        )
    },
    "2.2": {"load": Number("the load", lambda bench: bench.nothing, rtol=0.01)},
    "Report": {"procedure": ForAPerson()},
}
"""
_SPRING = """\
# %% [markdown]
# # Spring

# %% answer 1.1
k = 50

# %% [markdown]
# Say why.

# %% words 1.2 why [markdown]
# It is soft.
"""
_MASS = """\
# %% [markdown]
# # Mass

# %% answer 2.1
m = lab.value("1.1", "k") / 25

# %% [markdown]
# Its load.

# %% answer 2.2
load = 70

# %% [markdown]
# The report.

# %% words Report procedure [markdown]
# It hung.
"""
_SETTINGS = """
[late]
per_day = 10

[[assignment]]
title = "Lab A"
notebooks = ["01_spring", "02_mass"]
due = 2026-11-06T18:00:00Z
"""
_PDF = b"%PDF-1.7\n%%EOF\n"
_RIGHT = {"q1-1": "k = 50", "q1-2-why": "It is soft.", "q2-1": "m = 2"}


def course(folder: Path) -> Path:
    """Make the course in a folder; the folder with its key."""
    shutil.copytree(ROOT / "tests" / "courses" / "spring", folder, ignore=shutil.ignore_patterns("__pycache__"))
    solutions = folder / "solutions"
    (solutions / "01_spring.py").unlink()
    (solutions / "rubric.toml").unlink()
    files = {"key.py": _KEY, "course.toml": _SETTINGS, "01_spring.py": _SPRING, "02_mass.py": _MASS}
    for name, text in files.items():
        (solutions / name).write_text(text, encoding="utf-8")
    (folder / "springlab" / "catalogue.py").write_text(_CATALOGUE, encoding="utf-8")
    student_course.write_notebooks(courses.load(solutions))
    return solutions


def hand_in(source: Path, folder: Path) -> dict[str, Path]:
    """Put all submissions into a folder; the roster and the times, which lie beside it."""
    released = {name: (source.parent / "notebooks" / name).read_text(encoding="utf-8") for name in (SPRING, MASS)}
    for student, files in _submissions(released).items():
        (folder / student).mkdir(parents=True)
        for name, content in files.items():
            data = content.encode() if isinstance(content, str) else content
            (folder / student / name).write_bytes(data)
    tables = {"roster": [("id",), *((student,) for student in ROSTER)], "times": [("name", "time"), *_TIMES.items()]}
    for name, rows in tables.items():
        with folder.with_name(f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)
    return {name: folder.with_name(f"{name}.csv") for name in tables}


def _submissions(released: Mapping[str, str]) -> dict[str, dict[str, str | bytes]]:
    """Return student → the files that they hand in."""

    def filled(name: str, **changes: str) -> str:
        sources = {**_RIGHT, **{cell.replace("_", "-"): text for cell, text in changes.items()}}
        notebook = json.loads(released[name])
        for cell in notebook["cells"]:
            cell["source"] = sources.get(cell["id"], cell["source"])
        return json.dumps(notebook)

    def about(student: str, **more: Any) -> str:
        return json.dumps({"student": student, **more})

    recorded = {"cells": {"1.1": {"k": "q1-1"}}, "answers": {"1.1": {"k": {"kind": "number", "value": 50.0}}}}
    at_home = about("home", format=2, bench={}, software="", probe_seed=1, **recorded)
    spring, mass = filled(SPRING), filled(MASS)
    return {
        # late, and with a report; the key cannot mark the load
        "right": {SPRING: spring, MASS: filled(MASS, q2_2="load = 70"), "course.json": about("right"), REPORT: _PDF},
        # one cannot be read, a cell of the other never ends, and the report is no PDF
        "broken": {SPRING: spring[:100], MASS: filled(MASS, q2_1="m = 2\nwhile True:\n    pass"), REPORT: b"no PDF"},
        # a module that is missing, and a file that was left out
        "stopped": {
            SPRING: filled(SPRING, q1_1="import my_rods\nk = my_rods.k"),
            MASS: filled(MASS, q2_2="load = float(open('load.txt').read())"),
        },
        # an answer that is refused, one that builds on it, and another student's course.json
        "refused": {
            SPRING: filled(SPRING, q1_1="k = 'soft'"),
            MASS: filled(MASS, q2_1="m = lab.value('1.1', 'k') / 25"),
            "course.json": about("right"),
        },
        # recorded at home and missing here, and a partner who is not confirmed
        "home": {
            SPRING: filled(SPRING, q1_1="k = None"),
            MASS: mass,
            "answers.json": at_home,
            "course.json": about("home", **{"with": ["friend"]}),
        },
        # not on the roster; two copies, of which one counts; a notebook as it was handed out
        "copies": {SPRING: filled(SPRING, q1_1="k = 49"), "01_spring (1).ipynb": spring, MASS: released[MASS]},
    }

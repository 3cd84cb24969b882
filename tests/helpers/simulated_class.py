"""A small class of simulated students, each with a way of working of their own, and the marks that they should get.

The marks were worked out by hand from the points in the catalogue (2.9: recording 1, figure 1; 2.10: function 2,
figure 1; 2.11: frequency 2, explanation 1, which waits for a person; 2.12: inertia 1, stiffness 2) and the policy in
``solutions/key.py``.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from made_courses import copied

from rotflex.instructor import course as courses
from rotflex.instructor.release import student_course, student_notebooks

START, STIFFNESS = "00_start.ipynb", "02_finding_stiffness.ipynb"
Notebooks = dict[str, dict[str, Any]]

# --- what they write into their answer cells --------------------------------------------------------------------------

BY_OTHER_MEANS = {
    "q0-1": "from fractions import Fraction\nresolution = np.float32(float(Fraction(1, 4096)) * 2 * np.pi)",
    # Radians instead of degrees; two diagrams on one sheet; labels in TeX.
    "q2-9": r"""
with lab.bench() as b:
    experiments.free_decay(b, progress=False)
    sweep = experiments.sweep(b, 1, 5, 15, progress=False)
figure_sweep = plt.figure()
upper, lower = figure_sweep.subplots(2, 1, sharex=True)
upper.plot(sweep.time, sweep["theta"])
lower.plot(sweep.time, 1 * sweep["alpha"])
upper.set_ylabel(r"$\theta$ / rad")
lower.set_ylabel(r"$\alpha$ / rad")
lower.set_xlabel("Time [s]")
""",
    # No padding, another library, a spectrum to 250 Hz of which only a part is shown, a logarithmic axis.
    "q2-10": r"""
import scipy.signal
spectrum = lambda x, dt: (
    lambda f, power: (f, np.sqrt(2 * power))
)(*scipy.signal.periodogram(x, fs=1 / dt, scaling="spectrum"))
f_hz, amplitude_deg = spectrum(np.rad2deg(sweep["alpha"]), sweep.sample_time)
lines = plt.semilogy(f_hz[1:], amplitude_deg[1:])
plt.xlim(0, 10)
plt.xlabel("$f$ in Hz")
plt.ylabel(r"$|\alpha|$ in $^\circ$")
figure_spectrum = plt.gca()
""",
    # The ratio of the angles, and a parabola through the three highest points.
    "q2-11": r"""
f, cross = scipy.signal.csd(sweep["theta"], sweep["alpha"], fs=500, nperseg=len(sweep))
_, power = scipy.signal.welch(sweep["theta"], fs=500, nperseg=len(sweep))
inside = (f > 1.2) & (f < 4.8)
f, H = f[inside], np.abs(cross / power)[inside]
k = np.argmax(H)
a, b, c = np.polyfit(f[k - 1 : k + 2], H[k - 1 : k + 2], 2)
omega_n = np.array([[-b / a / 2 * 2 * np.pi]])
""",
    "q2-11-explanation": "theta is <b>not flat</b>: the link holds the servo still, like an absorber.",
    # Rods about their middles, shifted; exact arithmetic; K_s from the period.
    "q2-12": r"""
import sympy
m = {name: sympy.nsimplify(getattr(lab.joint, name)) for name in ("m_1", "L_1", "m_2", "L_2", "d_12")}
J_l = m["m_1"] * m["L_1"] ** 2 / 12 + m["m_1"] * (m["L_1"] / 2) ** 2 + m["m_2"] * (m["L_2"] ** 2 / 12 + m["d_12"] ** 2)
period = 2 * np.pi / float(omega_n[0, 0])
K_s = float(J_l) * 4 * np.pi**2 / period**2
""",
}

CONSISTENT = {
    # 25 rad/s is far off every bench (they lie between 17 and 22.5 rad/s); K_s = J_l·25² is then off, too.
    "q2-11": "omega_n = 25.0",
    "q2-11-explanation": "Because.",
}

WRONG = {
    "q0-1": "resolution = 360 / 4096",  # degrees
    "q2-9": """
with lab.bench() as b:
    sweep = experiments.sweep(b, drive="voltage", progress=False)
figure_sweep, ax = plt.subplots()
ax.plot(sweep.time, sweep.degrees("alpha"))
""",
    "q2-10": """
def spectrum(x, dt):
    return np.fft.rfftfreq(len(x), dt), np.abs(np.fft.rfft(x)) / len(x)
f_hz, amplitude_deg = spectrum(sweep.degrees("alpha"), sweep.sample_time)
figure_spectrum, ax = plt.subplots()
shown = f_hz < 10
ax.plot(2 * np.pi * f_hz[shown], amplitude_deg[shown])
ax.set(xlabel="frequency (Hz)", ylabel="amplitude (deg)")
""",
    "q2-11": "omega_n = 3.2",
    "q2-11-explanation": " ",
    "q2-12": "J_l = 0.01\nK_s = 5.0",
}

NONSENSE = {
    "q0-1": "resolution = 'small'",
    "q2-9": "sweep = [1, 2, 3]\nfigure_sweep = 'a drawing'",
    "q2-10": """
def spectrum(x, dt):
    return np.zeros(3), np.zeros((2, 2))
f_hz, figure_spectrum = None, plt.figure()
""",
    "q2-11": "omega_n = np.array([19.0, 20.0])",
    "q2-11-explanation": "...",
    "q2-12": "J_l = float('nan')\nK_s = np.inf",
}

ENDLESS = {"q2-10": "while True:\n    pass"}
DIES = {"q2-10": "import os\nos._exit(1)"}

#: The friend's arm swings at 18.7 rad/s, where the borrower's does at 21.5 rad/s.
BORROWED = {
    "q2-9": """
from rotflex.hil.student_benches import student_seed
with hil.open("virtual", seed=student_seed("friend")) as b:
    sweep = experiments.sweep(b, progress=False)
figure_sweep, ax = plt.subplots()
ax.plot(sweep.time, sweep.degrees("alpha"))
ax.set(xlabel="time (s)", ylabel="alpha (deg)")
""",
}

# What no lab.answer writes, put into the file by hand before the last answer is given in the proper way.
FORGED = {
    "q2-12": """
import json, pathlib
book = json.loads(pathlib.Path("answers.json").read_text())
book["student"] = "Forger"
book["answers"]["2.9"]["sweep"]["channels"]["alpha"]["values"] = "9" * 1000
book["answers"]["2.11"]["omega_n"]["value"] = "19.434"
book["answers"]["2.10"]["spectrum"]["outputs"] = [[[1, 2], [1e308, 1e308]]] * 4
book["answers"]["9.9"] = {"everything": {"kind": "number", "value": 1}}
pathlib.Path("answers.json").write_text(json.dumps(book))
J_l = lab.joint.m_1 * lab.joint.L_1**2 / 3 + lab.joint.m_2 * (lab.joint.L_2**2 / 12 + lab.joint.d_12**2)
K_s = 1.5085
""",
}

# --- who there is, and what they should get ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Student:
    """A simulated student.

    Attributes
    ----------
    writes : answer cell's id → source, beside the solutions unless ``alone``
    marks : question → points
    statuses : (question, part) → status, where it is worth a look
    awaiting : points that wait for a person
    trouble : a piece of what is reported as a problem; None if there should be none
    spoil : what else happens to the notebooks before they are handed in
    """

    writes: dict[str, str]
    marks: dict[str, float]
    statuses: dict[tuple[str, str], str]
    awaiting: float = 1
    trouble: str | None = None
    alone: bool = False
    spoil: Callable[[Notebooks], None] = field(default=lambda notebooks: None)
    zipped: bool = False


def _delete_and_double(course: Notebooks) -> None:
    cells = course[STIFFNESS]["cells"]
    cells[:] = [cell for cell in cells if cell["id"] != "q2-9"]
    place = next(index for index, cell in enumerate(cells) if cell["id"] == "q2-11")
    cells.insert(place + 1, {**cells[place], "source": "omega_n = 1.0"})
    lost = next(cell for cell in cells if cell["id"] == "q2-12")
    lost["metadata"] = {}


FULL = {"2.9": 2.0, "2.10": 3.0, "2.11": 2.0, "2.12": 3.0}
NOTHING = {"2.9": 0.0, "2.10": 0.0, "2.11": 0.0, "2.12": 0.0}
FOLLOWS = "right, given your own earlier answers"

CLASS = {
    "right": Student({}, FULL, {("2.11", "explanation"): "for a person", ("0.1", "resolution"): "right"}),
    "other-means": Student(
        BY_OTHER_MEANS, FULL, {("2.12", "K_s"): "right", ("0.1", "resolution"): "right"}, zipped=True
    ),
    # Loses the 2 points for omega_n. K_s = 0.003278·25² = 2.05, where the bench has 1.21: follows, 2 of 2.
    "consistent": Student(
        CONSISTENT,
        {"2.9": 2, "2.10": 3, "2.11": 0, "2.12": 3},
        {("2.11", "omega_n"): "wrong", ("2.12", "K_s"): FOLLOWS},
    ),
    # 2.9: the recording is of the voltage-driven sweep, 0; the figure shows it, but has no labels, ½ of 1.
    # 2.10: half the height, ½ of 2; the figure's frequencies are in rad/s where it says Hz, so nothing peaks there, 0.
    # 2.11: Hz for rad/s, 0; no explanation. 2.12: both wrong, and 5.0 is not 0.01·3.2² = 0.10 either.
    "wrong": Student(
        WRONG,
        {"2.9": 0.5, "2.10": 1.0, "2.11": 0.0, "2.12": 0.0},
        {
            ("0.1", "resolution"): "wrong",
            ("2.9", "sweep"): "wrong",
            ("2.9", "figure"): "partly right",
            ("2.10", "spectrum"): "partly right",
            ("2.10", "figure"): "wrong",
            ("2.11", "omega_n"): "wrong",
            ("2.11", "explanation"): "missing",
            ("2.12", "J_l"): "wrong",
            ("2.12", "K_s"): "wrong",
        },
        awaiting=0,
        alone=True,
    ),
    "empty": Student({}, NOTHING, {("2.12", "K_s"): "missing"}, awaiting=0, alone=True),
    # 00 is fine, 02 is cut off in the middle.
    "not-json": Student(
        {}, NOTHING, {("0.1", "resolution"): "right", ("2.9", "sweep"): "missing"}, awaiting=0, trouble="not JSON"
    ),
    # Without the recording (2.9 deleted) there is no spectrum of it; the function is defined before the cell fails, 2.
    # The second q2-11, omega_n = 1, is run as well, and is wrong, 0 of 2. J_l is right, and K_s follows from it, 3.
    "cells": Student(
        {},
        {"2.9": 0, "2.10": 2, "2.11": 0, "2.12": 3},
        {("2.9", "sweep"): "missing", ("2.10", "spectrum"): "right", ("2.11", "omega_n"): "wrong"},
        trouble="2.9 stopped: NameError, name 'sweep' is not defined",
        spoil=_delete_and_double,
    ),
    # Nothing of it has the form of an answer, so nothing is recorded.
    "nonsense": Student(NONSENSE, NOTHING, {("2.11", "omega_n"): "missing"}, awaiting=0, alone=True),
    # 2.9 was done before the loop. After it, spectrum and omega_n are not there; J_l is, 1 of 3.
    "endless": Student(
        ENDLESS,
        {"2.9": 2, "2.10": 0, "2.11": 0, "2.12": 1},
        {("2.10", "spectrum"): "missing", ("2.12", "J_l"): "right", ("2.12", "K_s"): "missing"},
        trouble="longer than",
    ),
    # 2.9 was recorded before the kernel died; nothing after it.
    "dies": Student(DIES, {"2.9": 2, "2.10": 0, "2.11": 0, "2.12": 0}, {("2.12", "J_l"): "missing"}, trouble="died"),
    # The recording is another bench's, 0 of 1; both figures show it as they should, 2 of 2; the function is right,
    # 2 of 2. The frequency is the friend's, 0 of 2; K_s = 0.003317·18.7² = 1.16, where the bench has 1.53: follows, 2.
    "borrower": Student(
        BORROWED,
        {"2.9": 1, "2.10": 3, "2.11": 0, "2.12": 3},
        {
            ("2.9", "sweep"): "wrong",
            ("2.9", "figure"): FOLLOWS,
            ("2.10", "figure"): FOLLOWS,
            ("2.11", "omega_n"): "wrong",
            ("2.12", "K_s"): FOLLOWS,
        },
    ),
    # The figures were honest, 1 and 1. Recording, function and frequency were forged, 0. J_l and K_s are right, 3.
    "forger": Student(
        FORGED,
        {"2.9": 1, "2.10": 1, "2.11": 0, "2.12": 3},
        {("2.9", "sweep"): "wrong", ("2.10", "spectrum"): "wrong", ("2.11", "omega_n"): "wrong"},
    ),
}


# --- what they hand in ------------------------------------------------------------------------------------------------


def course(folder: Path) -> Path:
    """The folder of this course with the notebooks that this class has done, and the real key to their questions."""
    return copied(
        folder, (START, STIFFNESS), more=f"\nKEY = {{number: KEY[number] for number in {('0.1', *FULL)!r}}}\n"
    )


def solution_sources(source: Path) -> dict[str, str]:
    """Answer cell's id → the instructor's source."""
    return {
        cell.id: cell.source
        for path in courses.load(source).notebooks
        for cell in student_notebooks.read(path).cells
        if student_notebooks.is_answer(cell)
    }


def filled_in(source: Path, writes: dict[str, str]) -> Notebooks:
    """The student notebooks with these sources in their answer cells."""
    filled = {name: json.loads(text) for name, text in student_course.derived(courses.load(source)).items()}
    for notebook in filled.values():
        for cell in notebook["cells"]:
            if cell["id"] in writes:
                cell["source"] = writes[cell["id"]].splitlines(keepends=True)
    return filled


def hand_in(source: Path, submissions: Path) -> None:
    """Put every student's submission into a folder."""
    solutions = solution_sources(source)
    for name, student in CLASS.items():
        work = filled_in(source, student.writes if student.alone else {**solutions, **student.writes})
        student.spoil(work)
        texts = {file: json.dumps(notebook) for file, notebook in work.items()}
        if name == "not-json":
            texts[STIFFNESS] = texts[STIFFNESS][:5000]
        if student.zipped:
            submissions.mkdir(exist_ok=True)
            with zipfile.ZipFile(submissions / f"{name}.zip", "w") as packed:
                for file, text in texts.items():
                    packed.writestr(f"my course/notebooks/{file}", text)
            continue
        folder = submissions / name
        folder.mkdir(parents=True)
        for file, text in texts.items():
            (folder / file).write_text(text, encoding="utf-8")

"""Students of the whole class who hand in notebooks, since the running of them matters."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from checkout import ROOT
from made_courses import OURS
from working_through import (
    FULL,
    MEASURED,
    Where,
)

from labcourse.grading.release import student_course, student_notebooks

Notebooks = dict[str, dict[str, Any]]

BY_OTHER_FORMS = {
    "q0-1": "resolution = float(np.deg2rad(360 / 4096))",
    "q2-1": "V = sympy.Rational(1, 2) * (alpha * sympy.sqrt(K_s)) ** 2 + 0 * theta",
    "q2-2": """
T = sympy.expand(0.5 * (J_eq * theta_dot**2 + J_l * (theta_dot**2 + 2 * theta_dot * alpha_dot + alpha_dot**2)))
""",
    "q2-3": "L = sympy.factor(sympy.nsimplify(T - V))",
    # A pair of sides; and an expression that is zero, divided by the inertia.
    "q2-4": """
equation_theta = (tau - B_eq * theta_dot, J_eq * theta_ddot + J_l * (alpha_ddot + theta_ddot))
""",
    "q2-4-strategy": "By hand.",
    "q2-5": """
equation_alpha = -(theta_ddot + alpha_ddot) - (B_l * alpha_dot + K_s * alpha) / J_l
""",
    "q2-5-strategy": "By hand.",
    "q2-6": """
inertia = sympy.Matrix([[J_eq + J_l, J_l], [J_l, J_l]])
theta_acceleration, alpha_acceleration = inertia.LUsolve(sympy.Matrix([tau - B_eq * theta_dot, -K_s * alpha]))
""",
    "q2-6-strategy": "By Cramer's rule.",
    "q2-7": """
omega_2 = K_s / J_l
A = [[0, 0, 1, 0], [0, 0, 0, 1], [0, K_s / J_eq, -B_eq / J_eq, 0], [0, -omega_2 * (1 + J_l / J_eq), B_eq / J_eq, 0]]
B = (0, 0, 1 / J_eq, -(J_eq**-1))
""",
    "q2-7-strategy": "Read off.",
    "q2-8": """
J_link = (4 * m_1 * L_1**2 + m_2 * (L_2**2 + 12 * d_12**2)) / 12
""",
    "q2-8-strategy": "Two rods.",
    "q2-14": """
A = [[0, 0, 1, 0], [0, 0, 0, 1],
     [0, K_s / lab.servo.J_eq, -lab.servo.B_eq / lab.servo.J_eq, 0],
     (0, -K_s / lab.servo.J_eq - K_s / J_l, lab.servo.B_eq / lab.servo.J_eq, 0)]
B = [0, 0, 1 / lab.servo.J_eq, -1 / lab.servo.J_eq]
C = np.matrix("1 0 0 0; 0 1 0 0")
D = (0, 0)
""",
    "q2-18": "poles = tuple(np.roots(np.poly(A_v)))[::-1]",
    "q3-2": """
open_loop_polynomial = np.poly(open_loop).real.reshape(5, 1)
""",
    "q3-2-strategy": "det(sI - A) = 0",
    "q3-3": """
a = [float(x) for x in np.ravel(open_loop_polynomial)]
A_c = [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [-a[4], -a[3], -a[2], -a[1]]]
B_c = 0, 0, 0, 1
""",
    "q3-4": """
desired_polynomial = [int(c) for c in np.convolve([1, 24, 400], np.convolve([1, 30], [1, 40]))]
desired_poles = np.roots(desired_polynomial)[::-1].tolist()
""",
    "q3-4-strategy": "Quadratic factors.",
    "q3-5": """
K_c = np.array([[desired_polynomial[4 - i] - a[4 - i]] for i in range(4)])
""",
    "q3-5-strategy": "Compare coefficients.",
    "q3-6": 'rank = 4\ncontrollable = " Yes"',
    "q3-6-explanation": "Full rank.",
    "q3-7": """
def columns(A, B):
    A, x = np.asarray(A, dtype=float), np.ravel(B).astype(float)
    found = []
    for _ in range(4):
        found.append(x)
        x = A @ x
    return np.transpose(found)
T, T_c = columns(A, B), columns(A_c, B_c).tolist()
W = np.linalg.solve(np.transpose(T_c), T.T).T
""",
    "q3-8": "import control\nK = tuple(np.ravel(control.place(A, B, desired_poles)).tolist())",
    "q3-9": """
poles = list(np.roots(np.poly(A - np.reshape(B, (4, 1)) @ np.reshape(K, (1, 4)))))[::-1]
""",
    "q3-9-conclusion": "They are.",
    "q3-10": "import control\nK_library = control.acker(A, B, desired_poles).reshape(4, 1)",
}

CARRIED_ON = {
    "q2-1": "V = K_s * alpha**2",
    "q2-11": "omega_n = 27.6",
    "q2-11-explanation": "Because.",
}

ENDLESS = {"q3-13": "while True:\n    pass"}


def _break(course: Notebooks) -> None:
    cells = course["01_modeling_prelab.ipynb"]["cells"]
    cells[:] = [cell for cell in cells if cell["id"] != "q2-8"]
    place = next(index for index, cell in enumerate(cells) if cell["id"] == "q2-3")
    cells.insert(place, {**cells[place], "source": "L = 0 * K_s"})


@dataclass(frozen=True)
class Handed:
    """Notebooks that are handed in: what is written into which cells, and what it should cost.

    Attributes
    ----------
    writes : answer cell's id → source, in place of the solution's
    loses : (question, part) → points lost, and why
    awaiting : points that should wait for a person
    trouble : pieces of what should be reported as problems
    notes : pieces of what should be noted
    """

    writes: Mapping[str, str]
    loses: Mapping[Where, tuple[float, str]]
    awaiting: float = 46.0
    trouble: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    spoil: Callable[[Notebooks], None] = lambda course: None
    not_json: str = ""

    def points(self) -> dict[str, float]:
        """Points by question."""
        sums: dict[str, float] = {}
        for (question, part), full in FULL.items():
            if question != "0.1":
                sums[question] = sums.get(question, 0.0) + full - self.loses.get((question, part), (0.0, ""))[0]
        return sums


def _all_of(question: str, reason: str) -> dict[Where, tuple[float, str]]:
    """All of a question's points that are marked automatically."""
    return {where: (points, reason) for where, points in FULL.items() if where[0] == question}


_STOPPED = "the cell was stopped, so there is no recording and nothing was measured on it"
_CUT_OFF = "notebook 09 is cut off in the middle: nothing of it can be read"

NOTEBOOKS = {
    "other-forms": Handed(BY_OTHER_FORMS, {}),
    # 27.6 rad/s, where the bench has 23.0 rad/s: K_s = J_l·27.6² is 44 % too large, and all of the design is for that.
    "consistent": Handed(
        CARRIED_ON,
        {
            ("2.1", "V"): (2, "without the factor ½; all that is derived from it follows"),
            ("2.11", "omega_n"): (2, "20 % off; all that is designed with it follows"),
        },
    ),
    # In words, missing: those of notebook 09, the conclusion of 3.16, 1, and the explanation of 3.17, 2: 46 - 3 = 43.
    "broken": Handed(
        ENDLESS,
        {
            ("2.8", "J_l"): (
                2,
                "its cell was deleted; of the doubled cell 2.3 both are run, and the later one counts, which is right",
            ),
            **_all_of("3.13", _STOPPED),
            **_all_of("3.14", _STOPPED),
            **_all_of("3.15", _CUT_OFF),
            **_all_of("3.16", _CUT_OFF),
            **{("Table 3", f"{name}_fsf"): (0.25, _STOPPED) for name in MEASURED[:3]},
            **{("Table 3", f"{name}_psf"): (0.25, _CUT_OFF) for name in MEASURED[:3]},
        },
        awaiting=43.0,
        trouble=("longer than", "not JSON"),
        notes=("the cell q2-8 is not there", "the cell q2-3 is there 2 times; all of them are run, in order"),
        spoil=_break,
        not_json="09_partial_state_feedback.ipynb",
    ),
}


def _with_solutions(writes: Mapping[str, str]) -> Notebooks:
    """The student notebooks with these sources in their answer cells, else with the instructor's."""
    course: Notebooks = {}
    for file, text in student_course.derive_notebooks(OURS).items():
        course[file] = json.loads(text)
        solutions = {cell.id: cell.source for cell in student_notebooks.read(ROOT / "solutions" / file).cells}
        for cell in course[file]["cells"]:
            if "grade" in cell["metadata"].get("nbgrader", {}) and cell["metadata"]["nbgrader"]["solution"]:
                cell["source"] = writes.get(cell["id"], solutions[cell["id"]])
    return course


def hand_in(submissions: Path) -> None:
    """Put the notebooks of those who hand in some into a folder."""
    for name, student in NOTEBOOKS.items():
        work = _with_solutions(student.writes)
        student.spoil(work)
        folder = submissions / name
        folder.mkdir(parents=True)
        for file, notebook in work.items():
            text = json.dumps(notebook)
            (folder / file).write_text(text[: 5000 if file == student.not_json else None], encoding="utf-8")

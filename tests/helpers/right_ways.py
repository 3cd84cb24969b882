"""Ways in which capable, honest students of different schools answer rightly: all of them, by group.

Most were written down from what students read, before the key and the marking code were. A way says what is given in
place of the usual answers of ``working_through.py``.
"""

import contextlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import right_ways_functions
import right_ways_numbers
import right_ways_readings
import right_ways_symbols
import sympy
from right_ways_types import Way, Written
from working_through import J_l, K_s, Pen, Where, alpha, design, modeling, prelab, responses, theta

import rotflex.course.lab

WAYS: list[Way] = [
    *right_ways_symbols.WAYS,
    *right_ways_functions.WAYS,
    *right_ways_numbers.NUMBER_FORMS,
    *right_ways_numbers.ARRAY_FORMS,
    *right_ways_numbers.POLYNOMIAL_FORMS,
    *right_ways_numbers.POLE_FORMS,
    *right_ways_numbers.CHOICES,
    *right_ways_numbers.ROUTES,
    *right_ways_readings.WAYS,
    *right_ways_readings.ROUNDED,
]

#: What is right in another form that is not taken: where, and what it is → it, and the words that say what to do.
TOLD: dict[tuple[Where, str], tuple[Written, str]] = {
    (("2.1", "V"), "text"): (lambda V, own: "K_s*alpha**2/2", "write it with sympy symbols, without quotes"),
    (("2.1", "V"), "an integral"): (lambda V, own: sympy.Integral(K_s * alpha, alpha), "add .doit() to it"),
    (("2.1", "V"), "an equation"): (lambda V, own: sympy.Eq(sympy.Symbol("E"), V), "give the expression alone"),
    (("2.1", "V"), "another symbol"): (lambda V, own: V.subs(K_s, sympy.Symbol("k")), "given symbols: theta, alpha,"),
    (("2.4", "equation"), "two sides as text"): (lambda e, own: f"{e.lhs} = {e.rhs}", "without quotes"),
    (("2.4", "equation"), "compared"): (lambda e, own: e.lhs == e.rhs, "write sympy.Eq(left, right)"),
    (("2.6", "theta_ddot"), "both in a list"): (lambda e, own: [e, own["2.6", "alpha_ddot"]], "a list, not a sympy"),
    (("2.6", "theta_ddot"), "of another name"): (lambda e, own: {theta: e}, "give one expression, solution[symbol]"),
    (("2.7", "A"), "text"): (lambda A, own: [[str(one) for one in row] for row in A.tolist()], "without quotes"),
    (("2.8", "J_l"), "named by itself"): (lambda J, own: J_l, "given symbols: m_1, L_1,"),
    (("2.11", "omega_n"), "text"): (lambda x, own: f"{x:.3g}", "leave out the quotes"),
    (("2.11", "omega_n"), "a decimal comma"): (lambda x, own: (22, 6), "one number is asked for; this has 2 values"),
    (("2.12", "K_s"), "with symbols"): (lambda x, own: J_l * 500.0, "still contains J_l: substitute numbers"),
    (("2.13", "state_space"), "called"): (lambda f, own: f(1.5, 4e-3, 2e-3, 4e-3), "give the function state_space"),
    (("2.14", "D"), "one zero"): (lambda D, own: 0, "it should be 2 numbers"),
    (("2.18", "poles"), "text"): (lambda p, own: [str(one) for one in p], "leave out the quotes"),
    (("3.1", "stability"), "shorter"): (lambda word, own: "marginal", "none of 'stable', 'marginally stable'"),
    (("3.6", "controllable"), "a letter"): (lambda word, own: "y", "none of 'yes', 'no'"),
    (("3.8", "K"), "three of four"): (lambda K, own: K[0, :3], "it should be 4 numbers; it is a row of 3"),
}


def worked(name: str, folder: Path, way: Way | None = None) -> tuple[dict[Where, Any], bytes]:
    """A student who works through the course: what they answer, and their ``answers.json``."""
    with contextlib.redirect_stdout(io.StringIO()):
        lab = rotflex.course.lab.start(name, folder=folder, quiet=True)
        write = Pen(way.carried(lab) if way and way.carried else {}, {})
        write("0.1", "resolution", 0.0015339807878856412)
        prelab(write)
        A, B, poles = modeling(lab, write)
        responses(lab, write, A, B, design(write, A, B, poles))
        for number, parts in write.answers.items():
            lab.answer(number, **parts)
    own = {(number, part): value for number, parts in write.answers.items() for part, value in parts.items()}
    return own, lab.book.path.read_bytes()


def rewritten(
    name: str, folder: Path, written: Mapping[Where, Written], own: Mapping[Where, Any], data: bytes
) -> tuple[bytes, list[str]]:
    """The ``answers.json`` of a student who gives some of their answers in another way, and what is said to them."""
    (folder / "answers.json").write_bytes(data)
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        lab = rotflex.course.lab.start(name, folder=folder, quiet=True)
        for (question, part), change in written.items():
            lab.answer(question, **{part: change(own[question, part], own)})
    return lab.book.path.read_bytes(), said.getvalue().splitlines()

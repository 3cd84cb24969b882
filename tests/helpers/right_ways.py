"""Ways in which capable, honest students of different schools answer rightly: all of them, by group.

Most were written down from what students read, before the key and the marking code were. A way says what is given in
place of the usual answers of ``working_through.py``.
"""

import contextlib
import io
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import control
import numpy as np
import scipy.fft
import scipy.signal
import sympy
from sympy.physics import mechanics
from working_through import FULL, Change, Pen, Where, digits, recorded, state_space

import rotflex.course.lab
from rotflex.config import srv02
from rotflex.course.questions import CATALOGUE
from rotflex.recording import Recording
from rotflex.simulation import with_actuator
from rotflex.units import HZ

#: (the usual answer, all usual answers) → another right one
Written = Callable[[Any, Mapping[Where, Any]], Any]


@dataclass(frozen=True)
class Way:
    """A way of answering that is right.

    Attributes
    ----------
    group, what : in words
    written : how some answers are given in place of the usual ones; nothing else changes
    carried : from a session, what is done otherwise, and carried on into all that builds on it
    """

    group: str
    what: str
    written: Mapping[Where, Written] = field(default_factory=dict)
    carried: Callable[[Any], Mapping[Where, Change]] | None = None

    def __str__(self) -> str:
        return f"{self.group}: {self.what}"


class Ways(list[Way]):
    """Ways of one group, as they are written down."""

    def __init__(self, group: str) -> None:
        super().__init__()
        self.group = group

    def add(self, what: str, written: Mapping[Where, Written]) -> None:
        self.append(Way(self.group, what, written))

    def each_of(self, wheres: Iterable[Where], changes: Mapping[str, Change]) -> None:
        """For each change, a way in which all of these answers are changed."""
        wheres = tuple(wheres)
        for what, change in changes.items():
            self.add(what, dict.fromkeys(wheres, lambda value, own, change=change: change(value)))

    def carry(self, what: str, carried: Callable[[Any], Mapping[Where, Change]]) -> None:
        self.append(Way(self.group, what, carried=carried))


class Frame:
    """As a table of pandas is to whoever does not know pandas: it goes through its columns' names, and is an array."""

    def __init__(self, values: Any) -> None:
        self._values = np.array(values)
        self.shape = self._values.shape

    def __len__(self) -> int:
        return int(self.shape[0])

    def __iter__(self) -> Any:
        return iter(f"column {i}" for i in range(self.shape[-1]))

    def __getitem__(self, name: Any) -> Any:
        raise KeyError(name)

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return self._values.astype(dtype) if dtype is not None else self._values.copy()


class Quantity:
    """As a number with a unit of a package for units: an array of no dimension, no float."""

    def __init__(self, magnitude: float) -> None:
        self.magnitude = magnitude

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return np.array(self.magnitude, dtype=dtype)


# --- the derivation (2.1 to 2.8): symbols, equations, accelerations, matrices -----------------------------------------

t, theta, alpha, theta_dot, alpha_dot, theta_ddot, alpha_ddot = sympy.symbols(
    "t theta alpha theta_dot alpha_dot theta_ddot alpha_ddot"
)
J_eq, J_l, B_eq, B_l, K_s, tau, m_1, L_1, m_2, L_2, d_12 = sympy.symbols(
    "J_eq J_l B_eq B_l K_s tau m_1 L_1 m_2 L_2 d_12"
)
EXPRESSIONS = (("2.1", "V"), ("2.2", "T"), ("2.3", "L"), ("2.6", "theta_ddot"), ("2.6", "alpha_ddot"), ("2.8", "J_l"))
EQUATIONS = (SERVO, LINK) = (("2.4", "equation"), ("2.5", "equation"))
MATRICES = (("2.7", "A"), ("2.7", "B"))
ALL = (*EXPRESSIONS, *EQUATIONS, *MATRICES)

DERIVATION = Ways("2.1 to 2.8")


def each(change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A change of an expression, for each side of an equation and each entry of a matrix."""

    def of(value: Any) -> Any:
        if isinstance(value, sympy.Eq):
            return sympy.Eq(change(value.lhs), change(value.rhs), evaluate=False)
        return value.applyfunc(change) if isinstance(value, sympy.MatrixBase) else change(value)

    return of


def with_functions(theta_t: Any, alpha_t: Any) -> Callable[[Any], Any]:
    """With functions of time and their derivatives."""
    time = theta_t.args[0]
    meant = {theta: theta_t, theta_dot: theta_t.diff(time), theta_ddot: theta_t.diff(time, 2)}
    meant |= {alpha: alpha_t, alpha_dot: alpha_t.diff(time), alpha_ddot: alpha_t.diff(time, 2)}
    return each(lambda expression: expression.xreplace(meant))


DERIVATION.each_of(
    ALL,
    {
        "dynamicsymbols": with_functions(*mechanics.dynamicsymbols("theta alpha")),
        "dummies": each(lambda e: e.xreplace({one: sympy.Dummy(one.name) for one in e.free_symbols})),
        "decimals for fractions": each(lambda e: e.evalf()),
        "decimals of three digits": each(lambda e: e.evalf(3)),
    },
)


def energy_of_points() -> Any:
    """The kinetic energy by way of positions, sines and cosines left as they come."""
    theta_t, alpha_t = sympy.Function("theta")(t), sympy.Function("alpha")(t)

    def of(inertia: Any, angle: Any) -> Any:
        return inertia * (sympy.cos(angle).diff(t) ** 2 + sympy.sin(angle).diff(t) ** 2) / 2

    return of(J_eq, theta_t) + of(J_l, theta_t + alpha_t)


DERIVATION.add("V, an integral", {("2.1", "V"): lambda V, own: sympy.integrate(K_s * t, (t, 0, alpha))})
DERIVATION.add("T, by positions", {("2.2", "T"): lambda T, own: energy_of_points()})


DERIVATION.each_of(
    EQUATIONS,
    {
        "solved for its own acceleration": lambda e: sympy.Eq(alpha_ddot, sympy.solve(e, alpha_ddot)[0]),
        "solved for the other acceleration": lambda e: sympy.Eq(theta_ddot, sympy.solve(e, theta_ddot)[0]),
    },
)


def by_newton(equation: Any, own: Any) -> Any:
    """The servo cut free: the spring and the joint's friction pull on it."""
    return sympy.Eq(J_eq * theta_ddot, tau - B_eq * theta_dot + K_s * alpha + B_l * alpha_dot)


def without_theta_ddot(equation: Any, own: Any) -> Any:
    """The link's equation, with the servo's acceleration put in from that of the servo."""
    servo = sympy.solve([own[SERVO], own[LINK]], [theta_ddot, alpha_ddot], dict=True)[0]
    return sympy.Eq(J_l * (servo[theta_ddot] + alpha_ddot) + B_l * alpha_dot + K_s * alpha, 0)


def without_alpha_ddot(equation: Any, own: Any) -> Any:
    """The servo's equation, with the link's acceleration put in from that of the link."""
    return sympy.Eq(own[SERVO].lhs.subs(alpha_ddot, sympy.solve(own[LINK], alpha_ddot)[0]), tau)


DERIVATION.add("the servo alone, by Newton", {SERVO: by_newton})
DERIVATION.add("the servo's without alpha_ddot", {SERVO: without_alpha_ddot})
DERIVATION.add("the link's without theta_ddot", {LINK: without_theta_ddot})
DERIVATION.add("by Newton, and both solved", {SERVO: by_newton, LINK: without_theta_ddot})


DERIVATION.add(
    "equations for second derivatives",
    {
        ("2.6", f"{angle}_ddot"): lambda e, own, angle=angle: sympy.Eq(sympy.Function(angle)(t).diff(t, 2), e)
        for angle in ("theta", "alpha")
    },
)


DERIVATION.each_of(
    MATRICES,
    {
        "numpy arrays of expressions": lambda m: np.array(m.tolist()),
        "SparseMatrix": sympy.SparseMatrix,
        "sympy.Array": lambda m: sympy.Array(m.tolist()),
        "a table with names of rows and columns": lambda m: Frame(m.tolist()),
    },
)


INERTIA = ("2.8", "J_l")
DERIVATION.add(
    "J_l, thirds and twelfths of three digits",
    {INERTIA: lambda J, own: 0.333 * m_1 * L_1**2 + 0.0833 * m_2 * L_2**2 + m_2 * d_12**2},
)


# --- the two functions (2.10, 2.13) -----------------------------------------------------------------------------------

FUNCTIONS = Ways("functions")


def spectrum(what: str) -> Any:
    return lambda function: (
        FUNCTIONS.add(f"spectrum {what}", {("2.10", "spectrum"): lambda _, own: function}),
        function,
    )[1]


def model(what: str) -> Any:
    return lambda function: (
        FUNCTIONS.add(f"model {what}", {("2.13", "state_space"): lambda _, own: function}),
        function,
    )[1]


@spectrum("by rfft, no zeros appended")
def _(x, dt):
    return np.fft.rfftfreq(len(x), dt), 2 * np.abs(np.fft.rfft(x)) / len(x)


@spectrum("with a Hann window, its height made up for")
def _(x, dt):
    w = np.hanning(len(x))
    return np.fft.rfftfreq(len(x), dt), 2 * np.abs(np.fft.rfft(w * x)) / w.sum()


@spectrum("as the root of a periodogram")
def _(x, dt):
    f, power = scipy.signal.periodogram(x, 1 / dt, scaling="spectrum", detrend=False)
    return f, np.sqrt(2 * power)


@spectrum("as columns of tables")
def _(x, dt):
    f, a = np.fft.rfftfreq(len(x), dt), 2 * np.abs(np.fft.rfft(x)) / len(x)
    return Frame(f[:, None]), Frame(a[:, None])


@spectrum("with a default sample time, the mean not doubled")
def _(x, dt=0.002):
    a = np.abs(np.fft.rfft(x)) / len(x)
    a[1:-1] *= 2
    return np.fft.rfftfreq(len(x), dt), a


@spectrum("by the sums themselves, up to 10 Hz")
def _(x, dt):
    n = np.arange(len(x))
    f = np.arange(0, 10, 1 / (len(x) * dt))
    return f, [2 / len(x) * abs(np.sum(x * np.exp(-2j * np.pi * one * n * dt))) for one in f]


@model("as sympy's matrices")
def _(K_s, J_l, J_eq, B_eq):
    return tuple(sympy.Matrix(np.asarray(m).tolist()) for m in state_space(K_s, J_l, J_eq, B_eq))


@model("with B and D as rows, and other names of arguments")
def _(stiffness, inertia, servo_inertia, friction):
    A, B, C, D = state_space(stiffness, inertia, servo_inertia, friction)
    return A, B.reshape(1, 4), C, D.reshape(1, 2)


@model("with 0 for D, and all states as outputs")
def _(K_s, J_l, J_eq, B_eq):
    A, B, *_outputs = state_space(K_s, J_l, J_eq, B_eq)
    return A, B, np.eye(4), 0


@model("as a system of python-control that calls its input V_m")
def _(K_s, J_l, J_eq, B_eq):
    return control.ss(*state_space(K_s, J_l, J_eq, B_eq), inputs="V_m", outputs=["theta", "alpha"])


# --- other forms of right numbers, matrices, polynomials, poles and choices -------------------------------------------

KINDS = {(q.number, p.name): (p.kind, p.shape) for q in CATALOGUE.everything.values() for p in q.parts}
NUMBERS = [where for where in FULL if KINDS[where][0] == "number"]
ARRAYS = [where for where in FULL if KINDS[where][0] == "matrix"]
VECTORS = [where for where in ARRAYS if np.size(np.zeros(KINDS[where][1])) == max(KINDS[where][1])]
POLYNOMIALS = [("3.2", "polynomial"), ("3.4", "polynomial")]
POLES = [where for where in FULL if KINDS[where][0] == "poles"]
s = sympy.Symbol("s")


NUMBER_FORMS = Ways("numbers")
NUMBER_FORMS.each_of(
    NUMBERS,
    {
        "sympy's sums with pi": lambda x: sympy.pi * (float(x) / np.pi),
        "decimals": lambda x: Decimal(str(float(x))),
        "with a unit": lambda x: Quantity(float(x)),
        "five digits": lambda x: float(f"{x:.5g}"),
    },
)
NUMBER_FORMS.add("the rank as sympy's", {("3.6", "rank"): lambda x, own: sympy.Integer(int(x))})

ARRAY_FORMS = Ways("matrices")
ARRAY_FORMS.each_of(
    ARRAYS,
    {
        "sympy's, immutable": lambda m: sympy.ImmutableMatrix(np.atleast_2d(m).tolist()),
        "sympy's arrays": lambda m: sympy.Array(np.asarray(m).tolist()),
        "arrays of sympy's numbers": lambda m: np.array(sympy.Matrix(np.atleast_2d(m).tolist())),
        "tables with names of rows and columns": lambda m: Frame(np.atleast_2d(m)),
        "single precision": lambda m: np.asarray(m, dtype=np.float32),
        "fractions": lambda m: np.vectorize(Fraction, otypes=[object])(np.asarray(m, dtype=float)),
    },
)
ARRAY_FORMS.each_of(
    VECTORS,
    {
        "vectors as columns": lambda v: np.reshape(v, (-1, 1)),
        "vectors as lists": lambda v: np.ravel(v).tolist(),
        "vectors as one-dimensional arrays": np.ravel,
        "vectors as tables of one column": lambda v: Frame(np.reshape(v, (-1, 1))),
    },
)
ARRAY_FORMS.each_of(
    [("2.14", "C"), ("2.14", "D"), ("3.3", "B_c")], {"whole numbers": lambda m: np.asarray(m).astype(int).tolist()}
)
ARRAY_FORMS.each_of([("2.14", "D"), ("Table 2", "D")], {"0 for zeros": lambda m: 0, "0.0": lambda m: np.float64(0.0)})

POLYNOMIAL_FORMS = Ways("polynomials")
POLYNOMIAL_FORMS.each_of(
    POLYNOMIALS,
    {
        "np.poly1d": np.poly1d,
        "numpy's Polynomial": lambda p: np.polynomial.Polynomial(p[::-1]),
        "numpy's Chebyshev": lambda p: np.polynomial.Polynomial(p[::-1]).convert(kind=np.polynomial.Chebyshev),
        "sympy.Poly": lambda p: sympy.Poly(p.tolist(), s),
        "a sum of powers": lambda p: sum(a * s**i for i, a in enumerate(p[::-1].tolist())),
        "a product of factors": lambda p: sympy.Mul(*(s - sympy.sympify(r) for r in np.roots(p).tolist())),
        "with what rounding leaves": lambda p: p + 1e-10 * np.abs(p).max() * np.array([0, 1, 1, 1, 1]) * 1e-3,
    },
)

POLE_FORMS = Ways("poles")
POLE_FORMS.each_of(
    POLES,
    {
        "in another order": lambda p: list(p)[::-1],
        "sorted": np.sort_complex,
        "np.matrix": np.matrix,
        "a column": lambda p: np.reshape(p, (4, 1)),
        "a list of rows": lambda p: np.reshape(p, (4, 1)).tolist(),
        "sympy's numbers": lambda p: [sympy.sympify(one) for one in np.asarray(p).tolist()],
        "a Matrix of sympy's": lambda p: sympy.Matrix([sympy.sympify(one) for one in np.asarray(p).tolist()]),
        "what eigenvals gives": lambda p: {sympy.sympify(one): 1 for one in np.asarray(p).tolist()},
        "sets": lambda p: set(np.asarray(p).tolist()),
        "a table of one column": lambda p: Frame(np.reshape(p, (4, 1))),
        "single precision": lambda p: np.asarray(p, dtype=np.complex64),
        "with what rounding leaves": lambda p: np.asarray(p) + 1e-9 * np.array([1, -1, 1j, -1j]),
    },
)

CHOICES = Ways("choices")
YES_NO = [("3.6", "controllable"), *((question, "satisfied") for question in ("3.12", "3.14", "3.16"))]
CHOICES.each_of(
    YES_NO,
    {
        "capitals": str.upper,
        "with a full stop and blanks": lambda word: f" {word.capitalize()}. ",
        "True and False": lambda word: word == "yes",
        "numpy's True and False": lambda word: np.bool_(word == "yes"),
    },
)
CHOICES.each_of(
    [("3.1", "stability")],
    {
        "the verdict in capitals": str.upper,
        "hyphen": lambda word: word.replace(" ", "-"),
        "blanks": lambda word: f"  {word.replace(' ', '   ')} ",
    },
)


# --- readings and roundings, carried on into all that builds on them --------------------------------------------------

OMEGA_N, K_S = ("2.11", "omega_n"), ("2.12", "K_s")
ALL_NUMBERS = [where for where in FULL if KINDS[where][0] in ("number", "matrix", "poles") and where[0] != "0.1"]
READINGS, ROUNDED = Ways("readings"), Ways("rounding")


def to(step: float, unit: float = 1.0) -> Change:
    """Reads a number off a scale with marks every ``step`` of a unit."""
    return lambda value: round(float(value) / unit / step) * step * unit


READINGS.carry("by eye, 0.05 Hz", lambda lab: {OMEGA_N: to(0.05, HZ)})
READINGS.carry("by eye, 3 % high", lambda lab: {OMEGA_N: lambda omega_n: 1.03 * omega_n})
READINGS.carry("by eye, 3 % low", lambda lab: {OMEGA_N: lambda omega_n: 0.97 * omega_n})
READINGS.carry("J_l in whole tenths of a g·m²", lambda lab: {("2.12", "J_l"): to(1e-5)})


QUESTIONS = ("3.12", "3.14", "3.16")


def rounding(wheres: list[Where], count: int) -> Callable[[Any], dict[Where, Change]]:
    return lambda lab: dict.fromkeys(wheres, digits(count))


ROUNDED.carry("each step to three digits", rounding(ALL_NUMBERS, 3))
for place in ("2.14 A", "2.18 poles", "3.2 polynomial", "3.5 K_c", "3.7 T", "3.7 W", "3.8 K"):
    question, name = place.split()
    ROUNDED.carry(f"{place} to three digits", rounding([(question, name)], 3))
#: What three digits may be off by, of each entry of the companion matrix's last row: it carries on into T_c.
WORST = np.vstack([np.ones((3, 4)), [1, 1.004, 1.004, 0.996]])
ROUNDED.carry(
    "3.3 A_c to three digits, at worst",
    lambda lab: {("3.3", "A_c"): lambda A_c: A_c * WORST},
)
ROUNDED.carry("omega_n to two digits", rounding([OMEGA_N], 2))
ROUNDED.carry("K_s to two digits", rounding([K_S], 2))
ROUNDED.carry("omega_n and K_s to two digits", rounding([OMEGA_N, K_S], 2))
ROUNDED.carry(
    "by eye, 3 % high, then K_s to two digits",
    lambda lab: {OMEGA_N: lambda omega_n: 1.03 * omega_n, **rounding([K_S], 2)(lab)},
)
ROUNDED.carry(
    "measured to two digits, all else to three",
    lambda lab: {**rounding(ALL_NUMBERS, 3)(lab), **rounding([OMEGA_N, K_S], 2)(lab)},
)
ROUNDED.carry(
    "responses to two digits, angles to three",
    lambda lab: {
        **rounding([(q, name) for q in QUESTIONS for name in ("t_s", "PO", "V_max")], 2)(lab),
        **rounding([(q, "alpha_max_deg") for q in QUESTIONS], 3)(lab),
    },
)


# --- the simulation of 3.11 by python-control -------------------------------------------------------------------------

SIMULATED, SIMULATION = ("3.11", "response"), Ways("simulation")


def forced_response(recording: Any, own: Mapping[Where, Any]) -> Any:
    """The closed loop with the voltage as an output, by ``control.forced_response`` along the same command."""
    A, B = with_actuator(own["2.14", "A"], own["2.14", "B"], srv02())
    K = np.reshape(own["3.8", "K"], (1, 4))
    C, D = np.vstack([np.eye(2, 4), -K]), [[0], [0], [K[0, 0]]]
    loop = control.ss(A - B @ K, B * K[0, 0], C, D, inputs="theta_ref", outputs=["theta", "alpha", "vm"])
    return control.forced_response(loop, recording.time, recording["theta_ref"])


SIMULATION.add("by control.forced_response", {SIMULATED: forced_response})
SIMULATION.add(
    "by control.forced_response, its outputs taken one by one",
    {
        SIMULATED: lambda recording, own: Recording.of(
            recording.time,
            theta_ref=recording["theta_ref"],
            **dict(zip(("theta", "alpha", "vm"), forced_response(recording, own).outputs, strict=True)),
        )
    },
)


WAYS: list[Way] = [*DERIVATION, *FUNCTIONS, *NUMBER_FORMS, *ARRAY_FORMS, *POLYNOMIAL_FORMS, *POLE_FORMS, *CHOICES]
WAYS += SIMULATION
WAYS += [*READINGS, *ROUNDED]


def worked(name: str, folder: Path, way: Way | None = None) -> tuple[dict[Where, Any], bytes]:
    """A student who works through the course: what they answer, and their ``answers.json``."""
    with contextlib.redirect_stdout(io.StringIO()):
        lab = rotflex.course.lab.start(name, folder=folder, quiet=True)
        write = Pen(way.carried(lab) if way and way.carried else {})
        data = recorded(lab, write)
    own = {(number, part): value for number, parts in write.answers.items() for part, value in parts.items()}
    return own, data


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

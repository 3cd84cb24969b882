"""Other forms of right numbers, matrices, polynomials, poles and choices."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import sympy
from right_ways_types import Frame, Quantity, Ways
from working_through import FULL

from rotflex.course.questions import CATALOGUE

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

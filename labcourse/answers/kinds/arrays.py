"""Matrices, vectors and sets of poles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.expressions import is_symbolic
from labcourse.answers.json_values import (
    FormError,
    NotAnswered,
    read_dict,
    read_list,
    read_matrix,
    read_vector,
    show_number,
)
from labcourse.answers.kinds.values import complex_number, of_slip, real_number
from labcourse.answers.parts import Part


def _rows_and_columns(shape: tuple[int, ...]) -> tuple[int, int]:
    """The shape in which a matrix is stored: a vector (n,) as one row."""
    return (1, shape[0]) if len(shape) == 1 else (shape[0], shape[1])


def _wanted(shape: tuple[int, ...]) -> str:
    rows, columns = _rows_and_columns(shape)
    return f"{max(rows, columns)} numbers" if 1 in (rows, columns) else f"a {rows} × {columns} matrix"


def entries(value: Any, shape: tuple[int, ...]) -> list[list[Any]]:
    """The entries of a matrix as rows, or the hint why it is none. A vector may lie or stand.

    Raises
    ------
    NotAnswered
        If there is nothing yet.
    FormError
        If it does not have the shape.
    """
    rows, columns = _rows_and_columns(shape)
    if value is None or value is Ellipsis:
        raise NotAnswered("nothing yet")
    value = _coefficients(value)
    if callable(value) and not hasattr(value, "__array__"):  # a polynomial of numpy's is both
        raise FormError("it is a function: call it, and give the result")
    try:
        array = np.asarray(value if not is_symbolic(value) or hasattr(value, "shape") else [value], dtype=object)
    except ValueError:
        raise FormError("its rows differ in length") from None
    if any(isinstance(entry, list | tuple | np.ndarray) for entry in array.ravel()):
        raise FormError("its rows differ in length")
    if array.size and all(entry is None or entry is Ellipsis for entry in array.ravel()):
        raise NotAnswered("nothing yet")
    lying_or_standing = 1 in (rows, columns) and array.size == rows * columns and sum(n > 1 for n in array.shape) <= 1
    if array.shape != (rows, columns) and not lying_or_standing:
        given = " × ".join(str(n) for n in array.shape) if array.ndim > 1 else f"a row of {array.size}"
        if array.ndim == 0:
            given = f"a {type(value).__name__}"
        raise FormError(f"it should be {_wanted(shape)}; it is {given}")
    table: list[list[Any]] = array.reshape(rows, columns).tolist()
    return table


def _coefficients(value: Any) -> Any:
    """The coefficients of a polynomial of sympy's or numpy's, highest power first; any other value as it is."""
    if hasattr(value, "all_coeffs"):
        return value.all_coeffs()
    if hasattr(value, "convert") and hasattr(value, "coef"):  # numpy's have the lowest first, and other bases
        return value.convert(kind=np.polynomial.Polynomial).coef[::-1]
    return value


def _without_unknown(value: Any) -> Any:
    """The polynomial that an expression in one unknown is, for its coefficients; any other value as it is."""
    import sympy

    if isinstance(value, sympy.Expr) and len(value.free_symbols) == 1 and value.is_polynomial(*value.free_symbols):
        return sympy.Poly(value, *value.free_symbols)
    return value


def encode_matrix(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    table = entries(_without_unknown(value) if is_symbolic(value) else value, part.shape)
    numbers = [[_entry(entry, i, j) for j, entry in enumerate(row)] for i, row in enumerate(table)]
    return {"value": numbers}, list(_unusual(part, [number for row in numbers for number in row if number]))


def _unusual(part: Part, numbers: list[float]) -> Iterator[str]:
    """Hints on a matrix, by its entries that are not zero."""
    digits, plausible, unit = part.usual.digits, part.usual.largest, part.usual.unit
    if digits > 1 and numbers and all(float(f"{number:.{digits - 2}e}") == number for number in numbers):
        yield (
            f"its entries have {digits - 1} digits or fewer: give what you computed, for what comes next builds on it"
        )
    if plausible is None or not numbers:
        return
    largest = max(abs(number) for number in numbers)
    if not plausible[0] <= largest <= plausible[1]:
        size = "large" if largest > plausible[1] else "small"
        yield of_slip(largest, plausible, unit) or f"its entries are unusually {size} for this plant: check"


def _entry(entry: Any, i: int, j: int) -> float:
    try:
        return real_number(entry)
    except NotAnswered:
        raise FormError(f"the entry in row {i + 1}, column {j + 1} is still empty") from None
    except FormError as error:
        raise FormError(f"look at the entry in row {i + 1}, column {j + 1}: {error}") from None


def decode_matrix(part: Part, content: Any) -> NDArray[np.float64]:
    value = read_dict(part.name, content, {"kind", "value"})["value"]
    return read_matrix(part.name, value, _rows_and_columns(part.shape)).reshape(part.shape)


def show_matrix(part: Part, content: dict[str, Any]) -> str:
    rows = content["value"]
    numbers = [number for row in rows for number in row]
    largest = max(abs(number) for number in numbers)
    # What rounding leaves of a zero would show as different noise on every machine.
    numbers = [number if abs(number) > 1e-9 * largest else 0.0 for number in numbers]
    if 1 in (len(rows), len(rows[0])):
        return f" = [{', '.join(show_number(number) for number in numbers)}]"
    return f": {len(rows)} × {len(rows[0])} matrix"


# --- poles -----------------------------------------------------------------------------------------------------------


def encode_poles(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    if value is None or value is Ellipsis:
        raise NotAnswered("nothing yet")
    if isinstance(value, dict):  # sympy's eigenvalues: pole -> how often
        value = [pole for pole, times in value.items() for _repeat in range(times if isinstance(times, int) else 1)]
    if isinstance(value, set | frozenset):
        value = list(value)
    if isinstance(value, str) or not hasattr(value, "__len__"):
        raise FormError(f"it is a {type(value).__name__}; give a list of {part.count} poles")
    try:
        given = np.asarray(value, dtype=object).ravel().tolist()
    except ValueError:
        raise FormError(f"give one list of {part.count} poles") from None
    if given and all(pole is None or pole is Ellipsis for pole in given):
        raise NotAnswered("nothing yet")
    if len(given) != part.count:
        raise FormError(
            f"{part.count} poles are asked for (count multiple ones as often as they occur); there are {len(given)}"
        )
    found = []
    for index, pole in enumerate(given):
        try:
            found.append(complex_number(pole))
        except NotAnswered:
            raise FormError(f"pole {index + 1} is still empty") from None
        except FormError as error:
            raise FormError(f"look at pole {index + 1}: {error}") from None
    found.sort(key=lambda pole: (float(f"{pole.real:.6g}"), pole.imag))
    hints = [] if _in_pairs(found) else ["the complex poles of a real system come in conjugate pairs; these do not"]
    return {"value": [[pole.real, pole.imag] for pole in found]}, hints


def _in_pairs(found: list[complex]) -> bool:
    """Whether the poles with an imaginary part are their own conjugates, within rounding to three digits."""
    scale = max(abs(pole) for pole in found)
    left = [pole for pole in found if abs(pole.imag) > 1e-6 * scale]
    return all(any(abs(pole.conjugate() - other) <= 5e-3 * scale for other in left) for pole in left)


def decode_poles(part: Part, content: Any) -> NDArray[np.complex128]:
    value = read_dict(part.name, content, {"kind", "value"})["value"]
    pairs = [read_vector(part.name, pair, 2, 2) for pair in read_list(part.name, value, part.count, part.count)]
    return np.array([complex(*pair) for pair in pairs], dtype=np.complex128)


def show_poles(part: Part, content: dict[str, Any]) -> str:
    found = [complex(*pair) for pair in content["value"]]
    scale = max(abs(pole) for pole in found)
    shown = []
    for pole in found:
        real = pole.real if abs(pole.real) > 1e-6 * scale else 0.0
        imag = pole.imag if abs(pole.imag) > 1e-6 * scale else 0.0
        sign = "-" if imag < 0 else "+"
        shown.append(show_number(real) + (f" {sign} {show_number(abs(imag))}j" if imag else ""))
    return f" = {', '.join(shown)}"

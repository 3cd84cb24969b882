"""Expressions, equations and matrices of expressions."""

from __future__ import annotations

from typing import Any

from labcourse.answers import expressions
from labcourse.answers.json_values import FormError, NotAnswered, read_dict, read_list
from labcourse.answers.kinds.arrays import entries
from labcourse.answers.parts import Part


def encode_expression(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    return {"value": expressions.encode(value, part.symbols, part.name)}, []


def decode_expression(part: Part, content: Any) -> Any:
    return expressions.decode(read_dict(part.name, content, {"kind", "value"})["value"], part.symbols)


def show_expression(part: Part, content: dict[str, Any]) -> str:
    return f": {_in_symbols('expression', part, content['value'])}"


def encode_equation(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    left, right = expressions.encode_equation(value, part.symbols)
    return {"lhs": left, "rhs": right}, []


def decode_equation(part: Part, content: Any) -> Any:
    import sympy

    sides = read_dict(part.name, content, {"kind", "lhs", "rhs"})
    left, right = (expressions.decode(sides[side], part.symbols) for side in ("lhs", "rhs"))
    return sympy.Eq(left, right, evaluate=False)


def show_equation(part: Part, content: dict[str, Any]) -> str:
    return f": {_in_symbols('equation', part, [content['lhs'], content['rhs']])}"


def encode_symbolic_matrix(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    rows = []
    for i, row in enumerate(entries(value, part.shape)):
        trees = []
        for j, entry in enumerate(row):
            try:
                trees.append(expressions.encode(entry, part.symbols))
            except NotAnswered:
                raise FormError(f"the entry in row {i + 1}, column {j + 1} is still empty") from None
            except FormError as error:
                raise FormError(f"look at the entry in row {i + 1}, column {j + 1}: {error}") from None
        rows.append(trees)
    return {"value": rows}, []


def decode_symbolic_matrix(part: Part, content: Any) -> Any:
    import sympy

    rows, columns = part.shape
    table = read_list(part.name, read_dict(part.name, content, {"kind", "value"})["value"], rows, rows)
    return sympy.Matrix(
        [
            [expressions.decode(tree, part.symbols) for tree in read_list(part.name, row, columns, columns)]
            for row in table
        ]
    )


def show_symbolic_matrix(part: Part, content: dict[str, Any]) -> str:
    noun = f"{part.shape[0]} × {part.shape[1]} matrix"
    return f": {_in_symbols(noun, part, content['value'])}"


def _in_symbols(noun: str, part: Part, data: Any) -> str:
    """As in "expression in k, x": a look at what was understood, the same on every machine."""
    present: set[str] = set()
    pending = [data]
    while pending:
        item = pending.pop()
        if isinstance(item, list):
            if len(item) == 2 and item[0] == "symbol":
                present.add(item[1])
            pending.extend(item)
    used = [symbol for symbol in part.symbols if symbol in present]
    return f"{noun} in {', '.join(used)}" if used else f"{noun} without symbols"

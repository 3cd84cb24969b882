"""Small faults that can be put into a Python source, each by one operator, at one place, on the same lines.

Left out is what changes nothing that can be seen: docstrings, annotations, texts, decorators, what is there for types
only, ``__all__``, and the ``strict`` of a ``zip`` (a claim on lengths that are equal anyway).
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
_ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
_LARGE = 10  # a number from here on is moved by a third, a smaller integer by one
_BY = 1.3

COMPARISON, ARITHMETIC, CONSTANT = "comparison", "arithmetic", "constant"
NEGATION, REMOVED, SWAPPED = "negation", "removed statement", "swapped arguments"
OPERATORS = (COMPARISON, ARITHMETIC, CONSTANT, NEGATION, REMOVED, SWAPPED)


@dataclass(frozen=True)
class Fault:
    """A fault in a file.

    Attributes
    ----------
    file : in the tree, with slashes
    line : where it begins, from 1
    last : the last line of what is replaced
    operator : one of :data:`OPERATORS`, or what a person says
    old, new : text before and after
    start : characters before it
    """

    file: str
    line: int
    last: int
    operator: str
    old: str
    new: str
    start: int

    def put_into(self, source: str) -> str:
        """The source with the fault; what follows stays on its lines."""
        new, lost = self.new, self.old.count("\n") - self.new.count("\n")
        if lost > 0 and new.endswith(")"):
            new = new[:-1] + "\n" * lost + ")"
        elif lost > 0:
            new += "\n" * lost
        return source[: self.start] + new + source[self.start + len(self.old) :]


def faults(source: str, file: str) -> list[Fault]:
    """All faults that the operators make of a source, in order."""
    return sorted(_Finder(source, file).found(), key=lambda one: (one.start, one.operator, one.new))


class _Finder:
    def __init__(self, source: str, file: str) -> None:
        self._source, self._file = source, file
        self._lines = source.splitlines(keepends=True)
        self._starts = [0]
        for line in self._lines:
            self._starts.append(self._starts[-1] + len(line))

    def found(self) -> Iterator[Fault]:
        for node in _seen(ast.parse(self._source)):
            for operator, what, new in _changes(node):
                start, end = self._place(what)
                old = self._source[start:end]
                if old != new:
                    yield Fault(self._file, what.lineno, what.end_lineno or what.lineno, operator, old, new, start)

    def _place(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return self._offset(node.lineno, node.col_offset), self._offset(node.end_lineno, node.end_col_offset)

    def _offset(self, line: int, column: int) -> int:
        """Characters before a place; the parser counts a column in bytes."""
        text = self._lines[line - 1].encode()[:column].decode()
        return self._starts[line - 1] + len(text)


def _seen(node: ast.AST) -> Iterator[ast.AST]:
    """A node and all below it that do something."""
    if isinstance(node, ast.JoinedStr | ast.arg):  # the places of what is in a text are not known; annotations
        return
    if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
        return
    if isinstance(node, ast.Assign) and any(isinstance(one, ast.Name) and one.id == "__all__" for one in node.targets):
        return
    if isinstance(node, ast.keyword) and node.arg == "strict":
        return
    yield node
    passed_over = {"annotation", "returns", "decorator_list", "type_params"}
    if isinstance(node, ast.ClassDef):
        passed_over |= {"bases", "keywords"}
    for name, value in ast.iter_fields(node):
        if name not in passed_over:
            for below in value if isinstance(value, list) else [value]:
                if isinstance(below, ast.AST):
                    yield from _seen(below)


def _changes(node: ast.AST) -> Iterator[tuple[str, ast.expr | ast.stmt, str]]:
    """Operator, what it replaces, and by what."""
    yield from _in_expressions(node)
    if isinstance(node, ast.If | ast.While | ast.IfExp) and not isinstance(node.test, ast.Constant):
        yield NEGATION, node.test, f"(not ({_said(node.test)}))"
    elif isinstance(node, ast.comprehension):
        for test in node.ifs:
            yield NEGATION, test, f"(not ({_said(test)}))"
    elif isinstance(node, ast.stmt) and _can_be_removed(node):
        yield REMOVED, node, "pass"


def _can_be_removed(node: ast.stmt) -> bool:
    """Whether what follows can be run without it: a name that it binds would be missing."""
    if isinstance(node, ast.Expr):
        return not isinstance(node.value, ast.Constant | ast.Yield | ast.YieldFrom)
    if isinstance(node, ast.Return):
        return node.value is None
    if isinstance(node, ast.Assign):
        return not isinstance(node.targets[0], ast.Name | ast.Tuple)  # but an attribute or an item
    return isinstance(node, ast.Raise | ast.AugAssign | ast.Continue | ast.Break)


def _in_expressions(node: ast.AST) -> Iterator[tuple[str, ast.expr | ast.stmt, str]]:
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        other = _COMPARISONS[type(node.ops[0])]()
        yield COMPARISON, node, f"({_said(ast.Compare(node.left, [other], node.comparators))})"
    elif isinstance(node, ast.BinOp) and type(node.op) in _ARITHMETIC and not _is_text(node):
        yield ARITHMETIC, node, f"({_said(ast.BinOp(node.left, _ARITHMETIC[type(node.op)](), node.right))})"
        if isinstance(node.op, ast.Sub | ast.Div):
            yield SWAPPED, node, f"({_said(ast.BinOp(node.right, node.op, node.left))})"
    elif isinstance(node, ast.BoolOp):
        either: ast.boolop = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        yield NEGATION, node, f"({_said(ast.BoolOp(either, node.values))})"
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield NEGATION, node, f"bool({_said(node.operand)})"
    elif isinstance(node, ast.Constant):
        yield from ((CONSTANT, node, new) for new in _other_constants(node.value))
    elif isinstance(node, ast.Call):
        first = node.args[:2]
        plain = len(first) == 2 and not any(isinstance(one, ast.Starred) for one in first)
        if plain and _said(first[0]) != _said(first[1]) and not _is_for_types(node):
            yield SWAPPED, node, _said(ast.Call(node.func, [first[1], first[0], *node.args[2:]], node.keywords))


def _other_constants(value: object) -> Iterator[str]:
    if isinstance(value, bool):
        yield str(not value)
    elif isinstance(value, int):
        yield str(value + 1 if value < _LARGE else round(value * _BY))
    elif isinstance(value, float):
        yield repr(value * _BY if value else 0.1)


def _is_text(node: ast.BinOp) -> bool:
    sides = (node.left, node.right)
    return any(
        isinstance(one, ast.JoinedStr | ast.List | ast.Tuple)
        or (isinstance(one, ast.Constant) and isinstance(one.value, str | bytes))
        or (isinstance(one, ast.BinOp) and _is_text(one))
        for one in sides
    )


def _is_for_types(node: ast.Call) -> bool:
    return isinstance(node.func, ast.Name) and node.func.id in {"cast", "TypeVar", "isinstance", "NewType"}


def _said(node: ast.AST) -> str:
    return ast.unparse(ast.fix_missing_locations(node))

"""Find the cells that a graded run can leave out: those that only show something, and that nothing depends on.

Cells of the course that explain are tagged ``illustration``. Nobody looks at what they show when a class is graded, and
they take half of the time. One of them is run all the same if a cell that is run uses a name that it binds. All of a
notebook's are run if a cell may use names in a way that its source does not show.
"""

from __future__ import annotations

import ast
import symtable
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Any

from labcourse.run.alignment import source_of

ILLUSTRATION = "illustration"
#: Characters of a cell whose names are looked at (600 lines), and of all of a notebook's. Python takes seconds to find
#: the names of a long cell that was written for that, and nothing else gets its turn meanwhile.
LONGEST, LONGEST_TOGETHER = 20_000, 100_000
NO_PYTHON = (SyntaxError, ValueError, RecursionError, MemoryError)  #: raised for a cell that is too long or no Python
#: With these, a cell can reach a name without writing it.
_NAMESPACES = {"globals", "locals", "vars", "dir", "__main__", "get_ipython", "In", "Out", "_", "__", "___"}
_ROUNDABOUT = _NAMESPACES | {"eval", "exec", "compile", "__import__", "importlib", "sys", "inspect", "gc", "builtins"}
_cached = lru_cache(maxsize=1024)  # most cells are the course's, and the same in every submission


def skippable(cells: Iterable[dict[str, Any]]) -> set[str]:
    """Return the ids of the cells of a notebook that need not be run.

    Parameters
    ----------
    cells : of a notebook of the course, with a submission's answer cells in it
    """
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    if not readable(map(source_of, code)):
        return set()
    try:
        optional = {
            cell["id"]: source_of(cell)
            for cell in code
            if ILLUSTRATION in cell["metadata"].get("tags", []) and not _imports_all(source_of(cell))
        }
        certain = [source_of(cell) for cell in code if cell["id"] not in optional]
        used = set[str]().union(*map(uses, certain))
        imported = set[str]().union(*map(bound, certain))
        binds = {name: bound(source) for name, source in optional.items()}
    except NO_PYTHON:
        return set()
    if (used | imported) & _ROUNDABOUT:
        return set()
    while wanted := [name for name in optional if binds[name] & used]:
        for name in wanted:
            used |= uses(optional.pop(name))
    return set(optional)


def readable(sources: Iterable[str]) -> bool:
    """Return whether the cells of a notebook are together short enough that their names can be looked at."""
    return sum(map(len, sources)) <= LONGEST_TOGETHER


@lru_cache(maxsize=64)
def _table(source: str) -> symtable.SymbolTable:
    if len(source) > LONGEST:
        raise ValueError(f"it has more than {LONGEST} characters")
    return symtable.symtable(ast.unparse(_Scoped().visit(ast.parse(source))), "cell", "exec")


class _Scoped(ast.NodeTransformer):
    """Writes comprehensions of lists, sets and dicts as generators, which bind and use the same names.

    From Python 3.12 on, the table of symbols has the names of the others as if they were those of the cell around them.
    """

    def visit_ListComp(self, node: ast.ListComp | ast.SetComp) -> ast.AST:
        return self.generic_visit(ast.GeneratorExp(node.elt, node.generators))

    visit_SetComp = visit_ListComp

    def visit_DictComp(self, node: ast.DictComp) -> ast.AST:
        pair = ast.Tuple([node.key, node.value], ast.Load())
        return self.generic_visit(ast.GeneratorExp(pair, node.generators))


@_cached
def _imports_all(source: str) -> bool:
    """Return whether a cell binds names that it does not write: ``from module import *``."""
    imports = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom))
    return any(alias.name == "*" for node in imports for alias in node.names)


@_cached
def bound(source: str) -> frozenset[str]:
    """Return the names that a cell binds for the cells after it.

    Raises
    ------
    SyntaxError
        If it is not Python.
    ValueError
        If it is too long.
    """
    return frozenset(
        symbol.get_name()
        for scope in _scopes(_table(source))
        for symbol in scope.get_symbols()
        if symbol.is_assigned() or symbol.is_imported()
        if scope.get_type() == "module" or symbol.is_declared_global()
    )


@_cached
def uses(source: str) -> frozenset[str]:
    """Return the names that a cell may take from the cells before it.

    Raises
    ------
    SyntaxError
        If it is not Python.
    ValueError
        If it is too long.
    """
    outer, *inner = _scopes(_table(source))
    names = {symbol.get_name() for symbol in outer.get_symbols()}
    names |= {
        symbol.get_name()
        for scope in inner
        for symbol in scope.get_symbols()
        if symbol.is_referenced() and symbol.is_global()
    }
    return frozenset(names & _flow(ast.parse(source).body, frozenset())[0])


def _scopes(table: symtable.SymbolTable) -> Iterator[symtable.SymbolTable]:
    yield table
    for child in table.get_children():
        yield from _scopes(child)


def _flow(statements: Iterable[ast.stmt], own: frozenset[str]) -> tuple[set[str], frozenset[str]]:
    """Return the names that statements read before they have bound them, and those that are bound after them for sure.

    What a loop, a ``try``, or a ``with`` (which may pass over an error) binds may not be bound after it.

    Parameters
    ----------
    statements : one after the other
    own : names that are bound before
    """
    read: set[str] = set()
    for statement in statements:
        match statement:
            case ast.If():
                if_true, if_false = _flow(statement.body, own), _flow(statement.orelse, own)
                read |= (_read(statement.test) - own) | if_true[0] | if_false[0]
                own = if_true[1] & if_false[1]
            case ast.For(iter=first, target=target):
                read |= (_read(first) | _read(target)) - own
                read |= _of_blocks([statement.body, statement.orelse], own | _stored(target))
            case ast.While():
                read |= (_read(statement.test) - own) | _of_blocks([statement.body, statement.orelse], own)
            case ast.Try():
                kinds = (handler.type for handler in statement.handlers if handler.type is not None)
                read |= set[str]().union(*map(_read, kinds)) - own
                handled = [handler.body for handler in statement.handlers]
                read |= _of_blocks([statement.body, *handled, statement.orelse, statement.finalbody], own)
            case ast.With():
                for item in statement.items:
                    read |= _read(item) - own
                    own |= _stored(item.optional_vars)
                read |= _flow(statement.body, own)[0]
            case _:
                read |= _read(statement) - own
                own |= _bound_by(statement)
    return read, own


def _of_blocks(blocks: Iterable[Iterable[ast.stmt]], own: frozenset[str]) -> set[str]:
    return set[str]().union(*(_flow(block, own)[0] for block in blocks))


def _read(node: ast.AST) -> set[str]:
    """Return the names that are read somewhere in it. (``x += 1`` reads x.)"""
    nodes = list(ast.walk(node))
    names = [each for each in nodes if isinstance(each, ast.Name) and not isinstance(each.ctx, ast.Store)]
    changed = [each.target for each in nodes if isinstance(each, ast.AugAssign) and isinstance(each.target, ast.Name)]
    return {each.id for each in (*names, *changed)}


def _bound_by(statement: ast.stmt) -> set[str]:
    """Return the names that a simple statement or a definition binds."""
    match statement:
        case ast.Assign():
            return set[str]().union(*map(_stored, statement.targets))
        case ast.AnnAssign(value=ast.expr()):
            return _stored(statement.target)
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
            return {statement.name}
        case ast.Import() | ast.ImportFrom():
            return {(alias.asname or alias.name).split(".")[0] for alias in statement.names}
    return set()


def _stored(target: ast.expr | None) -> set[str]:
    nodes = ast.walk(target) if target is not None else ()
    return {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}

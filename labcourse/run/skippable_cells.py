"""Which cells a graded run needs: those that only show something are left out, if nothing depends on them.

Cells of the course that explain are tagged ``illustration``. Nobody looks at what they show when a class is graded, and
they take half of the time. One of them is run all the same if a cell that is run uses a name that it binds; all of a
notebook's are, if a cell may use names in a way that cannot be read off its source.
"""

from __future__ import annotations

import ast
import symtable
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Any

ILLUSTRATION = "illustration"
#: Characters of a cell whose names are looked at (600 lines), and of all of a notebook's. Python takes seconds to tell
#: the names of a long cell that was written for that, and nothing else gets its turn meanwhile.
LONGEST, LONGEST_TOGETHER = 20_000, 100_000
#: With these, a cell can reach a name without writing it.
_NAMESPACES = {"globals", "locals", "vars", "dir", "__main__", "get_ipython", "In", "Out", "_", "__", "___"}
_ROUNDABOUT = _NAMESPACES | {"eval", "exec", "compile", "__import__", "importlib", "sys", "inspect", "gc", "builtins"}
_cached = lru_cache(maxsize=1024)  # most cells are the course's, and the same in every submission


def skippable(cells: Iterable[dict[str, Any]]) -> set[str]:
    """Ids of the cells of a notebook that need not be run.

    Parameters
    ----------
    cells : of a notebook of the course, with a submission's answer cells in it
    """
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    if not readable(map(_source, code)):
        return set()
    try:
        optional = {
            cell["id"]: cell
            for cell in code
            if ILLUSTRATION in cell["metadata"].get("tags", []) and not _binds_unseen(_source(cell))
        }
        certain = [_source(cell) for cell in code if cell["id"] not in optional]
        used = set[str]().union(*map(uses, certain))
        imported = set[str]().union(*map(bound, certain))
        binds = {name: bound(_source(cell)) for name, cell in optional.items()}
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # not Python alone, or too long
        return set()
    if (used | imported) & _ROUNDABOUT:
        return set()
    while wanted := [name for name in optional if binds[name] & used]:
        for name in wanted:
            used |= uses(_source(optional.pop(name)))
    return set(optional)


def readable(sources: Iterable[str]) -> bool:
    """Whether the cells of a notebook are together short enough that their names can be looked at."""
    return sum(map(len, sources)) <= LONGEST_TOGETHER


def _source(cell: dict[str, Any]) -> str:
    return "".join(cell["source"])


@lru_cache(maxsize=64)
def _table(source: str) -> symtable.SymbolTable:
    if len(source) > LONGEST:
        raise ValueError(f"it has more than {LONGEST} characters")
    return symtable.symtable(ast.unparse(_Scoped().visit(ast.parse(source))), "cell", "exec")


class _Scoped(ast.NodeTransformer):
    """Writes lists, sets and dicts that go through something as generators, which bind and use the same names.

    From Python 3.12 on, the table of symbols has the names of the others as if they were those of the cell around them.
    """

    def visit_ListComp(self, node: ast.ListComp | ast.SetComp) -> ast.AST:
        return self.generic_visit(ast.GeneratorExp(node.elt, node.generators))

    visit_SetComp = visit_ListComp

    def visit_DictComp(self, node: ast.DictComp) -> ast.AST:
        pair = ast.Tuple([node.key, node.value], ast.Load())
        return self.generic_visit(ast.GeneratorExp(pair, node.generators))


@_cached
def _binds_unseen(source: str) -> bool:
    """Whether a cell binds names that it does not write: ``from module import *``."""
    imported = (one for one in ast.walk(ast.parse(source)) if isinstance(one, ast.ImportFrom))
    return any(alias.name == "*" for one in imported for alias in one.names)


@_cached
def bound(source: str) -> frozenset[str]:
    """Names that a cell binds for the cells after it.

    Raises
    ------
    SyntaxError
        If it is not Python.
    ValueError
        If it is too long.
    """
    found = set()
    for scope in _scopes(_table(source)):
        top = scope.get_type() == "module"
        for symbol in scope.get_symbols():
            if (symbol.is_assigned() or symbol.is_imported()) and (top or symbol.is_declared_global()):
                found.add(symbol.get_name())
    return frozenset(found)


@_cached
def uses(source: str) -> frozenset[str]:
    """Names that a cell may take from the cells before it.

    Raises
    ------
    SyntaxError
        If it is not Python.
    ValueError
        If it is too long.
    """
    table = _table(source)
    inner = {
        symbol.get_name()
        for scope in _scopes(table)
        if scope.get_type() != "module"
        for symbol in scope.get_symbols()
        if symbol.is_referenced() and symbol.is_global()
    }
    outer = {symbol.get_name() for symbol in table.get_symbols()}
    read = _flow(ast.parse(source).body, frozenset())[0]
    return frozenset(read & (inner | outer))


def _scopes(table: symtable.SymbolTable) -> Iterator[symtable.SymbolTable]:
    yield table
    for child in table.get_children():
        yield from _scopes(child)


def _flow(statements: Iterable[ast.stmt], own: frozenset[str]) -> tuple[set[str], frozenset[str]]:
    """Names that statements read before they have bound them, and names that are bound after them, whatever happens.

    ``own`` are those that are bound before. What a loop, a ``try``, or a ``with`` (which may pass over an error) binds
    may not be, after it.
    """
    found: set[str] = set()
    for statement in statements:
        match statement:
            case ast.If():
                read, one = _flow(statement.body, own)
                other_read, other = _flow(statement.orelse, own)
                found |= (_read(statement.test) - own) | read | other_read
                own = one & other
            case ast.For() | ast.While() | ast.Try():
                found |= set().union(*map(_read, _heads(statement))) - own
                inside = own | (_stored(statement.target) if isinstance(statement, ast.For) else set())
                for block in _blocks(statement):
                    found |= _flow(block, inside)[0]
            case ast.With():
                for item in statement.items:
                    found |= _read(item) - own
                    own |= _stored(item.optional_vars)
                found |= _flow(statement.body, own)[0]
            case _:
                found |= _read(statement) - own
                own |= _bound_by(statement)
    return found, own


def _heads(statement: ast.For | ast.While | ast.Try) -> list[ast.expr]:
    match statement:
        case ast.For():
            return [statement.iter, statement.target]
        case ast.While():
            return [statement.test]
    return [handler.type for handler in statement.handlers if handler.type is not None]


def _blocks(statement: ast.For | ast.While | ast.Try) -> list[list[ast.stmt]]:
    blocks = [statement.body, statement.orelse]
    if isinstance(statement, ast.Try):
        blocks += [*(handler.body for handler in statement.handlers), statement.finalbody]
    return blocks


def _read(node: ast.AST) -> set[str]:
    """Names that are read somewhere in it. (``x += 1`` reads x.)"""
    found = {one.id for one in ast.walk(node) if isinstance(one, ast.Name) and not isinstance(one.ctx, ast.Store)}
    changed = [one.target for one in ast.walk(node) if isinstance(one, ast.AugAssign)]
    return found | {target.id for target in changed if isinstance(target, ast.Name)}


def _bound_by(statement: ast.stmt) -> set[str]:
    """Names that a simple statement or a definition binds."""
    match statement:
        case ast.Assign():
            return set().union(*map(_stored, statement.targets))
        case ast.AnnAssign(value=ast.expr()):
            return _stored(statement.target)
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
            return {statement.name}
        case ast.Import() | ast.ImportFrom():
            return {(alias.asname or alias.name).split(".")[0] for alias in statement.names}
    return set()


def _stored(target: ast.expr | None) -> set[str]:
    if target is None:
        return set()
    return {node.id for node in ast.walk(target) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}

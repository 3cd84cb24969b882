"""Words in the source that would reach a person without having gone through gettext, or that go there in vain.

Nobody can tell from a text alone who reads it, so that what is looked at is how it is written and where it stands:
whatever has two words in a row is taken for a sentence; a single word, where it is given to something that shows it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass

SAYS = ("_", "N_", "plural")
#: What shows texts: name of a function or class → which of its arguments.
SHOWS: dict[str, tuple[int, ...]] = {
    **dict.fromkeys(("Button",), (1, 4)),
    **dict.fromkeys(("Choice", "Slider"), (1,)),
    "Row": (0, 1, 3),
    "Readout": (0, 2),
    "line": (3,),
    "band": (4,),
    "handle": (3, 7),
    **dict.fromkeys(("text", "block", "signal"), (2,)),
    **dict.fromkeys(("progress", "with_progress"), (1, 2)),
    "counter": (0, 1),
    **dict.fromkeys(
        ("set_xlabel", "set_ylabel", "set_title", "annotate", "print", "echo", "secho", "display", "Markdown", "HTML"),
        (0,),
    ),
}
NAMED = (
    "label",
    "title",
    "xlabel",
    "ylabel",
    "legend",
    "words",
    "alt",
    "alt_text",
    "description",
)  #: the same, by name
#: Whose texts are for programs: what is searched for, split at, looked up or run.
_FOR_PROGRAMS = {
    *("compile", "fullmatch", "match", "sub", "search", "split", "rsplit", "partition", "rpartition", "replace", "get"),
    *("removeprefix", "removesuffix", "startswith", "endswith", "getattr", "setattr", "hasattr", "import_module"),
}
_NAMES_OF_LOOKS = {"loc", "textcoords", "xycoords", "boxstyle", "arrowstyle", "help", "metavar"}
_TAGS = re.compile(r"<style>.*?</style>|<[a-z/!][^<>]*>", re.DOTALL)
_UNITS = re.compile(r"\b(?:deg|rad|Hz|kg·m²|N·m|mV|ms)\b|\$[^$]*\$")
_SENTENCE = re.compile(r"[^\W\d_]{2,}[^\w\n]*[ \n][^\w\n]*[^\W\d_]{2,}|[^\W\d_]{3,}[:;,.!?]?[ \n]|[ ][^\W\d_]{3,}")
_WORD = re.compile(r"(?<![\w{.])[^\W\d_]{3,}(?!\w)")


@dataclass(frozen=True)
class Found:
    """Something that should be otherwise: its line, its text (as it is written), and what is wrong."""

    line: int
    text: str
    what: str


def found_in(source: str) -> Iterator[Found]:
    """What should be otherwise in a module."""
    tree = ast.parse(source)
    parents = {child: parent for parent in ast.walk(tree) for child in ast.iter_child_nodes(parent)}
    marked = {target.id for node in tree.body for target in _constants(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield from _of_call(node, parents, marked)
        elif isinstance(node, ast.FunctionDef | ast.comprehension):
            yield from _of_hidden(node, parents)
        elif isinstance(node, ast.Dict):
            yield from _among_messages(node, parents)
        else:
            text = _text(node, parents)
            if text and _is_sentence(text) and not _is_for_a_program(node, parents):
                yield Found(node.lineno, text, "is not translated")


def _constants(node: ast.stmt) -> Iterator[ast.Name]:
    """Names of a module that stand for a message that is still to be said."""
    if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and _called(node.value) == "N_":
        yield from (target for target in node.targets if isinstance(target, ast.Name))


def _called(node: ast.Call) -> str:
    function = node.func
    return function.id if isinstance(function, ast.Name) else getattr(function, "attr", "")


def _of_call(node: ast.Call, parents: dict[ast.AST, ast.AST], marked: set[str]) -> Iterator[Found]:
    name = _called(node)
    if isinstance(node.func, ast.Name) and name in SAYS:
        for argument in node.args[1:3] if name == "plural" else node.args[:1]:
            if isinstance(argument, ast.JoinedStr | ast.BinOp) or _is_formatted(argument):
                yield Found(node.lineno, ast.unparse(argument), "is made before it is looked up")
            elif isinstance(argument, ast.IfExp | ast.BoolOp) and any(map(_is_text, _alternatives(argument))):
                yield Found(node.lineno, ast.unparse(argument), "is not gathered")
        if name != "N_" and not _is_in_function(node, parents):
            yield Found(node.lineno, ast.unparse(node), "is said while the module is imported")
    match node.func:
        case ast.Attribute(attr="format", value=ast.Name(id=constant)) if constant in marked:
            yield Found(node.lineno, ast.unparse(node.func), "is marked, and not said")
    shown = [node.args[place] for place in SHOWS.get(name, ()) if place < len(node.args)]
    shown += [keyword.value for keyword in node.keywords if keyword.arg in NAMED]
    for argument in shown:
        for one in _alternatives(argument):
            text = _text(one, parents)
            if text and _WORD.search(_UNITS.sub("", text)) and not _is_sentence(text):
                yield Found(one.lineno, text, f"is shown by {name}, and not translated")


def _among_messages(node: ast.Dict, parents: dict[ast.AST, ast.AST]) -> Iterator[Found]:
    """Words in a table whose others are messages."""
    if any(isinstance(value, ast.Call) and _called(value) == "N_" for value in node.values):
        for value in node.values:
            text = _text(value, parents)
            if _WORD.search(_UNITS.sub("", text)):
                yield Found(value.lineno, text, "stands among messages, and is none")


def _alternatives(node: ast.expr) -> Iterator[ast.expr]:
    match node:
        case ast.Tuple(elts=several) | ast.List(elts=several) | ast.BoolOp(values=several):
            for one in several:
                yield from _alternatives(one)
        case ast.IfExp(body=one, orelse=other):
            yield from _alternatives(one)
            yield from _alternatives(other)
        case _:
            yield node


def _text(node: ast.AST, parents: dict[ast.AST, ast.AST]) -> str:
    """A text as it is written, names in braces, without a page's tags; "" for what is none, and for a part of one."""
    if isinstance(node, ast.JoinedStr):
        parts = [part.value if isinstance(part, ast.Constant) else "{}" for part in node.values]
        return "" if isinstance(parents[node], ast.FormattedValue) else _TAGS.sub("", "".join(map(str, parts)))
    if not _is_text(node) or isinstance(parents[node], ast.JoinedStr | ast.Expr):
        return ""
    return _TAGS.sub("", str(node.value))


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _is_sentence(text: str) -> bool:
    plain = _UNITS.sub("", text)
    return bool(_SENTENCE.search(plain)) and bool(_WORD.search(plain))


def _is_in_function(node: ast.AST, parents: dict[ast.AST, ast.AST]) -> bool:
    while node in parents:
        inner, node = node, parents[node]
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and inner in node.body:
            return True
        if isinstance(node, ast.Lambda) and inner is node.body:
            return True
    return False


def _is_formatted(node: ast.expr) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "format"


def _of_hidden(node: ast.FunctionDef | ast.comprehension, parents: dict[ast.AST, ast.AST]) -> Iterator[Found]:
    """What is said where ``_`` is a name for what nobody needs."""
    within = list(_within(node if isinstance(node, ast.FunctionDef) else parents[node]))
    bound = [one for one in within if isinstance(one, ast.arg) and one.arg == "_"]
    bound += [one for one in within if isinstance(one, ast.Name) and one.id == "_" and isinstance(one.ctx, ast.Store)]
    calls = [
        one for one in within if isinstance(one, ast.Call) and isinstance(one.func, ast.Name) and one.func.id == "_"
    ]
    if bound and calls:
        yield Found(calls[0].lineno, ast.unparse(calls[0]), "is said where _ is something else")


def _within(node: ast.AST) -> Iterator[ast.AST]:
    """What a function or a comprehension holds, but for those in it."""
    for child in ast.iter_child_nodes(node):
        yield child
        if not isinstance(
            child, ast.FunctionDef | ast.Lambda | ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp
        ):
            yield from _within(child)


def _is_for_a_program(node: ast.AST, parents: dict[ast.AST, ast.AST]) -> bool:
    while node in parents:
        inner, node = node, parents[node]
        match node:
            case ast.Call() if inner is not node.func:
                found = _called(node) in {*SAYS, *_FOR_PROGRAMS}
            case ast.Dict() if inner in node.keys:  # the name of a message
                value = node.values[node.keys.index(inner)]
                found = isinstance(value, ast.Call) and _called(value) == "N_"
            case ast.keyword(arg=name):
                found = name in _NAMES_OF_LOOKS
            case ast.Compare() | ast.arg():
                found = True
            case ast.Subscript():
                found = inner is node.slice
            case ast.AnnAssign():
                found = inner is node.annotation
            case ast.FunctionDef():
                found = inner is node.returns
            case _:
                found = False
        if found:
            return True
    return False

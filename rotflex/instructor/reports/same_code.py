"""Code, and words, that two students have in common and hardly anybody else.

Comments, white space, quotes, how numbers are written and which names are chosen do not matter; a program need not be
right to be compared. Own files that are text are read, too: a module of helpers, or samples in a table.
"""

from __future__ import annotations

import builtins
import json
import keyword
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import zip_longest

from rotflex.courseware.files import ANSWERS_FILE, COURSE_FILE
from rotflex.courseware.messages import _
from rotflex.courseware.run.handed_in import CODE, Cell, NotebookError, cells_of
from rotflex.courseware.words import Where, Words
from rotflex.instructor.reports.overlaps import Author, Overlap, Piece, Token, overlaps

WINDOW = 16  #: tokens of code that are compared at a time
FEWEST = 72  #: tokens of code in common that are told
WINDOW_OF_WORDS = 6  #: words that are compared at a time
FEWEST_WORDS = 30  #: words in common that are told
_LARGEST_FILE = 1_000_000  # bytes of an own file that is read
_MOST_TOKENS = 20_000  # of one text: an own file may be a table of a million samples
_NOTEBOOK = ".ipynb"
_TOKEN = re.compile(
    r"""(?P<comment>\#[^\n]*|\\\r?\n)
      | (?P<text>[rRbBuUfF]{0,2}(?:'''[\s\S]*?'''|\"\"\"[\s\S]*?\"\"\"|'(?:\\.|[^'\\\n])*'|"(?:\\.|[^"\\\n])*"))
      | (?P<number>(?:\d[\d_]*\.?[\d_]*|\.\d[\d_]*)(?:[eE][+-]?\d+)?[jJ]?)
      | (?P<name>[^\W\d]\w*)
      | (?P<sign>\*\*|//|==|!=|<=|>=|->|:=|[^\s\w])""",
    re.VERBOSE,
)
_WORD = re.compile(r"\w+")
_PYTHON = {*keyword.kwlist, *keyword.softkwlist, *dir(builtins)}
_OPENS, _CLOSES = frozenset("([{"), frozenset(")]}")


def code(text: str, known: Collection[str] = ()) -> tuple[Token, ...]:
    """The tokens of a program.

    Parameters
    ----------
    text : the program
    known : names that are nobody's own; neither are Python's, those of attributes, and those of arguments
    """
    found = [match for match in _TOKEN.finditer(text) if match.lastgroup != "comment"][:_MOST_TOKENS]
    tokens, depth, before = [], 0, ""
    for match, following in zip_longest(found, found[1:]):
        written, kind, after = match.group(), match.lastgroup, following.group() if following else ""
        depth += (written in _OPENS) - (written in _CLOSES)
        of_argument = depth > 0 and after == "="  # as in f(color="red")
        own = kind == "name" and before != "." and not of_argument and written not in _PYTHON and written not in known
        tokens.append(Token(_plain(written, kind), match.start(), match.end(), own))
        before = written
    return tuple(tokens)


def _plain(written: str, kind: str | None) -> str:
    """A token without what does not matter in it."""
    if kind == "text":
        return '"' + written.lstrip("rRbBuUfF").strip("'\"")
    if kind == "number":
        try:
            return f"{complex(written.replace('_', '')):.6g}"
        except ValueError:
            return written
    return written


def words(text: str) -> tuple[Token, ...]:
    """The words of a text, without regard to capitals."""
    found = (Token(one.group().casefold(), one.start(), one.end()) for one in _WORD.finditer(text))
    return tuple(found)[:_MOST_TOKENS]


class HandedOut:
    """What students were given: to have it in common says nothing.

    Parameters
    ----------
    notebooks : as they were handed out
    solutions : with what is usual, which many write alike
    """

    def __init__(self, notebooks: Sequence[bytes], solutions: Sequence[bytes] = ()) -> None:
        cells = [cell for notebook in notebooks for cell in _cells(notebook)]
        self.sources = frozenset(cell.source.strip() for cell in cells)
        texts = [*self.sources, *(cell.source for notebook in solutions for cell in _cells(notebook))]
        self.known = frozenset(name for cell in cells if cell.kind == CODE for name in _names(cell.source))
        self.code = tuple(code(text, self.known) for text in texts)
        self.words = tuple(map(words, texts))


def _cells(notebook: bytes) -> tuple[Cell, ...]:
    try:
        return cells_of(notebook)
    except NotebookError:
        return ()


def _names(source: str) -> Iterator[str]:
    return (one.group() for one in _TOKEN.finditer(source) if one.lastgroup == "name")


def coder(student: str, group: str, delivered: Mapping[str, bytes], given: HandedOut) -> Author:
    """A student, and their code: cells that are not as they were handed out, and own files that are text.

    Parameters
    ----------
    student, group : the ID, and what is the same for all who work together
    delivered : what was handed in last: name → content
    given : what was handed out
    """
    texts = [text for name, content in delivered.items() for text in _texts(name, content, given)]
    return Author(student, group, tuple(Piece(place, text, code(text, given.known)) for place, text in texts))


def _texts(name: str, content: bytes, given: HandedOut) -> Iterator[tuple[str, str]]:
    if name.endswith(_NOTEBOOK):
        sources = (cell.source for cell in _cells(content) if cell.kind == CODE)
        yield from ((name, source) for source in sources if source.strip() not in given.sources)
    elif name not in (ANSWERS_FILE, COURSE_FILE) and len(content) <= _LARGEST_FILE:
        try:
            yield name, content.decode("utf-8")
        except UnicodeDecodeError:
            return


def writer(student: str, group: str, written: Mapping[Where, Words]) -> Author:
    """A student, and their answers in words."""
    texts = [(f"{question} {part}", one.text) for (question, part), one in written.items()]
    return Author(student, group, tuple(Piece(place, text, words(text)) for place, text in texts))


def in_code(everybody: Sequence[Author], given: HandedOut) -> list[Overlap]:
    """Pairs of students who have code in common; see :func:`coder`."""
    return overlaps(everybody, given.code, WINDOW, FEWEST)


def in_words(everybody: Sequence[Author], given: HandedOut) -> list[Overlap]:
    """Pairs of students who have words in common; see :func:`writer`."""
    return overlaps(everybody, given.words, WINDOW_OF_WORDS, FEWEST_WORDS)


def told(found: Overlap, of_code: bool) -> str:
    """What there is to say of a pair, with an excerpt."""
    line = _("{students} have {count} {tokens} in common that hardly anybody else has ({places}): {excerpt}")
    return line.format(
        students=", ".join(found.students),
        count=found.tokens,
        tokens=_("words and signs of code") if of_code else _("words"),
        places=", ".join(found.places),
        excerpt=json.dumps(found.excerpt, ensure_ascii=False),
    )

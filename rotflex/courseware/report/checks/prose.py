"""A text of the student's, taken apart: running text, formulas, pictures. Code is left out of all of it."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

from rotflex.courseware.report.document import Place, Prose
from rotflex.courseware.words import STUB

FORMULA = "□"  #: what stands for a formula, or for code, in running text

_FENCED = re.compile(r"^(```|~~~).*?^\1[^\n]*$", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)", re.DOTALL)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_ENVIRONMENT = re.compile(r"^\\begin\{([A-Za-z]{1,20}\*?)\}.*?\\end\{\1\}", re.MULTILINE | re.DOTALL)
_DISPLAYED = re.compile(r"(?<!\\)\$\$(.+?)(?<!\\)\$\$", re.DOTALL)
_INLINE = re.compile(r"(?<![\\$])\$(?!\$)((?:[^$\n\\]|\\.|\n(?!\s*\n))+?)(?<!\\)\$(?!\$)")
_DOLLAR = re.compile(r"(?<!\\)\$")
_PICTURE = re.compile(r"!\[[^\]]*\]\(\s*<?([^)\s>]+)[^)]*\)")
_LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)]*)\)")
_ADDRESS = re.compile(r"(?:https?://|www\.|doi:)\S+", re.IGNORECASE)
_TABLE_ROW = re.compile(r"^\s*\|.*$|^[^|\n]*\|[^|\n]*\|.*$|^\s*:?-{3,}.*$", re.MULTILINE)
_EMPHASIS = re.compile(r"(?<![\w*])(\*{1,3})(?=\S)(.+?)(?<=\S)\1(?![\w*])")
_UNDERLINED = re.compile(r"(?<!\w)(_{1,2})(?=\S)([^_]+?)(?<=\S)\1(?!\w)")
_HEADING = re.compile(r"^#{1,6}\s+.*$", re.MULTILINE)
_MARKER = re.compile(r"^\s*(?:[-*+]|\d{1,3}[.)]|>)\s+", re.MULTILINE)
_FONT = re.compile(r"\\(?:math|text|operatorname|mbox)[a-z]*\*?\s*\{([^{}]*)\}")
_SPACE = re.compile(r"\\[,;:! ]|~|\\q?quad\b")
_COMMANDS = {"cdot": "·", "times": "×", "pm": "±", "approx": "≈", "circ": "°", "degree": "°", "mu": "μ"}
_COMMAND = re.compile(r"\\([A-Za-z]+)\s*")
#: Letter → its name, as LaTeX has it.
GREEK = {
    letter: unicodedata.name(letter).rpartition(" ")[2].lower().replace("lamda", "lambda")
    for letter in "αβγδεζηθικλμνξπρστυφχψω"
}
GREEK |= {letter.upper(): name.title() for letter, name in GREEK.items()}
_SENTENCE = re.compile(r"(?<=[.!?])\s+(?=[^\Wa-z\d_]|□)")
_WORD = re.compile(r"[^\W\d_]+(?:['’-][^\W\d_]+)*")


@dataclass(frozen=True)
class Formula:
    """A formula of a text: its LaTeX, and whether it stands on lines of its own."""

    latex: str
    displayed: bool


@dataclass(frozen=True)
class Reading:
    """A text as a reader goes through it.

    Attributes
    ----------
    where : number of its section, as in "II.1"
    heading : of its section
    place : its cell
    source : as it was written, without code and comments
    running : its words, with numbers and symbols of formulas as they would be typed; no tables, no pictures
    bare : the same with :data:`FORMULA` for each formula
    formulas : in order
    pictures : names of the pictures that it shows, as it has them
    unclosed : whether a "$" is left over
    begun : whether the line that was to be written over is still there
    """

    where: str
    heading: str
    place: Place
    source: str
    running: str
    bare: str
    formulas: tuple[Formula, ...]
    pictures: tuple[str, ...]
    unclosed: bool
    begun: bool

    @property
    def words(self) -> list[str]:
        """The words of its running text."""
        return words(self.bare)

    @property
    def paragraphs(self) -> list[str]:
        """Pieces of :attr:`bare` between blank lines."""
        return [piece.strip() for piece in re.split(r"\n\s*\n", self.bare) if piece.strip()]

    @property
    def sentences(self) -> list[str]:
        """Of :attr:`running`, in order."""
        found = []
        for piece in re.split(r"\n\s*\n", self.running):
            found += [" ".join(one.split()) for one in _SENTENCE.split(piece) if one.strip()]
        return found


def read(text: Prose, where: str, heading: str) -> Reading:
    """Take a text apart.

    Parameters
    ----------
    text : as it was written
    where, heading : number and heading of its section
    """
    source = _COMMENT.sub(" ", text.text.replace("\r\n", "\n").replace(STUB, " "))
    source = _CODE.sub(FORMULA, _FENCED.sub(f"\n{FORMULA}\n", source))
    formulas: list[Formula] = []

    def take(displayed: bool) -> _Taker:
        return _Taker(formulas, displayed)

    marked = _ENVIRONMENT.sub(take(True), source)
    marked = _INLINE.sub(take(False), _DISPLAYED.sub(take(True), marked))
    unclosed = bool(_DOLLAR.search(marked))
    pictures = tuple(_PICTURE.findall(marked))
    marked = _ADDRESS.sub(" ", _LINK.sub(r"\1", _PICTURE.sub(" ", marked)))
    marked = _TABLE_ROW.sub(" ", _HEADING.sub("\n", marked))
    marked = _UNDERLINED.sub(r"\2", _EMPHASIS.sub(r"\2", _MARKER.sub("", marked))).replace(r"\$", "$")
    running = re.sub(r"\ue000(\d+)\ue001", lambda at: typed(formulas[int(at[1])].latex), marked)
    bare = re.sub(r"\ue000\d+\ue001", FORMULA, marked)
    return Reading(
        where, heading, text.place, source, running, bare, tuple(formulas), pictures, unclosed, STUB in text.text
    )


@dataclass
class _Taker:
    """Puts a mark in the place of each formula, and keeps the formula."""

    kept: list[Formula]
    displayed: bool

    def __call__(self, found: re.Match[str]) -> str:
        latex = found[0] if found[0].startswith("\\begin") else found[1]
        self.kept.append(Formula(latex.strip(), self.displayed))
        return f"\ue000{len(self.kept) - 1}\ue001"


def typed(latex: str) -> str:
    """A formula as one would type it: ``x_{0} = 25\\,\\mathrm{rad}`` as "x_0 = 25 rad"."""
    text = _SPACE.sub(" ", latex.replace("{,}", ","))
    for _time in range(3):
        text = _FONT.sub(r"\1", text)
    text = _COMMAND.sub(lambda found: _COMMANDS.get(found[1], found[1] + " "), text)
    text = text.replace("{", "").replace("}", "").replace("$", "")
    return re.sub(r"\s+(?=[_^])", "", " ".join(text.split()))


def symbol(text: str) -> str:
    """A symbol by which it is compared, however it was written: ``$\\psi_{n}$``, "ψ_n" and "psi_n" are the same."""
    plain = typed(text.strip().strip("$`*")).replace(" ", "")
    return "".join(GREEK.get(sign, sign) for sign in plain)


def spelt(text: str) -> str:
    """A text with Greek letters by their names, as :func:`symbol` has them."""
    return "".join(GREEK.get(sign, sign) for sign in text)


def words(text: str) -> list[str]:
    """Words of a text; numbers are none."""
    return _WORD.findall(text)

"""Answers in words: what a student wrote in the text cells of a notebook, read from the saved file.

A cell of the course for such an answer carries ``{"question", "part"}`` in its metadata (:data:`KEY`). It begins with
a heading that says what to write there, and a line to be replaced (:data:`STUB`). Students split cells, renew their
ids, change their kind, or write in a cell of their own just below: their text is read wherever the question is clear,
and a note says where it was.
"""

from __future__ import annotations

import base64
import binascii
import io
import itertools
import re
import warnings
from collections import ChainMap, Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from PIL import Image, ImageOps, UnidentifiedImageError

from labcourse import files
from labcourse.answers import json_values
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.forms import STUBS, of_few_words
from labcourse.answers.json_values import clean
from labcourse.answers.notebooks import CODE, RAW, TEXT, Cell, Notebook, NotebookError, why_unread
from labcourse.patterns import CELL, SHORT, pattern
from labcourse.problems import Code, Problem, Where

KEY = "labcourse"  #: of a cell's metadata: {"question": ..., "part": ...}
INSTRUCTOR = "instructor"  #: tag of cells that only an instructor's notebook has
MARK = "✎"  #: begins each place to write, in every notebook
STUB = (
    "*Double-click here, and write in place of this line. Formulas between `$` signs and pasted pictures are welcome.*"
)
#: Lines around a model answer in the instructor's notebooks; rendered Markdown does not show them.
BEGIN, END = "<!-- BEGIN SOLUTION -->", "<!-- END SOLUTION -->"

_IN_ITALICS = pattern(r"\*[^*\n]+\*", CELL)
_HEADING = pattern(rf'(?:<div class="[\w -]{{1,60}}"><b>|\*\*){MARK}[^*<>\n]{{1,200}}(?:</b></div>|\*\*)', CELL)
#: The beginning of text that was written into a code cell: some words in a row, and no keyword of Python first.
_PROSE = pattern(r"\s*(?!(?:from|for|if|while|with|not|lambda|assert|del|import)\b)\w+(?:,? [^\W\d_]{1,40}){3}")


@dataclass(frozen=True)
class TextAnswer:
    """An answer in words.

    Attributes
    ----------
    text : Markdown, of at most :data:`~labcourse.answers.json_values.LONGEST_PROSE` characters
    pictures : name, as the text has it in ``![…](name)`` → PNG
    """

    text: str
    pictures: Mapping[str, bytes] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the answer as JSON data, with pictures in base64."""
        return {
            "text": self.text,
            "pictures": {name: base64.b64encode(data).decode("ascii") for name, data in self.pictures.items()},
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> TextAnswer:
        """Read what :meth:`as_json` returned."""
        return cls(content["text"], {name: base64.b64decode(data) for name, data in content["pictures"].items()})


@dataclass
class Written:
    """A student's answers in the text cells of a notebook. What there is to say of one has its question and part.

    Attributes
    ----------
    words : (question, part) → the answer; without answers that were not written
    notes : for people, such as where an answer is that is not in its cell
    problems : what is not read as the student left it
    asked : questions to the student about answers that are read as they are
    """

    words: dict[Where, TextAnswer] = field(default_factory=dict)
    notes: list[Problem] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    asked: list[Problem] = field(default_factory=list)


def where_of(cell: Mapping[str, Any]) -> Where | None:
    """Return the question and part that a text cell of the course answers; None for any other cell."""
    about = cell.get("metadata", {}).get(KEY, {})
    question, part = about.get("question"), about.get("part")
    readable = cell.get("cell_type") == TEXT and isinstance(question, str) and isinstance(part, str)
    return (question, part) if readable else None


def written(
    master_cells: Sequence[Mapping[str, Any]],
    student_cells: Sequence[Cell],
    files: Mapping[str, bytes] | None = None,
    with_pictures: bool = True,
    budget: Budget | None = None,
) -> Written:
    """Read the answers in words from a student's notebook.

    Parameters
    ----------
    master_cells : of the course's notebook as released
    student_cells : of the student's
    files : the student's own files beside the notebook, for pictures that a text shows from there
    with_pictures : decode them; else only the text is read
    budget : pixels that may still be decoded, for all notebooks of a submission; None for this one alone
    """
    result, budget = Written(), budget or Budget()
    places = _Places(master_cells, student_cells)
    for where, master in places.asked.items():
        cells, notes = places.cells_for(master)
        result.notes += _about(where, notes)
        text, attachments = _joined(cells, master)
        if not text:
            continue
        shown = pictures_of(text, attachments, files or {}, budget) if with_pictures else Pictures(lifted(text)[0])
        if len(shown.text) > (most := json_values.LONGEST_PROSE):
            shown.problems.append(Problem.of(Code.TEXT_TOO_LONG, count=len(shown.text), most=most))
        result.problems += _about(where, shown.problems)
        result.asked += _about(where, of_few_words(text))
        result.words[where] = TextAnswer(shown.text[:most], shown.saved)
    return result


def _about(where: Where, problems: Iterable[Problem]) -> list[Problem]:
    """Return problems with the question and part that they concern."""
    about = {"question": where[0], "part": where[1]}
    return [replace(problem, parameters={**about, **problem.parameters}) for problem in problems]


def _joined(cells: Sequence[Cell], master: Mapping[str, Any]) -> tuple[str, dict[str, Mapping[str, str]]]:
    """Join the texts and the attachments of an answer's cells.

    Some editors name each pasted picture ``image.png``: of two pictures of one name, the second is renamed.
    """
    pieces: dict[str, None] = {}
    attachments: dict[str, Mapping[str, str]] = {}
    for number, cell in enumerate(cells, start=1):
        piece = without_stub(cell.source, master)
        for name, content in cell.attachments.items():
            if attachments.setdefault(name, content) != content:
                attachments[f"{number}-{name}"] = content
                piece = piece.replace(f"(attachment:{name})", f"(attachment:{number}-{name})")
        pieces[piece] = None
    return clean("\n\n".join(filter(None, pieces))).strip(), attachments


def without_stub(source: str, master: Mapping[str, Any]) -> str:
    """Return a student's text in a cell, without the text of the course's cell."""
    stubs = stubs_of(master)
    given = {line.strip() for line in [*source_of(master).split("\n"), *stubs, BEGIN, END]}
    lines = []
    for line in source.replace("\r\n", "\n").split("\n"):
        rest = _HEADING.sub("", line, count=1) if MARK in line and _HEADING.match(line.lstrip()) else line
        for stub in stubs:
            rest = rest.replace(stub, "")
        lines.append("" if rest.strip() in given or (rest != line and not rest.strip()) else rest)
    text = "\n".join(lines).strip()
    return "" if text.casefold().rstrip(".") in STUBS else text


def stubs_of(master: Mapping[str, Any]) -> list[str]:
    """Return the lines of a course's cell that students replace by their text."""
    given = [line.strip() for line in source_of(master).split("\n")]
    return list(dict.fromkeys([STUB, *(line for line in given if _IN_ITALICS.fullmatch(line))]))


def source_of(cell: Mapping[str, Any]) -> str:
    """Return the text of a cell of a notebook's file."""
    return "".join(cell.get("source", ""))


def heading(label: str) -> str:
    """Return the first line of an answer cell for text: a coloured band in JupyterLab, plain elsewhere."""
    return f'<div class="alert alert-success"><b>{MARK} {label}</b></div>'


def headings(source: str) -> list[str]:
    """Find the headings in a cell that say what to write there."""
    return _HEADING.findall(source)


# --- the cells of an answer -------------------------------------------------------------------------------------------


@dataclass(eq=False)
class _Run:
    """Cells of a student's notebook that stand together: one of the course's, and the student's own below it.

    The first run of a notebook may have no cell of the course's; its owner is "".
    """

    owner: str
    pieces: list[Cell] = field(default_factory=list)  # the course's cell; several where it was split
    added: list[Cell] = field(default_factory=list)


class _Places:
    """A student's cells beside the course's: which are the course's, and which the student added."""

    def __init__(self, masters: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> None:
        self._order = [_id(master) for master in masters]
        self._text_above = {_id(master): above for above, master in itertools.pairwise(masters)}
        self.asked = {where: master for master in masters if (where := where_of(master)) is not None}
        self._answers = {_id(master): master for master in self.asked.values()}
        self._runs = [_Run("")]
        for cell, owner in zip(cells, _owners(masters, cells), strict=True):
            if owner and owner != self._runs[-1].owner:
                self._runs.append(_Run(owner))
            (self._runs[-1].pieces if owner else self._runs[-1].added).append(cell)
        self._last = {run.owner: run for run in self._runs}  # of each cell of the course that is there

    def cells_for(self, master: Mapping[str, Any]) -> tuple[list[Cell], list[Problem]]:
        """Find the cells with an answer, in order; and notes on where they are."""
        own, notes = self._own(master)
        before = self._before(_id(master))
        filled = [cell for run in own for cell in run.pieces if without_stub(cell.source, master)]
        below = _texts(own[-1].added) if own else []
        if any(cell.kind != TEXT for cell in filled):
            notes.append(Problem.of(Code.TEXT_IN_OTHER_KIND))
        if below:
            notes.append(Problem.of(Code.TEXT_ALSO_BELOW if filled else Code.TEXT_BELOW))
        elif not filled and (below := _texts(self._above(_id(master), own, before))):
            notes.append(Problem.of(Code.TEXT_ABOVE if own else Code.TEXT_IN_PLACE))
        elif not filled and (below := self._in_question(_id(master))):
            notes.append(Problem.of(Code.TEXT_IN_QUESTION))
        elif not filled and any(map(_may_be_words, [*before.added, *(own[-1].added if own else [])])):
            notes.append(Problem.of(Code.TEXT_BESIDE_NOT_READ))
        return [*filled, *below], notes

    def _own(self, master: Mapping[str, Any]) -> tuple[list[_Run], list[Problem]]:
        """Find the runs of an answer cell: all where there are copies that differ, else one, with text if possible."""
        own = [run for run in self._runs if run.owner == _id(master)]
        filled = [run for run in own if any(without_stub(cell.source, master) for cell in run.pieces)]
        if len({"\n\n".join(cell.source for cell in run.pieces) for run in filled}) < 2:
            return (filled or own)[:1], []
        return own, [Problem.of(Code.TEXT_COPIES_DIFFER, count=len(filled))]

    def _before(self, name: str) -> _Run:
        """Return the run of the course's last cell before this one that the student still has; else the first run."""
        earlier = self._order[: self._order.index(name)]
        return next((self._last[other] for other in reversed(earlier) if other in self._last), self._runs[0])

    def _above(self, name: str, own: Sequence[_Run], before: _Run) -> list[Cell]:
        """Find own cells just above an answer cell, or in its place, unless they may belong to another answer."""
        answer = self._answers.get(before.owner)
        if answer is not None and not any(without_stub(cell.source, answer) for cell in before.pieces):
            return []
        if own:
            return before.added if self._runs.index(before) + 1 == self._runs.index(own[0]) else []
        later = self._order[self._order.index(before.owner) + 1 if before.owner else 0 :]
        missing = itertools.takewhile(lambda other: other not in self._last, later)
        return before.added if [other for other in missing if other in self._answers] == [name] else []

    def _in_question(self, name: str) -> list[Cell]:
        """Find what was added to the course's text just before an answer cell, if all of that text is still there."""
        question = self._text_above.get(name, {})
        given, run = source_of(question).strip(), self._last.get(_id(question))
        if question.get("cell_type") != TEXT or where_of(question) or not given or run is None:
            return []
        source = "\n".join(cell.source for cell in run.pieces)
        is_whole = all(line.strip() in source for line in given.split("\n"))
        return _texts([replace(run.pieces[0], source=without_stub(source, question))] if is_whole else [])


def _texts(cells: Iterable[Cell]) -> list[Cell]:
    """Keep the cells with text in them."""
    return [cell for cell in cells if cell.kind in (TEXT, RAW) and without_stub(cell.source, {})]


def _may_be_words(cell: Cell) -> bool:
    return bool(_texts([cell])) or (cell.kind not in (TEXT, RAW) and bool(_PROSE.match(cell.source, 0, SHORT)))


def _id(cell: Mapping[str, Any]) -> str:
    return str(cell.get("id", ""))


def _owners(masters: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> list[str]:
    """Return the id of the course's cell for each of the student's cells; "" for the student's own."""
    owners: dict[tuple[str, str], str] = {}  # by what a cell of the course is known by, as ("id", its id)
    sources = Counter(source_of(master).strip() for master in masters)
    for master in masters:
        source = source_of(master).strip()
        known_by = [("id", _id(master)), ("grade id", grade_id(master))]
        known_by += [("heading", heading) for heading in headings(source)] if where_of(master) else []
        known_by += [("source", source)] if sources[source] == 1 else []
        owners |= dict.fromkeys(known_by, _id(master))
    found = []
    for cell in cells:
        signs = [("id", cell.id), ("grade id", cell.grade_id), *(("heading", text) for text in headings(cell.source))]
        signs.append(("source", cell.source.strip()))
        found.append(next((owners[kind, text] for kind, text in signs if text and (kind, text) in owners), ""))
    return found


def grade_id(cell: Mapping[str, Any]) -> str:
    """Return the id in a cell's grading metadata; "" if it has none."""
    name = cell.get("metadata", {}).get("nbgrader", {}).get("grade_id")
    return name if isinstance(name, str) else ""


def own_masters(cells: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the course's cells in a student's copy of a notebook, recognised by their metadata.

    Cells that have been split are returned once. In a notebook with cells for instructors, no cell is a student's.
    """
    masters: dict[str, Mapping[str, Any]] = {}
    whole = any(INSTRUCTOR in cell["metadata"].get("tags", ()) for cell in cells)
    for cell in cells:
        metadata = cell["metadata"]
        if whole or grade_id(cell) or metadata.get("deletable") is False or metadata.get("editable") is False:
            name = grade_id(cell) or _id(cell)
            kind = TEXT if KEY in metadata else cell.get("cell_type", CODE)
            masters.setdefault(name, {"id": name, "cell_type": kind, "metadata": metadata, "source": ""})
    return list(masters.values())


# --- in a student's folder --------------------------------------------------------------------------------------------


class SavedTexts:
    """The answers in words in the notebooks of a folder, read again when a file has changed.

    Parameters
    ----------
    folder : with the notebooks
    catalogue : of the course; it names them

    Attributes
    ----------
    notices : for the student: what could not be read, or not as it is; and what is asked about
    """

    def __init__(self, folder: Path, catalogue: Catalogue) -> None:
        self.notices: list[Problem] = []
        self._paths = [folder / f"{name}.ipynb" for name in catalogue.notebooks]
        self._versions: dict[Path, tuple[int, ...] | None] = {}
        self._texts: dict[Path, dict[Where, str]] = {}
        self._asked: set[Problem] = set()  # each question once, and not at each saving

    def refresh(self) -> None:
        """Read the notebooks that have been saved since."""
        for path in self._paths:
            version = files.version(path)
            if version != self._versions.get(path):
                self._versions[path] = version
                self._texts[path] = self._read(path) if version else {}

    def get(self, question: str, part: str) -> dict[str, Any] | None:
        """Return an answer as JSON data, as :func:`labcourse.answers.forms.encode` does; None if there is none."""
        text = ChainMap(*self._texts.values()).get((question, part))
        return None if text is None else {"kind": "prose", "value": text}

    def _read(self, path: Path) -> dict[Where, str]:
        """Read the answers in words from a notebook, and note what the student should know."""
        try:
            notebook = Notebook.without_outputs(files.read(path))
        except (OSError, NotebookError) as error:
            self.notices.append(Problem.of(Code.TEXTS_UNREAD, path.name, why=why_unread(error)))
            return {}
        answers = written(own_masters(notebook.content["cells"]), notebook.cells, with_pictures=False)
        asked = [replace(question, where=path.name) for question in answers.asked]
        self.notices += [replace(problem, where=path.name) for problem in answers.problems]
        self.notices += [question for question in asked if question not in self._asked]
        self._asked.update(asked)
        return {where: answer.text for where, answer in answers.words.items()}


# --- pictures ---------------------------------------------------------------------------------------------------------
# They come from untrusted files: attachments of a text cell, pictures in the text itself ("data:"), and files beside
# the notebook. They are decoded within limits, and written anew as PNG; those that cannot be read are left out, with a
# message.

MOST_PICTURES = 6  #: pictures of one answer; two pages of each of three drafts
MAX_PICTURE = 20_000_000  #: of a picture as it comes; a telephone's largest photograph
MAX_PIXELS = 60_000_000  #: of one; a telephone's largest photographs have 50 million
MAX_PIXELS_TOGETHER = 200_000_000  #: of all that are decoded for a submission
FEWEST_PIXELS = 5_000_000  #: as which a picture counts at least, for it is written anew, in several sizes if need be
MOST_SCANS = 100  #: of a JPEG, each of which goes over the whole picture; those that load gradually have a dozen
_SCAN = b"\xff\xda"  # begins each
_BAND = 16  # a band so many times narrower, in the middle, shows how large a picture will be as PNG
MAX_SIDE = 20_000  #: pixels of its height and of its width as it comes; a strip of few pixels takes very long
LONGEST_SIDE = 1400  #: pixels, as it is stored; handwriting on a page can be read
MAX_STORED = 700_000  #: of a picture as it is stored; six of them are within 5 MB
_FORMATS = ("PNG", "JPEG", "GIF", "WEBP", "BMP")
_SMALLER = (LONGEST_SIDE, 1000, 700, 400)  # until it is within MAX_STORED

#: A picture in Markdown, ``![words](target)``: its target in angle brackets or not, with or without a title.
PICTURE = pattern(
    r"!\[(?P<alt>[^\]\n]{0,500})\]\(\s{0,9}(?:<(?P<in>[^<>\n]{1,1000})>|(?P<out>[^\s()<>]{1,1000}))"
    r"(?:[ \t][^()\n]{0,300})?\)"  # so that there is but one way to read it, and a long line takes no time
)
warnings.filterwarnings("ignore", category=Image.DecompressionBombWarning)  # sizes are looked at here, see _spend
#: Its words have no bracket, so that none is read more than once.
_IN_TEXT = pattern(r"(!\[[^\[\]\n]{0,500}\]\(\s{0,9}<?)data:image/[\w.+-]{1,30};base64,([A-Za-z0-9+/=]+)", CELL)


Attachments = Mapping[str, Mapping[str, str]]  #: of a cell: name → media type → base64


class PictureError(Exception):
    """A picture that is left out; ``problem`` says why."""

    def __init__(self, code: Code, **parameters: Any) -> None:
        super().__init__(code)
        self.problem = Problem.of(code, **parameters)


@dataclass
class Budget:
    """How many pixels may still be decoded for a submission."""

    left: int = MAX_PIXELS_TOGETHER


@dataclass
class Pictures:
    """The pictures of an answer.

    Attributes
    ----------
    text : of the answer, with a name in place of each picture in the text itself
    saved : name, as in the text (``attachment:name`` or a file's path) → PNG
    problems : what was left out, and why
    """

    text: str
    saved: dict[str, bytes] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)


def lifted(text: str) -> tuple[str, dict[str, dict[str, str]]]:
    """Replace the pictures in the text itself by names; return the text, and the pictures as attachments."""
    pictures: dict[str, dict[str, str]] = {}

    def name(match: re.Match[str]) -> str:
        pictures[f"in-text-{len(pictures) + 1}"] = {"image/*": match[2]}
        return f"{match[1]}attachment:in-text-{len(pictures)}"

    return _IN_TEXT.sub(name, text), pictures


def pictures_of(text: str, attachments: Attachments, files: Mapping[str, bytes], budget: Budget) -> Pictures:
    """Read the pictures that a text shows.

    Parameters
    ----------
    text : Markdown
    attachments : of its cell: name → media type → base64
    files : the student's own files beside the notebook: relative path → content
    budget : pixels that may still be decoded
    """
    text, inside = lifted(text)
    result = Pictures(text)
    shown = PICTURE.finditer(text, 0, json_values.LONGEST_PROSE)
    for target in dict.fromkeys(match["in"] or match["out"] for match in shown):
        if len(result.saved) == MOST_PICTURES:
            result.problems.append(Problem.of(Code.TOO_MANY_PICTURES, most=MOST_PICTURES))
            break
        try:
            result.saved[target] = as_png(_content(target, {**attachments, **inside}, files), budget)
        except PictureError as error:
            result.problems.append(Problem.of(Code.PICTURE_LEFT_OUT, picture=target, why=error.problem))
    return result


def _content(target: str, attachments: Attachments, files: Mapping[str, bytes]) -> bytes:
    """Return the content of the picture that a text names."""
    kind, _colon, name = target.partition(":")
    if kind == "attachment":
        # Jupyter Notebook 6 stores "a (1).png" as "a%20%281%29.png".
        for media, data in (attachments.get(name) or attachments.get(unquote(name), {})).items():
            if media.startswith("image/"):
                return decoded(data)
        raise PictureError(Code.PICTURE_NOT_IN_CELL)
    path = target.removeprefix("./")
    try:
        return files[path if path in files else unquote(path)]
    except KeyError:
        raise PictureError(Code.PICTURE_NOT_IN_NOTEBOOK) from None


def decoded(data: str) -> bytes:
    """Decode base64. Raises PictureError if it is too large or damaged."""
    _check_size(len(data) * 3 // 4 - 3)
    try:
        return base64.b64decode(data)
    except (binascii.Error, ValueError):
        raise PictureError(Code.PICTURE_DAMAGED) from None


def _check_size(size: int) -> None:
    if size > MAX_PICTURE:
        raise PictureError(Code.PICTURE_TOO_LARGE, most=MAX_PICTURE)


def as_png(data: bytes, budget: Budget) -> bytes:
    """Write a picture as a PNG of bounded size, with nothing but its pixels.

    Raises
    ------
    PictureError
        If it is too large, is damaged, or is of a format that is not read.
    """
    _check_size(len(data))
    try:
        with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
            if image.format == "JPEG" and data.count(_SCAN) > MOST_SCANS:
                raise PictureError(Code.PICTURE_UNUSUAL)
            _spend(image, budget)
            ImageOps.exif_transpose(image, in_place=True)
            return _packed(image)
    except PictureError:
        raise
    except Image.DecompressionBombError:
        raise PictureError(Code.PICTURE_OF_MANY_PIXELS, most=MAX_PIXELS // 1_000_000) from None
    except UnidentifiedImageError:
        raise PictureError(Code.PICTURE_OF_OTHER_FORMAT, formats=_FORMATS) from None
    except Exception:  # pillow raises all sorts of errors on what is damaged
        raise PictureError(Code.PICTURE_DAMAGED) from None


def _spend(image: Image.Image, budget: Budget) -> None:
    """Check the size that a picture's header states, before anything is decoded; a JPEG is decoded at a smaller one."""
    pixels = image.width * image.height
    if max(image.size) > MAX_SIDE:
        raise PictureError(Code.PICTURE_TOO_WIDE, most=MAX_SIDE)
    if pixels > MAX_PIXELS:
        raise PictureError(Code.PICTURE_OF_MANY_PIXELS, most=MAX_PIXELS // 1_000_000)
    image.draft("RGB", (LONGEST_SIDE, LONGEST_SIDE))
    pixels = max(image.width * image.height, FEWEST_PIXELS)
    if pixels > budget.left:
        raise PictureError(Code.PICTURES_OF_MANY_PIXELS)
    budget.left -= pixels


def _as_bytes(image: Image.Image) -> bytes:
    packed = io.BytesIO()
    image.save(packed, format="PNG", compress_level=4)  # of a photograph, three times as fast as 6, and 2 % larger
    return packed.getvalue()


def _packed(image: Image.Image) -> bytes:
    """Write a PNG, on white where the picture is transparent, and reduce it until it is small enough."""
    if image.mode in ("RGB", "RGBA", "L", "LA"):  # the others have to be decoded before they can be made smaller
        image.thumbnail((LONGEST_SIDE, LONGEST_SIDE), reducing_gap=2.0)
    if image.mode != "RGB":
        transparent = image.convert("RGBA")
        image = Image.new("RGB", transparent.size, "white")
        image.paste(transparent, mask=transparent.getchannel("A"))
    for side in _SMALLER:
        image.thumbnail((side, side))
        left = image.width // 2
        band = image.crop((left, 0, left + image.width // _BAND, image.height)) if image.width >= _BAND else image
        for colours in (Image.Image.copy, lambda it: it.quantize(128, Image.Quantize.FASTOCTREE)):
            if len(_as_bytes(colours(band))) * _BAND > 1.3 * MAX_STORED:
                continue
            if len(packed := _as_bytes(colours(image))) <= MAX_STORED:
                return packed
    raise PictureError(Code.PICTURE_NOT_REDUCED)

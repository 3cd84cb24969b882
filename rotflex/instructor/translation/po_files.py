"""Notebook → ``.po``: what there is to translate of it, with what was translated before.

An entry is a piece of a text cell; its context is the cell's id, so that the same words in two cells may be translated
differently. Where the source was changed, the earlier translation is a proposal (fuzzy), with the source as it was.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotflex.courseware import files, words
from rotflex.courseware.messages import _, is_language
from rotflex.errors import GradingError
from rotflex.instructor.translation import paragraphs

if TYPE_CHECKING:
    from polib import POEntry, POFile

FOLDER = "locale"  #: in the course's folder: translations
_NOTEBOOKS = "notebooks"  # there, in a language's folder
_ALIKE = 0.6  # from which similarity (0 to 1) on a piece counts as another's successor

Key = tuple[str, str]  # id of the cell, piece


def folder(course: Path, language: str) -> Path:
    """Where the translations of a course's notebooks into a language lie."""
    return course / FOLDER / language / _NOTEBOOKS


def file_of(course: Path, language: str, notebook: str) -> Path:
    """The file of a notebook's translation, which may not be there."""
    return folder(course, language) / f"{Path(notebook).stem}.po"


def check_language(language: str) -> None:
    """Raise GradingError unless a language is named as files are: "de", "pt_BR"."""
    if not is_language(language):
        raise GradingError(_("{language!a} names no language: it should be as de, or pt_BR.").format(language=language))


def languages(course: Path) -> list[str]:
    """Those into which notebooks of a course are translated, at least in part."""
    return sorted({path.parent.parent.name for path in (course / FOLDER).glob(f"*/{_NOTEBOOKS}/*.po")})


def read(path: Path) -> POFile:
    """A ``.po`` file; an empty one where there is none.

    Raises
    ------
    GradingError
        If it cannot be read.
    """
    import polib

    if not path.exists():
        return polib.POFile()
    try:
        return polib.pofile(str(path), encoding="utf-8")
    except (OSError, ValueError) as error:
        raise GradingError(
            _("{path} cannot be read as a file of translations (.po): {error}").format(path=path, error=error)
        ) from None


def update(notebook: Mapping[str, Any], name: str, course: Path, language: str) -> None:
    """Bring the file of a notebook's translation up to date, and make it if there is none; see :func:`updated`.

    Raises
    ------
    GradingError
        If it is there and cannot be read.
    """
    path = file_of(course, language, name)
    made = updated(notebook, name, language, read(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    files.write(path, str(made).rstrip("\n") + "\n")


def keys(notebook: Mapping[str, Any]) -> list[Key]:
    """What is to be translated of a notebook, each once, in order."""
    return list(dict.fromkeys((str(cell["id"]), text) for cell in cells(notebook) for text in pieces_of(cell)))


def cells(notebook: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """The text cells of a notebook that students see, and that have words to translate."""
    for cell in notebook["cells"]:
        tags = cell.get("metadata", {}).get("tags", ())
        if cell["cell_type"] == "markdown" and words.INSTRUCTOR not in tags and pieces_of(cell):
            yield cell


def pieces_of(cell: Mapping[str, Any]) -> list[str]:
    """What is to be translated of a text cell."""
    return paragraphs.to_translate(words.source_of(cell))


def updated(notebook: Mapping[str, Any], name: str, language: str, before: POFile) -> POFile:
    """The file of a notebook as it is now.

    Parameters
    ----------
    notebook : the course's own
    name : of its file
    language : as "de"
    before : the file as it was; translations of pieces that are gone are kept in it as obsolete
    """
    import polib

    made = polib.POFile()
    made.header = before.header or _HEADER.format(name=name)
    made.metadata = {
        **before.metadata,
        "Project-Id-Version": name,
        "Language": language,
        "MIME-Version": "1.0",
        "Content-Type": "text/plain; charset=UTF-8",
        "Content-Transfer-Encoding": "8bit",
    }
    wanted = keys(notebook)
    left: dict[Key, POEntry] = {}
    for entry in before:
        key = (entry.msgctxt or "", entry.msgid)
        if key not in left or left[key].obsolete:  # what counts now before what counted once
            left[key] = entry
    taken = {key: left.pop(key) for key in wanted if key in left}
    for key in wanted:
        made.append(_as_it_was(key, taken[key]) if key in taken else _new(key, left))
    for entry in left.values():
        if entry.msgstr:
            entry.obsolete = True
            made.append(entry)
    return made


_HEADER = """\
Translation of the text cells of {name}: rotflex translate makes and updates this file.
Formulas, code, link targets, tags and numbers have to be as in the source; else a cell stays untranslated."""


def _as_it_was(key: Key, entry: POEntry) -> POEntry:
    entry.obsolete = False
    entry.msgctxt, entry.msgid = key
    return entry


def _new(key: Key, left: dict[Key, POEntry]) -> POEntry:
    """An entry for a piece that had none: with the translation of what it was before, if that can be told."""
    import polib

    cell, text = key
    moved = next((one for one in left if one[1] == text and left[one].msgstr), None)
    if moved is not None:  # the same words, in a cell of another id
        entry = left.pop(moved)
        return polib.POEntry(msgctxt=cell, msgid=text, msgstr=entry.msgstr, flags=[*entry.flags])
    older = _most_alike(text, [one for one in left if one[0] == cell and left[one].msgstr])
    if older is None:
        return polib.POEntry(msgctxt=cell, msgid=text)
    entry = left.pop(older)
    source = entry.previous_msgid if entry.fuzzy and entry.previous_msgid else entry.msgid
    return polib.POEntry(
        msgctxt=cell, msgid=text, msgstr=entry.msgstr, flags=["fuzzy"], previous_msgid=source, tcomment=entry.tcomment
    )


def _most_alike(text: str, candidates: Sequence[Key]) -> Key | None:
    ratios = {one: difflib.SequenceMatcher(None, one[1], text, autojunk=False).ratio() for one in candidates}
    best = max(ratios, key=lambda one: ratios[one], default=None)
    return best if best is not None and ratios[best] >= _ALIKE else None

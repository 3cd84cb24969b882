"""A student's answers in words, as the notebooks beside answers.json hold them: read from the saved files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from labcourse import files
from labcourse.answers import handed_in, words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.handed_in import NotebookError
from labcourse.answers.words import Where

MAX_BYTES = 100_000_000  #: of a notebook, with all of its outputs


class SavedWords:
    """The words in the notebooks of a folder, read again when a file has changed.

    Parameters
    ----------
    folder : where the notebooks are
    catalogue : of the course; it names them

    Attributes
    ----------
    notices : what could not be read, or not as it is, that the student should know; and what is asked about
    """

    def __init__(self, folder: Path, catalogue: Catalogue) -> None:
        self.notices: list[str] = []
        self._catalogue = catalogue
        self._paths = [folder / f"{name}.ipynb" for name in catalogue.notebooks]
        self._known: dict[Path, tuple[int, ...] | None] = {}
        self._found: dict[Path, dict[Where, str]] = {}
        self._asked: set[str] = set()  # each question once, and not at each saving

    def refresh(self) -> None:
        """Read the notebooks that have been saved since."""
        for path in self._paths:
            seen = _identity(path)
            if path not in self._known or seen != self._known[path]:
                self._known[path] = seen
                self._found[path] = self._read(path) if seen else {}

    def get(self, question: str, part: str) -> dict[str, Any] | None:
        """An answer as plain data, as :func:`labcourse.answers.forms.encode` gives it, or None."""
        for path in self._paths:
            text = self._found.get(path, {}).get((question, part))
            if text is not None:
                return {"kind": "prose", "value": text}
        return None

    def _read(self, path: Path) -> dict[Where, str]:
        try:
            data = files.read(path, MAX_BYTES)
            cells = handed_in.cells_of(data)
        except (OSError, NotebookError) as error:
            self.notices.append(f"{path.name} could not be read for answers in words: {files.reason(error)}")
            return {}
        masters = words.own_masters(handed_in.document(data)["cells"])
        written = words.written(masters, cells, with_pictures=False)
        self.notices.extend(f"{path.name}: {problem}" for problem in written.problems)
        asked = [f"{path.name}: {question}" for question in written.asked]
        self.notices.extend(question for question in asked if question not in self._asked)
        self._asked.update(asked)
        return {where: found.text for where, found in written.words.items()}


def _identity(path: Path) -> tuple[int, ...] | None:
    """What tells a file from any other that bears, or bore, its name; None where there is none."""
    try:
        seen: os.stat_result = path.stat()
    except OSError:
        return None
    return seen.st_dev, seen.st_ino, seen.st_size, seen.st_mtime_ns

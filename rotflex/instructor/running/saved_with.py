"""Find the Python that a student's notebooks were saved with, which Jupyter writes into each behind its cells."""

from __future__ import annotations

import contextlib
import re
from itertools import islice

from rotflex.courseware.run.portability import Version, version
from rotflex.instructor.running.intake import Submission, limits
from rotflex.instructor.running.intake.stores import Unreadable, opened

_ABOUT = b'"language_info"'
_LONGEST = 2_000  # characters of what Jupyter writes of the language
_VERSION = re.compile(rb'"version"\s*:\s*"([\d.]+)')
_MOST = 30  # notebooks of a piece that are looked at; a course has as many


def python_of(submission: Submission) -> Version | None:
    """Return the newest Python that a notebook of a submission was saved with; None if none says so."""
    found = []
    for piece in submission.pieces:
        paths = islice((path for path in piece.files if path.endswith(".ipynb")), _MOST)
        with contextlib.suppress(Unreadable), opened(piece.where) as store:
            for path in paths:
                found.append(_saved_with(store.read(piece.files[path].key, limits.MAX_NOTEBOOK_FILE)))
    return max(filter(None, found), default=None)


def _saved_with(notebook: bytes) -> Version | None:
    about = notebook.rpartition(_ABOUT)[2][:_LONGEST]
    said = _VERSION.search(about)
    return version(said[1].decode()) if said else None

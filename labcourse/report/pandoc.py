"""Pandoc, which reads Markdown and writes typst's markup and HTML. It opens no file that a text names."""

from __future__ import annotations

import json
import secrets
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from labcourse.errors import CourseError

#: As a notebook reads Markdown. Raw HTML is read as such, so that it can be left out (labcourse.report.tree).
_MARKDOWN = "commonmark+tex_math_dollars+pipe_tables+strikeout+footnotes+autolink_bare_uris"
_PATIENCE = 60  # s for a report; it takes a tenth of one, on a slow machine some
_MEMORY = "1G"  # of pandoc's own

Node = dict[str, Any]  # of pandoc's tree: {"t": type, "c": content}


class ReportError(CourseError):
    """A report that cannot be made; the message says why, and what to do."""


def program() -> str:
    """The path of pandoc.

    Raises
    ------
    ReportError
        If it is not installed.
    """
    try:
        import pypandoc

        return str(pypandoc.get_pandoc_path())
    except (ImportError, OSError):
        raise ReportError("pandoc is not installed.") from None


def read(texts: Sequence[str]) -> list[list[Node]]:
    """The blocks of each of some Markdown texts. No text can reach into another.

    Raises
    ------
    ReportError
        If pandoc cannot read them.
    """
    between = secrets.token_hex(16)
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "m").write_text(between, encoding="utf-8")
        for place, text in enumerate(texts):
            Path(folder, str(place)).write_text(text, encoding="utf-8")
        names = [name for place in range(len(texts)) for name in (str(place), "m")]
        said = _run(["--file-scope", "-f", _MARKDOWN, "-t", "json", *names], b"", folder)
    found: list[list[Node]] = [[]]
    try:
        blocks = json.loads(said)["blocks"]
    except RecursionError:
        raise ReportError("A text has lists or quotes within each other too many times; make it plainer.") from None
    for block in blocks:
        if block["t"] == "Para" and block["c"] == [{"t": "Str", "c": between}]:
            found.append([])
        else:
            found[-1].append(block)
    return found[: len(texts)]


def write(blocks: Sequence[Node], into: str, options: Sequence[str] = ()) -> tuple[str, dict[str, str]]:
    """Blocks in another format.

    Parameters
    ----------
    blocks : of pandoc's tree
    into : "typst" or "html5"
    options : more of pandoc's

    Returns
    -------
    str
        The text.
    dict
        LaTeX of each formula that is not understood → what pandoc says of it.
    """
    content = json.dumps({"pandoc-api-version": [1, 23, 1, 1], "meta": {}, "blocks": list(blocks)})
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "log.json")
        said = _run(["-f", "json", "-t", into, "--wrap=none", f"--log={log}", *options], content.encode(), folder)
        entries: list[Mapping[str, Any]] = json.loads(log.read_text(encoding="utf-8")) if log.exists() else []
    refused = {
        str(entry.get("contents")): str(entry.get("message", "")).strip()
        for entry in entries
        if entry.get("type") == "CouldNotConvertTeXMath"
    }
    return said.decode("utf-8"), refused


def _run(words: Sequence[str], content: bytes, folder: str) -> bytes:
    try:
        done = subprocess.run(
            [program(), "+RTS", f"-M{_MEMORY}", "-RTS", "--sandbox", *words],
            input=content,
            capture_output=True,
            cwd=folder,
            timeout=_PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ReportError(f"pandoc took more than {_PATIENCE} s.") from None
    except OSError as error:
        raise ReportError(f"pandoc cannot be started: {error.strerror}.") from None
    if done.returncode:
        why = done.stderr.decode("utf-8", "replace").strip()
        raise ReportError(f"pandoc could not read or write the report: {why[-500:]}")
    return done.stdout

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

#: Markdown as a notebook shows it. HTML is always read as such, and left out afterwards (labcourse.report.markup).
_MARKDOWN = (
    "commonmark-raw_attribute-attributes+tex_math_dollars+pipe_tables+strikeout+footnotes+autolink_bare_uris"
    "+implicit_figures"
)
#: The page's title is the heading of level 1; its contents have parts and sections.
_OPTIONS = {"html5": ["--mathml", "--shift-heading-level-by=1", "--toc", "--toc-depth=3"], "typst": []}
_TIMEOUT = 60  # s; a report takes a tenth of a second
_MEMORY = "1G"  # of pandoc's own

Node = dict[str, Any]  # of pandoc's document: {"t": type, "c": content}


class ReportError(CourseError):
    """A report that cannot be made; the message says why, and what to do."""


def read(texts: Sequence[str]) -> list[list[Node]]:
    """Read some Markdown texts, each by itself, and return the blocks of each.

    Raises
    ------
    ReportError
        If pandoc is missing or cannot read them.
    """
    separator = secrets.token_hex(16)
    inputs = {f"{index}.md": text for index, text in enumerate(texts)}
    names = [name for text in inputs for name in (text, "separator.md")]
    output, _log = _run(["--file-scope", "-f", _MARKDOWN, "-t", "json", *names], {**inputs, "separator.md": separator})
    blocks: list[list[Node]] = [[]]
    for block in json.loads(output)["blocks"]:
        if block["t"] == "Para" and block["c"] == [{"t": "Str", "c": separator}]:
            blocks.append([])
        else:
            blocks[-1].append(block)
    return blocks[: len(texts)]


def write(blocks: Sequence[Node], to: str, template: str = "", **values: str) -> tuple[str, dict[str, str]]:
    """Write blocks in another format.

    Parameters
    ----------
    blocks : of pandoc's document
    to : "typst" or "html5"
    template : text of a template; "" for none
    values : for the template

    Returns
    -------
    str
        The text.
    dict
        LaTeX of each formula that pandoc does not understand → the reason.
    """
    meta = {name: {"t": "MetaString", "c": value} for name, value in values.items()}  # pandoc escapes them
    document = {"pandoc-api-version": [1, 23, 1, 1], "meta": meta, "blocks": list(blocks)}
    inputs = {"document.json": json.dumps(document), "template.html": template}
    options = [*_OPTIONS[to], *(["--template=template.html"] if template else [])]
    output, log = _run(["-f", "json", "-t", to, "--wrap=none", "--eol=lf", *options, "document.json"], inputs)
    refused = {entry["contents"]: entry["message"] for entry in log if entry["type"] == "CouldNotConvertTeXMath"}
    return output, refused


def _run(options: Sequence[str], inputs: Mapping[str, str]) -> tuple[str, list[dict[str, str]]]:
    """Run pandoc on some files; return its output and its log."""
    try:
        import pypandoc

        program = pypandoc.get_pandoc_path()
    except (ImportError, OSError):
        raise ReportError("pandoc is not installed.") from None
    with tempfile.TemporaryDirectory() as folder:
        for name, text in inputs.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        command = [program, "+RTS", f"-M{_MEMORY}", "-RTS", "--sandbox", "--log=log", *options]
        try:
            done = subprocess.run(command, capture_output=True, cwd=folder, timeout=_TIMEOUT, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise ReportError(f"pandoc cannot be run: {error}") from None
        if done.returncode:
            reason = done.stderr.decode("utf-8", "replace").strip()
            raise ReportError(f"pandoc could not read or write the report: {reason[-500:]}")
        return done.stdout.decode("utf-8"), json.loads(Path(folder, "log").read_text(encoding="utf-8"))

"""The catalogues of messages: gather what is said in the source, bring translations up to date, compile them.

    python tools/messages.py            # gather, update each language's .po, compile, and say what is missing
    python tools/messages.py --new fr   # begin a language
    python tools/messages.py --check    # change nothing: exit code 1 where a catalogue is not up to date or not whole

There are three catalogues, so that no student gets what is the instructor's (docs/languages.md).
"""

from __future__ import annotations

import argparse
import ast
import io
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from babel.messages.catalog import Catalog
from babel.messages.extract import extract
from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po, write_po

ROOT = Path(__file__).resolve().parents[1]
TEMPLATE = "messages.pot"
#: ``_``, and its like: which of their arguments are messages.
KEYWORDS = {"_": None, "N_": None, "plural": (2, 3)}
_WIDTH = 120


@dataclass(frozen=True)
class Domain:
    """A catalogue: whose it is, and what of the source it holds.

    Attributes
    ----------
    name : in the catalogues' heads
    folder : in which it lies
    sources : folders and files that are read
    left_out : of these, what no student reads
    """

    name: str
    folder: str
    sources: tuple[str, ...]
    left_out: tuple[str, ...] = ()

    def files(self) -> list[Path]:
        """The files that are read, in order."""
        found = []
        for source in self.sources:
            place = ROOT / source
            found += [place] if place.is_file() else [path for path in place.rglob("*") if path.suffix in _METHODS]
        return sorted(path for path in found if not self._is_left_out(path))

    def _is_left_out(self, path: Path) -> bool:
        name = PurePosixPath(path.relative_to(ROOT).as_posix())
        return any(name.is_relative_to(other) for other in self.left_out)

    @property
    def locale(self) -> Path:
        """The folder of the template and of each language's catalogue."""
        return ROOT / self.folder / "locale"


#: What a head says; no version of a library, nor anybody's address.
_HEADS = ("Project-Id-Version", "Language", "Plural-Forms", "MIME-Version", "Content-Type", "Content-Transfer-Encoding")


class _Catalog(Catalog):
    """A catalogue whose head is the same whoever writes it, and whenever."""

    def _of_interest(self) -> list[tuple[str, str]]:
        return [(name, value) for name, value in Catalog.mime_headers.fget(self) if name in _HEADS]

    mime_headers = property(_of_interest, Catalog.mime_headers.fset)


def said_in(
    file: BinaryIO, *_unused: object, **_options: object
) -> Iterator[tuple[int, str, list[str | None], list[str]]]:
    """The calls of a module, as Babel wants them. Babel's own reader passes over calls inside f-strings and calls."""
    calls = [node for node in ast.walk(ast.parse(file.read())) if isinstance(node, ast.Call)]
    for node in sorted(calls, key=lambda node: (node.lineno, node.col_offset)):
        match node.func:
            case ast.Name(id=name) | ast.Attribute(attr=name) if name in KEYWORDS:
                values = [getattr(one, "value", None) for one in node.args]
                yield node.lineno, name, [one if isinstance(one, str) else None for one in values], []


_METHODS = {".py": said_in, ".html": "jinja2.ext:babel_extract"}
DOMAINS = (
    Domain(
        "rotflex",
        "rotflex",
        ("rotflex",),
        # A laboratory's bench is set up by whoever runs it, in English.
        (
            "rotflex/instructor",
            "rotflex/bench_doctor",
            "rotflex/commissioning",
            "rotflex/courseware/report/page.html",  # pandoc's, and has no words
            "rotflex/hil/bench_file.py",
            "rotflex/hil/serial",
        ),
    ),
    Domain(
        "rotflex-instructor",
        "rotflex/instructor",
        (
            "rotflex/instructor/accounts",
            "rotflex/instructor/graded_run.py",
            "rotflex/instructor/marking",
            "rotflex/instructor/release/student_course.py",
            "rotflex/instructor/reports",
            "rotflex/instructor/running",
            "rotflex/instructor/verdicts.py",
        ),
        # What these say is for instructors alone.
        (
            "rotflex/instructor/marking/marking_processes.py",
            "rotflex/instructor/marking/unit_words.py",
            "rotflex/instructor/reports/changes.py",
            "rotflex/instructor/reports/grades_table.py",
            "rotflex/instructor/reports/live_report.py",
            "rotflex/instructor/running/bundles.py",
            "rotflex/instructor/running/executors.py",
            "rotflex/instructor/running/inside",
            "rotflex/instructor/running/isolation_report.py",
        ),
    ),
    Domain(
        "rotflex-course",
        "solutions",
        ("solutions",),
        ("solutions/conftest.py", "solutions/real_benches.py", "solutions/stated.py"),
    ),
)


# --- the source -------------------------------------------------------------------------------------------------------


def gathered(domain: Domain, known: Catalog | None = None) -> Catalog:
    """The messages of a domain, as they stand in the source, by file.

    Parameters
    ----------
    domain : whose
    known : what another catalogue has already, which is left out
    """
    catalog = _catalog(domain)
    for path in domain.files():
        with path.open("rb") as file:
            found = list(extract(_METHODS[path.suffix], file, KEYWORDS, (), {"encoding": "utf-8"}))
        for _line, message, _comments, _context in found:
            one = message if isinstance(message, str) else message[0]
            if one and (known is None or one not in known):
                place = path.relative_to(ROOT).as_posix()
                catalog.add(message, locations=[(place, 0)])
    return catalog


def templates() -> Iterator[tuple[Domain, Catalog]]:
    """Each domain with its messages; a message that students' catalogue has stands in no other."""
    students = gathered(DOMAINS[0])
    yield DOMAINS[0], students
    for domain in DOMAINS[1:]:
        yield domain, gathered(domain, students)


def _catalog(domain: Domain, language: str | None = None) -> Catalog:
    head = f"# Messages of {domain.name}. docs/languages.md says how they are translated."
    return _Catalog(language, project=domain.name, version="1", header_comment=head, fuzzy=False)


# --- the files --------------------------------------------------------------------------------------------------------


def as_po(catalog: Catalog) -> bytes:
    """A template or a language's catalogue, as its file holds it: by file, without the numbers of lines."""
    text = io.BytesIO()
    write_po(text, catalog, width=_WIDTH, sort_by_file=True, include_lineno=False)
    return text.getvalue()


def as_mo(catalog: Catalog) -> bytes:
    """A language's catalogue, as gettext reads it."""
    binary = io.BytesIO()
    write_mo(binary, catalog)
    return binary.getvalue()


def read(path: Path) -> Catalog:
    """A language's catalogue."""
    with path.open("rb") as file:
        return read_po(file, locale=path.stem, abort_invalid=True)


def updated(path: Path, domain: Domain, template: Catalog) -> Catalog:
    """A language's catalogue with all that is said today. What is said no more is kept at its end, as a comment."""
    catalog = _catalog(domain, path.stem)
    for message in read(path) if path.exists() else ():
        if message.id:
            catalog.add(message.id, message.string, user_comments=message.user_comments, flags=message.flags)
    if path.exists():
        catalog.obsolete = read(path).obsolete
    catalog.update(template, no_fuzzy_matching=True)
    catalog.header_comment = template.header_comment
    return catalog


def languages(domain: Domain) -> list[Path]:
    """Each language's catalogue of a domain."""
    return sorted(domain.locale.glob("*.po"))


def faults(catalog: Catalog) -> Iterator[str]:
    """What keeps a catalogue from being whole: a message without its translation, or one that is only guessed."""
    for message in catalog:
        if not message.id:
            continue
        shown = message.id if isinstance(message.id, str) else message.id[0]
        strings = [message.string] if isinstance(message.string, str) else list(message.string)
        if not strings or not all(strings):
            yield f"not translated: {shown!r}"
        elif message.fuzzy:
            yield f"fuzzy: {shown!r}"


def wanted(new: str = "") -> Iterator[tuple[Path, bytes]]:
    """Each file of the catalogues, and what it should hold.

    Parameters
    ----------
    new : a language to begin
    """
    for domain, template in templates():
        yield domain.locale / TEMPLATE, as_po(template)
        paths = languages(domain)
        if new:
            paths = sorted({*paths, domain.locale / f"{new}.po"})
        for path in paths:
            catalog = updated(path, domain, template)
            yield path, as_po(catalog)
            yield path.with_suffix(".mo"), as_mo(catalog)


def main(arguments: list[str] | None = None) -> int:
    """The program; 0 where all is up to date and whole."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="change nothing")
    parser.add_argument("--new", default="", metavar="LANGUAGE", help="begin a language, as fr")
    given = parser.parse_args(arguments)
    stale = 0
    for path, content in list(wanted(given.new)):
        if path.exists() and path.read_bytes() == content:
            continue
        stale += 1
        if given.check:
            print(f"{path.relative_to(ROOT)} is not up to date: python tools/messages.py")
        else:
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(content)
    missing = 0
    for domain in DOMAINS:
        for path in languages(domain):
            catalog = read(path)
            left = list(faults(catalog))
            missing += len(left)
            print(f"{path.relative_to(ROOT)}: {len(catalog)} messages, {len(left)} without a translation")
    return int(bool(given.check and stale) or bool(missing))


if __name__ == "__main__":
    sys.exit(main())

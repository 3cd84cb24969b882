"""What Sphinx gets to see: a folder with the pages of one site, and nothing else.

There are two sites. The public one may be read by students, so no page that gives an answer away is copied into it. The
instructors' has these pages, too. Pages lie in groups, and a group's table of contents takes all that is in it: a new
page in ``docs/`` appears by itself.

In the repository a link is the path from one file to another, as any code host has it. Here it becomes a link to the
page; to a file that is no page, it becomes the file's name, or a link to the code host where one is given.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from rotflex.errors import RotflexError

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"

#: Pages that give answers away: in the instructors' site alone. Patterns of paths below ``docs/``.
FOR_INSTRUCTORS = ("errata_answers.md", "derivation.html", "guide/*", "reference/answers.md")

#: Group → its pages in ``docs/``, without ``.md``. What is in none is in ``MORE``.
GROUPS = {
    "": ("index", "student", "instructor", "maintainer"),
    "start": ("without_installing", "jupyterhub"),
    "benches": ("own_bench", "real_bench", "real_bench_marks", "serial_bench", "matlab_and_octave"),
    "class": ("settings_and_releases", "handing_in", "scoring", "class", "outcomes", "platforms"),
    "project": ("architecture", "new_course", "errata", "errata_answers"),
}
MORE = "more"
FROM_ROOT = {"CONTRIBUTING.md": "project/contributing.md", "CHANGELOG.md": "project/changes.md"}
#: File of the repository → page that has the same in it.
SAME = {
    "README.md": "index.md",
    "LICENSE": "project/licence.md",
    "docs/derivation.html": "chapters/90_derivation.ipynb",
}
#: Kinds of files that pages show or hand out; they are copied.
HANDED_OUT = (".png", ".svg", ".jpg", ".gif", ".m", ".toml", ".csv", ".ino")

_FENCE = re.compile(r"^( *)(```+|~~~+).*?^\1\2 *$", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)", re.DOTALL)
_CONTENTS = re.compile(r"^(```\{toctree\}\n(?::[^\n]*\n)*\n)(.*?)\n```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")


class DeadLink(RotflexError):
    """A link of a page leads to a file that is not there."""


@dataclass
class Stage:
    """A folder for Sphinx.

    Attributes
    ----------
    folder : where it is
    instructors : whether it is the instructors' site
    code : address of the repository's files on a code host; without one, files that are no pages are only named
    pages : file of the repository → page, both as paths with slashes
    """

    folder: Path
    instructors: bool = False
    code: str = ""
    pages: dict[str, str] = field(default_factory=dict)

    def write(self) -> None:
        """Copy all pages, with their links as they have to be there.

        Raises
        ------
        DeadLink
            If a page links to a file that is not in the repository.
        """
        self.pages = {**dict(_pages(self.instructors)), **FROM_ROOT, **self._notebooks()}
        for source, page in self.pages.items():
            if source.endswith(".md"):
                text = (ROOT / source).read_text(encoding="utf-8")
                self.add(page, self._listed(self.relinked(text, source, page), page))
        licence = (ROOT / "LICENSE").read_text(encoding="utf-8")
        self.add(SAME["LICENSE"], f"# Licence\n\n```text\n{licence}```\n")

    def add(self, page: str, text: str) -> None:
        """Write a page."""
        path = self.folder / page
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")

    def relinked(self, text: str, source: str, page: str) -> str:
        """A text of the repository's file ``source`` with its links as ``page`` needs them."""

        def replaced(found: re.Match[str]) -> str:
            picture, words, target = found.groups()
            if re.match(r"[a-z]+:|#", target):
                return found[0]
            name, hash_, anchor = target.partition("#")
            path = os.path.normpath(PurePosixPath(source).parent / name).replace(os.sep, "/")
            if not (ROOT / path).exists():
                raise DeadLink(f"{source}: the link to {target} leads nowhere: there is no file {path}.")
            there = self.pages.get(path) or self.pages.get(SAME.get(path, "")) or SAME.get(path, "")
            if there and (there in self.pages.values() or path == "LICENSE"):
                return f"[{words}]({_from(page, there)}{hash_}{anchor})"
            if path.startswith("docs/") and not self.instructors and is_for_instructors(path):
                return f"{words} (in the instructors' site)"
            if path.endswith(HANDED_OUT) and not path.startswith(("solutions/", "rotflex/instructor/")):
                return f"{picture}[{words}]({_from(page, self._handed_out(path))})"
            if self.code:
                return f"[{words}]({self.code.rstrip('/')}/{path})"
            return words if path.strip("/") in words else f"{words} (`{path}`)"

        return outside_code(text, lambda piece: _LINK.sub(replaced, piece))

    def _listed(self, text: str, page: str) -> str:
        """A text whose tables of contents name pages of this site alone: a group may be empty, or for instructors."""
        folder = PurePosixPath(page).parent
        there = [PurePosixPath(one).with_suffix("") for one in (*self.pages.values(), SAME["LICENSE"])]

        def kept(found: re.Match[str]) -> str:
            head, entries = found[1], found[2].split("\n")
            entries = [one for one in entries if one and any(name.match((folder / one).as_posix()) for name in there)]
            return f"{head}{chr(10).join(entries)}\n```" if entries else ""

        return _CONTENTS.sub(kept, text)

    def _handed_out(self, path: str) -> str:
        target = self.folder / "files" / PurePosixPath(path).name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / path, target)
        return f"files/{target.name}"

    def _notebooks(self) -> Mapping[str, str]:
        """The chapters; for instructors, those with solutions beside them."""
        found = {f"notebooks/{path.name}": f"chapters/{path.name}" for path in (ROOT / "notebooks").glob("*.ipynb")}
        if self.instructors:
            for path in (ROOT / "solutions").glob("*.ipynb"):
                group = "chapters" if path.name.startswith("9") else "solutions"
                found[f"solutions/{path.name}"] = f"{group}/{path.name}"
        return found


def outside_code(text: str, change: Callable[[str], str]) -> str:
    """A Markdown text whose pieces outside of code were changed."""
    spans = sorted((found.span() for found in _FENCE.finditer(text)), key=lambda span: span[0])
    pieces, at = [], 0
    for begin, end in [*spans, (len(text), len(text))]:
        prose = text[at:begin]
        inline = 0
        for found in _CODE.finditer(prose):
            before = prose[inline : found.start()]
            # A link's words may be code; what is code and no link's words stays.
            if before.endswith("[") and prose[found.end() :].startswith("]("):
                continue
            pieces.append(change(before))
            pieces.append(found[0])
            inline = found.end()
        pieces.append(change(prose[inline:]))
        pieces.append(text[begin:end])
        at = end
    return "".join(pieces)


def _pages(instructors: bool) -> Iterator[tuple[str, str]]:
    """File of the repository → page, of all Markdown below ``docs/``."""
    for path in sorted(DOCS.rglob("*.md")):
        inside = path.relative_to(DOCS)
        name = f"docs/{inside.as_posix()}"
        if inside.parts[0].startswith("_") or (is_for_instructors(name) and not instructors):
            continue
        yield name, (PurePosixPath(_group(inside)) / inside.name).as_posix()


def _group(inside: Path) -> str:
    if len(inside.parts) > 1:
        return inside.parent.as_posix()
    return next((group for group, pages in GROUPS.items() if inside.stem in pages), MORE)


def is_for_instructors(path: str) -> bool:
    return any(PurePosixPath(path).match(f"docs/{pattern}") for pattern in FOR_INSTRUCTORS)


def _from(page: str, target: str) -> str:
    """The way from one page to another file of the folder."""
    return os.path.relpath(target, PurePosixPath(page).parent).replace(os.sep, "/")

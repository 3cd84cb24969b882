"""The pages of a site as they were built: where their links lead, and how far each is from the front page."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from html.parser import HTMLParser
from pathlib import Path
from posixpath import dirname, join, normpath
from urllib.parse import unquote, urlsplit

FRONT = "index.html"
_LEADS = {"a": "href", "link": "href", "area": "href"}
_LOADS = {"img": "src", "script": "src", "iframe": "src", "source": "src", "object": "data"}


class _Reader(HTMLParser):
    """What a page has: anchors, links, files that it loads, words."""

    def __init__(self) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.words = 0
        self._unread = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors.update(filter(None, (given.get("id"), given.get("name") if tag == "a" else None)))
        name = _LEADS.get(tag) or _LOADS.get(tag)
        if name and given.get(name):
            self.links.append(given[name])
        self._unread += tag in ("script", "style")

    def handle_endtag(self, tag: str) -> None:
        self._unread -= tag in ("script", "style")

    def handle_data(self, data: str) -> None:
        if not self._unread:
            self.words += len(data.split())


@dataclass(frozen=True)
class Built:
    """A built site."""

    folder: Path

    @cached_property
    def pages(self) -> dict[str, _Reader]:
        """Path from the front page's folder → what is on the page."""
        found = {}
        for path in sorted(self.folder.rglob("*.html")):
            reader = _Reader()
            reader.feed(path.read_text(encoding="utf-8"))
            found[path.relative_to(self.folder).as_posix()] = reader
        return found

    def targets(self, page: str) -> Iterator[tuple[str, str, str]]:
        """Links of a page that stay in the site: as written, the file, the anchor."""
        for link in self.pages[page].links:
            parts = urlsplit(link)
            if not parts.scheme and not parts.netloc:
                path = normpath(join(dirname(page), unquote(parts.path))) if parts.path else page
                yield link, path, unquote(parts.fragment)

    @cached_property
    def outside(self) -> dict[str, set[str]]:
        """Links that leave the site → pages that have them."""
        found: dict[str, set[str]] = {}
        for page, reader in self.pages.items():
            for link in reader.links:
                if urlsplit(link).netloc:
                    found.setdefault(link, set()).add(page)
        return found

    def dead(self) -> list[str]:
        """Links that lead to no file, or to no anchor of a page."""
        found = []
        for page in self.pages:
            for link, path, anchor in self.targets(page):
                if not (self.folder / path).is_file():
                    found.append(f"{page}: {link}: there is no {path}")
                elif anchor and path in self.pages and anchor not in self.pages[path].anchors:
                    found.append(f"{page}: {link}: {path} has no anchor {anchor}")
        return found

    def clicks(self) -> dict[str, int]:
        """Page → the fewest clicks from the front page, of those that can be reached."""
        far, waiting = {FRONT: 0}, [FRONT]
        for page in waiting:
            for _link, path, _anchor in self.targets(page):
                if path in self.pages and path not in far:
                    far[path] = far[page] + 1
                    waiting.append(path)
        return far

    def words(self) -> int:
        """Of all pages, their menus included."""
        return sum(reader.words for reader in self.pages.values())

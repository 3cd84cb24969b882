"""A language that nobody speaks: each message between marks, so that it shows what was looked up, and what was not."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import messages as catalogues
from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po

from rotflex.courseware import messages

LANGUAGE = "eo"
BEGIN, END = "[¡", "¡]"


def marked(text: str) -> str:
    return f"{BEGIN}{text}{END}"


def write(folder: Path) -> None:
    """Put the catalogue of all three domains' messages into a folder."""
    made = Catalog(LANGUAGE, fuzzy=False)
    for domain in catalogues.DOMAINS:
        with (domain.locale / catalogues.TEMPLATE).open("rb") as file:
            for message in read_po(file):
                if message.id:
                    made.add(message.id, _marked(message.id))
    folder.mkdir(exist_ok=True)
    (folder / f"{LANGUAGE}.mo").write_bytes(catalogues.as_mo(made))


def _marked(message: str | tuple[str, ...]) -> str | tuple[str, ...]:
    return marked(message) if isinstance(message, str) else tuple(map(marked, message))


@contextmanager
def folder_of_catalogues(folder: Path) -> Iterator[None]:
    """Look into this folder, too; afterwards all is as before."""
    before = list(messages._folders), messages._spoken
    messages.add(folder)
    try:
        yield
    finally:
        messages._folders[:], messages._spoken = before

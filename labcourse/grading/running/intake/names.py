"""Names of files as people would read them, and the forms by which they are compared.

A Mac takes an ü apart. Zips of before 2006, and some since, do not say in which code their names are written; programs
that unpack them then guess, and ``JÃ¼rgen`` or ``J├╝rgen`` comes out. That is a name as good as any: what it was before
is told by a roster, or by what a student's files say.
"""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Collection, Iterator

from labcourse import messages
from labcourse.answers.own_files import RECEIPTS

_READ_AS = ("cp437", "cp1252", "latin-1")  # in which code UTF-8 is read by mistake, or another one
_WRITTEN_IN = ("utf-8", "cp850", "cp1252")
_ZIPS_CODE = "cp437"  # in which names in a zip are read that do not say theirs
HIDDEN = (".", "__MACOSX", "~$")  #: beginnings of names that nobody means to hand in
_SYSTEM = {"thumbs.db", "desktop.ini", "icon\r"}
LONGEST_SHOWN = 120  #: characters of a name in a message
_MOST_SHOWN = 5  # names in one


def readable(name: str) -> str:
    """A name in composed form."""
    return unicodedata.normalize("NFC", name)


def unflagged(name: str) -> str:
    """A name in a zip that did not say in which code it is: UTF-8 where it has the form of that."""
    try:
        return name.encode(_ZIPS_CODE).decode()
    except UnicodeError:
        return name


def alternatives(name: str) -> Iterator[str]:
    """What a name may have been, if it was written in another code than it was read in; itself first."""
    yield readable(name)
    for written_in in _WRITTEN_IN if not name.isascii() else ():
        for read_as in _READ_AS:
            try:
                yield readable(_bytes(name, read_as).decode(written_in))
            except UnicodeError:
                continue


def _bytes(name: str, code: str) -> bytes:
    """The bytes that a name was before it was read in some code, or by the file system."""
    if any("\udc80" <= character <= "\udcff" for character in name):
        return os.fsencode(name)
    return name.encode(code)


def shown(name: str) -> str:
    """A name for a message: quoted, on one line, not too long."""
    cut = name if len(name) <= LONGEST_SHOWN else f"{name[: LONGEST_SHOWN - 1]}…"
    return repr(cut.encode("utf-8", "replace").decode())


def listed(given: Collection[str]) -> str:
    """Some names for a message; of many, the first, and how many more there are."""
    return messages.listed(list(map(shown, given)), _MOST_SHOWN)


def is_hidden(part: str) -> bool:
    """Whether a file or folder is one that a system or a program put there for itself."""
    return part.startswith(HIDDEN) or part.casefold() in _SYSTEM or part.endswith(RECEIPTS)


def letters(text: str) -> str:
    """Letters and digits of a text, without regard to capitals: what is left of a name in every platform's hands."""
    folded = unicodedata.normalize("NFC", unicodedata.normalize("NFC", text).casefold())
    return "".join(filter(str.isalnum, folded))


def plain_letters(text: str) -> str:
    """The same without accents."""
    apart = unicodedata.normalize("NFKD", text)
    return letters("".join(character for character in apart if not unicodedata.combining(character)))

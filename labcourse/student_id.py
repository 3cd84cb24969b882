"""A student's ID: one rule for the laboratory, for submissions, and for the gradebook.

An ID is a line of text that can name a folder on Windows, macOS and Linux: each student's results are in one. It is
stored in Unicode's composed form (NFC), without white space around, so that ``jürgen`` is one student with one bench,
although a Mac decomposes the ü. Capitals are stored as written, but IDs are compared without them.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator

from labcourse.errors import StudentIDError

LONGEST = 80  #: characters of an ID
LONGEST_IN_BYTES = 240  #: of UTF-8; file systems take 255, and ".zip" is put behind it
GRADES_FILE = "grades.csv"  #: in the folder of results, beside the students' folders
GRADEBOOK_FILE = "gradebook.sqlite"  #: beside it
HINTS_FILE, HINTS_DATA_FILE = "hints.md", "hints.json"  #: beside it: for instructors, and as data
INTAKE_FILE = "intake.csv"  #: beside it
_OF_SQLITE = ("", "-journal", "-wal", "-shm")  # endings of the names of a gradebook's files
#: Names of grading's own files in the folder of results.
RESERVED = (
    GRADES_FILE,
    HINTS_FILE,
    HINTS_DATA_FILE,
    INTAKE_FILE,
    *(f"{GRADEBOOK_FILE}{ending}" for ending in _OF_SQLITE),
)
_NOWHERE = '/\\:*?"<>|'  # not allowed in a folder's name on some system
_DEVICES = {
    *("con", "prn", "aux", "nul", "conin$", "conout$"),
    *(f"{device}{number}" for device in ("com", "lpt") for number in "123456789¹²³"),
}


def normalised(given: object) -> str:
    """Return a student's ID as it is stored.

    Raises
    ------
    StudentIDError
        If it cannot be an ID; the message says why, and what to do.
    """
    if not isinstance(given, str):
        raise StudentIDError(f"A student's ID should be text, not {given!a:.80}.")
    student = composed(given)
    why = next(_objections(student), None)
    if why is not None:
        raise StudentIDError(f"{student[:LONGEST]!r} cannot be a student's ID: {why}")
    return student


def composed(given: str) -> str:
    """Return any text in the form of a stored ID, whether it is valid or not."""
    return unicodedata.normalize("NFC", str.__str__(given)).strip()


def caseless(given: str) -> str:
    """Return the form of any text by which IDs are compared: equal for the same student."""
    return unicodedata.normalize("NFC", composed(given).casefold())


def letters(text: str) -> str:
    """Return the letters and digits of a text in small letters: what every platform leaves of a name."""
    return "".join(filter(str.isalnum, caseless(text)))


def plain_letters(text: str) -> str:
    """Return the letters and digits of a text in small letters and without accents."""
    decomposed = unicodedata.normalize("NFKD", text)
    return letters("".join(character for character in decomposed if not unicodedata.combining(character)))


def name_words(name: str) -> frozenset[str]:
    """Return the words of a person's name, in any order, in small letters and without accents and commas."""
    return frozenset(map(plain_letters, name.replace(",", " ").split())) - {""}


def _objections(student: str) -> Iterator[str]:
    """Say why a text cannot be an ID. Each check may rely on those before it."""
    if not student:
        yield "it is empty. Give the one that your instructor knows you by."
    unseen = [character for character in student if not character.isprintable()]
    if unseen:
        yield f"it should be one line of characters that can be seen. Leave {unseen[0]!a} out."
    if len(student) > LONGEST:
        yield f"it has {len(student)} characters, and {LONGEST} is the most. Shorten it."
    size = len(student.encode())
    if size > LONGEST_IN_BYTES:
        yield f"as a folder's name it takes {size} bytes, and {LONGEST_IN_BYTES} is the most. Shorten it."
    if student.startswith("."):
        yield "it begins with a dot, as the names of hidden files do. Leave the dot out."
    if student.endswith("."):
        yield "it ends with a dot, which Windows drops from a folder's name. Leave the dot out."
    unfit = [character for character in student if character in _NOWHERE]
    if unfit:
        yield f"{unfit[0]} is not allowed in a folder's name on every system. Leave it out, or write - instead."
    if caseless(student) in RESERVED:
        yield "grading has a file of that name. Use another."
    stem = student.partition(".")[0].rstrip()
    if caseless(stem) in _DEVICES:
        yield f"Windows keeps the name {stem} for a device. Use another."

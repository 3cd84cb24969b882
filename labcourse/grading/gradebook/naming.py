"""What names a person in a text, and texts from which that is struck out.

A person is named by their ID, name, e-mail address and the other names by which platforms know them, each as a whole.
Somebody's first name alone, or a slip in it, is not found. Capitals of A to Z are taken for small letters, and no
others where something is struck out: so the guards of the tables can check it (``migrations``), on every database.
"""

from __future__ import annotations

import json
import re
from functools import cached_property

from labcourse.grading.gradebook.records import StudentRecord

FEWEST_CHARACTERS = 3  #: of a word that is looked for in texts: a shorter one is found in texts that name nobody
FEWEST_DIGITS = 5  #: of a number: points, years and frequencies have up to four


class Person:
    """A person who is erased.

    Parameters
    ----------
    about : who
    number : of the student's row

    Attributes
    ----------
    student : the ID
    words : by which they are named in texts, the longest first
    unsought : those that are so short that they are not looked for
    mark : what stands in the place of each
    """

    def __init__(self, about: StudentRecord, number: int) -> None:
        given = dict.fromkeys(filter(None, (about.student, about.name, about.email, *about.aliases)))
        self.student = about.student
        self.words = tuple(sorted(filter(_tells, given), key=len, reverse=True))
        self.unsought = tuple(word for word in given if not _tells(word))
        self.mark = f"[erased {number}]"

    def struck(self, text: str) -> str:
        """A text without what names the person."""
        for word in self.words:
            text = self.struck_once(text, word)
        return text

    def struck_once(self, text: str, word: str) -> str:
        """A text without one of the words."""
        return re.sub(rf"(?<!\w)(?ai:{re.escape(word)})(?!\w)", lambda _found: self.mark, text)

    def named_in(self, content: str | bytes) -> bool:
        """Whether a text, or a file, names the person, in any capitals; in JSON letters may stand as ``\\u00e9``."""
        if not self.words:
            return False
        text = content if isinstance(content, str) else content.decode("utf-8", "replace")
        return self._anywhere.search(text) is not None

    @cached_property
    def _anywhere(self) -> re.Pattern[str]:
        spelled = dict.fromkeys(form for word in self.words for form in (word, json.dumps(word)[1:-1]))
        return re.compile("|".join(rf"(?<!\w){re.escape(form)}(?!\w)" for form in spelled), re.IGNORECASE)


def _tells(word: str) -> bool:
    return len(word) >= (FEWEST_DIGITS if word.isdecimal() else FEWEST_CHARACTERS)

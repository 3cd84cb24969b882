"""Messages for people, in one place on their way: where they are to be translated, it is done here."""

from __future__ import annotations

import re
from collections.abc import Sequence

ENGLISH = "en"  #: the language of the source


def _(text: str) -> str:
    """A message in the reader's language; today, as it is written.

    Names are put in afterwards: ``_("{count} marks changed.").format(count=count)``. It must not be an f-string, nor
    may names be put in before: a translation is looked up by the text as it stands in the source, and a text that has
    a number or a name in it already stands in no list of translations.
    """
    return text


def is_language(name: str) -> bool:
    """Whether a language can have this name: "de", "pt_BR"."""
    return re.fullmatch(r"[a-z]{2,3}(_[A-Z]{2})?", name) is not None


def N_(text: str) -> str:
    """Marks a text for translation where no language is known yet, as in a table of a module; ``_`` says it."""
    return text


def plural(count: int, noun: str) -> str:
    """As in "1 curve", "2 curves"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def listed(texts: Sequence[str], most: int) -> str:
    """Some texts in a row; of many, the first and how many more there are, as in "1.2, 1.3 and 12 more"."""
    some, more = ", ".join(texts[:most]), len(texts) - most
    return _("{some} and {count} more").format(some=some, count=more) if more > 0 else some

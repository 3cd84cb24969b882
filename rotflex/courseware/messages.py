"""Messages for people, in one place on their way: where they are to be translated, it is done here."""

from __future__ import annotations


def _(text: str) -> str:
    """A message in the reader's language; today, as it is written.

    Names are put in afterwards: ``_("{count} marks changed.").format(count=count)``. It must not be an f-string, nor
    may names be put in before: a translation is looked up by the text as it stands in the source, and a text that has
    a number or a name in it already stands in no list of translations.
    """
    return text


def plural(count: int, noun: str) -> str:
    """As in "1 curve", "2 curves"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"

"""Messages for people, in the reader's language: looked up when they are said, and not before.

Translations are catalogues as gettext reads them, ``locale/de.mo``, in folders of the packages that are installed: the
students' package has one, so has the instructor's for what students read of it, and so may a course (:func:`add`).
What no catalogue has is said in English, as it stands in the source. docs/languages.md says how to make one.

Numbers, dates and units are the same in each language: 0.5 s is what a student types, what Python prints, and what the
axes of figures show; 0,5 beside it would be another way to write the same number, and one that no cell takes.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # loaded where there is something to look up
    from gettext import NullTranslations

SETTING = "ROTFLEX_LANGUAGE"  #: environment variable: the reader's language, whatever the course's is
ENGLISH = "en"  #: the language of the source
FOLDER = "locale"  #: of catalogues, in a package's or a course's folder
_SUFFIX = ".mo"

_PACKAGE = Path(__file__).parents[1]
_folders = [_PACKAGE / FOLDER, _PACKAGE / "instructor" / FOLDER]
#: The language that is spoken, and its catalogues, one behind the other; None until something is said or chosen.
_spoken: tuple[str, NullTranslations | None] | None = None


class Message(str):
    """A message that is made where no language is known yet, as when a module is imported: see :data:`N_`.

    It is the English text: so it is compared, kept and packed. :func:`_` says it in the reader's language; so does
    whatever text it is put into, as in ``_("Not {what}.").format(what=WHAT)``. Names to be put in are given along.
    """

    template: str
    names: dict[str, Any]

    def __new__(cls, template: str, /, **names: Any) -> Message:
        english = {name: str(value) if isinstance(value, Message) else value for name, value in names.items()}
        made = super().__new__(cls, template.format(**english) if names else template)
        made.template, made.names = template, names
        return made

    def __format__(self, spec: str) -> str:
        return format(_(self), spec)


#: Marks a text for translation where it stands, and leaves it for ``_`` to be said: ``TITLE = N_("Stability")``, and
#: where it is shown, ``_(TITLE)``.
N_ = Message


def _(text: str) -> str:
    """A message in the reader's language; in English where there is no translation.

    Names are put in afterwards: ``_("{count} marks changed.").format(count=count)``. It must not be an f-string, nor
    may names be put in before: a translation is looked up by the text as it stands in the source, and a text that has
    a number or a name in it already stands in no catalogue. Nor may it be called while a module is imported: that
    would be said in one language for ever. There, :data:`N_` marks a text.
    """
    if isinstance(text, Message) and text.names:
        return _found(text.template).format(**text.names)
    return _found(str(text))


def plural(count: int, one: str, many: str) -> str:
    """As in ``plural(count, "{count} curve", "{count} curves")``: "1 curve", "2 curves". English has these two forms.

    Another language may have more of them, or one.
    """
    catalogues = _now()[1]
    if catalogues is None:
        return (one if count == 1 else many).format(count=count)
    return catalogues.ngettext(one, many, count).format(count=count)


def listed(texts: Sequence[str], most: int) -> str:
    """Some texts in a row; of many, the first and how many more there are, as in "1.2, 1.3 and 12 more"."""
    some, more = ", ".join(texts[:most]), len(texts) - most
    return _("{some} and {count} more").format(some=some, count=more) if more > 0 else some


# --- which language ---------------------------------------------------------------------------------------------------


def speak(language: str) -> None:
    """Say what follows in a language, as "de" or "de_AT"; in English where there is no catalogue of it, or none given.

    It holds for the whole process: a session, a command, or a program that writes pages for a course.
    """
    global _spoken  # noqa: PLW0603  # one language for the whole process, as its readers are
    spoken = _nearest(language)
    _spoken = (spoken, None if spoken == ENGLISH else _catalogues(spoken))


def speak_to_reader(language: str) -> str:
    """As :func:`speak`, but the reader's own choice (:data:`SETTING`) comes first.

    Returns
    -------
    str
        A note where the language that was asked for is not there; "" where it is.
    """
    wanted = os.environ.get(SETTING) or language
    speak(wanted)
    if not wanted or spoken() in (wanted, _base(wanted)):
        return ""
    return _("There are no messages in the language {wanted!r:.20}. There are {languages}.").format(
        wanted=wanted, languages=", ".join(languages())
    )


def spoken() -> str:
    """The language that messages are said in now, as HTML names it: "en", "de"."""
    return _now()[0].replace("_", "-")


def languages() -> list[str]:
    """The languages that there are messages in."""
    there = {path.stem for folder in _folders for path in folder.glob(f"*{_SUFFIX}")}
    return sorted(there | {ENGLISH})


def is_language(name: str) -> bool:
    """Whether a language can have this name: "de", "pt_BR"."""
    return re.fullmatch(r"[a-z]{2,3}(_[A-Z]{2})?", name) is not None


def add(folder: Path) -> None:
    """Look into another folder for catalogues as well, as of a course; there need not be one."""
    if folder not in _folders:
        _folders.append(folder)
        if _spoken is not None:
            speak(_spoken[0])


def _now() -> tuple[str, NullTranslations | None]:
    if _spoken is None:
        speak(os.environ.get(SETTING, ""))
    assert _spoken is not None
    return _spoken


def _found(text: str) -> str:
    catalogues = _now()[1]
    return catalogues.gettext(text) if catalogues is not None and text else text  # "" would be a catalogue's head


def _base(language: str) -> str:
    return language.replace("-", "_").partition("_")[0]


def _nearest(language: str) -> str:
    """The language itself, or without its country; English where neither is there."""
    there = languages() if language else []
    return next((one for one in (language.replace("-", "_"), _base(language)) if one in there), ENGLISH)


def _catalogues(language: str) -> NullTranslations:
    import gettext

    found = gettext.NullTranslations()
    for path in [folder / f"{language}{_SUFFIX}" for folder in _folders]:
        if path.is_file():
            with path.open("rb") as file:
                found.add_fallback(gettext.GNUTranslations(file))
    return found

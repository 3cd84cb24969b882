"""Templates of pages. Whatever is put into one is text: it is escaped, and turns no direction of writing."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from markupsafe import Markup

from rotflex.courseware import messages
from rotflex.instructor.reports.safe_text import no_escapes

if TYPE_CHECKING:
    from jinja2 import Environment

_PACKAGE, _SHARED = "rotflex.instructor", "reports/templates"


@cache
def templates(folder: str = _SHARED) -> Environment:
    """The templates of a folder of rotflex/instructor; behind them those of reports, which all pages share.

    Parameters
    ----------
    folder : as "overview/templates"
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    folders = dict.fromkeys([folder, _SHARED])
    made = Environment(
        loader=ChoiceLoader([PackageLoader(_PACKAGE, one) for one in folders]),
        autoescape=True,
        finalize=_plain,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        extensions=["jinja2.ext.i18n"],
    )
    # A template is made once, and says what it says in the language of the moment.
    made.install_gettext_callables(messages._, _number_of, newstyle=False)  # type: ignore[attr-defined]  # the extension adds it
    made.globals |= {"plural": messages.plural, "spoken": messages.spoken}
    return made


def _number_of(one: str, many: str, count: int) -> str:
    return messages.plural(count, one, many)


def _plain(value: object) -> object:
    return no_escapes(value) if isinstance(value, str) and not isinstance(value, Markup) else value

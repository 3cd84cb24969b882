"""Templates of pages. Values are escaped in HTML, and cannot turn the direction of writing."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from markupsafe import Markup

from labcourse.messages import plural
from labcourse.safe_text import no_escapes
from labcourse.sentences import sentence, sentences

if TYPE_CHECKING:
    from jinja2 import Environment

_PACKAGE, _SHARED = "labcourse.grading", "reports/templates"


@cache
def templates(folder: str = _SHARED) -> Environment:
    """Return the templates of a folder of labcourse/grading; behind them those of reports, which all pages share.

    Parameters
    ----------
    folder : as "scoring/page"
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    folders = dict.fromkeys([folder, _SHARED])
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(_PACKAGE, one) for one in folders]),
        autoescape=lambda name: not (name or "").endswith(".md"),  # Markdown is read as text
        finalize=_plain,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals |= {"plural": plural, "sentence": sentence, "sentences": sentences}
    return environment


def _plain(value: object) -> object:
    return no_escapes(value) if isinstance(value, str) and not isinstance(value, Markup) else value

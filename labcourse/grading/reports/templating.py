"""Templates of pages. Values are escaped in HTML, and cannot turn the direction of writing."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from markupsafe import Markup

from labcourse.grading.accounts import in_full, points, worth
from labcourse.grading.reports.changes import state_text
from labcourse.grading.reports.result import lapse, moment, not_counted, request_text, state_of, sums
from labcourse.messages import number_of
from labcourse.safe_text import no_escapes
from labcourse.sentences import sentence, sentences

if TYPE_CHECKING:
    from jinja2 import Environment

_PACKAGE, _SHARED = "labcourse.grading", "reports/templates"
#: What each template may call.
_FUNCTIONS = (
    *(in_full, lapse, moment, not_counted, number_of, points, request_text, sentence, sentences),
    *(state_of, state_text, sums, worth),
)


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
    environment.globals |= {function.__name__: function for function in _FUNCTIONS}
    return environment


def _plain(value: object) -> object:
    return no_escapes(value) if isinstance(value, str) and not isinstance(value, Markup) else value

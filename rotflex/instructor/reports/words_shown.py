"""A student's answer in words, as a piece of a page."""

from __future__ import annotations

from collections.abc import Mapping

from markupsafe import Markup

from rotflex.courseware.messages import _
from rotflex.instructor.reports.safe_text import no_escapes


def as_html(text: str, pictures: Mapping[str, bytes]) -> Markup:
    """The words as they were typed, and how many pictures came with them."""
    shown = Markup('<div class="given">{}</div>').format(no_escapes(text))
    if pictures:
        shown += Markup("<p>{}</p>").format(_("With {count} pictures.").format(count=len(pictures)))
    return shown

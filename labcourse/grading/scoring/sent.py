"""What a page sends, which may be anything: read, or refused in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from labcourse.grading.scoring.desk import Pick, Where

LONGEST_REMARK = 2000  #: characters; a page
MOST_ANSWERS = 50  #: in one act; a page shows several times fewer


class BadRequest(Exception):
    """An act that no page sends; says what is wrong with it."""


@dataclass(frozen=True)
class Sheet:
    """What a scorer had before them.

    Attributes
    ----------
    picks : the answers that were ticked
    shown : keys of all, in their order
    remark, points : as they were typed
    """

    picks: list[Pick]
    shown: list[str]
    remark: str
    points: str


def sent_text(sent: Mapping[str, Any], name: str) -> str:
    """A text; "" if there is none."""
    value = sent.get(name, "")
    if not isinstance(value, str) or len(value) > LONGEST_REMARK:
        raise BadRequest(f"{name}: a text of at most {LONGEST_REMARK} characters.")
    return value


def sent_where(sent: Mapping[str, Any]) -> Where:
    """Question and part."""
    question, part = sent_text(sent, "question"), sent_text(sent, "part")
    if not question or not part:
        raise BadRequest("Say which question and part.")
    return question, part


def sent_sheet(sent: Mapping[str, Any]) -> Sheet:
    """What was before the scorer; if it does not say what was shown, that is what was ticked."""
    ticked = sent.get("answers")
    if not isinstance(ticked, list) or not 1 <= len(ticked) <= MOST_ANSWERS:
        raise BadRequest("Tick at least one answer.")
    if not all(isinstance(one, dict) for one in ticked):
        raise BadRequest("An answer is a key and what was seen.")
    picks = [Pick(sent_text(one, "key"), sent_text(one, "seen")) for one in ticked]
    shown = sent.get("shown", [pick.key for pick in picks])
    if not isinstance(shown, list) or len(shown) > MOST_ANSWERS or not all(isinstance(one, str) for one in shown):
        raise BadRequest("What was shown is a list of keys.")
    points = sent.get("points")
    return Sheet(picks, shown, sent_text(sent, "remark").strip(), "" if points is None else str(points))

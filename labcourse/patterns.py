"""Regular expressions for text that students write: each stands beside its use, and all of them are in one list.

A text can be written so that a pattern reads it in very many ways, which takes minutes and holds up the whole class.
Tests run each pattern of the list on such texts of its greatest length.
"""

from __future__ import annotations

import re
from typing import AnyStr

SHORT = 5_000  #: characters of an answer in words, a name, a label, a message
ANSWER = 1_000_000  #: of all answers that a run records
CELL = 10_000_000  #: of a text cell, which may hold pictures, as Colab writes them

LISTED: dict[re.Pattern[str] | re.Pattern[bytes], int] = {}  #: pattern → the length of the longest text it is used on


def pattern(text: AnyStr, longest: int = SHORT, flags: int = 0) -> re.Pattern[AnyStr]:
    """Compile a pattern for text that students write, and list it.

    Parameters
    ----------
    text : the regular expression
    longest : characters, or bytes, of the longest text that it is used on
    flags : of the module :mod:`re`
    """
    compiled = re.compile(text, flags)
    LISTED[compiled] = max(longest, LISTED.get(compiled, 0))
    return compiled


CELL_ID = pattern(r"[a-zA-Z0-9_-]{1,64}", CELL)  #: what the format of notebooks allows as the id of a cell

"""What a student's marks come to: weights, what is left out, lateness, and the total, step by step, in words.

===============  =====================================================================================================
``exact``        decimal numbers as they are written, and rounding half up
``lateness``     what is due when for a student, and how late it came
``account``      marks → :class:`Account`: what counts, and the final grade
``in_words``     how that came about, so that it can be done again by hand
===============  =====================================================================================================
"""

from __future__ import annotations

from labcourse.grading.accounts.account import Account, Bonus, Line, account_of
from labcourse.grading.accounts.lateness import Timing

__all__ = ["Account", "Bonus", "Line", "Timing", "account_of"]

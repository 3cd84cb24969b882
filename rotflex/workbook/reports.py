"""The reports of this course, for their notebooks: the outline, and a button that makes the whole document."""

from __future__ import annotations

from functools import partial

from rotflex.courseware import reports
from rotflex.courseware.report.button import button
from rotflex.workbook.questions import CATALOGUE

__all__ = ["button", "outline"]

outline = partial(reports.outline, CATALOGUE)

"""The reports of this course as far as they are recorded, as Markdown: see :mod:`rotflex.courseware.reports`."""

from __future__ import annotations

from functools import partial

from rotflex.courseware import reports
from rotflex.workbook.questions import CATALOGUE

outline = partial(reports.outline, CATALOGUE)
assembled = partial(reports.assembled, CATALOGUE)

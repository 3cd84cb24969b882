"""The reports of this course as far as they are recorded, as Markdown: see :mod:`rotflex.courseware.reports`."""

from __future__ import annotations

from rotflex.courseware import reports
from rotflex.courseware.session import Session


def outline(report: str, lab: Session) -> str:
    """See :func:`rotflex.courseware.reports.outline`; of what is asked of the student's class."""
    return reports.outline(lab.catalogue, report, lab)


def assembled(report: str, lab: Session) -> str:
    """See :func:`rotflex.courseware.reports.assembled`; of what is asked of the student's class."""
    return reports.assembled(lab.catalogue, report, lab)

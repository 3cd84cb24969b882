"""The reports of this course, for their notebooks: the outline, and a button that makes the whole document."""

from __future__ import annotations

from rotflex.courseware import reports
from rotflex.courseware.report.button import button
from rotflex.courseware.session import Session

__all__ = ["button", "outline"]


def outline(report: str, lab: Session) -> str:
    """See :func:`rotflex.courseware.reports.outline`; of what is asked of the student's class."""
    return reports.outline(lab.catalogue, report, lab)

"""The reports of this course, for their notebooks: the outline, and a button that makes the whole document."""

from __future__ import annotations

from labcourse.answers import report_files
from labcourse.report.making import button
from labcourse.session import Session

__all__ = ["button", "outline"]


def outline(report: str, lab: Session) -> str:
    """See :func:`labcourse.answers.report_files.outline`; of what is asked of the student's class."""
    return report_files.outline(lab.catalogue, report, lab)

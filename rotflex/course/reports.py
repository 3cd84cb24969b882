"""The reports of this course, for their notebooks: the outline, and a button that makes the whole document."""

from labcourse.answers.report_files import outline
from labcourse.report.making import button

__all__ = ["button", "outline"]

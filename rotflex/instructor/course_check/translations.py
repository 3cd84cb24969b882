"""Translations of the notebooks, held against the notebooks as they are now."""

from __future__ import annotations

import json
from collections.abc import Iterator

from rotflex.courseware.messages import _
from rotflex.errors import GradingError
from rotflex.instructor.course import Course
from rotflex.instructor.course_check import cells
from rotflex.instructor.course_check.finding import Finding
from rotflex.instructor.translation import po_files
from rotflex.instructor.translation.translated import translated


def check(course: Course) -> Iterator[Finding]:
    """Files that are not of the notebook as it is now, or of none; translations that are refused.

    What is not translated yet is no fault.
    """
    by_stem = {path.stem: path for path in course.notebooks}
    for language in po_files.languages(course.folder):
        for file in sorted(po_files.folder(course.folder, language).glob("*.po")):
            where = file.relative_to(course.folder).as_posix()
            path = by_stem.get(file.stem)
            if path is None:
                yield Finding(where, _("the course has no notebook of this name: remove the file."))
                continue
            notebook = json.loads(path.read_text(encoding="utf-8"))
            try:
                made, progress = translated(notebook, path.name, course.folder, language)
            except GradingError as error:
                yield Finding(where, str(error))
                continue
            if progress.stale:
                yield Finding(
                    where,
                    _("the notebook was changed since: say rotflex translate {language}.").format(language=language),
                )
            for fault in progress.refused:
                yield Finding(where, _("{fault}. The cell stays as it is.").format(fault=fault))
            for finding in cells.in_words(path.name, made["cells"]):
                yield Finding(where, str(finding))

"""Erase a person in the folder of results: delete their own folders, and write the files of the class anew."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from labcourse import files
from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.outcomes import class_report, sheet_files
from labcourse.grading.overview import glance, shown
from labcourse.grading.reports.grades import Reports
from labcourse.student_id import GRADES_FILE, HINTS_FILE, caseless


class Results:
    """The folder of results of a gradebook.

    Parameters
    ----------
    folder : the folder; it need not be there
    course : the course
    """

    def __init__(self, folder: Path, course: Course) -> None:
        self.folder, self._course = folder, course

    def own(self, student: str) -> list[Path]:
        """Return the folders of one student alone."""
        holders = filter(Path.is_dir, (self.folder, self.folder / sheet_files.FOLDER))
        inside = (path for holder in holders for path in sorted(holder.iterdir()) if path.is_dir())
        return [path for path in inside if caseless(path.name) == caseless(student)]

    def of_class(self) -> list[Path]:
        """Return the files that are made of the whole class, if they exist."""
        return [self.folder / name for names in self._writers() for name in names if (self.folder / name).is_file()]

    def remove(self, student: str) -> None:
        """Delete the folders of one student, and the files of the whole class, until they are written anew.

        Raises
        ------
        GradingError
            If something cannot be deleted.
        """
        try:
            for folder in self.own(student):
                shutil.rmtree(folder)
            for path in self.of_class():
                path.unlink()
        except OSError as error:
            raise GradingError(
                f"{error.filename} cannot be removed: {error.strerror}. The gradebook is as it was; nobody is erased."
            ) from None

    def write(self, book: Gradebook, there: list[Path]) -> list[str]:
        """Write files of the class anew, without the student; return a sentence on each that could not be written."""
        before, unwritten = {path.name for path in there}, []
        for names, write in self._writers().items():
            if before & set(names) and book.students():
                try:
                    write(book)
                except GradingError as error:
                    missing = ", ".join(sorted(before & set(names)))
                    unwritten.append(f"{missing}: taken away, and not written anew. {error}")
        return unwritten

    def _writers(self) -> dict[tuple[str, ...], Callable[[Gradebook], object]]:
        """Return the names of files that are written together → what writes them."""
        report = (class_report.PAGE_FILE, class_report.TABLE_FILE, class_report.STUDENTS_FILE)
        return {
            (GRADES_FILE, HINTS_FILE): lambda book: Reports(self.folder, self._course, book).write_all(),
            (shown.CLASS_FILE,): self._write_class,
            report: lambda book: class_report.write(self.folder, self._course, book),
            (sheet_files.CLASS_FILE,): self._write_sheets,
        }

    def _write_sheets(self, book: Gradebook) -> None:
        """Write the sheets of students who have some: there may be sheets of a few only."""
        folders = {caseless(path.name) for path in (self.folder / sheet_files.FOLDER).iterdir() if path.is_dir()}
        if left := [about.student for about in book.students() if caseless(about.student) in folders]:
            sheet_files.write(self.folder, self._course, book, left)

    def _write_class(self, book: Gradebook) -> None:
        page = self.folder / shown.CLASS_FILE
        try:
            files.write(page, shown.page(glance.at(book, self._course)))
        except OSError as error:
            raise GradingError(f"{page} cannot be written: {error.strerror}.") from None

"""Read a student's submission: the cells of the course's notebooks, own files, and what was recorded at home."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import PurePosixPath
from typing import Any

import labcourse
from labcourse import course_file
from labcourse.answers import answers, notebooks, own_files, report_files
from labcourse.answers.notebooks import MAX_FILE, Cell, Notebook, NotebookError, to_bytes
from labcourse.errors import ConfigurationError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.gradebook.records import Delivery
from labcourse.grading.intake import archives
from labcourse.grading.intake.archives import Shelf, Unreadable, is_notebook, named
from labcourse.grading.intake.finding import MAX_COURSE_FILE
from labcourse.grading.intake.owners import course_data
from labcourse.grading.submission import Decisions, Doubt, Piece, Submission, content_name
from labcourse.patterns import pattern
from labcourse.problems import Code, Problem, Reason, has
from labcourse.run.alignment import count_changed, source_of
from labcourse.run.portability import version
from labcourse.student_id import caseless

MAX_STRANGERS = 30  #: notebooks of other names that are compared with the course's cells
_MOST_COMPARED = 10  # files that may be the same notebook
_SAME_TIME = timedelta(seconds=2)  # to which a zip rounds
_OLD = datetime.min.replace(tzinfo=UTC)
_WORD, _DIGITS = pattern(r"[^\W_]+"), pattern(r"\d+")
_FEWEST_CELLS = 3  # by which a notebook of another name is recognised; two may be equal by chance

#: How much a file's name differs from a notebook's: 0 if not at all, else 1 plus the number of its words that are not
#: in the notebook's name; and the negated number of the copy.
Fit = tuple[int, int]
#: A notebook of the course: the id of each cell → the cell.
Master = Mapping[str, Mapping[str, Any]]


def read(
    submission: Submission,
    wanted: Sequence[str],
    masters: Mapping[str, Master] | None = None,
    *,
    packages: Collection[str] = (labcourse.__name__,),
    reports: Sequence[str] = (),
    decisions: Decisions | None = None,
) -> Submission:
    """Read a submission's pieces, in order of time: fill in what was read. Return the same submission.

    If one of the pieces cannot be read, the others are. Problems, notes and doubts of the submission say what is not.

    Parameters
    ----------
    submission : as found
    wanted : file names of the course's notebooks
    masters : file name of a notebook of the course → its cells, by which a notebook of another name is recognised
    packages : names of the course's packages, which are not own files
    reports : file names of the course's reports, as PDF
    decisions : which of several files counts, by the instructor
    """
    with Shelf() as shelf:
        reader = _Reader(submission, shelf, wanted, masters or {}, packages, reports, decisions or {})
        for piece in submission.pieces:
            reader.read(piece)
    submission.notes = list(dict.fromkeys(submission.notes))
    return submission


def found_digest(submission: Submission) -> str:
    """Return the digest of what was found of a submission, before it is read: its pieces, and what their files hold.

    Files in an archive are not opened: its table of contents has their checksums.
    """

    def parts() -> Iterator[bytes]:
        yield repr([submission.problems, submission.notes]).encode()
        for piece in (*submission.pieces, *submission.unconfirmed):
            saved = sorted((path, file.modified) for path, file in piece.files.items())
            yield repr([replace(piece, files={}), saved]).encode()
            yield from shelf.held(piece.files)

    with Shelf() as shelf:
        return content_name(parts())


def unread_problems(submission: Submission, earlier: Collection[str] = ()) -> list[Problem]:
    """Return a problem for each thing in a submission that could not be read and that nothing later replaces.

    There is also one if no notebook was ever handed in, while all pieces can be read.

    Parameters
    ----------
    submission : as it was read
    earlier : names of what was handed in before
    """
    read_names = {item.name for item in submission.items} | set(earlier)
    problems = [*submission.faults, *submission.unreadable]
    for name, why in submission.unread.items():
        code = Code.OLDER_NOTEBOOK_COUNTS if name in read_names else Code.NOTEBOOK_UNREAD
        if name.endswith(report_files.PDF):
            problems.append(Problem.of(Code.REPORT_UNREAD, name, why=why, earlier=name in read_names))
        else:
            problems.append(Problem.of(code, name, why=why))
    if not (submission.has_notebooks or submission.unreadable or any(map(is_notebook, [*submission.unread, *earlier]))):
        problems.append(Problem.of(Code.NO_NOTEBOOK, **named(sorted(submission.names))))
    return list(dict.fromkeys(problems))


def is_unread(name: str, problems: Collection[Reason]) -> bool:
    """Return whether the problems of a run say that a notebook was handed in and could not be read.

    It may be that an older version of it counts.
    """
    return any(has(code, problems, name) for code in (Code.NOTEBOOK_UNREAD, Code.OLDER_NOTEBOOK_COUNTS))


@dataclass
class _Reader:
    """Reads the pieces of a submission, one after the other."""

    submission: Submission
    shelf: Shelf
    wanted: Sequence[str]
    masters: Mapping[str, Master]
    packages: Collection[str]
    reports: Sequence[str]
    decisions: Decisions
    parts: int = 0  # of the notebooks that were read

    def read(self, piece: Piece) -> None:
        """Read what counts of a piece, and note what does not."""
        submission, trouble = self.submission, piece.trouble
        submission.names |= {path.rpartition("/")[2] for path in piece.files}
        try:
            if piece.files:
                self.shelf.open(next(iter(piece.files.values())).store)
                self._read_all(piece)
        except Unreadable as error:
            trouble = (error.problem,)
        if trouble:
            received = piece.received.isoformat()  # the next week's may have the same name
            submission.unreadable.append(
                Problem.of(Code.SUBMISSION_UNREAD, piece.source, why=trouble, received=received)
            )
        for why in dict.fromkeys(piece.refused.values()):
            refused = [path for path, reason in piece.refused.items() if reason == why]
            self._note_files(Code.FILES_REFUSED, refused, why=why)

    def _read_all(self, piece: Piece) -> None:
        """Read the files of a piece: notebooks, reports, what was recorded at home, and own files."""
        self._piece, self._used, self._missing = piece, set[str](), list(self.wanted)
        self._notebooks: dict[str, Notebook | Problem] = {}
        fits = _fitting(self._piece.files, self.wanted, *archives.NOTEBOOK_ENDINGS)
        self._base = self._folder_of_most(fits)
        for name, candidates in fits.items():
            self._missing.remove(name)
            notebook = self._notebook(self._best(name, candidates))
            if isinstance(notebook, Notebook):
                self._add_notebook(name, notebook)
            else:
                self.submission.unread[name] = notebook
        self._by_cells()
        self._explain_missing()
        for name, candidates in _fitting(self._piece.files, self.reports, report_files.PDF).items():
            self._report(name, self._best(name, candidates))
        self._of_the_course(ANSWERS_FILE, answers.MAX_BYTES)
        self._of_the_course(COURSE_FILE, MAX_COURSE_FILE)
        self._own_files()

    def _read(self, path: str, most: int) -> bytes:
        return self.shelf.read(self._piece.files[path], most)

    def _add(self, name: str, data: bytes) -> None:
        """Add a file to what was read of the submission, under its name in the course."""
        piece, digest = self._piece, hashlib.sha256(data).hexdigest()
        about = (piece.received, piece.source, piece.clock, piece.folder_of)
        self.submission.items.append(Delivery(name, digest, data, *about, attempt=piece.owner.attempt, copy=piece.copy))
        self.submission.unread.pop(name, None)

    # --- notebooks ----------------------------------------------------------------------------------------------------

    def _notebook(self, path: str) -> Notebook | Problem:
        """Return a notebook, or why it cannot be read; each file is read once."""
        if path not in self._notebooks:
            self._notebooks[path] = self._read_notebook(path)
        return self._notebooks[path]

    def _read_notebook(self, path: str) -> Notebook | Problem:
        try:
            data = self._read(path, MAX_FILE)
            if (parts := self.parts + notebooks.parts_in(data)) > notebooks.MAX_PARTS:
                return Problem.of(Code.TOO_MANY_PARTS, most=notebooks.MAX_PARTS, with_others=True)
            self.parts, notebook = parts, Notebook.without_outputs(data)
        except (Unreadable, NotebookError) as error:
            return error.problem
        self.submission.python = max(filter(None, (version(notebook.python), self.submission.python)), default=None)
        return notebook

    def _add_notebook(self, name: str, notebook: Notebook) -> None:
        """Add a notebook to what was read. If it is changed, problems of unreadable pieces before it become notes."""
        master, submission = self.masters.get(name), self.submission
        self._add(name, to_bytes(notebook.cells))
        submission.faults += [replace(problem, where=name) for problem in notebook.problems]
        submission.has_notebooks = True
        if master is None or _count_changed(notebook, master):
            submission.notes += submission.unreadable
            submission.unreadable.clear()

    def _folder_of_most(self, fits: Mapping[str, Sequence[tuple[Fit, str]]]) -> str:
        """Return the folder of this piece that holds most of the course's notebooks; "" is the top.

        If there are no notebooks, it is the folder of most files ``answers.json`` and ``course.json``, or the top.

        Parameters
        ----------
        fits : from :func:`_fitting`
        """
        lie_in = {(name, path.rpartition("/")[0]) for name, candidates in fits.items() for _fit, path in candidates}
        if not lie_in:
            parts = (path.rpartition("/") for path in self._piece.files)
            lie_in = {(name, folder) for folder, _slash, name in parts if name in (ANSWERS_FILE, COURSE_FILE)}
        folders = Counter(folder for _name, folder in lie_in)
        return min(folders, key=lambda folder: (-folders[folder], len(PurePosixPath(folder).parts), folder), default="")

    def _nearness(self, path: str) -> tuple[bool, int, str]:
        """Return a key that sorts paths: those in the folder of most notebooks first, then by depth and name."""
        return path.rpartition("/")[0] != self._base, path.count("/"), path

    def _best(self, name: str, candidates: Sequence[tuple[Fit, str]]) -> str:
        """Return the path of the file that counts as a notebook or report; note others if something in them is lost.

        Then a row is added for the instructor, who may decide otherwise.

        Parameters
        ----------
        name : name of the notebook or report in the course
        candidates : the files that may be it, from :func:`_fitting`
        """
        (changes, _copy), path = candidates[0]
        paths = [path for _fit, path in candidates]
        self._used.update(paths)
        if len(paths) > 1:
            path, why = self._chosen(name, candidates)
            others = [other for other in paths if other != path and self._may_lose_work(name, other, path)]
            if others:
                about = {"count": len(others) + 1, "chosen": path, "why": why, **named(others)}
                self.submission.notes.append(Problem.of(Code.ONE_OF_SEVERAL, name, **about))
                doubt = Doubt(self._piece.source, name, path, (why,), "; ".join(others), self._content(paths))
                self.submission.doubts.append(doubt)
        elif changes:
            self.submission.notes.append(Problem.of(Code.TAKEN_BY_NAME, name, file=path))
        return path

    def _chosen(self, name: str, candidates: Sequence[tuple[Fit, str]]) -> tuple[str, Problem]:
        """Choose the newest of the files in which something is written; of near times, the one with most written.

        If nothing is written in any, it is chosen of those that can be read, or else of all. What the instructor
        decided counts before all of this. Parameters as for :meth:`_best`.

        Returns
        -------
        tuple
            path of the file, and the reason
        """
        ordered = sorted((changes, self._nearness(path)[0], copy, path) for (changes, copy), path in candidates)
        paths = [path for *_order, path in ordered]
        decided = Doubt(self._piece.source, name, "", (), content=self._content(paths)).decided(self.decisions)
        if decided in paths:
            return decided, Problem.of(Code.DECIDED)
        if decided:
            self.submission.faults.append(Problem.of(Code.DECISION_ON_NO_FILE, name, file=decided))
        compared = paths[:_MOST_COMPARED]
        written = {path: self._written(name, path) if is_notebook(path) else 0 for path in compared}
        saved = {path: self._piece.files[path].modified or _OLD for path in written}
        best = min(max(written.values()), 1)  # 1: something is written; 0: it can be read; -1: it cannot
        usable = [path for path in written if written[path] >= best]
        newest = max(saved[path] for path in usable)
        path = max(usable, key=lambda path: (newest - saved[path] <= _SAME_TIME, written[path]))
        when = {"saved": f"{saved[path]:%Y-%m-%d %H:%M}"} if saved[path] > _OLD else {}
        return path, Problem.of(Code.CHOSEN_BY_TIME, cells=max(written[path], 0), **when)

    def _content(self, paths: Iterable[str]) -> str:
        """Return a name for what files hold that may be one of the course's; a notebook without its outputs."""
        return content_name(part for path in sorted(paths) for part in (path.encode(), self._held(path)))

    def _held(self, path: str) -> bytes:
        """Return what a file holds; of one that cannot be read, its path and size."""
        if is_notebook(path):
            notebook = self._notebook(path)
            return to_bytes(notebook.cells) if isinstance(notebook, Notebook) else repr(notebook).encode()
        try:
            return self._read(path, report_files.MAX_BYTES)
        except Unreadable:
            return f"{path}, {self._piece.files[path].size}".encode()

    def _may_lose_work(self, name: str, path: str, chosen: str) -> bool:
        """Return whether ignoring a file may lose work of the student's.

        For a notebook: its cells differ from the chosen one's, and something is written in it or it cannot be read. For
        a report: the bytes differ, or one of the two cannot be read.

        Parameters
        ----------
        name : name of the notebook or report in the course
        path, chosen : the file that is ignored, and the one that counts
        """
        if is_notebook(path):
            one, other = self._notebook(path), self._notebook(chosen)
            same = isinstance(one, Notebook) and isinstance(other, Notebook) and one.cells == other.cells
            return not same and self._written(name, path) != 0
        return self._held(path) != self._held(chosen)

    def _written(self, name: str, path: str) -> int:
        """Return in how many cells of a notebook a student wrote; -1 if it cannot be read."""
        notebook = self._notebook(path)
        return _count_changed(notebook, self.masters.get(name, {})) if isinstance(notebook, Notebook) else -1

    def _by_cells(self) -> None:
        """Recognise missing notebooks by their cells among files of other names; note files that are not recognised."""
        missing = {name for name in self._missing if name in self.masters}
        others = [path for path in self._piece.files if path not in self._used and is_notebook(path)] if missing else []
        for path in sorted(others, key=self._nearness)[:MAX_STRANGERS]:
            notebook = self._notebook(path)
            if not isinstance(notebook, Notebook):
                continue
            if (name := _most_alike(notebook.cells, self.masters)) and name in missing:
                missing.remove(name)
                self._take(name, path, notebook, Code.TAKEN_BY_CELLS)
        if missing:
            self._note_files(Code.NOT_RECOGNISED, [path for path in others if path not in self._used])

    def _take(self, name: str, path: str, notebook: Notebook, code: Code) -> None:
        """Take a file for a missing notebook, and note it."""
        self._missing.remove(name)
        self._used.add(path)
        self._add_notebook(name, notebook)
        self.submission.notes.append(Problem.of(code, name, file=path))

    def _explain_missing(self) -> None:
        """Take a missing notebook from a file of its name that ends in .json; record other such files as the reason.

        Add a fault if any notebook is missing and an archive that is not read lies there.
        """
        unused = [path for path in self._piece.files if path not in self._used]
        for name in [*self._missing] if self.masters else []:
            stem = name.casefold().removesuffix(".ipynb")
            instead = [path for path in unused if PurePosixPath(path.casefold()).stem == stem]
            as_json = next((path for path in instead if path.casefold().endswith(".json")), "")
            if as_json and isinstance(notebook := self._notebook(as_json), Notebook):
                self._take(name, as_json, notebook, Code.TAKEN_BY_NAME)
            elif instead:
                self.submission.unread[name] = Problem.of(Code.NO_NOTEBOOK_IN_PLACE, name, **named(instead))
        packed = [*filter(archives.is_other_archive, self._piece.files)]
        if packed and self._missing and not self._piece.trouble:
            self.submission.faults.append(Problem.of(Code.PACKED_FILES, **named(packed)))

    # --- other files --------------------------------------------------------------------------------------------------

    def _report(self, name: str, path: str) -> None:
        """Read a report's PDF, or note why it is refused. It is not parsed: its size and its first bytes decide."""
        try:
            data = self._read(path, report_files.MAX_BYTES)
            why = report_files.refusal(data)
        except Unreadable as error:
            why = error.problem
        if why:
            self.submission.unread[name] = why
        else:
            self._add(name, data)

    def _of_the_course(self, name: str, most: int) -> None:
        """Read a file that the course's notebooks made, of at most so many bytes: the one nearest to the notebooks."""
        paths = sorted((path for path in self._piece.files if path.rpartition("/")[2] == name), key=self._nearness)
        self._used.update(paths)
        try:
            for path in paths[:1]:
                self._add(name, data := self._read(path, most))
                if name == COURSE_FILE:
                    course_file.parse(data)
        except Unreadable as error:
            self.submission.notes.append(Problem.of(Code.FILE_UNREAD, name, why=error.problem))
        except ConfigurationError as error:
            self.submission.notes.append(Problem.of(Code.COURSE_FILE_UNREAD, name, error=str(error)))

    def _own_files(self) -> None:
        """Read the other files in the folder of the notebooks and below it; note those that are not read."""
        prefix = f"{self._base}/" if self._base else ""
        others = [path for path in self._piece.files if path not in self._used]
        beside = {path.removeprefix(prefix): path for path in others if path.startswith(prefix)}
        folders = {str(folder) for path in beside for folder in PurePosixPath(path).parents} & {*beside}
        self._note_files(Code.FILE_AND_FOLDER, sorted(folders))
        sizes = [(PurePosixPath(name), self._piece.files[beside[name]].size) for name in beside if name not in folders]
        paths, notes = own_files.choose(sizes, [*self.wanted, *report_files.made_files(self.reports)], self.packages)
        self.submission.notes += notes
        no_report = self.reports and not {item.name for item in self.submission.items} & {*self.reports}
        for name in map(str, paths):
            try:  # by their sizes, they are few enough together
                self._add(name, self._read(beside[name], own_files.MAX_FILE))
                if no_report and "/" not in name and name.casefold().endswith(report_files.PDF):
                    self.submission.notes.append(Problem.of(Code.OTHER_PDF, name))
            except Unreadable as error:
                self.submission.notes.append(Problem.of(Code.OWN_FILE_REFUSED, name, why=error.problem))
        outside = [path for path in others if not path.startswith(prefix)]
        self._note_files(Code.OUTSIDE_THE_FOLDER, sorted(outside))

    def _note_files(self, code: Code, paths: Sequence[str], **about: Any) -> None:
        """Add a note on files, if there are any; ``about`` are further parameters of the problem."""
        if paths:
            self.submission.notes.append(Problem.of(code, **named(paths), **about))


def choose_newest(
    submission: Submission, items: Iterable[Delivery], wanted: Sequence[str], reports: Sequence[str] = ()
) -> list[Problem]:
    """Set the notebooks, own files, answers, course data and PDFs of a submission to the newest version of each.

    If there are notebooks, return a note for each one that is missing and was not found unreadable.

    Parameters
    ----------
    submission : as it was read
    items : all files that were ever handed in for the student, in order of arrival, which decides between files of one
        time
    wanted : file names of the course's notebooks
    reports : file names of the course's reports, as PDF
    """
    in_order = sorted(items, key=lambda item: item.received)
    latest = {item.name: item for item in in_order}
    own = [name for name in sorted(latest) if name not in (*wanted, *reports, ANSWERS_FILE, COURSE_FILE)]
    received = [name for name in wanted if name in latest]
    submission.notebooks = {name: Notebook.read(latest[name].content).cells for name in received}
    submission.files = {name: latest[name].content for name in own}
    submission.answers_at_home = latest[ANSWERS_FILE].content if ANSWERS_FILE in latest else None
    submission.course = course_data(latest[COURSE_FILE].content) if COURSE_FILE in latest else {}
    submission.pdfs = {name: latest[name].content for name in reports if name in latest}
    absent = [name for name in wanted if received and name not in latest and name not in submission.unread]
    return [Problem.of(Code.NOT_HANDED_IN, name) for name in absent]


# --- which notebook of the course a file is ---------------------------------------------------------------------------


def _fitting(paths: Iterable[str], wanted: Sequence[str], *endings: str) -> dict[str, list[tuple[Fit, str]]]:
    """Find the files that may be a notebook (or a report) of the course, by their names.

    Browsers write ``x (1).ipynb`` and ``x.ipynb.txt``, JupyterLab ``x-Copy1.ipynb``, Canvas ``x-1.ipynb``, drives
    ``Copy of x.ipynb``, and platforms put people and numbers before it.

    Parameters
    ----------
    paths : of the files
    wanted : file names of the course's notebooks, or of its reports
    endings : of the files that are looked at

    Returns
    -------
    dict
        wanted name → (fit, path) of each file that may be it, the best first; names without any file are left out
    """
    words = {name: _words(name) for name in wanted}
    candidates: dict[str, list[tuple[Fit, str]]] = {}
    for path in (path for path in paths if path.casefold().endswith(endings)):
        file_name = path.rpartition("/")[2]
        own_words = _words(file_name)
        fits = {name: fit for name in wanted if (fit := _fit(file_name, own_words, name, words[name]))}
        if fits:  # the longest of the names that the file's name contains
            name = max(fits, key=lambda name: (words[name].count("_"), [-part for part in fits[name]]))
            candidates.setdefault(name, []).append((fits[name], path))
    return {name: sorted(candidates[name]) for name in wanted if name in candidates}


def _words(name: str) -> str:
    """Return the words and numbers in a file's name as ``_01_x_``, in small letters and without the ending."""
    folded = caseless(name)
    ending = next((ending for ending in (*archives.NOTEBOOK_ENDINGS, report_files.PDF) if folded.endswith(ending)), "")
    return f"_{'_'.join(_WORD.findall(folded.removesuffix(ending)))}_"


def _fit(file_name: str, words: str, wanted: str, wanted_words: str) -> Fit | None:
    """Return how well a file's name fits a name in the course; None unless it contains all words of that, in one piece.

    Parameters
    ----------
    file_name, words : the file's name, and its :func:`_words`
    wanted, wanted_words : the name in the course, and its words
    """
    if caseless(file_name) == caseless(wanted):
        return 0, 0
    before, found, after = words.partition(wanted_words)
    if not found:
        return None
    numbers = [int(number) for number in _DIGITS.findall(after)[-1:] if len(number) < 4]
    return 1 + before.count("_") + after.count("_"), -sum(numbers)


def _most_alike(cells: Sequence[Cell], masters: Mapping[str, Master]) -> str | None:
    """Return the notebook of the course that has most of these cells; None if two have as many, or if they are too few.

    Too few are less than three, or than half of the notebook's.
    """

    def alike(master: Master) -> int:
        """Return how many of the cells a notebook of the course holds, by their ids or their texts."""
        texts = {source_of(cell).strip() for cell in master.values()} - {""}
        return sum(cell.id in master or cell.grade_id in master or cell.source.strip() in texts for cell in cells)

    counts = Counter({name: alike(master) for name, master in masters.items()}).most_common(2)
    if not counts or (len(counts) == 2 and counts[0][1] == counts[1][1]):
        return None
    name, most = counts[0]
    return name if most >= max(_FEWEST_CELLS, len(masters[name]) // 2) else None


def is_changed(content: bytes, masters: Iterable[Master]) -> bool:
    """Return whether a student wrote something in a notebook that none of the course's, given as masters, holds."""
    notebook = Notebook.read(content)
    return all(_count_changed(notebook, master) for master in masters)


def _count_changed(notebook: Notebook, master: Master) -> int:
    """Return in how many cells of a notebook a student wrote."""
    return count_changed([*master.values()], notebook.cells)

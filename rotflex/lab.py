"""The laboratory as a notebook sees it: a student, their bench, and their answers.

import rotflex.lab

lab = rotflex.lab.start(student="ada", bench="virtual")
with lab.bench() as bench:
    recording = experiments.sweep(bench)
lab.answer("2.11", omega_n=omega_n)
K_s = lab.value("2.12", "K_s")
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from rotflex import hil
from rotflex.courseware import student_id
from rotflex.errors import AnswerError, ConfigurationError, StudentIDError
from rotflex.hil.draw import student_seed
from rotflex.workbook import forms
from rotflex.workbook.answers import AnswerBook
from rotflex.workbook.parts import Question
from rotflex.workbook.plain import plural
from rotflex.workbook.probes import check_seed
from rotflex.workbook.questions import EVERYTHING, NOTEBOOKS, TABLES, find, find_part
from rotflex.workbook.tables import ResultsTable

ANSWERS_FILE = "answers.json"
COURSE_FILE = "course.json"  #: in the notebooks' folder: {"student": "..."}
PROBE_SEED = "ROTFLEX_PROBE_SEED"  #: environment variable; grading sets it
DEMO = "demo"  #: the student of whoever gives no name
_RAISE = object()


def start(
    student: str = "", bench: str = "virtual", folder: str | os.PathLike[str] | None = None, quiet: bool = False
) -> Lab:
    """Begin a session in the laboratory.

    Parameters
    ----------
    student : whose bench and answers these are; without one, the student of ``course.json``, else "demo"
    bench : address of the bench, see :func:`rotflex.hil.open`
    folder : where answers are kept; the notebook's own by default
    quiet : leave out the welcome

    Raises
    ------
    ConfigurationError
        If the student's ID cannot be one, see :mod:`rotflex.courseware.student_id`.
    BenchError
        If the bench's address is not understood.
    """
    place = Path(folder) if folder is not None else Path.cwd()
    return Lab(_student(student, place), bench, place, quiet)


def _student(given: str, folder: Path) -> str:
    """The student's ID: the given one, or that of ``course.json``, or "demo"."""
    student: Any = given
    if not given:
        try:
            course = json.loads((folder / COURSE_FILE).read_text(encoding="utf-8"))
            student = course["student"] or DEMO
        except FileNotFoundError:
            student = DEMO
        except (ValueError, TypeError, KeyError) as error:
            raise ConfigurationError(
                f'{COURSE_FILE} should be {{"student": "your id"}}; it is not: {error!r}.'
            ) from None
    try:
        return student_id.normalised(student)
    except StudentIDError as error:
        if given:
            raise
        raise ConfigurationError(f"{COURSE_FILE}: {error}") from None


class Lab:
    """A student's session. Made by :func:`start`.

    Attributes
    ----------
    student : the student's id
    servo, joint : the parts on the bench as the data sheets state them (:mod:`rotflex.config`)
    questions : everything that can be answered, by number
    book : the answers so far
    address : of the bench, see :func:`rotflex.hil.open`
    seed : of the student's virtual bench
    """

    def __init__(self, student: str, uri: str, folder: Path, quiet: bool = False) -> None:
        self.student = student
        self.questions = EVERYTHING
        self.address = uri
        self.seed = student_seed(student)
        bench = self.bench()
        self.servo = bench.servo
        self.joint = bench.joint
        given_seed = os.environ.get(PROBE_SEED)
        probe_seed = self.seed if given_seed is None else check_seed(given_seed)
        self.book = AnswerBook(folder / ANSWERS_FILE, student, bench.identity, probe_seed)
        if not quiet:
            self._welcome()
        self._tell_notices()

    def __repr__(self) -> str:
        return f"<Lab: student {self.student}, bench {self.address}>"

    def _welcome(self) -> None:
        note = ' (nobody in particular: write your id in student = "...")' if self.student == DEMO else ""
        print(f"Student   {self.student}{note}")
        parts = f"arm in position {self.joint.arm_position}, encoders of type {self.servo.encoder}"
        print(f"Bench     {self.address}: {parts}")
        print(f"Answers   {self.book.path.name}")

    def _tell_notices(self) -> None:
        for notice in self.book.notices:
            print(f"Note      {notice}")
        self.book.notices.clear()

    def bench(self) -> hil.Bench:
        """This student's bench, to be opened in a ``with`` statement."""
        return hil.open(self.address, seed=self.seed)

    # --- answers -------------------------------------------------------------------------------------------------

    def answer(self, question: str, /, **parts: Any) -> None:
        """Give answers to parts of a question, by name. Each is acknowledged by a line, and kept if its form is right.

        Only the form is looked at (kind, shape, units that are plausible), never the value.

        Raises
        ------
        AnswerError
            If there is no such question or part; the message names those that there are.
        """
        print(*self.record(question, **parts), sep="\n")

    def record(self, question: str, /, **parts: Any) -> list[str]:
        """As :meth:`answer`, but returns the lines: for explorers, which have their own place for them."""
        replies = self.book.answer(find(question), parts)
        self._tell_notices()
        return [str(reply) for reply in replies]

    def value(self, question: str, part: str, default: Any = _RAISE) -> Any:
        """An answer that was given earlier, here or in another notebook.

        Parameters
        ----------
        question, part : as in ``lab.value("2.12", "K_s")``
        default : returned, with a word of warning, where there is no answer yet

        Returns
        -------
        float, array, text, sympy expression, ...: see :func:`rotflex.workbook.forms.decode`

        Raises
        ------
        AnswerError
            If there is no such question or part, or no answer yet and no default; the message names the notebook that
            asks for it.
        """
        asked = find(question)
        wanted = find_part(asked, part)
        self._refresh()
        content = self.book.get(question, part)
        if content is not None:
            try:
                return forms.decode(wanted, content)
            except AnswerError as error:
                raise AnswerError(f"{question}  {part}  cannot be read: {error} Answer it again.") from None
        missing = f"{question}  {part}  not answered yet: notebook {asked.notebook} asks for it"
        if default is _RAISE:
            raise AnswerError(f"{missing}. Answer it there first.")
        print(missing)
        return default

    def has(self, question: str, part: str) -> bool:
        """Whether there is an answer to a part.

        Raises
        ------
        AnswerError
            If there is no such question or part.
        """
        find_part(find(question), part)
        self._refresh()
        return self.book.get(question, part) is not None

    def table(self, number: str) -> ResultsTable:
        """A results table ("Table 2" or "Table 3") as filled in so far, to be shown.

        Raises
        ------
        AnswerError
            If there is no such table.
        """
        if number not in TABLES:
            raise AnswerError(f"There is no table {number!r}; there are {', '.join(TABLES)}.")
        self._refresh()
        return ResultsTable(TABLES[number], self.book)

    # --- progress ------------------------------------------------------------------------------------------------

    def progress(self, notebook: str = "") -> None:
        """Print which questions are answered: all of the course, or those of one notebook.

        Raises
        ------
        AnswerError
            If there is no such notebook.
        """
        if notebook and notebook not in NOTEBOOKS:
            raise AnswerError(f"There is no notebook {notebook!r} with questions; there are {', '.join(NOTEBOOKS)}.")
        self._refresh()
        for question in self.questions.values():
            if notebook in ("", question.notebook):
                missing = self._missing(question)
                state = f"missing: {', '.join(missing)}" if missing else "answered"
                print(f"{question.number:<16}  {question.title}: {state}")

    def summary(self) -> None:
        """Print how much of each notebook is answered, a line for each."""
        self._refresh()
        for notebook in NOTEBOOKS:
            asked = [question for question in self.questions.values() if question.notebook == notebook]
            done = sum(not self._missing(question) for question in asked)
            print(f"{notebook:<26}  {done} of {plural(len(asked), 'question')} answered")

    def _refresh(self) -> None:
        self.book.refresh()
        self._tell_notices()

    def _missing(self, question: Question) -> list[str]:
        """Names of the parts that have no answer."""
        return [part.name for part in question.parts if self.book.get(question.number, part.name) is None]

"""A student's session in a course: who they are, their answers, and how far they have come.

A course's own ``lab`` builds on it, and adds the bench.
"""

from __future__ import annotations

import os
from collections.abc import AsyncIterator, Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from labcourse import clock, course_file, courses, files, job, student_id
from labcourse.answers import cell_reports, forms, reflection
from labcourse.answers.answers import AnswerBook, ResultsTable, student_in
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.json_values import is_given
from labcourse.answers.parts import Question
from labcourse.answers.report_files import ReportFile, own_document
from labcourse.answers.words import SavedTexts
from labcourse.course_file import NOBODY
from labcourse.errors import AnswerError, ConfigurationError, StudentIDError
from labcourse.files import ANSWERS_FILE, COURSE_FILE, IN_BROWSER
from labcourse.messages import number_of
from labcourse.problems import Where
from labcourse.report import making, recorded_figures
from labcourse.run import by_program, from_notebook, place
from labcourse.run.from_notebook import cell_now
from labcourse.sentences import sentences

if TYPE_CHECKING:  # the bar is for live notebooks alone
    from labcourse.scene.course_bar import Chip, CourseBar

PROBE_SEED = "LABCOURSE_PROBE_SEED"  #: environment variable; grading sets it
_RAISE = object()


def student_of(given: str, folder: Path) -> str:
    """Return the student's ID: from ``course.json``, else from the hub, else the given one, else "demo".

    An ID that is known stays: a notebook that gives another one does not change the bench, and sets no answers aside.
    In a run by a check or by grading, the job's student counts (:mod:`labcourse.job`), and another ID is reported.
    Where another program runs the notebooks, the given ID counts.

    Raises
    ------
    ConfigurationError
        If it cannot be an ID.
    """
    if job.STUDENT:
        cell_reports.unused("student", given, job.STUDENT)
        return job.STUDENT
    typed = student_id.normalised(given) if given else ""
    known = "" if typed and by_program() else _known(folder, typed)
    if known and typed and student_id.caseless(known) != student_id.caseless(typed):
        print(f"Note      You are {known} here, and go on as {known}: the line student = {typed!r} changes nothing.")
        way = course_file.how_to_name()
        print(f"          If {known} is wrong, {way if IN_BROWSER else f'end JupyterLab and {way}'}")
    return known or typed or NOBODY


def _known(folder: Path, typed: str) -> str:
    """Return the ID from ``course.json``, else from the recorded answers, else from the hub; "" if there is none."""
    answers = folder / ANSWERS_FILE
    recorded = student_in(files.read(answers)) if answers.is_file() else ""
    named = (course_file.read(folder) or {}).get(course_file.STUDENT_KEY) or (recorded if recorded != NOBODY else "")
    try:
        return student_id.normalised(named) if named else course_file.hub_user()
    except StudentIDError as error:
        raise ConfigurationError(f"{COURSE_FILE}: {error}") from None
    except ConfigurationError:  # the hub's name cannot be an ID
        if not typed:
            raise
        return ""


class Session:
    """A student's session.

    Parameters
    ----------
    student : the student's ID
    folder : with the answers and notebooks
    catalogue : of the course
    bench : identity of the bench, as JSON data; it is saved with the answers
    seed : of the student's bench; inputs of functions are drawn from it, unless grading gives another

    Attributes
    ----------
    student, seed : as given
    catalogue, questions : what this class is asked; all that can be answered, by number
    book : the answers so far, except those in words
    saved_texts : the answers in words, as the notebooks in the folder hold them
    """

    def __init__(self, student: str, folder: Path, catalogue: Catalogue, bench: Mapping[str, Any], seed: int) -> None:
        self.student = student
        self.seed = seed
        course = course_file.of(folder) or {}
        self.catalogue = catalogue.of_release(course)
        self.questions = self.catalogue.everything
        self._folder = folder
        self._given = course.get(course_file.GIVEN, {})
        self.book = AnswerBook(folder / ANSWERS_FILE, student, bench, int(os.environ.get(PROBE_SEED, seed)))
        self.saved_texts = SavedTexts(folder, self.catalogue)
        self._place = place.NotebookPlace()
        self._bar: CourseBar | None = None
        self._lacked: dict[str, set[Where]] = {}  # of a cell as it ran last: answers that it asked for in vain

    @classmethod
    def begin(cls, package: str, catalogue: Catalogue, student: str = "") -> Self:
        """Begin a session in the notebook's folder, at the student's virtual bench.

        Parameters
        ----------
        package : import name of the course's package
        catalogue : of the course
        student : the student's ID; without one, that of :func:`student_of`

        Raises
        ------
        ConfigurationError
            If the ID cannot be used, or if ``course.json`` cannot be read.
        """
        courses.use(package)
        folder = Path.cwd()
        name = student_of(student, folder)
        seed = course_file.bench_policy(folder).seed_for(name)
        session = cls(name, folder, catalogue, {"uri": "virtual", "seed": seed}, seed)
        session.welcome("virtual")
        session.print_notices()
        return session

    def welcome(self, bench: str, *notes: str) -> None:
        """Show the course bar; where there is no live notebook, print who works at which bench.

        Parameters
        ----------
        bench : the bench in a few words
        notes : what else to know at the beginning, a line each
        """
        way = f'no ID yet: {course_file.how_to_name()}, or write your ID in student = "..."'
        student = self.student + (f" ({way})" if self.student == NOBODY else "")
        word = self.catalogue.bench_word.capitalize()
        if not from_notebook.in_kernel():
            print(f"{'Student':<9} {student}", f"{word:<9} {bench}", *notes, sep="\n")
            return
        from IPython.display import display

        from labcourse.scene.course_bar import CourseBar, Kept

        self._place = here = place.here(self._folder, self.catalogue)
        about = (f"Student {student} · {word} {bench}", *notes)
        report = [from_notebook.report_of(self.catalogue, here.name)]
        words = {"check": self._who(), "submit": self._who(), "make-report": report}
        labels = {"check": "Check", "submit": "Submit"} | ({"make-report": "Report"} if self.catalogue.reports else {})
        start: Callable[..., Iterator[str] | AsyncIterator[str]] = from_notebook.output_of
        kept = None
        if IN_BROWSER:
            from labcourse.run import in_browser

            start = in_browser.output_of
            kept = Kept(
                lambda: self._is_begun() and in_browser.is_loose(self._folder),
                lambda: in_browser.packed(self._folder, self.student),
                lambda data: in_browser.unpack(data, self._folder),
            )
        self._bar = CourseBar(
            lambda: self._drawn(about),
            "\n".join(filter(None, (here.line, *about))),
            labels,
            lambda command: start(command, words[command], self._folder, self._take),
            lambda cells: bool(here.name) and cells == from_notebook.saved_cells(self._folder / here.name),
            kept,
        )
        display(self._bar)

    def _drawn(self, about: Sequence[str]) -> str:
        """Return the course bar's HTML as it is now."""
        from labcourse.scene import course_bar

        self.refresh()
        here = self._place
        asked = [question for question in self.questions.values() if f"{question.notebook}.ipynb" == here.name]
        return course_bar.page(here.line, here.before, here.after, [*map(self._chip, asked)], about)

    def _chip(self, question: Question) -> Chip:
        from labcourse.scene.course_bar import ANSWERED, EMPTY, IN_PART, WAITS, Chip

        missing, here = self._missing(question), self._place
        needed = {
            where
            for cell, lacked in self._lacked.items()
            for where in lacked
            if here.builds.get(cell) == question.number and self.content(*where) is None
        }
        if not missing:
            state, words = ANSWERED, ""
        elif needed:
            state, words = WAITS, f"builds on {', '.join(sorted({number for number, _part in needed}))}"
        elif len(missing) < len(question.parts):
            state, words = IN_PART, f"missing: {', '.join(missing)}"
        else:
            state, words = EMPTY, ""
        cell = here.cells.get(question.number)
        return Chip(question.number, state, f"#cell-id={cell}" if cell else here.name, words)

    def print_notices(self) -> None:
        """Print messages about the stored answers."""
        for notice in (*self.book.notices, *sentences(self.saved_texts.notices)):
            print(f"Note      {notice}")
        self.book.notices.clear()
        self.saved_texts.notices.clear()

    # --- answers -------------------------------------------------------------------------------------------------

    def answer(self, question: str, /, **parts: Any) -> None:
        """Answer parts of a question, by name. Print a line for each; an answer is saved if its form is right.

        Only the form is checked (kind, shape, plausible units), never the value.

        Raises
        ------
        AnswerError
            If there is no such question or part; the message names those that there are.
        """
        print(*self.record(question, **parts), sep="\n")
        if not by_program():  # questions about texts are asked while the student remembers them
            self.saved_texts.refresh()
            self.print_notices()

    def record(self, question: str, /, **parts: Any) -> list[str]:
        """Answer as :meth:`answer` does, but return the lines, for explorers that show them themselves."""
        wanted = self.catalogue.whole.find(question)
        unasked = [name for name in parts if wanted.part(name) and not self.asks(question, name)]
        message = [f"{question}  not asked in your class: {', '.join(unasked)}"] if unasked else []
        parts = {name: value for name, value in parts.items() if name not in unasked}
        if unasked and not parts:
            return message
        replies = self.book.answer(wanted, parts, cell_now())
        for reply in replies:
            if not reply.recorded:
                cell_reports.refused(reply.question, reply.part, reply.refused)
        if not by_program():
            recorded = {reply.part: parts[reply.part] for reply in replies if reply.recorded}
            recorded_figures.keep_recorded(self._folder, self.catalogue.find(question), recorded, self.book)
        self.print_notices()
        if self._bar is not None:
            self._bar.refresh()
        return [*map(str, replies), *message]

    def asks(self, question: str, part: str) -> bool:
        """Check whether the class is asked a part of a question."""
        return question in self.questions and part in self.questions[question].names

    def value(self, question: str, part: str, default: Any = _RAISE) -> Any:
        """Return an earlier answer, of this notebook or another.

        Parameters
        ----------
        question, part : as in ``lab.value("1.2", "speed")``
        default : returned, with a printed warning, if there is no answer yet

        Returns
        -------
        float, array, text, sympy expression, ...: see :func:`labcourse.answers.forms.decode`

        Raises
        ------
        AnswerError
            If there is no such question or part, or no answer yet and no default; the message names the notebook that
            asks for it.
        """
        asked = self.catalogue.whole.find(question)
        wanted = asked.part(part)
        self.refresh()
        content, is_asked = self.content(question, part), self.asks(question, part)
        if content is not None:
            if not is_asked:
                print(f"{question}  {part}  is given to your class; it is not asked")
            try:
                return forms.decode(wanted, content)
            except AnswerError as error:
                raise AnswerError(f"{question}  {part}  cannot be read: {error} Answer it again.") from None
        missing, todo = f"{question}  {part}  is not asked in your class", ""
        if is_asked:
            cell_reports.lacked(question, part)
            self._lacked.setdefault(cell_now(), set()).add((question, part))
            how = " (words are read from the saved notebook)" if wanted.kind == "prose" else ""
            missing = f"{question}  {part}  not answered yet: notebook {asked.notebook} asks for it{how}"
            todo = " Answer it there first."
        if default is _RAISE:
            raise AnswerError(f"{missing}.{todo}")
        place.show_linked(missing, self.catalogue)
        return default

    def has(self, question: str, part: str) -> bool:
        """Check whether a part has an answer: a recorded one, a saved text, or a value that was given to the class.

        Raises
        ------
        AnswerError
            If the course has no such question or part. One that the class is not asked is no error.
        """
        self.catalogue.whole.find(question).part(part)
        self.refresh()
        return self.content(question, part) is not None

    def given(self, questions: str, *values: Any) -> bool:
        """Check whether a cell has the values that it needs; if not, print which questions give them.

        Parameters
        ----------
        questions : their numbers, as in ``lab.given("1.2, 1.3", speed, K)``
        values : what the cell needs of them; None or ``...`` for a value that is not there yet

        Raises
        ------
        AnswerError
            If there is no such question.
        """
        numbers = [self.catalogue.whole.find(number.strip()).number for number in questions.split(",")]
        if all(map(is_given, values)):
            return True
        asked = [number for number in numbers if number in self.questions]
        if asked:
            named = f"question {asked[0]}" if len(asked) == 1 else f"questions {', '.join(asked)}"
            place.show_linked(f"Answer {named} first; then run this cell again.", self.catalogue)
        else:
            print("This cell builds on questions that your class is not asked. Go on below it.")
        return False

    def content(self, question: str, part: str) -> dict[str, Any] | None:
        """Return an answer as JSON data: a given value, a text of the saved notebook, or a recorded answer; or None."""
        given = None if self.asks(question, part) else self.given_value(question, part)
        if given is None:
            return self.saved_texts.get(question, part) or self.book.get(question, part)
        return forms.encode(self.catalogue.whole.find(question).part(part), given, self.book.probe_seed).content

    def given_value(self, question: str, part: str) -> Any:
        """Return the value that is given for a part which the class is not asked; None if there is none."""
        return self._given.get(question, {}).get(part)

    def table(self, number: str) -> ResultsTable:
        """Return a results table, by its number as "Table 1", filled in so far, for a notebook to show.

        Raises
        ------
        AnswerError
            If there is no such table.
        """
        if number not in self.catalogue.tables:
            raise AnswerError(f"There is no table {number!r}; there are {', '.join(self.catalogue.tables)}.")
        self.refresh()
        return ResultsTable(self.catalogue.tables[number], self.book)

    # --- progress ------------------------------------------------------------------------------------------------

    def progress(self, notebook: str = "") -> None:
        """Print which questions are answered, in the whole course or in one notebook.

        Answers in words are read from the saved notebooks.

        Parameters
        ----------
        notebook : its name, or how the name starts, as "02"; "" for all notebooks

        Raises
        ------
        AnswerError
            If there is no such notebook.
        """
        notebooks = self.catalogue.find_notebooks(*([str(notebook)] if notebook else []))
        self.refresh()
        for question in self.questions.values():
            if question.notebook in notebooks:
                missing = self._missing(question)
                state = f"missing: {', '.join(missing)}" if missing else "answered"
                if own := self.own_document(question.number):
                    state = f"in your own document, {own.name}"
                print(f"{question.number:<16}  {question.title}: {state}")
        self._print_how_texts_are_read()

    def summary(self) -> None:
        """Print how much of each notebook is answered, a line for each. Texts count as they are saved."""
        self.refresh()
        lines = []
        for notebook in self.catalogue.notebooks:
            asked = [question for question in self.questions.values() if question.notebook == notebook]
            done = sum(not self._missing(question) for question in asked)
            questions = number_of(len(asked), "question")
            lines.append(f"{notebook:<26}  {done} of {questions} answered")
        place.show_linked("\n".join(lines), self.catalogue)
        self._print_how_texts_are_read()

    # --- predictions ---------------------------------------------------------------------------------------------

    def predict(self, question: str, /, **values: Any) -> None:
        """Predict the result of an experiment, before it. A prediction cannot be changed later, and is never marked.

        Without a prediction, print what can be predicted, and what was.

        Raises
        ------
        AnswerError
            If nothing can be predicted of this question, or not this.
        """
        print(*reflection.predict(self.book, self.catalogue.predictions, question, values), sep="\n")

    def observed(self, question: str, /, why: str = "") -> None:
        """Print what was predicted of an experiment beside what was recorded, and what to think about.

        Parameters
        ----------
        question : number, as in "1.2"
        why : your explanation of the difference, in a sentence: it is saved, and never marked

        Raises
        ------
        AnswerError
            If nothing can be predicted of this question, or ``why`` is not text or is too long.
        """
        self.refresh()
        lines = reflection.observed(self.book, self.catalogue.predictions, question, why, self._found)
        print(*lines, sep="\n")

    def predicted(self, question: str, name: str) -> Any:
        """Return a prediction, to be drawn beside a recording: a number or a word; None if there is none.

        Raises
        ------
        AnswerError
            If nothing can be predicted of this question.
        """
        self.book.refresh()
        return reflection.value(self.book, self.catalogue.predictions, question, name)

    # --- own answers, compared with each other -----------------------------------------------------------------------

    def checks(self) -> Iterable[reflection.Comparison]:
        """Return the course's checks that compare this student's own answers with each other."""
        return ()

    def reflect(self, *notebooks: str) -> None:
        """Compare your own answers and recordings with each other, and print questions about what does not agree.

        The correct answers are not used, nothing is marked, and nothing is saved.

        Parameters
        ----------
        notebooks : by their numbers, as in ``lab.reflect("02")``: checks that are possible when these are done; all
            unless given

        Raises
        ------
        AnswerError
            If there is no such notebook.
        ConfigurationError
            If ``course.json`` cannot be read.
        """
        if reason := reflection.silence(course_file.of(self._folder) or {}, clock.now()):
            print(reason)
            return
        self.refresh()
        checks = [
            check
            for check in reflection.of_notebooks(self.checks(), self.catalogue.whole, map(str, notebooks))
            if all(self.asks(*where) or self.content(*where) is not None for where in check.about)
        ]
        place.show_linked(str(reflection.reflect(checks, self._found)), self.catalogue)

    def _found(self, question: str, part: str) -> Any:
        """Return an answer; raises AnswerError if there is none, or none that can be read."""
        content = self.content(question, part)
        return forms.decode(self.catalogue.whole.everything[question].part(part), content)

    def report(self, name: str, pdf: str | os.PathLike[str] = "") -> None:
        """Make a report of the recorded and saved answers, as HTML and PDF; or use a PDF of your own as the report.

        Parameters
        ----------
        name : of the report, or the beginning of its name
        pdf : file of your own document

        Raises
        ------
        AnswerError
            If there is no such report, or its notebook or your document cannot be read.
        """
        making.report(self, self._folder, name, cell_now(), pdf)

    # --- before it is handed in ------------------------------------------------------------------------------------

    def check(self, everything: bool = False) -> None:
        """Run the saved notebooks as for marking, and print which answers are recorded, which are not, and why.

        They run in a copy of the folder. Nothing is marked, and nothing is changed.

        Parameters
        ----------
        everything : show what is missing in all notebooks, however long it is
        """
        options = [*self._who(), *(["--everything"] if everything else [])]
        from_notebook.run("check", options, self._folder, cell_now())

    def submit(self, *partners: str) -> None:
        """Check the saved notebooks, and pack them into one zip to hand in, with a receipt.

        Parameters
        ----------
        partners : IDs of those who hand in the same work
        """
        options = [*self._who(), *(f"--with={partner}" for partner in partners)]
        from_notebook.run("submit", options, self._folder, cell_now(), needs_saving=True, take=self._take)

    def _is_begun(self) -> bool:
        """Return whether anything is recorded, or written in words."""
        parts = ((question.number, part.name) for question in self.questions.values() for part in question.parts)
        return any(self.saved_texts.get(*where) or self.book.get(*where) for where in parts)

    def _take(self, path: Path) -> None:
        """Give a file to hand in to the browser's downloads, where the folder is in a browser."""
        if self._bar is not None:
            self._bar.hand_over(path)

    def _who(self) -> list[str]:
        """Return the options of a command that say for whom, and in which notebook, it is run."""
        return ["--student", self.student, *(["--notebook", self._place.name] if self._place.name else [])]

    def restore(self, *notebooks: str | int) -> None:
        """Restore the course's cells, as the installed release has them. No answer is changed.

        Parameters
        ----------
        notebooks : by their numbers, as in ``lab.restore("02")``; all unless given
        """
        from_notebook.run("restore", ["--", *map(str, notebooks)], self._folder, cell_now(), needs_saving=True)

    def _print_how_texts_are_read(self) -> None:
        if any(part.kind == "prose" for question in self.questions.values() for part in question.parts):
            print("Answers in words are read from the saved notebooks: save, and run this cell again.")

    def refresh(self) -> None:
        """Read answers and saved notebooks again, where they have changed."""
        self.book.refresh()
        self.saved_texts.refresh()
        self.print_notices()

    def own_document(self, report: str) -> ReportFile | None:
        """Return the PDF in the folder that is the student's own document for a report; None if there is none."""
        return own_document(self._folder, self.catalogue, report)

    def _missing(self, question: Question) -> list[str]:
        """Return the names of the parts without an answer; texts of a report are not missing in an own document."""
        if self.own_document(question.number):
            return []
        return [part.name for part in question.parts if self.content(question.number, part.name) is None]

"""A course as one object: its questions, its key, the truth of a student's bench, and what students get.

A course's folder holds the notebooks with solutions, ``course.py``, which defines the object as ``COURSE``, and the
settings, ``course.toml``. Beside the folder lie the student notebooks (``notebooks/``, derived), what may be handed out
with them (``data/``), and what was handed out before (``releases/``). Each process that needs the course loads it once
from its folder, and passes it on from there.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import json
import math
import sys
import traceback
import types
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import labcourse
from labcourse import courses
from labcourse.benches import REAL, BenchPolicy
from labcourse.errors import AnswerError, ConfigurationError, GradingError

if TYPE_CHECKING:  # every command imports this module, and --help should be quick
    from labcourse.answers.catalogue import Catalogue
    from labcourse.grading.settings import CourseSettings
    from labcourse.grading.verdicts import Key

SOLUTIONS_VARIABLE = "LABCOURSE_SOLUTIONS"  #: environment variable with the course's folder, where no option names it
OUTCOMES_FILE = "outcomes.toml"  #: in the course's folder, optional: the outcomes of its codes
SHEETS_FILE = "sheets.toml"  #: in the course's folder, optional: the layout of its scoring sheets
RUBRIC_FILE = "rubric.toml"  #: in the course's folder, optional: what a person looks for in answers in words
SOLUTIONS = Path("solutions")  #: usual name of the course's folder
_FILE = "course.py"  # in the course's folder: it defines COURSE
_FIRST_INSTRUCTOR_NOTEBOOK = "90"  # from this number on, notebooks are for instructors only


@dataclass(frozen=True)
class StatedNumber:
    """A number that the course's texts repeat. Wherever a text matches the pattern, its number must be this one.

    Attributes
    ----------
    what : a name for people, for messages
    pattern : regular expression with the number as its group; white space in it matches any white space
    value : the number
    """

    what: str
    pattern: str
    value: float


def _default_settings() -> CourseSettings:
    """Return settings with all defaults; their module is imported only when they are needed."""
    from labcourse.grading.settings import CourseSettings

    return CourseSettings()


@dataclass(frozen=True)
class Course:
    """A course for instructors.

    Attributes
    ----------
    name : of the folder and the zip that students get
    catalogue : of its questions; once it is loaded, of those of the class, without optional notebooks that are off
    key : question → part → check; once it is loaded, for these questions
    bench : function of a student's ID and a policy of benches: returns that student's bench as it really is, for the
        checks of the key
    title : of the course, for people; a title in the settings replaces it
    presets : names of the benches that all students may be given
    draw : version of how it draws benches
    own_seed : function of a student's ID: returns the seed of their own bench, by which a partner keeps the bench when
        the student is erased; None where benches are not drawn from seeds
    given : (question, part) → function of a student's ID and a policy, for classes that are not asked the part: it
        returns the value that they are given. For the ID "" of a release, None says that each session works it out
    benches : name of each of the laboratory's benches with known truth → what is wrong with it, or ""
    evidence : function of the students' package, "package.module:function", that reads the files which a student
        brought from a laboratory's bench, and returns plain data; it is called in the sandbox
    bench_of_evidence : function of a policy of the laboratory's benches, and of what ``evidence`` returned (JSON, a
        claim): returns the bench that the files were made at. The ``problems`` and ``notes`` of the bench are reported;
        where its ``is_known`` is false, a person marks what was measured
    knows_bench : function of the notebooks' parameters: returns whether the truth of the bench that they are run on is
        known. What answers say of their bench is a claim: it is compared with the ``identity`` of the true bench, if
        that has one, and a difference is reported
    package : import name of the course's package, in which the notebooks of a release are installed
    packages : import names of the packages that students get besides labcourse
    withheld : modules of these packages that students do not get, as "package.module": what they are asked to build
    command : the program that students type
    requires : further packages that ``packages`` need, as pip takes them
    parameters : parameters of the notebooks when they are graded, besides ``student``
    follow_limit : how many times farther from 0 than its plausible range (or nearer to 0, or of the other sign) a
        number may be for what follows from it to count; beyond, a person decides. Without a limit, it always counts
    imports : modules that notebooks use, to be imported once for all of them
    stated : numbers that the course's texts repeat
    settings : decisions for a term
    folder : where it was loaded from
    """

    name: str
    catalogue: Catalogue
    key: Key
    bench: Callable[[str, BenchPolicy], Any]
    package: str
    packages: tuple[str, ...]
    title: str = ""
    presets: tuple[str, ...] = ()
    draw: int | None = None
    own_seed: Callable[[str], int] | None = None
    given: Mapping[tuple[str, str], Callable[[str, BenchPolicy], Any]] = field(default_factory=dict)
    benches: Mapping[str, str] = field(default_factory=dict)
    evidence: str = ""
    bench_of_evidence: Callable[[BenchPolicy, bytes], Any] | None = None
    knows_bench: Callable[[Mapping[str, Any]], bool] = lambda bench: True
    command: str = "labcourse"
    withheld: tuple[str, ...] = ()
    requires: tuple[str, ...] = ()
    parameters: Mapping[str, str] = field(default_factory=dict)
    follow_limit: float = math.inf
    imports: tuple[str, ...] = ()
    stated: Sequence[StatedNumber] = ()
    settings: CourseSettings = field(default_factory=_default_settings)
    folder: Path = Path()

    def true_bench(self, student: str, policy: BenchPolicy | None = None, evidence: bytes = b"") -> Any:
        """Return a student's bench as it really is.

        Parameters
        ----------
        student : ID
        policy : which bench each student has, in the release under which this one worked; None for that of the settings
        evidence : what the function ``evidence`` returned in the sandbox, as JSON; b"" for nothing
        """
        policy = policy or self.settings.bench
        if policy.which == REAL and self.bench_of_evidence is not None:
            return self.bench_of_evidence(policy, evidence)
        return self.bench(student, policy)

    @property
    def off(self) -> frozenset[str]:
        """The names of the optional notebooks that the class does not have."""
        return frozenset(self.catalogue.optional).difference(self.settings.optional)

    @property
    def asked_catalogue(self) -> Catalogue:
        """The questions of the class: the catalogue without questions in notebooks that the class does not have."""
        return self.catalogue.without(self.settings.without)

    def given_values(
        self, student: str, policy: BenchPolicy, asked_parts: Collection[tuple[str, str]]
    ) -> dict[tuple[str, str], Any]:
        """Return (question, part) → value that a student is given in place of an answer that the class is not asked.

        Parameters
        ----------
        student : ID; "" for a release, in which None stands for a value that each session works out
        policy : which bench each student has
        asked_parts : the (question, part) that the class is asked

        Raises
        ------
        GradingError
            If a value cannot be given to students with benches of this policy.
        """
        return {where: value(student, policy) for where, value in self.given.items() if where not in asked_parts}

    @cached_property
    def cells(self) -> dict[tuple[str, str], str]:
        """(question, part) → id of the cell in which a student answers it, for parts that a cell records."""
        from labcourse.run.alignment import asked_cells

        notebooks = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in self.notebooks}
        found = asked_cells(notebooks, self.catalogue)
        return {where: entry.cell.removesuffix("-answer") for _name, entry, parts in found for where in parts}

    def notebook_of(self, question: str | None) -> str:
        """Return the notebook of a question, without ending; "" if the course does not ask it, or it is None."""
        asked = self.catalogue.marked
        return asked[question].notebook if question in asked else ""

    @property
    def notebooks(self) -> list[Path]:
        """Paths of the notebooks with solutions that have a student version, by name, without those that are off."""
        paths = [path for path in sorted(self.folder.glob("*.ipynb")) if path.name < _FIRST_INSTRUCTOR_NOTEBOOK]
        return [path for path in paths if path.stem not in self.off]

    @property
    def student_notebooks(self) -> Path:
        """The folder of the student notebooks."""
        return self.folder.parent / courses.NOTEBOOKS

    @property
    def data(self) -> Path:
        """The folder of what may be handed out with the notebooks."""
        return self.folder.parent / "data"

    @property
    def releases(self) -> Path:
        """The folder in which releases are stored."""
        return self.folder.parent / self.settings.releases


def find(option: str | Path | None = None, with_optional: bool = False) -> Course:
    """Find and load a course: the one named, or the one in the current folder, or the one installed from a folder.

    Parameters
    ----------
    option : the course's folder, or the one above it; None or "" if no course is named
    with_optional : as for :func:`load`

    Raises
    ------
    GradingError
        If there is none (the message says how to name one), or as :func:`load` does.
    """
    folder = Path(option or "")
    if not (folder / _FILE).is_file() and ((folder / SOLUTIONS / _FILE).is_file() or not option):
        folder = folder / SOLUTIONS
    if not (option or folder.is_dir()):
        folder = _solutions_beside_installed() or folder
    if not folder.is_dir():
        raise GradingError(
            f"There is no course at {folder.resolve()}. Name the course's folder, the one that holds {_FILE}, by "
            f"--solutions FOLDER or by the environment variable {SOLUTIONS_VARIABLE}. Or name a course that was "
            f"installed by pip install -e, by --course NAME or by {courses.COURSE_VARIABLE}."
        )
    return load(folder, with_optional)


def _solutions_beside_installed() -> Path | None:
    """Return the folder of solutions of the course that is installed from a folder; None if there is none.

    It is looked for in the folders above the course's package, the nearest first.
    """
    try:
        installed = courses.current()
    except ConfigurationError:
        return None
    return next((above / SOLUTIONS for above in installed.above if (above / SOLUTIONS / _FILE).is_file()), None)


def load(folder: Path, with_optional: bool = False) -> Course:
    """Load the course in a folder. Its code is run.

    Parameters
    ----------
    folder : of the course
    with_optional : with all notebooks, whatever the settings say: for those who write the course

    Raises
    ------
    GradingError
        If it cannot be loaded, if its key does not fit its catalogue, or if its settings are not understood.
    """
    from labcourse.grading import settings

    folder = folder.resolve()
    if not (folder / _FILE).is_file():
        raise GradingError(
            f"{folder} is not a course's folder: it holds no {_FILE}. Name one by --solutions FOLDER, or by the "
            f"environment variable {SOLUTIONS_VARIABLE}."
        )
    package = _make_package(folder)
    if str(folder.parent) not in sys.path:
        sys.path.append(str(folder.parent))  # the students' packages may lie beside the course
    try:
        module = importlib.import_module(f"{package}.course")
    except Exception as error:
        raise GradingError(
            f"The course in {folder} cannot be loaded: {type(error).__name__}: {error}{_origin(error, folder)}"
        ) from error
    course = getattr(module, "COURSE", None)
    if not isinstance(course, Course):
        raise GradingError(f"{folder} should define COURSE, a labcourse.grading.course.Course, in {_FILE}.")
    _check_key(course)
    course_settings = settings.read(folder, course.presets, course.draw, course.benches, course.catalogue)
    if with_optional:
        course_settings = replace(course_settings, optional=course.catalogue.optional, without=())
    title = course_settings.title or course.title or course.name
    catalogue = course.catalogue.without({*course.catalogue.optional}.difference(course_settings.optional))
    key = {number: checks for number, checks in course.key.items() if number in catalogue.marked}
    return replace(course, catalogue=catalogue, key=key, folder=folder, settings=course_settings, title=title)


def _origin(error: Exception, folder: Path) -> str:
    """Return " (file, line)" of the course's code that an error came from; "" for none and for a syntax error."""
    engine, where = Path(labcourse.__file__).parent, ""
    for frame in () if isinstance(error, SyntaxError) else traceback.extract_tb(error.__traceback__):
        path = Path(frame.filename)
        is_library = path.is_relative_to(engine) or "site-packages" in path.parts
        if path.is_relative_to(folder.parent) and not is_library:
            where = f" ({path.name}, line {frame.lineno})"
    return where


def package_folder(name: str) -> Path:
    """Return the folder of a package that students get, by its import name.

    Raises
    ------
    GradingError
        If there is no such package.
    """
    spec = importlib.util.find_spec(name)
    if spec is None or spec.origin is None:
        raise GradingError(f"The course needs the package {name}, which is not to be found.")
    return Path(spec.origin).parent


def _make_package(folder: Path) -> str:
    """Register a course's folder as a package and return the package's name.

    The name is unique to the folder, so that modules of equal names of two courses do not collide.
    """
    name = f"labcourse_course_{hashlib.sha256(str(folder).encode()).hexdigest()[:12]}"
    if name not in sys.modules:
        sys.modules[name] = package = types.ModuleType(name)
        package.__path__ = [str(folder)]
    return name


def _check_key(course: Course) -> None:
    """Raise GradingError unless the key's questions have a check of the right kind for each of their parts, no more."""
    for number, checks in course.key.items():
        try:
            question = course.catalogue.find_marked(number)
        except AnswerError as error:
            raise GradingError(f"The key: {error}") from None
        if set(checks) != set(question.names):
            parts, names = ", ".join(question.names), ", ".join(checks)
            raise GradingError(f"The key: question {number} has the parts {parts}, and the key has checks for {names}.")
        for part in question.parts:
            check = checks[part.name]
            kinds = getattr(check, "kinds", ())
            if isinstance(kinds, str) or part.kind not in kinds:
                raise GradingError(
                    f"The key: {number}, {part.name} is a {part.kind}; its check, {type(check).__name__}, is for "
                    f'{kinds or "nothing"}. A check names what it can check, as kinds = ("{part.kind}",).'
                )

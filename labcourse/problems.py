"""What went wrong with a hand-in, and what is worth knowing about it: codes with parameters, never sentences.

Each room reports :class:`Problem` objects, and others decide and count by their codes. The module
:mod:`labcourse.sentences` puts them into words where a person reads them. Texts that a student's code or file brings
are parameters: bounded here, cleaned when they are shown, and never searched.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum, auto
from typing import Any

LONGEST = 2_000  #: characters of a parameter
MOST = 200  #: entries of a parameter that is a list


class Code(StrEnum):
    """What happened. Each code has a sentence in :mod:`labcourse.sentences`."""

    # who handed in
    OTHER_STUDENT_NAMED = auto()
    PARTNERS_UNCONFIRMED = auto()
    PARTNERS_DECLINED = auto()
    PARTNER_UNKNOWN = auto()
    TOO_MANY_PARTNERS = auto()
    NOT_ON_ROSTER = auto()
    HANDED_IN_BY_PARTNER = auto()
    DECLINED_AS_PARTNER = auto()
    CONFIRMATION_NEEDED = auto()
    GIVEN_TO_OWNER = auto()
    # why nobody is the owner
    NAMES_NOBODY = auto()
    NAME_AND_NUMBER_DIFFER = auto()
    NAME_WITH_OTHER_NUMBERS = auto()
    SEVERAL_STUDENTS = auto()
    PLATFORM_NAME_UNKNOWN = auto()
    PLATFORM_NAME_WITHOUT_ROSTER = auto()
    NOT_AN_ID = auto()
    CALLED_LIKE_NOBODY = auto()
    NOTHING_OF_THE_COURSE = auto()
    COURSE_FILE_NAMES = auto()
    LOOSE_NOTEBOOK = auto()
    OWNER_TO_BE_GIVEN = auto()
    # why a file, a folder or an archive is not read
    TOO_MANY_FILES = auto()
    TOO_MANY_BYTES = auto()
    SYSTEM_ERROR = auto()
    NOT_ORDINARY = auto()
    LONG_TABLE_OF_CONTENTS = auto()
    NOT_AN_ARCHIVE = auto()
    GONE = auto()
    ENCRYPTED = auto()
    UNUSUAL_COMPRESSION = auto()
    ARCHIVE_DAMAGED = auto()
    SEVERAL_PIECES = auto()
    UNUSUAL_HEADERS = auto()
    PACKED_OTHERWISE = auto()
    TOO_MANY_ARCHIVES = auto()
    THERE_TWICE = auto()
    TOO_DEEP = auto()
    NOT_A_FILE = auto()
    LEADS_OUTSIDE = auto()
    LONG_PATH = auto()
    NEWER_OF_SAME_NAME = auto()
    SEVERAL_HAND_INS = auto()
    NO_FOLDER_NO_ZIP = auto()
    WRITTEN_BY_PLATFORM = auto()
    IGNORED = auto()
    # what an instructor may decide, and why
    DECIDED = auto()
    CHOSEN_BY_TIME = auto()
    ONLY_THEIR_COMPUTER = auto()
    ONLY_THEIR_COURSE_FILE = auto()
    NAMES_FIT_PLATFORMS = auto()
    NAMES_OF_SEVERAL_PLATFORMS = auto()
    PLATFORM_UNDECIDED = auto()
    DECISION_ON_NO_FILE = auto()
    DECISION_ON_PARTNER_UNCLEAR = auto()
    DECIDED_OWNER_UNKNOWN = auto()
    DECIDED_TIME_UNCLEAR = auto()
    # what was read
    SUBMISSION_UNREAD = auto()
    ARCHIVE_UNREAD = auto()
    NO_NOTEBOOK = auto()
    NOTEBOOK_UNREAD = auto()
    OLDER_NOTEBOOK_COUNTS = auto()
    REPORT_UNREAD = auto()
    NOT_HANDED_IN = auto()
    EMPTY_BESIDE_ANSWERED = auto()
    FILES_REFUSED = auto()
    PACKED_FILES = auto()
    PACKED_ARCHIVES = auto()
    ONE_OF_SEVERAL = auto()
    TAKEN_BY_NAME = auto()
    TAKEN_BY_CELLS = auto()
    NOT_RECOGNISED = auto()
    NO_NOTEBOOK_IN_PLACE = auto()
    OTHER_PDF = auto()
    FILE_UNREAD = auto()
    COURSE_FILE_UNREAD = auto()
    FILE_AND_FOLDER = auto()
    OUTSIDE_THE_FOLDER = auto()
    OWN_FILE_REFUSED = auto()
    MORE_OWN_FILES_REFUSED = auto()
    ARRIVED = auto()
    VERSION_WORTH_LESS = auto()
    VERSION_NOT_RUN = auto()
    VERSION_TO_BE_RUN = auto()
    VERSION_AFTER_GIVEN_BACK = auto()
    VERSION_TAKEN = auto()
    # who was erased
    ERASED_HANDED_IN = auto()
    ERASED_NAMED = auto()
    # why an own file does not come along
    CHANGES_SETTINGS = auto()
    WRITTEN_BY_RUN = auto()
    HIDES_MODULE = auto()
    OWN_FILES_TOO_LARGE = auto()
    TOO_MANY_OWN_FILES = auto()
    OWN_FILE_TOO_LARGE = auto()
    OWN_FILE_TOO_DEEP = auto()
    UNUSUAL_NAME = auto()
    # notebooks, texts and pictures
    NOT_JSON = auto()
    NO_CELLS = auto()
    TOO_MANY_CELLS = auto()
    NOTEBOOK_TOO_LARGE = auto()
    TOO_MANY_PARTS = auto()
    TOO_MANY_LINES = auto()
    CELLS_TOO_LARGE = auto()
    PASTED_PICTURE_LEFT_OUT = auto()
    CELL_TOO_LONG = auto()
    CELL_REPEATED = auto()
    CELL_CHANGED = auto()
    CELL_IS_TEXT = auto()
    UNTOUCHED = auto()
    TEXT_TOO_LONG = auto()
    TEXT_OF_FEW_WORDS = auto()
    TEXT_IN_OTHER_KIND = auto()
    TEXT_ALSO_BELOW = auto()
    TEXT_BELOW = auto()
    TEXT_ABOVE = auto()
    TEXT_IN_PLACE = auto()
    TEXT_IN_QUESTION = auto()
    TEXT_BESIDE_NOT_READ = auto()
    TEXT_COPIES_DIFFER = auto()
    PICTURE_LEFT_OUT = auto()
    TOO_MANY_PICTURES = auto()
    PICTURE_NOT_IN_CELL = auto()
    PICTURE_NOT_IN_NOTEBOOK = auto()
    PICTURE_DAMAGED = auto()
    PICTURE_TOO_LARGE = auto()
    PICTURE_UNUSUAL = auto()
    PICTURE_OF_MANY_PIXELS = auto()
    PICTURE_OF_OTHER_FORMAT = auto()
    PICTURE_TOO_WIDE = auto()
    PICTURES_OF_MANY_PIXELS = auto()
    PICTURE_NOT_REDUCED = auto()
    REPORT_TOO_LARGE = auto()
    NOT_A_PDF = auto()
    REPORT_IN_PDF = auto()
    MAY_ASK_FOR_PASSWORD = auto()
    # the release, and what was recorded at home
    RELEASE_CONTRADICTED = auto()
    RELEASE_UNKNOWN = auto()
    RELEASE_EARLIER = auto()
    CLAIM_UNREAD = auto()
    VALUE_SUPPLIED = auto()
    # the run
    CELL_TIMED_OUT = auto()
    PYTHON_DIED = auto()
    RUN_TIMED_OUT = auto()
    PRINTED_TOO_MUCH = auto()
    RUN_ENDED_EARLY = auto()
    RESULT_UNREAD = auto()
    GRADING_FAILED = auto()
    EARLIER_MARKS_STAY = auto()
    UNKNOWN = auto()
    # cells that stopped, and what it cost
    CELL_STOPPED = auto()
    STOPPED_WITHOUT_COST = auto()
    STOPPED_ON_UNANSWERED = auto()
    STOPPED_ON_REFUSED = auto()
    RECORDED_AT_HOME = auto()
    NAME_NOT_USED = auto()
    # why a cell stopped
    PYTHON_ENDED = auto()
    LEFT_PYTHON = auto()
    TOOK_TOO_LONG = auto()
    MODULE_MISSING = auto()
    FILE_NOT_FOUND = auto()
    BENCH_STOPPED = auto()
    INPUT_NEEDED = auto()
    NONE_USED = auto()
    NEWER_PYTHON_NEEDED = auto()
    RAISED = auto()
    # why there is no answer
    REFUSED = auto()
    BUILDS_ON_REFUSED = auto()
    BUILDS_ON_UNANSWERED = auto()
    BUILDS_ON_STOPPED = auto()
    LEFT_AS_IT_WAS = auto()
    RUN_AND_EMPTY = auto()
    MISSING_HERE = auto()
    NOTEBOOK_NOT_THERE = auto()
    NOTHING_LEFT = auto()
    NO_CELL_KNOWN = auto()
    CELL_NOT_AMONG = auto()
    RUN_LEAVES_EMPTY = auto()
    NOT_IN_THE_RUN = auto()
    NO_TEXT = auto()
    NO_REPORT_TEXT = auto()
    NOTEBOOK_OF_IT_ABSENT = auto()
    NOTEBOOK_OF_IT_UNREAD = auto()
    NOTHING_READ = auto()
    # marking
    NO_ANSWERS_LEFT = auto()
    ANSWERS_UNREAD = auto()
    ANSWER_TO_NOTHING = auto()
    MORE_OF_THIS_SORT = auto()
    ANSWERS_OF_ANOTHER = auto()
    ANSWERS_OF_ANOTHER_BENCH = auto()
    GIVEN_TO_CLASS = auto()
    NOT_IN_KEY = auto()
    KEY_FAILED = auto()
    MALFORMED = auto()
    NOT_COMPARED = auto()
    FOLLOWS_FROM_ABSURD = auto()
    KEY_HAS_FAULT = auto()
    SUPPLIED = auto()
    PARTNER_NOT_CONFIRMED = auto()
    NOT_GRADED = auto()
    SAID_BY_COURSE = auto()
    DOUBTED_BY_COURSE = auto()
    # what an instructor has to do
    TODO_ASK_FOR_WORK = auto()
    TODO_ASK_FOR_CHANGES = auto()
    TODO_GRADE = auto()
    TODO_GRADE_VERSION = auto()
    TODO_DECIDE_TIME = auto()
    TODO_FAILED = auto()
    TODO_FAILED_AGAIN = auto()
    TODO_RUN_TIMED_OUT = auto()
    TODO_OUT_OF_MEMORY = auto()
    TODO_PRINTED_TOO_MUCH = auto()
    TODO_RUN_ENDED_EARLY = auto()
    TODO_ANSWERS_UNREAD = auto()
    TODO_CELL_TIMED_OUT = auto()
    TODO_INSTALL_MODULE = auto()
    TODO_NEWER_PYTHON = auto()
    TODO_FILE_LEFT_OUT = auto()
    TODO_RECORDED_AT_HOME = auto()
    TODO_READ_REPORT = auto()
    TODO_OLDER_FILE_COUNTS = auto()
    TODO_ASK_AGAIN = auto()
    TODO_DECIDE_OWNER = auto()
    TODO_OTHER_BENCH = auto()
    TODO_ADD_RELEASE = auto()
    TODO_LOOK_AT_RECORDING = auto()
    TODO_NEWER_FILE_EMPTY = auto()
    TODO_LOOK_AT_TEXT = auto()
    TODO_MEND_KEY = auto()
    TODO_OLDER_KEY = auto()
    TODO_MARK_LAPSED = auto()
    TODO_SCORER_ASKS = auto()
    TODO_READ_ANSWERS = auto()
    TODO_DECIDE_ANSWER = auto()
    TODO_ANSWER_REQUEST = auto()
    TODO_MARKS_MOVED = auto()
    TODO_HANDED_IN_AGAIN = auto()
    TODO_GIVE_BACK = auto()
    TODO_CORRECT_SETTINGS = auto()
    TODO_FIND_OWNERS = auto()
    TODO_DOUBTS = auto()
    TODO_NOT_ON_ROSTER = auto()
    # a student's folder
    REPORT_NOT_HANDED_IN = auto()
    LOOKS_LIKE_REPORT = auto()
    TEXTS_UNREAD = auto()
    MISNAMED = auto()
    NOT_THERE = auto()
    COPY_NOT_CHECKED = auto()
    CHECKPOINT_HAS_MORE = auto()
    # a check at home
    HOME_ANSWERS_UNREAD = auto()
    HOME_ANSWERS_ABSENT = auto()
    HOME_ANSWERS_OF_ANOTHER = auto()
    ANSWERS_UNLIKE = auto()
    CELLS_CHANGED = auto()
    OTHER_RELEASE_BEGUN = auto()
    OLDER_PYTHON_GRADES = auto()
    MODULE_NOT_OF_COURSE = auto()
    FILE_NOT_HANDED_IN = auto()
    OWN_REPORT_READ = auto()
    REPORT_OUT_OF_DATE = auto()
    # a receipt
    PARTNER_TO_CONFIRM = auto()
    OUTPUTS_LEFT_OUT = auto()


@dataclass(frozen=True)
class Problem:
    """Something that went wrong, or is worth knowing.

    Attributes
    ----------
    code : what happened
    where : name of the file, question or cell that it concerns; "" for the whole
    parameters : plain data for the sentence: texts, numbers, lists of them, or other problems

    Examples
    --------
    >>> Problem.of(Code.NOT_HANDED_IN, "02_stiffness.ipynb")
    Problem(code=<Code.NOT_HANDED_IN: 'not_handed_in'>, where='02_stiffness.ipynb', parameters={})
    """

    code: Code
    where: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @classmethod
    def of(cls, code: Code, where: str = "", **parameters: Any) -> Problem:
        """Make a problem; texts and lists among its parameters are cut, and empty texts and None are left out."""
        given = {name: _bounded(value) for name, value in parameters.items() if value not in ("", None)}
        return cls(code, where[:LONGEST], given)

    def as_json(self) -> dict[str, Any]:
        """Return the problem as plain data, for :meth:`from_json`."""
        content: dict[str, Any] = {"code": self.code.value, "where": self.where, **as_json(self.parameters)}
        return {name: value for name, value in content.items() if name == "code" or value not in ("", None)}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Problem:
        """Read a stored problem; one with an unknown code is :data:`Code.UNKNOWN`."""
        values = {name: value for name, value in content.items() if name not in ("code", "where")}
        named = str(content.get("code", ""))
        code = next((code for code in Code if code.value == named), Code.UNKNOWN)
        if named != code.value:
            values["named"] = named[:LONGEST] or "?"
        return cls(code, str(content.get("where", "")), {name: from_json(value) for name, value in values.items()})


#: Something that a student made, and that does not count.
NOT_COUNTED = (
    *(Code.SUBMISSION_UNREAD, Code.NOTEBOOK_UNREAD, Code.OLDER_NOTEBOOK_COUNTS, Code.REPORT_UNREAD),
    *(Code.ONE_OF_SEVERAL, Code.NOT_RECOGNISED, Code.OTHER_PDF, Code.CELL_TOO_LONG),
    Code.VERSION_AFTER_GIVEN_BACK,
    *(Code.FILES_REFUSED, Code.PACKED_FILES, Code.FILE_UNREAD, Code.FILE_AND_FOLDER, Code.OUTSIDE_THE_FOLDER),
    *(Code.OWN_FILE_REFUSED, Code.MORE_OWN_FILES_REFUSED, Code.TEXT_TOO_LONG, Code.TEXT_BESIDE_NOT_READ),
    *(Code.PICTURE_LEFT_OUT, Code.TOO_MANY_PICTURES, Code.PASTED_PICTURE_LEFT_OUT),
)

#: What is reported of a hand-in when it is found and read.
OF_READING = (
    *(Code.OTHER_STUDENT_NAMED, Code.PARTNERS_UNCONFIRMED, Code.PARTNERS_DECLINED, Code.PARTNER_UNKNOWN),
    *(Code.TOO_MANY_PARTNERS, Code.NOT_ON_ROSTER, Code.HANDED_IN_BY_PARTNER, Code.NOTEBOOK_UNREAD),
    *(Code.OLDER_NOTEBOOK_COUNTS, Code.REPORT_UNREAD, Code.EMPTY_BESIDE_ANSWERED, Code.FILES_REFUSED),
    *(Code.PACKED_FILES, Code.ONE_OF_SEVERAL, Code.TAKEN_BY_NAME, Code.TAKEN_BY_CELLS, Code.NOT_RECOGNISED),
    *(Code.OTHER_PDF, Code.FILE_UNREAD, Code.COURSE_FILE_UNREAD, Code.FILE_AND_FOLDER, Code.OUTSIDE_THE_FOLDER),
    *(Code.OWN_FILE_REFUSED, Code.MORE_OWN_FILES_REFUSED),
)

Where = tuple[str, str]  #: question and part

#: Why a mark is what it is: the words of a key or a person, or a problem.
Reason = str | Problem


def codes(reason: Reason) -> set[Code]:
    """Return the code of a problem, and those of the problems among its parameters; none of a text."""
    if isinstance(reason, str):
        return set()
    inner = (value if isinstance(value, list) else [value] for value in reason.parameters.values())
    return {reason.code}.union(*(codes(one) for values in inner for one in values if isinstance(one, Problem)))


def has(code: Code, problems: Iterable[Reason], where: str | None = None) -> bool:
    """Return whether a problem of this code is among some, about a file or question if one is named."""
    return any(isinstance(one, Problem) and one.code is code and where in (None, one.where) for one in problems)


def _bounded(value: Any) -> Any:
    if isinstance(value, str):
        return value[:LONGEST]
    return [_bounded(entry) for entry in value[:MOST]] if isinstance(value, list | tuple) else value


def as_json(value: Any) -> Any:
    """Return problems, texts, or lists of them as plain data, for :func:`from_json`."""
    if isinstance(value, Problem):
        return value.as_json()
    if isinstance(value, Mapping):
        return {name: as_json(entry) for name, entry in value.items()}
    return [*map(as_json, value)] if isinstance(value, list | tuple) else value


def from_json(value: Any) -> Any:
    """Read what :func:`as_json` returned."""
    if isinstance(value, Mapping):
        return Problem.from_json(value)
    return [*map(from_json, value)] if isinstance(value, list) else value

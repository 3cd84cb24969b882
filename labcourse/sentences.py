"""The sentences about problems, made when a page or a terminal is written. Nothing decides by them."""

from __future__ import annotations

import string
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from labcourse import messages, program
from labcourse.problems import Code, Problem, Reason
from labcourse.safe_text import no_escapes

_LONGEST_NAME, _MOST_NAMES = 120, 5  # characters of a name in a sentence, and names
_MOST_CELLS = 6  # that are named before "and 12 more"
_MOST_QUESTIONS = 2  # that are named before "and 12 more"
_ALONE = "it counts as {owners}'s alone, on their own bench"


def sentence(reason: Reason) -> str:
    """Say a problem in words. The words of a key or a person are returned as they are, without control characters."""
    if isinstance(reason, str):
        return no_escapes(reason)
    return no_escapes(_FORMATTER.vformat(template(reason), (), _Values(reason)))


def sentences(reasons: Iterable[Reason]) -> list[str]:
    """Say several problems in words, each once."""
    return list(dict.fromkeys(map(sentence, reasons)))


def quoted(name: str) -> str:
    """Return a name for a sentence: in quotes, on one line, cut if it is long."""
    cut = name if len(name) <= _LONGEST_NAME else f"{name[: _LONGEST_NAME - 1]}…"
    return repr(cut.encode("utf-8", "replace").decode())


def template(problem: Problem) -> str:
    """Return the sentence about a problem with the names of its parameters in braces, for the table of problems."""
    text = _SENTENCES[problem.code]
    return text if isinstance(text, str) else text(problem)


class _Values(dict[str, Any]):
    """The parameters of a problem by name, with what is made of them."""

    def __init__(self, problem: Problem) -> None:
        about = problem.parameters
        answer = f"{about['question']}, {about['part']}" if "part" in about else ""
        place = "".join(f"{text}: " for text in (problem.where, answer) if text)
        made = {"where": problem.where, "place": place, "cell_name": _cell(about), "command": program.name()}
        super().__init__({**about, **made, "some_files": _some_files(about)})

    def __missing__(self, name: str) -> str:
        return ""


class _Formatter(string.Formatter):
    """Formats parameters: other problems in words, lists with commas.

    The conversions are in :data:`_CONVERSIONS`; ``:MB`` is megabytes, and ``:file|files`` one word for one thing, and
    another for several.
    """

    def convert_field(self, value: Any, conversion: str | None) -> Any:
        convert = _CONVERSIONS.get(conversion or "")
        return super().convert_field(value, conversion) if convert is None else convert(value)

    def format_field(self, value: Any, format_spec: str) -> str:
        if "|" in format_spec:
            one, several = format_spec.split("|")
            return one if (value if isinstance(value, int | float) else len(value)) == 1 else several
        if not isinstance(value, int | float):
            return _said(value)
        return f"{value / 1e6:.3g} MB" if format_spec == "MB" else format(value, format_spec)

    def get_field(self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        """Return a parameter, or a part of it; "" if it is not there, as in a problem of another version."""
        try:
            return super().get_field(field_name, args, kwargs)
        except (LookupError, AttributeError, TypeError):
            return "", field_name


_FORMATTER = _Formatter()


def _said(value: Any) -> str:
    """Say a parameter: another problem, or several things."""
    if isinstance(value, list | tuple):
        separator = " " if any(isinstance(one, Problem) for one in value) else ", "
        return separator.join(map(_said, value))
    return sentence(value) if isinstance(value, Problem) else str(value)


#: How ``{name!q}`` and the like show a parameter.
_CONVERSIONS: Mapping[str, Callable[[Any], str]] = {
    "q": lambda value: quoted(str(value)),  # in quotes
    "l": lambda value: messages.listed([*map(quoted, value)], _MOST_NAMES),  # names in quotes
    "c": lambda value: messages.listed(value, _MOST_CELLS) if value else "",  # cells
    "a": " and ".join,
    "b": lambda value: _said(value).rstrip("."),  # bare: without the full stop at the end
    "t": lambda value: messages.shortened(_said(value)),  # trimmed
}


def _some_files(about: Mapping[str, Any]) -> str:
    """Return the names of files in quotes, and how many more there are."""
    names, more = ", ".join(map(quoted, about.get("files", []))), about.get("more", 0)
    return f"{names} and {more} more" if more else names


def _cell(about: Mapping[str, Any]) -> str:
    """Return how a cell that stopped is called."""
    question, name = about.get("question", ""), f"{about.get('cell', '')} in {about.get('notebook', '')}"
    match about.get("role"):
        case "added":
            return f"Your own cell before {question}" if question else f"Your own cell {name}"
        case "answer" | "recorder":
            return str(question or about.get("cell", ""))
    return f"The course's cell {name}"


# --- sentences with several forms -------------------------------------------------------------------------------------


def _if(parameter: str, text: str, otherwise: str = "") -> Callable[[Problem], str]:
    """Return a template that depends on whether a parameter is there, and not empty."""
    return lambda problem: text if problem.parameters.get(parameter) else otherwise


def _with(*pieces: str | Callable[[Problem], str]) -> Callable[[Problem], str]:
    """Return a template of texts one after the other, some of which depend on parameters."""
    return lambda problem: "".join(piece if isinstance(piece, str) else piece(problem) for piece in pieces)


def _stopped(problem: Problem) -> str:
    """Say that a cell stopped, why, and which questions build on it."""
    others = [one.replace("{", "{{").replace("}", "}}") for one in problem.parameters.get("building", [])]
    if not others:
        return "{cell_name} stopped: {why!b}."
    if len(others) > _MOST_QUESTIONS + 1:
        return f"{{cell_name}} stopped: {{why!b}}; {messages.listed(others, _MOST_QUESTIONS)} build on it."
    *most, last = others
    building = f"{', '.join(most)} and {last} build" if most else f"{last} builds"
    return f"{{cell_name}} stopped: {{why!b}}; {building} on it."


_LINE, _OTHERS = _if("line", ", line {line}"), _if("with_others", "with what was read before it, ")
_ERROR = ("{type}", _if("text", ", {text}"), _LINE)


def _changed(problem: Problem) -> str:
    if problem.parameters.get("role") == "answer":
        return "{place}the answer cell {cell} was {what}."
    return "{place}the course's cell {cell} was {what}; it is run as the course has it."


def _cells_changed(problem: Problem) -> str:
    """Say what happened to the course's cells of a notebook, and how to have them back."""
    places = range(len(problem.parameters.get("cells", [])))
    happened = "; ".join(f"{{cells[{place}][0]}}: {{cells[{place}][1]!c}}" for place in places) or "{cells}"
    return (
        f"{{where}}: of the course's cells, {happened}. They are run as the course has them; {{command}} restore "
        '{number}, or lab.restore("{number}") in a notebook, gives them back and touches no answer.'
    )


# --- all sentences ----------------------------------------------------------------------------------------------------

#: Code → sentence, or function that returns it; names in braces are parameters.
_SENTENCES: Mapping[Code, str | Callable[[Problem], str]] = {
    # who handed in
    Code.OTHER_STUDENT_NAMED: (
        "course.json names the student {named!q}, but the submission was handed in under the name of {owner!q}, and "
        "counts as theirs. If it is not, an instructor has to decide it in intake.csv."
    ),
    Code.PARTNERS_UNCONFIRMED: (
        f"course.json says that the work was made with {{partners}}, which nobody has confirmed. Until then, {_ALONE}."
    ),
    Code.PARTNERS_DECLINED: (
        f"course.json says that the work was made with {{partners}}. As the instructor decided, {_ALONE}."
    ),
    Code.PARTNER_UNKNOWN: "course.json names {partner!q} as a partner, and no student is known by that ID.",
    Code.TOO_MANY_PARTNERS: "course.json names more than {most} partners: {partners} are left out.",
    Code.NOT_ON_ROSTER: "{student} is not on the roster; only the name of {where!q} says that it is theirs.",
    Code.HANDED_IN_BY_PARTNER: "Handed in by {partner}: their course.json says that it was made together.",
    Code.DECLINED_AS_PARTNER: (
        "The course.json of {owners} names you as a partner. As the instructor decided, their work does not count "
        "for you."
    ),
    Code.CONFIRMATION_NEEDED: "The work of {names} names you as a partner. Your instructor has to confirm it.",
    Code.GIVEN_TO_OWNER: "{where} is {owner}'s, as the instructor decided.",
    # why nobody is the owner
    Code.NAMES_NOBODY: "it does not say who handed it in.",
    Code.NAME_AND_NUMBER_DIFFER: "its name and its number are of different students ({students}).",
    Code.NAME_WITH_OTHER_NUMBERS: "its name is {student}'s, and so is another's here, with another number ({numbers}).",
    Code.SEVERAL_STUDENTS: "it may be any of {students}.",
    Code.PLATFORM_NAME_UNKNOWN: "{platform} named it, and nobody on the roster is called so.",
    Code.PLATFORM_NAME_WITHOUT_ROSTER: "{platform} named it, and there is no roster to say who that is.",
    Code.NOT_AN_ID: "it is not named by a student's ID. {error}",
    Code.CALLED_LIKE_NOBODY: "nobody on the roster is called so.",
    Code.NOTHING_OF_THE_COURSE: "nobody on the roster is called so, and there is nothing of the course in it.",
    Code.COURSE_FILE_NAMES: "Its course.json names {named!q}.",
    Code.LOOSE_NOTEBOOK: "it does not say who handed it in. Put it into a folder that is named by the student's ID.",
    Code.OWNER_TO_BE_GIVEN: (
        "Rename it to the student's ID, put the student on the roster ({command} roster), or write the ID into "
        "intake.csv."
    ),
    # why a file, a folder or an archive is not read
    Code.TOO_MANY_FILES: _with(_OTHERS, "it has more than {most} files and folders."),
    Code.TOO_MANY_BYTES: _with(_OTHERS, "it has more than {most} bytes."),
    Code.SYSTEM_ERROR: "{error!b}.",
    Code.NOT_ORDINARY: "it is not an ordinary file.",
    Code.LONG_TABLE_OF_CONTENTS: "its table of contents has more than {most} bytes.",
    Code.NOT_AN_ARCHIVE: "it is not an archive that can be read ({error}).",
    Code.GONE: "it is no longer there.",
    Code.ENCRYPTED: "it is encrypted.",
    Code.UNUSUAL_COMPRESSION: "it is compressed in an unusual way; use an ordinary zip.",
    Code.ARCHIVE_DAMAGED: "the zip is damaged ({error}).",
    Code.SEVERAL_PIECES: "it is compressed in several pieces. Use an ordinary zip.",
    Code.UNUSUAL_HEADERS: "its headers are unusual or too long. Use an ordinary zip.",
    Code.PACKED_OTHERWISE: "it is packed in a way that is not read. Unpack it, or ask for an ordinary zip.",
    Code.TOO_MANY_ARCHIVES: (
        "of a submission, {most} archives are read, and not more than {nested} within each other; it is one too many."
    ),
    Code.THERE_TWICE: "it is there twice; the first is taken.",
    Code.TOO_DEEP: "it lies deeper than {most} folders.",
    Code.NOT_A_FILE: "it is a link, or something else that is not a file.",
    Code.LEADS_OUTSIDE: "its path leads outside the archive.",
    Code.LONG_PATH: "its path has more than {most} characters.",
    Code.NEWER_OF_SAME_NAME: "there is a newer one of the same name.",
    Code.SEVERAL_HAND_INS: (
        "it seems to hold the submissions of several students. If it does, put it into a folder of its own; if it is "
        "one student's, rename it to the student's ID."
    ),
    Code.NO_FOLDER_NO_ZIP: "it is neither a folder nor a zip.",
    Code.WRITTEN_BY_PLATFORM: "{platform} itself wrote it.",
    Code.IGNORED: "{some_files} {files:is|are} not read: {why}",
    # what an instructor may decide, and why
    Code.DECIDED: "as the instructor decided",
    Code.CHOSEN_BY_TIME: _if(
        "saved", "saved {saved} UTC, with {cells} cells written", "without a time, with {cells} cells written"
    ),
    Code.ONLY_THEIR_COMPUTER: "only the student's computer says when it was saved",
    Code.ONLY_THEIR_COURSE_FILE: "only the course.json of {student} says so",
    Code.NAMES_FIT_PLATFORMS: "all names fit {platforms!a}",
    Code.NAMES_OF_SEVERAL_PLATFORMS: "its names are not of one platform",
    Code.PLATFORM_UNDECIDED: (
        "{why}. If one platform named it, give --platform ({choices}), or decide it in intake.csv; else put each into "
        "its own folder."
    ),
    Code.DECISION_ON_NO_FILE: "intake.csv: there is no file {file!q} that may be {where}.",
    Code.DECISION_ON_PARTNER_UNCLEAR: "intake.csv: on the partner {partner!q} of {where}, write yes or no.",
    Code.DECIDED_OWNER_UNKNOWN: "intake.csv: {owner!q}, the owner of {where!q}, is unknown.",
    Code.DECIDED_TIME_UNCLEAR: "intake.csv: {time!q} is not a time; write it as 2026-11-21 13:05.",
    # what was read
    Code.SUBMISSION_UNREAD: "The submission cannot be read: {where!q}: {why} Hand it in again.",
    Code.ARCHIVE_UNREAD: "{where!q} cannot be read: {why}",
    Code.NO_NOTEBOOK: _with(
        "There is no notebook of the course in the submission. Names of notebooks end in .ipynb.",
        _if("files", " It holds {some_files}."),
    ),
    Code.NOTEBOOK_UNREAD: "{where} cannot be read: {why!b}.",
    Code.REPORT_UNREAD: _with(
        "{where} cannot be read: {why!b}.", _if("earlier", " The one that was handed in before it counts.")
    ),
    Code.OLDER_NOTEBOOK_COUNTS: "{where} cannot be read: {why!b}. The one that was handed in before it counts.",
    Code.NOT_HANDED_IN: "{where} was not handed in.",
    Code.EMPTY_BESIDE_ANSWERED: "{where} in {source!q} is empty; the one that was handed in before it counts.",
    Code.FILES_REFUSED: "{some_files}: not read: {why!b}.",
    Code.PACKED_FILES: "{some_files}: packed in a way that is not read; hand it in plain.",
    Code.PACKED_ARCHIVES: "{some_files}: packed in a way that is not read; hand in an ordinary zip.",
    Code.ONE_OF_SEVERAL: "There are {count} files {where}; {chosen!q} counts, {why}; not {some_files}.",
    Code.TAKEN_BY_NAME: "{file!q} is taken for {where}.",
    Code.TAKEN_BY_CELLS: "{file!q} is taken for {where}, by its cells.",
    Code.NOT_RECOGNISED: (
        "{some_files}: not recognised as notebooks of the course, by their names or by the course's cells in them."
    ),
    Code.NO_NOTEBOOK_IN_PLACE: "{some_files} is no notebook. Hand in {where}.",
    Code.OTHER_PDF: "{where} has the name of no report. It came along as a file of yours, and is not read as a report.",
    Code.FILE_UNREAD: "{where} is not read: {why!b}.",
    Code.COURSE_FILE_UNREAD: "{error}",
    Code.FILE_AND_FOLDER: "{some_files}: not taken along: there is a folder of the same name.",
    Code.OUTSIDE_THE_FOLDER: "{some_files}: not taken along: not in the notebooks' folder.",
    Code.OWN_FILE_REFUSED: "{where} does not come along: {why!b}.",
    Code.MORE_OWN_FILES_REFUSED: "{count} more {count:file|files} of yours {count:does|do} not come along, either.",
    Code.ARRIVED: "From the submission of {time} UTC ({source}): {names}.",
    Code.VERSION_WORTH_LESS: "{where} of {time} UTC is worth less than that of {counts} UTC, which counts.",
    Code.VERSION_NOT_RUN: (
        "{where} of {time} UTC is so late that it could not be worth more than that of {counts} UTC, which counts."
    ),
    Code.VERSION_TO_BE_RUN: "{where} of {time} UTC may be worth more than that of {counts} UTC: it will be run, too.",
    Code.VERSION_AFTER_GIVEN_BACK: (
        "{where} of {time} UTC came after the marks were given back. It counts only if an instructor takes it."
    ),
    Code.VERSION_TAKEN: "{where} of {time} UTC counts, as your instructor decided.",
    # who was erased
    Code.ERASED_HANDED_IN: (
        "{student} was erased on {when}, but there is a submission of theirs. It is not taken in: delete it "
        "({sources}). If they begin anew, use --again {student}."
    ),
    Code.ERASED_NAMED: (
        "{student} handed in work that names {partner}, who was erased on {when}: take {partner} out of the "
        "submission's course.json and name, or the gradebook names them again."
    ),
    # why an own file does not come along
    Code.CHANGES_SETTINGS: "it would change {program}'s settings.",
    Code.WRITTEN_BY_RUN: "a run writes a file of that name.",
    Code.HIDES_MODULE: "Python has a module {module} already; give yours another name.",
    Code.OWN_FILES_TOO_LARGE: "with it, your own files have more than {most:MB}.",
    Code.TOO_MANY_OWN_FILES: "{most} files at most come along.",
    Code.OWN_FILE_TOO_LARGE: "it has more than {most:MB}.",
    Code.OWN_FILE_TOO_DEEP: "it is in more than {most} folders within folders.",
    Code.UNUSUAL_NAME: "its name is too long, or has characters that cannot be seen.",
    # notebooks, texts and pictures
    Code.NOT_JSON: "it is not JSON ({error}).",
    Code.NO_CELLS: "it is JSON, but not a notebook with cells in format 4: save it in JupyterLab.",
    Code.TOO_MANY_CELLS: "it has more than {most} cells.",
    Code.NOTEBOOK_TOO_LARGE: "it has more than {most} bytes. Clear its large outputs, and save it.",
    Code.TOO_MANY_PARTS: _if(
        "with_others",
        "with the notebooks before it, it has more than {most} parts.",
        "it has more than {most} parts. Clear its large outputs, and save it.",
    ),
    Code.TOO_MANY_LINES: "its cells have more than {most} lines.",
    Code.CELLS_TOO_LARGE: "its {kind} cells have more than {most} bytes.",
    Code.PASTED_PICTURE_LEFT_OUT: (
        "{place}the picture {picture!q} in its cell {cell} is left out: the notebook's pictures are too large together."
    ),
    Code.CELL_TOO_LONG: "{place}its cell {cell} is left out: it has more than {most} characters.",
    Code.CELL_REPEATED: "{place}the cell {cell} is there {times} times; all of them are run, in order.",
    Code.CELL_CHANGED: _changed,
    Code.CELL_IS_TEXT: "{place}the answer cell {cell} is a text cell; it is run as code. Esc, then Y, makes it code.",
    Code.UNTOUCHED: "{place}nothing is written in it.",
    Code.TEXT_TOO_LONG: "{place}it has {count} characters, of which the first {most} are read; shorten it.",
    Code.TEXT_OF_FEW_WORDS: "{place}it is {count} {count:word|words} long: is that all? A person reads it.",
    Code.TEXT_IN_OTHER_KIND: "{place}written in a cell that is no text cell any more.",
    Code.TEXT_ALSO_BELOW: "{place}with the text of an added cell just below the answer cell.",
    Code.TEXT_BELOW: "{place}taken from an added cell just below the answer cell, which is empty.",
    Code.TEXT_ABOVE: "{place}taken from an added cell just above the answer cell, which is empty.",
    Code.TEXT_IN_PLACE: "{place}taken from an added cell where the answer cell is missing.",
    Code.TEXT_IN_QUESTION: "{place}taken from the text above the answer cell, which is empty; move it into that cell.",
    Code.TEXT_BESIDE_NOT_READ: "{place}its cell is empty; an added cell beside it is not read as the answer.",
    Code.TEXT_COPIES_DIFFER: "{place}{count} copies of its cell differ; all are read, one after the other.",
    Code.PICTURE_LEFT_OUT: "{place}the picture {picture!q} is left out: {why!b}.",
    Code.TOO_MANY_PICTURES: "{place}more than {most} pictures: the first {most} are shown.",
    Code.PICTURE_NOT_IN_CELL: "it is not in the cell; paste it again.",
    Code.PICTURE_NOT_IN_NOTEBOOK: "it is not in the notebook; paste it into the cell.",
    Code.PICTURE_DAMAGED: "it is damaged.",
    Code.PICTURE_TOO_LARGE: "it has more than {most:MB}.",
    Code.PICTURE_UNUSUAL: "it was saved in an unusual way; save it anew.",
    Code.PICTURE_OF_MANY_PIXELS: "it has more than {most} million pixels.",
    Code.PICTURE_OF_OTHER_FORMAT: "it is none of {formats}.",
    Code.PICTURE_TOO_WIDE: "it is more than {most} pixels wide or high.",
    Code.PICTURES_OF_MANY_PIXELS: "all pictures of the submission together have too many pixels; paste smaller ones.",
    Code.PICTURE_NOT_REDUCED: "it cannot be made small enough.",
    Code.REPORT_TOO_LARGE: "it has {bytes:MB}, and {most:MB} is the most: save its pictures smaller.",
    Code.NOT_A_PDF: "it is no PDF: save or export it as PDF.",
    Code.REPORT_IN_PDF: _with(
        "{where}: ",
        _if("own", "your own document, {name} (", "{name}, made of the notebook’s texts ("),
        "PDF, {bytes:MB}; {digest}).",
    ),
    Code.MAY_ASK_FOR_PASSWORD: "{where}: {name} may ask for a password.",
    # the release, and what was recorded at home
    Code.RELEASE_CONTRADICTED: "course.json names the release {named}, but the notebooks are those of {release}.",
    Code.RELEASE_UNKNOWN: (
        "course.json names the release {named!q}, which is not among the releases in {folder}/. Until your instructor "
        "puts the zip of that release into it, {closest} counts, which the notebooks resemble most."
    ),
    Code.RELEASE_EARLIER: "Run and marked under an earlier release, {release}.",
    Code.CLAIM_UNREAD: "The student's own answers.json cannot be read, and is not compared: {error}",
    Code.VALUE_SUPPLIED: "Your instructor supplied {where} = {value}.",
    # the run
    Code.CELL_TIMED_OUT: "A cell took longer than {seconds:g} s and was stopped.",
    Code.PYTHON_DIED: "The Python process died while a notebook was run; the rest of that notebook was not run.",
    Code.RUN_TIMED_OUT: "The run took longer than {seconds:g} s and was stopped.",
    Code.PRINTED_TOO_MUCH: "The run was stopped: it printed too much.",
    Code.RUN_ENDED_EARLY: "The run ended before all notebooks were run.",
    Code.RESULT_UNREAD: "{where} cannot be read: {error!b}.",
    Code.GRADING_FAILED: "Grading failed, which is not the student's fault: {error}",
    Code.EARLIER_MARKS_STAY: "Grading failed, which is not the student's fault: {error!b}. The earlier marks stay.",
    Code.UNKNOWN: "Another version stored the message {named!q}, which this version does not know.",
    # cells that stopped, and what it cost
    Code.CELL_STOPPED: _stopped,
    Code.STOPPED_WITHOUT_COST: "{cell_name} stopped: {why!b}; no answer is missing for it.",
    Code.STOPPED_ON_UNANSWERED: "{cell_name} stopped: {why!b}; it builds on {on}, which is not answered.",
    Code.STOPPED_ON_REFUSED: (
        "{cell_name} stopped: {why!b}; it builds on {on}, which was given and not recorded: {refusal!b}."
    ),
    Code.RECORDED_AT_HOME: "Recorded at home and missing here: {parts}; {why!b}.",
    Code.NAME_NOT_USED: "{where}: {name} = {value!q} changes nothing, since a check and grading set the {name}.",
    # why a cell stopped
    Code.PYTHON_ENDED: "Python ended in it, and nothing after it in this notebook was run.",
    Code.LEFT_PYTHON: "it called exit(), which ends Python: nothing after it in this notebook was run.",
    Code.TOOK_TOO_LONG: _with("it took longer than {seconds:g} s and was stopped", _LINE),
    Code.MODULE_MISSING: _with(
        "{module} is not installed ",
        _if("at_home", "here", "where grading runs"),
        ", and no file of that name was found beside the notebooks",
        _LINE,
    ),
    Code.FILE_NOT_FOUND: _with(*_ERROR),
    Code.BENCH_STOPPED: _with("your bench stopped: {text}", _LINE),
    Code.INPUT_NEEDED: _with("it asks for input", _LINE, "; in a run, nobody types: write the value into the cell"),
    Code.NONE_USED: _with(*_ERROR, "; a value in it is missing (None or ...), as after a function without return"),
    Code.NEWER_PYTHON_NEEDED: _with(*_ERROR, ": it seems that this needs Python {needed}; grading runs {here}"),
    Code.RAISED: _with(*_ERROR),
    # why there is no answer
    Code.REFUSED: "It was given, and not recorded: {why!b}.",
    Code.BUILDS_ON_REFUSED: "It builds on {on}, which was given and not recorded: {why!b}.",
    Code.BUILDS_ON_UNANSWERED: "It builds on {on}, which is not answered.",
    Code.BUILDS_ON_STOPPED: "It builds on what stopped before it: {cell_name} ({why!b}).",
    Code.LEFT_AS_IT_WAS: "There is no answer: its cell was left as it was.",
    Code.RUN_AND_EMPTY: "There is no answer: its cell was run, and a value is None or holds ... (Is a return missing?)",
    Code.MISSING_HERE: "It was recorded at home; {why!b}.",
    Code.NOTEBOOK_NOT_THERE: "{where} is not there, or cannot be read.",
    Code.NOTHING_LEFT: "nothing is left of it after {where} was run.",
    Code.NO_CELL_KNOWN: "no cell is known that did it, and {where} leaves it empty.",
    Code.CELL_NOT_AMONG: "the cell that did it, {cell}, is not among those of {where} that were run.",
    Code.RUN_LEAVES_EMPTY: "{where}, run from top to bottom, leaves it empty.",
    Code.NOT_IN_THE_RUN: "There is no answer in what was left when your notebooks had been run.",
    Code.NO_TEXT: "No text for it was found in the notebook that was handed in.",
    Code.NO_REPORT_TEXT: "No text of the report was found in the notebook that was handed in.",
    Code.NOTEBOOK_OF_IT_ABSENT: "Its notebook, {where}, was not handed in.",
    Code.NOTEBOOK_OF_IT_UNREAD: "Its notebook, {where}, could not be read.",
    Code.NOTHING_READ: "Nothing of the course could be read in what was handed in for you.",
    # marking
    Code.NO_ANSWERS_LEFT: "No answers were left when the notebooks had been run.",
    Code.ANSWERS_UNREAD: "answers.json cannot be read. {error}",
    Code.ANSWER_TO_NOTHING: "Ignored an answer to {number!q}, {name!q}: there is no such thing.",
    Code.MORE_OF_THIS_SORT: "And {count} more of this sort.",
    Code.ANSWERS_OF_ANOTHER: "The answers say that they are those of {student!q}.",
    Code.ANSWERS_OF_ANOTHER_BENCH: (
        "The answers say that they come from another bench than the one on which they were run: {bench}. They are "
        "marked by the one on which they were run."
    ),
    Code.GIVEN_TO_CLASS: "Given to this class, not asked: {names}.",
    Code.NOT_IN_KEY: "Question {where} was answered; the key does not mark it.",
    Code.KEY_FAILED: "{question}, {part} is not marked: the key failed. {error}",
    Code.MALFORMED: "Malformed: {error}",
    Code.NOT_COMPARED: "It could not be compared ({error}); a person will look at it.",
    Code.FOLLOWS_FROM_ABSURD: "{reason} As {own} is far from anything plausible, a person will look at it.",
    Code.KEY_HAS_FAULT: "The key that it is marked by has a fault; it will be marked when that is mended.",
    Code.SUPPLIED: _with(
        _if("why", "{why} "),
        "Your instructor supplied this value, so that what builds on it could be run; it earns nothing.",
    ),
    Code.PARTNER_NOT_CONFIRMED: "A class-mate's work names you as a partner; your instructor has to confirm it.",
    Code.NOT_GRADED: "Grading failed; ask your instructor.",
    Code.SAID_BY_COURSE: "{text}",
    Code.DOUBTED_BY_COURSE: "{where} does not count until a person has looked at it: {why!b}.",
    # what an instructor has to do
    Code.TODO_ASK_FOR_WORK: "missing: {title}. Ask for it, excuse them, or give an extension in course.toml.",
    Code.TODO_ASK_FOR_CHANGES: (
        "untouched: {title}. Nothing is written in the file. Ask for their work, or excuse them."
    ),
    Code.TODO_GRADE: "handed in: not graded yet.",
    Code.TODO_GRADE_VERSION: "{where}: a later version, which was not run, may be worth more by now.",
    Code.TODO_DECIDE_TIME: "waits for a person: nobody knows when {title} was handed in. Decide in MARKS/intake.csv.",
    Code.TODO_FAILED: "could not be graded: {problem!t}",
    Code.TODO_FAILED_AGAIN: "the last grading failed, and earlier marks stand. {problem!t}",
    Code.TODO_RUN_TIMED_OUT: "the run was stopped: it took too long.",
    Code.TODO_OUT_OF_MEMORY: "the run was stopped: memory ran out, most likely.",
    Code.TODO_PRINTED_TOO_MUCH: "the run was stopped: it printed too much. Look at its cells.",
    Code.TODO_RUN_ENDED_EARLY: "the run was stopped. Nobody knows why.",
    Code.TODO_ANSWERS_UNREAD: "the answers of the run cannot be read. Look at its cells.",
    Code.TODO_CELL_TIMED_OUT: "a cell took too long.",
    Code.TODO_INSTALL_MODULE: "a module is missing where grading runs. Install it.",
    Code.TODO_NEWER_PYTHON: "a newer Python is needed. Grade with it.",
    Code.TODO_FILE_LEFT_OUT: "a cell needs a file that was left out.",
    Code.TODO_RECORDED_AT_HOME: "answers were recorded at home and are missing.",
    Code.TODO_READ_REPORT: "a report cannot be read, it seems. Look at it.",
    Code.TODO_OLDER_FILE_COUNTS: "an older file counts: {problem!t}",
    Code.TODO_ASK_AGAIN: "could not be graded: {problem!t} Ask for it again.",
    Code.TODO_DECIDE_OWNER: "there is a doubt about who did it. Decide it in MARKS/intake.csv.",
    Code.TODO_OTHER_BENCH: "the answers say that they come from another bench. Look at the notebooks.",
    Code.TODO_ADD_RELEASE: "a release is unknown. Put its zip where the message says.",
    Code.TODO_LOOK_AT_RECORDING: "a recording does not count until you have looked at it.",
    Code.TODO_NEWER_FILE_EMPTY: "a newer file is empty, so that an older one counts. Look at both.",
    Code.TODO_LOOK_AT_TEXT: "part of a text is not read, or a picture or a cell is left out. Look at it.",
    Code.TODO_MEND_KEY: "could not be graded: {problem!t} Mend the key.",
    Code.TODO_OLDER_KEY: "marks are of an older key, or of an older version.",
    Code.TODO_MARK_LAPSED: "a person's mark for {answer} lapsed, as the answer or its points changed.",
    Code.TODO_SCORER_ASKS: "a scorer asks you to decide.",
    Code.TODO_READ_ANSWERS: "waits for a person: answers of {title}.",
    Code.TODO_DECIDE_ANSWER: "waits for a person: {answer}. {reason!t}",
    Code.TODO_ANSWER_REQUEST: "a request to look again at {answer}.",
    Code.TODO_MARKS_MOVED: "marks of {title} moved since you gave them back.",
    Code.TODO_HANDED_IN_AGAIN: "{title}: a version came after you gave it back. It counts only if you take it.",
    Code.TODO_GIVE_BACK: "marked: all of {title}, and not given back yet.",
    Code.TODO_CORRECT_SETTINGS: "course.toml has unknown students or sections in {where}: {names!l}. Correct it.",
    Code.TODO_FIND_OWNERS: (
        "nobody knows who handed in {names!l}, so that it is not graded. Decide it in MARKS/intake.csv."
    ),
    Code.TODO_DOUBTS: "not certain: {names!l}. Decide it in MARKS/intake.csv.",
    Code.TODO_NOT_ON_ROSTER: "not on the roster. Take the roster in again, or rename the submission.",
    # a student's folder
    Code.REPORT_NOT_HANDED_IN: "{where} is not handed in: {why!b}.",
    Code.LOOKS_LIKE_REPORT: (
        '{where} is a file of your own. Is it your report? Then run lab.report("NAME OF THE REPORT", pdf="{where}").'
    ),
    Code.TEXTS_UNREAD: "{where} could not be read for answers in words: {why!b}.",
    Code.MISNAMED: (
        "{where} is not there. (Is it {similar!l}? Then give it its name again. Else {command} restore {where} gives a "
        "new one.)"
    ),
    Code.NOT_THERE: "{files} {files:is|are} not there. ({command} restore NAME gives a new one.)",
    Code.COPY_NOT_CHECKED: (
        "{file} is a copy; only {where} is checked. To go on in the copy, delete {where}, and give the copy its name."
    ),
    Code.CHECKPOINT_HAS_MORE: (
        "{where} is empty, and its checkpoint has answers: open it, and choose File → Revert Notebook to Checkpoint…."
    ),
    # a check at home
    Code.HOME_ANSWERS_UNREAD: "There is nothing to compare with: {where} cannot be read. {error}",
    Code.HOME_ANSWERS_ABSENT: "There is no {where} to compare the run with. That costs no points: only the run counts.",
    Code.HOME_ANSWERS_OF_ANOTHER: "{where} has the answers of {student!q}. Nothing is compared with them.",
    Code.ANSWERS_UNLIKE: (
        "Your notebooks, as they are saved and run from the first cell to the last, do not give what is on your page: "
        "{answers!c}. Save them (Ctrl+S), and check again. If that changes nothing, choose Kernel → Restart Kernel and "
        "Run All Cells… in them, and look at these answers. Random numbers need a seed."
    ),
    Code.CELLS_CHANGED: _cells_changed,
    Code.OTHER_RELEASE_BEGUN: (
        "This folder was begun with release {begun} of the course, and is checked with {here}, which is installed. "
        "Start {command} lab once more: it brings the folder to that release, and touches no answer."
    ),
    Code.OLDER_PYTHON_GRADES: "Your Python is {here}, and Python {there} grades: it knows no newer syntax.",
    Code.MODULE_NOT_OF_COURSE: "{module} is not of the course, and may be missing in grading: ask, or do without it.",
    Code.FILE_NOT_HANDED_IN: (
        "{where} names the file {file!r}, which is not handed in: put it beside your notebooks, and use its new name."
    ),
    Code.OWN_REPORT_READ: (
        "{where}: a text that is not in its cell is looked for in your own document, {name}, under its heading."
    ),
    Code.REPORT_OUT_OF_DATE: (
        "{where} is older than {notebook}. If a text, a figure or a table has changed since, run lab.report() again."
    ),
    # a receipt
    Code.PARTNER_TO_CONFIRM: (
        "Your partner {partner} counts once they hand in with {student}, too, or your instructor confirms it."
    ),
    Code.OUTPUTS_LEFT_OUT: "{where}: what {count} {count:cell|cells} had shown is left out; marking needs none of it.",
}

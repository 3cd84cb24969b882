"""What a check found, in words: a summary, what to look at first, then notebook by notebook."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

from labcourse import program
from labcourse.messages import listed, plural
from labcourse.run.alignment import Change, Happened
from labcourse.run.check import GOOD, Checked, Part, State

_NAMED = 6  # cells that are named before "and 12 more"
_HAPPENED = {
    Happened.CHANGED: "changed: {cells}",
    Happened.MISSING: "gone: {cells}",
    Happened.MOVED: "moved: {cells}",
    Happened.RENAMED: "without their names: {cells}",
    Happened.OTHER_KIND: "turned into cells of another kind: {cells}",
}
_DIFFERENT = (
    "Other than on your page: your saved notebook, run from its first cell to its last, gives another answer than the "
    "one that you recorded. Choose Kernel → Restart Kernel and Run All Cells…, and look at it. Random numbers need a "
    "seed."
)


def lines(checked: Checked) -> list[str]:
    """The report of a check."""
    return [
        *_summary(checked),
        *_block("Look at this first", _first(checked)),
        *_block("By notebook", _by_notebook(checked)),
        *_block("Worth knowing", _notes(checked)),
    ]


def brief(checked: Checked) -> str:
    """How much is there, in a sentence."""
    questions = checked.questions
    done = sum(questions.values())
    if done == len(questions):
        return "All there: {questions}.".format(questions=plural(done, "{count} question", "{count} questions"))
    states = {one: {part.state for part in checked.parts if part.question == one} for one in questions}
    open_ = [one for one, there in questions.items() if not there]
    empty = sum(states[one] <= {State.EMPTY} for one in open_)
    wrong = sum(bool(states[one] & {State.MISSING, State.DIFFERENT}) for one in open_)
    rest = [
        f"{wrong} with something to look at",
        f"{len(open_) - empty - wrong} answered in part",
        f"{empty} empty",
    ]
    told = ", ".join(
        text for text, count in zip(rest, (wrong, len(open_) - empty - wrong, empty), strict=True) if count
    )
    return "{done} of {questions} are all there; {rest}.".format(
        done=done, questions=plural(len(questions), "{count} question", "{count} questions"), rest=told
    )


def _summary(checked: Checked) -> Iterator[str]:
    yield f"Checked in {checked.seconds:.0f} s, as your work is run for marking (and nothing was marked)."
    yield f"Student {checked.student}, folder {checked.folder}"
    yield ""
    yield brief(checked)


def _first(checked: Checked) -> Iterator[str]:
    yield from checked.problems
    yield from checked.stops
    yield from checked.lost
    bad = {part.notebook for part in checked.parts if part.state in (State.MISSING, State.DIFFERENT)}
    for name, why in checked.unsaved.items():
        if name in bad:
            yield f"{name} {why}."
    if any(part.state is State.DIFFERENT for part in checked.parts):
        yield _DIFFERENT


def _by_notebook(checked: Checked) -> Iterator[str]:
    groups = [(name, list(parts)) for name, parts in itertools.groupby(checked.parts, lambda part: part.notebook)]
    width = max((len(_stem(name)) for name, _parts in groups), default=0)
    for name, parts in groups:
        questions = list(dict.fromkeys(part.question for part in parts))
        lacking = [part for part in parts if part.state not in GOOD]
        done = len(questions) - len({part.question for part in lacking})
        if all(part.state is State.EMPTY for part in parts):
            told = "nothing yet"
        elif not lacking:
            told = "all there"
        else:
            told = "{done} of {questions} all there".format(
                done=done, questions=plural(len(questions), "{count} question", "{count} questions")
            )
        yield f"{_stem(name):<{width}}  {told}"
        if any(part.state is not State.EMPTY for part in parts):
            yield from _lacking(lacking)


def _lacking(parts: Sequence[Part]) -> Iterator[str]:
    """What is not there of a notebook that was begun."""
    for (question, said), group in itertools.groupby(parts, lambda part: (part.question, _said(part))):
        names = ", ".join(part.name for part in group)
        yield f"    {question}  {names}: {said}"


def _said(part: Part) -> str:
    if part.state is State.DIFFERENT:
        return "recorded, but other than on your page"
    if part.state is State.EMPTY:
        return "empty"
    return f"not recorded. {part.why}"


def _notes(checked: Checked) -> Iterator[str]:
    for name, changes in checked.changes.items():
        yield (
            f"{name}: among the course's cells, {'; '.join(_happened(changes))}. They are run as the course has "
            f'them; {program.name()} restore {name.partition("_")[0]}, or lab.restore("{name.partition("_")[0]}") in a '
            "notebook, gives them back and touches no answer."
        )
    bad = {part.notebook for part in checked.parts if part.state in (State.MISSING, State.DIFFERENT)}
    for name, why in checked.unsaved.items():
        if name not in bad:
            yield f"{name} {why}."
    yield from checked.notes


def _happened(changes: Sequence[Change]) -> Iterator[str]:
    for what in Happened:
        cells = [change.cell for change in changes if change.what is what]
        if cells:
            yield _HAPPENED[what].format(cells=listed(cells, _NAMED))


def _block(title: str, content: Iterator[str]) -> Iterator[str]:
    found = list(content)
    if found:
        yield ""
        yield title
        yield from (f"  {line}" for line in found)


def _stem(name: str) -> str:
    return name.removesuffix(".ipynb")

"""One column of a platform's file with marks in it, and all that there is to tell about that."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

from labcourse.errors import GradingError
from labcourse.grading.accounts.exact import half_up
from labcourse.grading.platforms.earned import Earned
from labcourse.grading.platforms.matching import Matches
from labcourse.grading.platforms.recognised import Column, Export, number, plain

_WITH_COMMA = re.compile(r"\d+,(?!\d{3}$)\d+")  # not a thousand
_WITH_POINT = re.compile(r"\d+\.\d+")
_IN_BRACKETS = re.compile(r"\(.*\)$")


@dataclass(frozen=True)
class Choice:
    """What is told of how to write.

    Attributes
    ----------
    decimals : that a mark is rounded to, half up
    unfinished : whether what is decided so far is written of those who wait
    cap : whether a mark above the maximum is written as the maximum
    """

    decimals: int
    unfinished: bool = False
    cap: bool = False


@dataclass(frozen=True)
class Change:
    """A mark that is written: whose, what the cell said, and what it says now."""

    student: str
    before: str
    after: str


@dataclass(frozen=True)
class Filled:
    """What came of it.

    Attributes
    ----------
    data : the file's bytes
    written : marks where there was none
    replaced : marks where there was another
    unchanged : students whose mark was there already
    left : student → why the cell was left as it is
    capped : student → what the mark would have been
    so_far : student → what still waits, where a mark is written all the same
    """

    data: bytes
    written: tuple[Change, ...]
    replaced: tuple[Change, ...]
    unchanged: tuple[str, ...]
    left: Mapping[str, str]
    capped: Mapping[str, str]
    so_far: Mapping[str, str]


def rounded(value: Fraction, decimals: int) -> Decimal:
    """A number to so many decimals, half up, in the form in which files have it."""
    return Decimal(int(half_up(value, decimals) * 10**decimals)).scaleb(-decimals)


def fill(
    export: Export, column: Column, maximum: Decimal, matches: Matches, earned: Mapping[str, Earned], choice: Choice
) -> Filled:
    """Write everybody's mark into one column.

    Parameters
    ----------
    export, column, maximum : the file, which of its columns, and what that is out of
    matches : whose row is whose
    earned : student → what they have
    choice : how to write it

    Raises
    ------
    GradingError
        If the column holds what are no points, or marks would be above the maximum: all of them are told.
    """
    _must_be_points(export, column)
    comma = _writes_commas(export)
    new: dict[tuple[int, int], str] = {}
    written: list[Change] = []
    replaced: list[Change] = []
    unchanged, left, capped, so_far = list[str](), dict[str, str](), dict[str, str](), dict[str, str]()
    for row, about in sorted(matches.found.items()):
        student, before = about.student, export.table.cell(row, column.place).strip()
        mark = earned[student]
        why = _why_left(export, column, row, mark, choice)
        if why or mark.share is None:
            left[student] = why
            continue
        value = rounded(mark.share * Fraction(maximum), choice.decimals)
        if value > maximum:
            capped[student] = plain(value)
            value = maximum
        if mark.waits:
            so_far[student] = mark.waits
        if number(before) == value:
            unchanged.append(student)
            continue
        after = plain(value).replace(".", ",") if comma else plain(value)
        new[row, column.place] = after
        (written if _is_empty(export, before) else replaced).append(Change(student, before, after))
    if capped and not choice.cap:
        raise GradingError(_too_much(capped, column, maximum))
    data = export.table.changed(new)
    return Filled(data, tuple(written), tuple(replaced), tuple(unchanged), left, capped, so_far)


def _why_left(export: Export, column: Column, row: int, mark: Earned, choice: Choice) -> str:
    """Why a cell is left as it is; "" where a mark goes into it."""
    why = _why_untouched(export, column, row)
    if not why and mark.share is None:
        why = f"{mark.why_none}."
    elif not why and mark.waits and not choice.unfinished:
        why = f"still waits for a person: {mark.waits}."
    return why


def _why_untouched(export: Export, column: Column, row: int) -> str:
    """Why a cell is not ours to write into; "" where it is."""
    before = export.table.cell(row, column.place).strip()
    if column.place >= len(export.table.rows[row]):
        return f"line {export.table.line(row)} of the file is too short: it has no such cell."
    if export.locked is not None and export.table.cell(row, export.locked).strip() == "No":
        return "Moodle takes no mark of theirs ('Grade can be changed' says No)."
    if before.casefold() in export.left:
        return export.left[before.casefold()]
    if not _is_empty(export, before) and number(before) is None:
        return f"it says {before!r} there, which is no number."
    return ""


def _is_empty(export: Export, said: str) -> bool:
    return not said or _IN_BRACKETS.sub("", said).strip() in export.empty


def _must_be_points(export: Export, column: Column) -> None:
    """Refuse a column of letters or words: not one of its cells is a number."""
    said = [export.table.cell(row, column.place).strip() for row in export.students]
    there = [one for one in said if not _is_empty(export, one) and one.casefold() not in export.left]
    if there and all(number(one) is None for one in there):
        raise GradingError(
            f"{column.heading!r} holds {there[0]!r} and the like, and no points: letters, percentages or words."
        )


def _writes_commas(export: Export) -> bool:
    """Whether the file has a comma before decimals."""
    said = [cell.text.strip() for row in export.table.rows for cell in row]
    return any(map(_WITH_COMMA.fullmatch, said)) and not any(map(_WITH_POINT.fullmatch, said))


def _too_much(above: Mapping[str, str], column: Column, maximum: Decimal) -> str:
    listed = ", ".join(f"{student}: {value}" for student, value in above.items())
    return (
        f"Nothing is written: {column.heading!r} is out of {plain(maximum)}, and these would have more: "
        f"{listed}. A platform cuts, refuses or takes that as it likes. Raise its points on the platform and "
        f"export the file again, or say --cap, and {plain(maximum)} is written for them. (If it is by rounding, "
        "say more --decimals.)"
    )


def told(export: Export, filled: Filled, matches: Matches, dry: bool = False) -> list[str]:
    """All that there is to tell, a line each, the sum first; where nothing is written, each new mark, too."""
    lines = [
        f"{len(filled.written) + len(filled.replaced)} written ({len(filled.replaced)} of them in place of "
        f"another mark), {len(filled.unchanged)} as they were, {len(filled.left)} left as they are, "
        f"{len(matches.unknown) + len(matches.refused)} of theirs not found in the gradebook, "
        f"{len(matches.missing)} of the gradebook not found in the file."
    ]
    if dry and filled.written:
        listed = ", ".join(f"{one.student}: {one.after}" for one in filled.written)
        lines.append(f"{len(filled.written)} into empty cells: {listed}")
    if filled.replaced:
        listed = ", ".join(f"{one.student}: {one.before} → {one.after}" for one in filled.replaced)
        lines.append(f"{len(filled.replaced)} replaced: {listed}")
    if filled.capped:
        listed = ", ".join(f"{student} ({value})" for student, value in filled.capped.items())
        lines.append(f"Cut to the maximum, as told: {listed}")
    if filled.so_far:
        listed = "; ".join(f"{student} ({waits})" for student, waits in filled.so_far.items())
        lines.append(f"Written with what is decided so far, though more still waits: {listed}")
    lines += [f"{student}: left; {why}" for student, why in filled.left.items()]
    lines += [f"{export.shown(row)}: nobody's; {why}" for row, why in matches.refused.items()]
    if matches.unknown:
        listed = "; ".join(map(export.shown, matches.unknown))
        lines.append(f"In the file, and not in the gradebook: {listed}")
    if matches.missing:
        listed = ", ".join(one.student for one in matches.missing)
        lines.append(f"In the gradebook, and not in the file: {listed}")
    return lines

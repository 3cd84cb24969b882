"""How a final grade came about, in words: for the student it is of, and for whoever does it again by hand."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from datetime import datetime
from fractions import Fraction
from typing import TYPE_CHECKING

from labcourse.grading.accounts.exact import exact, in_full, to_decimals
from labcourse.grading.accounts.lateness import Timing
from labcourse.messages import plural

if TYPE_CHECKING:
    from labcourse.grading.accounts.account import Account, Line


def how(account: Account) -> list[str]:
    """What is special about an account, in short words without points."""
    return [*_short(account)]


def _short(account: Account) -> Iterator[str]:
    dropped = [*_by_name(account.lines, "dropped_as")]
    if dropped:
        yield f"not counted: {', '.join(dropped)}"
    for name, lines in _by_name((one for one in account.lines if one.counts), "weighted_as").items():
        yield f"{name} counts {in_full(lines[0].weight)} times"
    for one in account.timings:
        if one.waits:
            yield f"{one.notebook}: not known when it came, to be decided"
        elif one.received is None:
            yield f"{one.notebook}: not known when it came, taken as in time"
        elif not one.days:
            yield f"{one.notebook}: in time by an extension"
        else:
            yield f"{one.notebook}: {_days(one.days)} late, {in_full(one.taken * 100)} % taken"
    for bonus in account.bonus:
        yield f"{bonus.number} {bonus.what}"


def steps(account: Account) -> list[str]:
    """How the final grade came about, step by step."""
    return [*_steps(account)]


def _steps(account: Account) -> Iterator[str]:
    lines = account.lines
    total = _of(_points(lines), sum(one.out_of for one in lines))
    yield f"All answers: {total}."
    dropped = _by_name(lines, "dropped_as")
    if dropped:
        left = [one for one in lines if one.counts]
        yield "Not counted: {what}. Left: {left}.".format(
            what=", ".join(f"{name} ({_so_far(those)})" for name, those in dropped.items()),
            left=_of(_points(left), _sum_out_of(left)),
        )
    for name, those in _by_name((one for one in lines if one.counts), "weighted_as").items():
        before = _of(_points(those), _sum_out_of(those))
        after = _of(sum(one.weighted for one in those), sum(one.possible for one in those))
        yield f"{name} counts {in_full(those[0].weight)} times: {before} become {after}."
    for one in account.timings:
        yield _timing(one, account)
    for bonus in account.bonus:
        yield f"{bonus.number} {bonus.what}, {_worth(bonus.each)} each: {in_full(bonus.points)} more."
    if not account.is_plain:
        yield f"Together: {_of(account.earned, account.out_of)}."
    yield from _last(account)


def _timing(one: Timing, account: Account) -> str:
    """What there is to say of when a notebook came."""
    if one.waits:
        return (
            f"{one.notebook} was due on {_when(one.until, one.until)}. Only the computer that it was written on says "
            "when it was saved; your instructor decides when it was handed in."
        )
    if one.received is None:
        return (
            f"{one.notebook} was due on {_when(one.until, one.until)}. It is not known when it was handed in; it "
            "is taken as in time."
        )
    start = f"{one.notebook} was handed in on {_when(one.received, one.until)}"
    if one.clock:
        start += f" ({one.clock})"
    if not one.days:
        return (
            f"{start}. It was due on {_when(one.due, one.until)}; by an extension until "
            f"{_when(one.until, one.until)} it is in time."
        )
    late, weighted = account.late, sum(line.weighted for line in account.lines if line.notebook == one.notebook)
    what = "{start}, due on {until}{extended}{grace}: {days} late (one that has begun counts).".format(
        start=start,
        until=_when(one.until, one.until),
        extended=" by an extension" if one.extended else "",
        grace=f" with {in_full(exact(late.grace_hours))} h of grace" if late.grace_hours else "",
        days=_days(one.days),
    )
    if not one.taken:
        return f"{what} That costs nothing."
    capped = one.days * exact(late.per_day) > exact(late.cap)
    return "{what} {per_day} % a day{capped}: {percent} % of its {points} are taken, {lost}.".format(
        what=what,
        per_day=in_full(exact(late.per_day)),
        capped=f", and {in_full(exact(late.cap))} % at most" if capped else "",
        percent=in_full(one.taken * 100),
        points=_worth(weighted),
        lost=in_full(weighted * one.taken),
    )


def _last(account: Account) -> Iterator[str]:
    """The final grade, or why there is none."""
    if account.undecided:
        waiting = sum(one.possible for one in account.undecided)
        yield f"There is no final grade yet: still to be decided are {_worth(waiting)}."
        return
    final = account.final
    if final is None:
        yield "Nothing of this counts, so that there is no final grade."
        return
    marks = account.marks
    if marks.out_of is not None:
        yield (
            f"On the scale of {in_full(exact(marks.out_of))}: {in_full(account.earned)} / "
            f"{in_full(account.out_of)} × {in_full(exact(marks.out_of))} = {in_full(account.scaled)}."
        )
    yield "Final grade: {final} of {out_of}, rounded to {decimals} (half up).".format(
        final=to_decimals(final, marks.decimals),
        out_of=in_full(exact(account.final_out_of)),
        decimals=plural(marks.decimals, "{count} decimal", "{count} decimals"),
    )


def _by_name(lines: Iterable[Line], attribute: str) -> dict[str, list[Line]]:
    """Lines by the name that the settings have for them; those without one are left out."""
    found: dict[str, list[Line]] = {}
    for line in lines:
        name = getattr(line, attribute)
        if name:
            found.setdefault(name, []).append(line)
    return found


def _so_far(lines: list[Line]) -> str:
    """Points of lines; where some are not decided, that is said."""
    points = _of(_points(lines), _sum_out_of(lines))
    return points if all(one.points is not None for one in lines) else f"{points} so far"


def _points(lines: Iterable[Line]) -> Fraction:
    return sum((one.points or Fraction(0) for one in lines), Fraction(0))


def _sum_out_of(lines: Iterable[Line]) -> Fraction:
    return sum((one.out_of for one in lines), Fraction(0))


def _of(points: Fraction | int, out_of: Fraction | int) -> str:
    return f"{in_full(Fraction(points))} of {in_full(Fraction(out_of))} points"


def _worth(points: Fraction | int) -> str:
    return "1 point" if points == 1 else f"{in_full(Fraction(points))} points"


def _days(number: int) -> str:
    return "1 day" if number == 1 else f"{number} days"


def _when(moment: datetime, zone_of: datetime) -> str:
    """A moment to the minute, in the zone of what is due."""
    return f"{moment.astimezone(zone_of.tzinfo):%Y-%m-%d %H:%M %Z}"

"""How a final grade came about, in words: for the student it is of, and for whoever does it again by hand."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from datetime import datetime
from fractions import Fraction
from typing import TYPE_CHECKING

from rotflex.courseware.messages import _, plural
from rotflex.instructor.accounts.exact import exact, in_full, to_decimals
from rotflex.instructor.accounts.lateness import Timing

if TYPE_CHECKING:
    from rotflex.instructor.accounts.account import Account, Line


def how(account: Account) -> list[str]:
    """What is special about an account, in short words without points."""
    return [*_short(account)]


def _short(account: Account) -> Iterator[str]:
    dropped = [*_by_name(account.lines, "dropped_as")]
    if dropped:
        yield _("not counted: {names}").format(names=", ".join(dropped))
    for name, lines in _by_name((one for one in account.lines if one.counts), "weighted_as").items():
        yield _("{name} counts {weight} times").format(name=name, weight=in_full(lines[0].weight))
    for one in account.timings:
        if one.received is None:
            yield _("{notebook}: not known when it came, taken as in time").format(notebook=one.notebook)
        elif not one.days:
            yield _("{notebook}: in time by an extension").format(notebook=one.notebook)
        else:
            yield _("{notebook}: {days} late, {percent} % taken").format(
                notebook=one.notebook, days=_days(one.days), percent=in_full(one.taken * 100)
            )
    for bonus in account.bonus:
        yield _("{number} {what}").format(number=bonus.number, what=bonus.what)


def steps(account: Account) -> list[str]:
    """How the final grade came about, step by step."""
    return [*_steps(account)]


def _steps(account: Account) -> Iterator[str]:
    lines = account.lines
    yield _("All answers: {points}.").format(points=_of(_points(lines), sum(one.out_of for one in lines)))
    dropped = _by_name(lines, "dropped_as")
    if dropped:
        left = [one for one in lines if one.counts]
        yield _("Not counted: {what}. Left: {left}.").format(
            what=", ".join(f"{name} ({_so_far(those)})" for name, those in dropped.items()),
            left=_of(_points(left), _sum_out_of(left)),
        )
    for name, those in _by_name((one for one in lines if one.counts), "weighted_as").items():
        yield _("{name} counts {weight} times: {before} become {after}.").format(
            name=name,
            weight=in_full(those[0].weight),
            before=_of(_points(those), _sum_out_of(those)),
            after=_of(sum(one.weighted for one in those), sum(one.possible for one in those)),
        )
    for one in account.timings:
        yield _timing(one, account)
    for bonus in account.bonus:
        yield _("{number} {what}, {each} each: {points} more.").format(
            number=bonus.number, what=bonus.what, each=_worth(bonus.each), points=in_full(bonus.points)
        )
    if not account.is_plain:
        yield _("Together: {points}.").format(points=_of(account.earned, account.out_of))
    yield from _last(account)


def _timing(one: Timing, account: Account) -> str:
    """What there is to say of when a notebook came."""
    if one.received is None:
        return _("{notebook} was due on {due}. It is not known when it was handed in; it is taken as in time.").format(
            notebook=one.notebook, due=_when(one.until, one.until)
        )
    start = _("{notebook} was handed in on {received}").format(
        notebook=one.notebook, received=_when(one.received, one.until)
    )
    if not one.days:
        return _("{start}. It was due on {due}; by an extension until {until} it is in time.").format(
            start=start, due=_when(one.due, one.until), until=_when(one.until, one.until)
        )
    late, weighted = account.late, sum(line.weighted for line in account.lines if line.notebook == one.notebook)
    what = _("{start}, due on {until}{extended}{grace}: {days} late (one that has begun counts).").format(
        start=start,
        until=_when(one.until, one.until),
        extended=_(" by an extension") if one.extended else "",
        grace=_(" with {hours} h of grace").format(hours=in_full(exact(late.grace_hours))) if late.grace_hours else "",
        days=_days(one.days),
    )
    if not one.taken:
        return _("{what} That costs nothing.").format(what=what)
    capped = one.days * exact(late.per_day) > exact(late.cap)
    return _("{what} {per_day} % a day{capped}: {percent} % of its {points} are taken, {lost}.").format(
        what=what,
        per_day=in_full(exact(late.per_day)),
        capped=_(", and {cap} % at most").format(cap=in_full(exact(late.cap))) if capped else "",
        percent=in_full(one.taken * 100),
        points=_worth(weighted),
        lost=in_full(weighted * one.taken),
    )


def _last(account: Account) -> Iterator[str]:
    """The final grade, or why there is none."""
    if account.undecided:
        waiting = sum(one.possible for one in account.undecided)
        yield _("There is no final grade yet: still to be decided are {waiting}.").format(waiting=_worth(waiting))
        return
    final = account.final
    if final is None:
        yield _("Nothing of this counts, so that there is no final grade.")
        return
    marks = account.marks
    if marks.out_of is not None:
        yield _("On the scale of {scale}: {earned} / {out_of} × {scale} = {scaled}.").format(
            scale=in_full(exact(marks.out_of)),
            earned=in_full(account.earned),
            out_of=in_full(account.out_of),
            scaled=in_full(account.scaled),
        )
    yield _("Final grade: {final} of {out_of}, rounded to {decimals} (half up).").format(
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
    return points if all(one.points is not None for one in lines) else _("{points} so far").format(points=points)


def _points(lines: Iterable[Line]) -> Fraction:
    return sum((one.points or Fraction(0) for one in lines), Fraction(0))


def _sum_out_of(lines: Iterable[Line]) -> Fraction:
    return sum((one.out_of for one in lines), Fraction(0))


def _of(points: Fraction | int, out_of: Fraction | int) -> str:
    return _("{points} of {out_of} points").format(points=in_full(Fraction(points)), out_of=in_full(Fraction(out_of)))


def _worth(points: Fraction | int) -> str:
    return _("1 point") if points == 1 else _("{points} points").format(points=in_full(Fraction(points)))


def _days(number: int) -> str:
    return _("1 day") if number == 1 else _("{number} days").format(number=number)


def _when(moment: datetime, zone_of: datetime) -> str:
    """A moment to the minute, in the zone of what is due."""
    return f"{moment.astimezone(zone_of.tzinfo):%Y-%m-%d %H:%M %Z}"

"""The first minutes at a real bench, guided: what is wired where and which way, and a record that it was found so.

Each step is a function over one :class:`~rotflex.commissioning.steps.Work`, on an open bench; :data:`STEPS` puts them
in order. No loop is closed before the last step, which runs under a provisional record and with the runaway guard on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from rotflex.commissioning import checks, steps
from rotflex.commissioning.steps import Connect, Dialogue, Terminal, Work
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.real import record

__all__ = ["STEPS", "Dialogue", "Terminal", "add_watchdog_test", "commission"]

#: How the bench is opened, and the steps that share it.
STEPS: tuple[tuple[Callable[[Work], Bench], tuple[Callable[[Work, Bench], None], ...]], ...] = (
    (steps.at_rest, (checks.board, steps.directions, steps.full_turn_and_zero)),
    (steps.driven_carefully, (steps.motor_sign,)),
    (steps.driven_carefully, (steps.watchdog_passes,)),
    (steps.driven_slowly, (steps.link,)),
    (steps.in_closed_loop, (steps.short_sweep,)),
)


def commission(file: BenchFile, connect: Connect, dialogue: Dialogue) -> BenchFile:
    """Guide a person through the commissioning of a bench.

    Parameters
    ----------
    file : the bench as far as it is known: board, channels, parts
    connect : makes a bench from what is known of it
    dialogue : with the person

    Returns
    -------
    BenchFile
        With the signs that were found, and the record.

    Raises
    ------
    BenchError
        If something is not as it must be, or it is broken off: the message says what to look at, and what is saved.
    """
    work = Work(file, connect, dialogue)
    try:
        for opened, together in STEPS:
            with opened(work) as bench:
                for step in together:
                    step(work, bench)
    except (KeyboardInterrupt, EOFError):
        saved = (
            "The mark that you set for theta = 0 is saved, and nothing else" if work.zero_set else "Nothing is saved"
        )
        broken_off = BenchError(
            f"The commissioning was broken off. {saved}: no file was written or changed, and a record from before is "
            "as it was. Begin again with the same command."
        )
        broken_off.outcome = None if work.bench is None else work.bench.safety.outcome
        raise broken_off from None
    done = work.file
    return replace(done, record=record(done.identity(), work.measured, watchdog=done.record.get("watchdog")))


def add_watchdog_test(file: BenchFile, connect: Connect, dialogue: Dialogue) -> BenchFile:
    """Test the watchdog alone, with the motor, and add the result to the record of a commissioning.

    Raises
    ------
    BenchError
        If the bench was not commissioned, or the servo did not turn. Nothing was recorded then.
    """
    if not file.record:
        raise BenchError("This bench has no record yet. Run rotflex bench setup: it tests the watchdog, too.")
    work = Work(file, connect, dialogue)
    with steps.driven_carefully(work) as bench:
        steps.watchdog(work, bench)
    return work.file

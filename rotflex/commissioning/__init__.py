"""The first minutes at a real bench, guided: what is wired where and which way, and a record that it was found so.

The steps are functions over an open bench; this module puts them in order. Nothing is closed into a loop before the
last step, which runs under a provisional record and with the runaway guard on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rotflex.commissioning import by_hand, driven, watchdog
from rotflex.commissioning.dialogue import Dialogue, Terminal
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.bench_file import BenchFile, serial_number
from rotflex.hil.commissioned import record
from rotflex.hil.real import CAREFUL, Setup
from rotflex.units import HZ

__all__ = ["NOTEBOOK", "Dialogue", "Terminal", "add_watchdog_test", "commission"]

NOTEBOOK = Path(__file__).with_name("commissioning.ipynb")  #: the same steps, in JupyterLab
_VOLTAGE = 2.0  # V, at most, once the watchdog has stopped the motor
_APART = 0.1  # by which two ways to the natural frequency may differ

Connect = Callable[[BenchFile, Setup], Bench]


def commission(told: BenchFile, connect: Connect, dialogue: Dialogue) -> BenchFile:
    """Guide a person through the commissioning of a bench.

    Parameters
    ----------
    told : the bench as far as it is known: board, channels, parts
    connect : makes a bench from what is known of it; each step opens one
    dialogue : with the person

    Returns
    -------
    BenchFile
        With the signs that were found, and the record.

    Raises
    ------
    BenchError
        If something is not as it must be, or it is broken off: the message says what to look at, and what is kept.
    """
    kept = "Nothing of it is kept"

    def connected(bench: BenchFile, setup: Setup) -> Bench:
        made = connect(bench, setup)
        made.safety = replace(made.safety, folder=None)  # nobody looks for the recordings of a commissioning later
        return made

    measured: dict[str, Any] = {}
    try:
        told = _at_rest(told, connected, dialogue, measured)
        kept = "The mark is kept that you set for theta = 0, and nothing else"
        return _in_motion(told, connected, dialogue, measured)
    except (KeyboardInterrupt, EOFError):
        raise BenchError(
            f"The commissioning was broken off; the motor is at 0 V. {kept}: no file was written or changed, and a "
            "record from before is as it was. Begin again with the same command."
        ) from None


def _in_motion(told: BenchFile, connect: Connect, dialogue: Dialogue, measured: dict[str, Any]) -> BenchFile:
    """All that is found with the motor on, and the record."""
    _require_free(dialogue)
    told = _driving(told, connect, dialogue, measured)
    _in_closed_loop(told, connect, dialogue, measured)
    return replace(told, record=record(told.identity(), measured, watchdog=told.record.get("watchdog")))


def add_watchdog_test(told: BenchFile, connect: Connect, dialogue: Dialogue) -> BenchFile:
    """Test the watchdog alone, with the motor, and add the result to the record of a commissioning.

    Raises
    ------
    BenchError
        If the bench was not commissioned, or the servo did not turn. Nothing was recorded then.
    """
    if not told.record:
        raise BenchError("This bench has no record yet. Run rotflex bench setup: it tests the watchdog, too.")
    _require_free(dialogue)
    return replace(told, record={**told.record, "watchdog": _watchdog(told, connect, dialogue)})


def _require_free(dialogue: Dialogue) -> None:
    dialogue.say("Now the motor drives, slowly and by up to 40 degrees. Keep a hand on the emergency stop.")
    if not dialogue.agree("Is the arm free to turn half a turn either way, and the amplifier on?"):
        raise BenchError("It was broken off before the motor drove. Nothing was recorded.")


def _watchdog(told: BenchFile, connect: Connect, dialogue: Dialogue) -> dict[str, Any]:
    """The watchdog's test, and what the board refused, told."""
    dialogue.say("The watchdog: 1 V for a moment, and then the program is silent. The board must stop the motor.")
    with _unguarded(told, connect) as bench:
        tested = watchdog.test(bench, told)
    for refusal in bench.refused.values():
        dialogue.say(f"The board refused something that not all boards have. {refusal}")
    dialogue.say(tested["found"])
    return tested


def _at_rest(told: BenchFile, connect: Connect, dialogue: Dialogue, measured: dict[str, Any]) -> BenchFile:
    """All that is found at 0 V."""
    dialogue.say("Opening the board; the motor stays at 0 V. Switch the amplifier off: first you move all by hand.")
    with connect(told, told.setup()) as bench:
        dialogue.say(f"The board answers at {told.address}.")
        if serial := serial_number(bench.board):
            measured["serial_number"] = serial
        measured["loopback"] = by_hand.loopback(bench, told)
        dialogue.say(f"Loopback: {measured['loopback']}.")
        signs = by_hand.directions(bench, told, dialogue)
        dialogue.say("Encoders: servo {servo_sign:+d}, link {link_sign:+d}.".format(**signs))
        turn = by_hand.full_turn(bench, told, dialogue)
        measured["counts_per_turn"] = turn.counts
        dialogue.say(f"A turn is {turn.counts} counts: encoder {turn.encoder}.")
        dialogue.wait(
            "Turn the arm back to where zero shall be, clear of everything either way, no cable twisted. Put a mark "
            "there: after power-off you will be asked to turn the arm to it."
        )
        gap = by_hand.from_zero(turn, bench.counts()[0], signs["servo_sign"])
        bench.set_zero()
    if gap is not None:
        measured["potentiometer_gap_deg"] = gap
        dialogue.say(f"The potentiometer's gap is at {gap:.0f} deg.")
    return replace(told, parts={**told.parts, "encoder": turn.encoder}).with_signs(**signs)


def _driving(told: BenchFile, connect: Connect, dialogue: Dialogue, measured: dict[str, Any]) -> BenchFile:
    """All that is found with a small voltage and no loop."""
    told = told.with_signs(motor_sign=1)
    with _unguarded(told, connect) as bench:
        told = told.with_signs(motor_sign=driven.motor_sign(bench))
    dialogue.say(f"Motor: {told.wiring['motor_sign']:+d}.")
    if "@" not in told.address:  # a simulator harms nobody
        tested = _watchdog(told, connect, dialogue)
        if not tested["passed"]:
            raise BenchError(
                f"{tested['found']} Nothing was recorded. Until it passes, no loop is closed on this bench, and the "
                "motor gets at most 1 V. Look at what the board refused, and ask its maker how its watchdog sets 0 V."
            )
        told = replace(told, record={"watchdog": tested})
    with _unguarded(told, connect, _VOLTAGE) as bench:
        plus, minus = driven.breakaway(bench)
        measured["breakaway_V"] = [plus, minus]
        dialogue.say(f"The servo breaks away at {plus:.2f} V and at −{minus:.2f} V.")
        omega = driven.link(bench, dialogue.say)
        stiffness = bench.joint.J_l * omega**2
        measured["natural_frequency_Hz"], measured["stiffness"] = omega / HZ, stiffness
        dialogue.say(
            f"The link swings at {omega / HZ:.2f} Hz: K_s is {stiffness:.2f} N·m/rad, its inertia taken as nominal."
        )
        dialogue.say("Now short steps, each from rest: a minute or two.")
        delay = driven.loop_delay(bench, stiffness)
        measured["delay_s"] = delay
        dialogue.say(f"A voltage takes effect after {delay * 1e3:.1f} ms.")
    return told


def _in_closed_loop(told: BenchFile, connect: Connect, dialogue: Dialogue, measured: dict[str, Any]) -> None:
    """The first closed loop, under a provisional record."""
    if not dialogue.agree("Last comes a sweep in closed loop, 8 s, some 4 degrees either way. Begin?"):
        raise BenchError("The commissioning was broken off before the first closed loop. Nothing was recorded.")
    kept = record(told.identity(), measured, provisional=True, watchdog=told.record.get("watchdog"))
    provisional = replace(told, record=kept)
    with connect(provisional, provisional.setup()) as bench:
        if bench.mark_unknown:  # a board that forgets its counts when it is closed
            dialogue.wait(f"{bench.mark_unknown} Switch the amplifier on again.")
            bench.set_zero()
        recording, natural = driven.short_sweep(bench, dialogue.say)
    expected = measured["natural_frequency_Hz"]
    dialogue.say(f"In closed loop the link swings at {natural:.2f} Hz.")
    if abs(natural / expected - 1) > _APART:
        raise BenchError(
            f"In closed loop the link swings at {natural:.2f} Hz, and before at {expected:.2f} Hz: look for what "
            "is loose. Nothing was recorded."
        )
    timing = recording.metadata.get("timing")
    if timing:
        measured["late"], measured["missed"] = timing["late"], timing["missed"]


def _unguarded(told: BenchFile, connect: Connect, voltage: float = CAREFUL.voltage) -> Bench:
    """A bench on which little can happen, and which takes motion the wrong way for what it is to find out.

    The limits stand here, for only here the motor gets more than an uncommissioned bench allows. No loop is closed.
    """
    limits = replace(CAREFUL, voltage=voltage, why="The commissioning allows no more.")
    return connect(told, replace(told.setup(), limits=limits, commissioned=lambda: "", guarded=False, marked=False))

"""The first minutes at a real bench, guided: what is wired where and which way, and a record that it was found so.

Each step is a function over one :class:`Work`, on an open bench; :data:`STEPS` puts them in order: by hand at 0 V, then
with the motor, slowly and within a few degrees. No loop is closed before the last step, which runs under a provisional
record and with the runaway guard on. A step that finds something wrong raises :class:`~rotflex.errors.BenchError`,
which says what to look at.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from rotflex import doubts, experiments
from rotflex.commissioning import checks
from rotflex.config import ENCODERS
from rotflex.errors import BenchError
from rotflex.hil import bench_file
from rotflex.hil.bench import Bench
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.real import CAREFUL, Setup, record, today
from rotflex.identification import frequency_response, resonance
from rotflex.link import NATURAL, natural_frequency
from rotflex.recording import Recording
from rotflex.specifications import SAMPLE_TIME
from rotflex.units import DEG, HZ, Vector

_TURN, _POLL = 15.0, 0.005  # s, for a full turn by hand, and from one look at it to the next
_ENOUGH = 30  # counts, of a push by hand; 1.3 deg at least
_VOLTAGE = 2.0  # V, at most, once the watchdog has stopped the motor
_SLOPE = 0.25  # V/s
_FAR = 3 * DEG
_SWEEP = {"f_start": 2.0, "f_stop": 5.0, "duration": 6.0, "amplitude": 0.6}  # Hz, s, V: the servo turns by 5 to 20 deg
_LEFT = 0.25  # of the arm's motion, that may be left over; 0.02 to 0.12 is usual
_SWEEPS = 3  # tries of a sweep, until few enough of its samples come late
_APART = 0.1  # by which two ways to the natural frequency may differ

Connect = Callable[[BenchFile, Setup], Bench]


class Terminal:
    """The person at the bench, who sits at a terminal."""

    def say(self, text: str) -> None:
        """Tell something."""
        print(text, flush=True)

    def wait(self, text: str) -> None:
        """Ask for something to be done by hand, and return when it has been."""
        self.say(text)
        input("Then press Enter. ")

    def agree(self, text: str) -> bool:
        """Ask a question, until the answer is yes or no."""
        self.say(text)
        while True:
            answer = input("yes or no? ").strip().lower()
            if answer[:1] in ("y", "n"):
                return answer[0] == "y"

    def turning(self, text: str) -> Iterator[None]:
        """Ask for a slow turn by hand, and yield again and again from Enter on, for as long as it may take."""
        self.say(f"{text} You have {_TURN:g} s for it.")
        input("Press Enter, and turn. ")
        end = time.monotonic() + _TURN
        while time.monotonic() < end:
            yield
            time.sleep(_POLL)


@dataclass
class Work:
    """What the steps of one commissioning share.

    Attributes
    ----------
    file : the bench as far as it is known by now
    connect : makes a bench from what is known of it
    dialogue : with the person
    measured : what was found, plain values for the record
    zero_set : whether the mark of theta = 0 was set
    may_drive : whether the person has agreed that the motor drives
    bench : that was opened last
    """

    file: BenchFile
    connect: Connect
    dialogue: Terminal
    measured: dict[str, Any] = field(default_factory=dict)
    zero_set: bool = False
    may_drive: bool = False
    bench: Bench | None = None

    def recorded(self) -> BenchFile:
        """Return the bench with a record of what was found until now."""
        found = record(self.file.identity(), self.measured, self.file.record.get("watchdog"))
        return replace(self.file, record=found)


# --- how the bench is opened ------------------------------------------------------------------------------------------


def _opened(work: Work, file: BenchFile, **changes: Any) -> Bench:
    work.bench = bench = work.connect(file, replace(file.setup(), **changes))
    bench.recorder.folder = None  # nobody looks for the recordings of a commissioning later
    return bench


def at_rest(work: Work) -> Bench:
    """Open the bench for steps at 0 V."""
    work.dialogue.say(
        "Opening the board; the motor stays at 0 V. Switch the amplifier off, and leave the arm alone until you are "
        "asked to move it."
    )
    return _opened(work, work.file)


def driven_carefully(work: Work) -> Bench:
    """Open the bench for up to 1 V, and no loop."""
    return driven_slowly(work, CAREFUL.voltage)


def driven_slowly(work: Work, voltage: float = _VOLTAGE) -> Bench:
    """Open a bench on which little can happen, and which takes motion the wrong way for what it is to find out.

    The limits stand here, for only here the motor gets more than an uncommissioned bench allows. No loop is closed.
    """
    if not work.may_drive:
        work.dialogue.say("Now the motor drives, slowly and by up to 40 degrees. Keep a hand on the emergency stop.")
        if not work.dialogue.agree("Is the arm free to turn half a turn either way, and the amplifier on?"):
            raise BenchError("It was broken off before the motor drove. Nothing was recorded.")
        work.may_drive = True
    limits = replace(CAREFUL, voltage=voltage, why="The commissioning allows no more.")
    return _opened(work, work.file, limits=limits, commissioned=lambda: None, guarded=False, marked=False)


def in_closed_loop(work: Work) -> Bench:
    """Open the bench for its first closed loop, under a provisional record and with the guard on."""
    if not work.dialogue.agree("Last comes a sweep in closed loop, 8 s, some 4 degrees either way. Begin?"):
        raise BenchError("The commissioning was broken off before the first closed loop. Nothing was recorded.")
    return _opened(work, work.recorded())


# --- by hand, at 0 V --------------------------------------------------------------------------------------------------


def board(work: Work, bench: Bench) -> None:
    """Look at the board before a hand or the motor moves anything.

    Raises
    ------
    BenchError
        If something fails. All is looked at before.
    """
    if serial := bench_file.serial_number(bench.board):
        work.measured["serial_number"] = serial
    failed = []
    for finding in checks.look(bench, work.file):
        work.dialogue.say(str(finding))
        if finding.level is checks.Level.FAIL:
            failed.append(f"{finding.message} {finding.advice}")
    if failed:
        raise BenchError(" ".join([*failed, "Nothing was recorded."]))


def directions(work: Work, bench: Bench) -> None:
    """Find the signs of both encoders. Positive is counter-clockwise, seen from above."""
    ask = "Turn the servo with the arm on it COUNTER-CLOCKWISE, seen from above, by about 20 degrees."
    servo = _moved(work, bench, 0, "the servo", ask)
    ask = "Hold the servo, and bend the arm COUNTER-CLOCKWISE against its springs by about 5 degrees. Keep it there."
    link = _moved(work, bench, 1, "the arm", ask)
    work.dialogue.wait("Let the arm go.")
    work.file = work.file.with_signs(servo_sign=servo, link_sign=link)
    work.dialogue.say(f"Encoders: servo {servo:+d}, link {link:+d}.")


def _moved(work: Work, bench: Bench, which: int, what: str, ask: str) -> int:
    """Return the sign of what one encoder counted, if that was more than the other one did."""
    before = bench.connection.counts()
    work.dialogue.wait(ask)
    moved = [now - then for now, then in zip(bench.connection.counts(), before, strict=True)]
    channels = (work.file.wiring["servo_encoder"], work.file.wiring["link_encoder"])
    mine, others = abs(moved[which]), abs(moved[1 - which])
    if mine >= _ENOUGH and mine > others:
        return 1 if moved[which] > 0 else -1
    if others >= _ENOUGH:
        raise BenchError(
            f"You moved {what}, and encoder {channels[1 - which]} counted {others} where encoder {channels[which]} "
            f"counted {mine}: the two are the other way round. Exchange their cables, or servo_encoder and "
            "link_encoder in bench.toml."
        )
    raise BenchError(
        f"You moved {what}, and encoder {channels[which]} counted {mine}, which is too little to tell a "
        "direction: look at its cable and its number in bench.toml, and move it further."
    )


def full_turn_and_zero(work: Work, bench: Bench) -> None:
    """Count a full turn of the servo, which tells the encoder; then set the place where theta is zero."""
    begin = bench.connection.counts()[0]
    ask = "Turn the servo slowly by exactly one full turn, mark to mark, counter-clockwise."
    for _each in work.dialogue.turning(ask):
        pass
    turned = abs(bench.connection.counts()[0] - begin)
    nearest = min(ENCODERS, key=lambda name: abs(math.log(max(turned, 1) / ENCODERS[name])))
    if abs(turned / ENCODERS[nearest] - 1) > 0.1:
        raise BenchError(
            f"A full turn counted {turned}; the encoders that exist have {', '.join(map(str, ENCODERS.values()))} "
            "counts a turn. Turn it from mark to mark, and look whether the board counts all four edges."
        )
    work.measured["counts_per_turn"] = turned
    work.file = replace(work.file, parts={**work.file.parts, "encoder": nearest})
    work.dialogue.say(f"A turn is {turned} counts: encoder {nearest}.")
    work.dialogue.wait(
        "Turn the arm back to where zero shall be, clear of everything either way, no cable twisted. Put a mark "
        "there: after power-off you will be asked to turn the arm to it."
    )
    bench.set_zero()
    work.zero_set = True


# --- with the motor ---------------------------------------------------------------------------------------------------


def motor_sign(work: Work, bench: Bench) -> None:
    """Find which way a positive voltage turns the servo: it rises slowly, and goes off after 3 degrees; then back.

    Raises
    ------
    BenchError
        If a negative voltage turns it the same way: with a wrong sign, the first closed loop would run away.
    """
    turn_slowly(bench, 1, _FAR)
    turned = bench.latest.theta
    turn_slowly(bench, -1, _FAR)
    if turned * bench.latest.theta > 0:
        raise BenchError(
            "The servo turned the same way at a positive and at a negative voltage: somebody pushed the arm, or its "
            "cables pull at it. Nothing was recorded: begin again, and let the arm go."
        )
    sign = work.file.wiring["motor_sign"] * (1 if turned > 0 else -1)
    work.file = work.file.with_signs(motor_sign=sign)
    work.dialogue.say(f"Motor: {sign:+d}.")


def turn_slowly(bench: Bench, way: int, far: float) -> None:
    """Raise the voltage slowly from 0 V at rest, one way, until the servo has turned so far, rad; then 0 V.

    Raises
    ------
    BenchError
        If it does not turn.
    """
    most = bench.safety.limits.voltage
    experiments.rest(bench)
    bench.start(SAMPLE_TIME)
    try:
        for _sample in range(round(most / _SLOPE / SAMPLE_TIME)):
            measured = bench.read()
            if abs(measured.theta) >= far:
                return
            bench.write(way * min(_SLOPE * measured.time, most))
    finally:
        bench.stop()
    raise BenchError(
        f"The servo did not move at {way * most:g} V: is the amplifier on, its emergency stop released, the motor's "
        "cable plugged in, and is the amplifier on the output that bench.toml names as motor?"
    )


def return_to_mark(bench: Bench) -> None:
    """Turn the servo slowly back to its mark, if it has drifted away: limits are counted from there."""
    experiments.rest(bench)
    away = bench.begun + bench.latest.theta
    if abs(away) > _FAR:
        turn_slowly(bench, -1 if away > 0 else 1, abs(away))


def _sweep(work: Work, bench: Bench, **settings: Any) -> Recording:
    """Return a sweep in which few enough samples came late."""
    for _each in range(_SWEEPS):
        if "drive" in settings:  # a loop brings it back by itself
            return_to_mark(bench)
        recording = experiments.sweep(bench, **settings, progress=False)
        late = doubts.of_samples(recording.metadata, len(recording))
        if late is None or not late.refuses:
            if late:
                work.dialogue.say(str(late))
            return recording
        work.dialogue.say(f"{late} The sweep comes again, at most {_SWEEPS} times in all.")
    raise BenchError(f"{late} It was so in {_SWEEPS} sweeps. Nothing was recorded: begin again.")


def link(work: Work, bench: Bench) -> None:
    """Find the link's natural frequency from a sweep of the voltage: no loop is closed yet."""
    recording = _sweep(work, bench, **_SWEEP, drive="voltage")

    def fitted(alpha: Vector) -> tuple[float, float]:
        return natural_frequency(recording["theta"], alpha, recording.sample_time)

    omega, left = fitted(recording["alpha"])
    if left >= _LEFT:
        if fitted(-recording["alpha"])[1] < left:
            raise BenchError(
                "The arm deflects in the wrong direction when the servo accelerates: the sign of one encoder "
                "was found the wrong way round. Begin again, and turn servo and arm both counter-clockwise."
            )
        raise BenchError(
            f"The arm does not swing like an arm on this joint's springs, between {NATURAL[0] / HZ:g} and "
            f"{NATURAL[1] / HZ:g} Hz: {left:.0%} of its motion remains unexplained. Look at the springs, at "
            "what else is on the arm, at the link's encoder, and whether something touches the arm."
        )
    stiffness = bench.joint.J_l * omega**2
    work.measured |= {"natural_frequency_Hz": omega / HZ, "stiffness": stiffness}
    work.dialogue.say(
        f"The link swings at {omega / HZ:.2f} Hz: K_s is {stiffness:.2f} N·m/rad, its inertia taken as nominal."
    )


def short_sweep(work: Work, bench: Bench) -> None:
    """Close the first loop, and compare the link's natural frequency in it with the one before."""
    if bench.safety.mark_unknown:  # a board that forgets its counts when it is closed
        work.dialogue.wait(f"{bench.safety.mark_unknown} Switch the amplifier on again.")
        bench.set_zero()
    recording = _sweep(work, bench, duration=8.0)
    natural, expected = resonance(frequency_response(recording)).value / HZ, work.measured["natural_frequency_Hz"]
    work.dialogue.say(f"In closed loop the link swings at {natural:.2f} Hz.")
    if abs(natural / expected - 1) > _APART:
        raise BenchError(
            f"In closed loop the link swings at {natural:.2f} Hz, and before at {expected:.2f} Hz: look for what "
            "is loose. Nothing was recorded."
        )
    if timing := recording.metadata.get("timing"):
        work.measured |= {"late": timing["late"], "missed": timing["missed"]}


# --- the watchdog -----------------------------------------------------------------------------------------------------


def watchdog_passes(work: Work, bench: Bench) -> None:
    """Test the watchdog; a simulator, which harms nobody, needs no test."""
    if "@" in work.file.address:
        return
    work.file = replace(work.file, record={})
    watchdog(work, bench)
    tested = work.file.record["watchdog"]
    if not tested["passed"]:
        raise BenchError(
            f"{tested['found']} Nothing was recorded. Until it passes, no loop is closed on this bench, and the "
            "motor gets at most 1 V. Look at what the board refused, and ask its maker how its watchdog sets 0 V."
        )


def watchdog(work: Work, bench: Bench) -> None:
    """Drive the motor with 1 V, reload the watchdog no more, and record whether the servo stops.

    The record has whether it passed, the date, what was found, and which verbs the board refused.

    Raises
    ------
    BenchError
        If the servo did not turn: then nothing was tested.
    """
    work.dialogue.say("The watchdog: 1 V for a moment, and then the program is silent. The board must stop the motor.")
    experiments.rest(bench)
    trouble = checks.leave_alone(bench, work.file, CAREFUL.voltage)
    for refusal in bench.connection.refused.values():
        work.dialogue.say(f"The board refused something that not all boards have. {refusal}")
    result = trouble or f"At {CAREFUL.voltage:g} V, left alone, the servo stopped."
    work.dialogue.say(result)
    tested = {"passed": trouble is None, "date": today(), "found": result, "refused": list(bench.connection.refused)}
    work.file = replace(work.file, record={**work.file.record, "watchdog": tested})


# --- all of it --------------------------------------------------------------------------------------------------------

#: How the bench is opened, and the steps that share it.
STEPS: tuple[tuple[Callable[[Work], Bench], tuple[Callable[[Work, Bench], None], ...]], ...] = (
    (at_rest, (board, directions, full_turn_and_zero)),
    (driven_carefully, (motor_sign,)),
    (driven_carefully, (watchdog_passes,)),
    (driven_slowly, (link,)),
    (in_closed_loop, (short_sweep,)),
)


def commission(file: BenchFile, connect: Connect, dialogue: Terminal) -> BenchFile:
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
    return work.recorded()


def add_watchdog_test(file: BenchFile, connect: Connect, dialogue: Terminal) -> BenchFile:
    """Test the watchdog alone, with the motor, and add the result to the record of a commissioning.

    Raises
    ------
    BenchError
        If the bench was not commissioned, or the servo did not turn. Nothing was recorded then.
    """
    if not file.record:
        raise BenchError("This bench has no record yet. Run rotflex bench setup: it tests the watchdog, too.")
    work = Work(file, connect, dialogue)
    with driven_carefully(work) as bench:
        watchdog(work, bench)
    return work.file

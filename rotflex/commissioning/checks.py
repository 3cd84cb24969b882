"""The first steps of a commissioning: does the board work? ``rotflex doctor --bench`` takes these steps alone.

To the motor's output 0 V is written, and nothing else.
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from rotflex import __version__, hil, unanswered
from rotflex.commissioning import steps
from rotflex.commissioning.steps import Work
from rotflex.errors import BenchError, ConfigurationError, RotflexError
from rotflex.hil import bench_file, drivers
from rotflex.hil.bench import Bench
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.loop import listen
from rotflex.specifications import SAMPLE_TIME
from rotflex.units import DEG

_SAMPLED = 3.0  # s
_SAMPLES = f"samples at {1 / SAMPLE_TIME:.0f} Hz"
_CABLES = "Switch the amplifier off. Then look at the board's power and cables, and whether another program has it."
_TEST_VOLTAGES = (-2.0, 0.0, 2.0)  # V, at the loopback
_PERIOD_OFF = 0.02  # of the period: what its median may be off by
_NOTHING_STOPS = (
    "Nothing would stop the motor of a program that is killed: do not switch the amplifier on, and ask the board's "
    "maker."
)


class Level(StrEnum):
    """How good it is."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True)
class Diagnosis:
    """One thing that was looked at: whether it is as it should be, what was found, and what to do about it."""

    what: str
    level: Level
    message: str
    advice: str = ""

    def __str__(self) -> str:
        advice = f"\n{'':25}→ {self.advice}" if self.advice else ""
        return f"{self.level:5}{self.what:20}{self.message}{advice}"


def examine(uri: str, seconds: float = _SAMPLED) -> Iterator[Diagnosis]:
    """Look at a bench, one thing after the other, whether it was commissioned or not.

    Parameters
    ----------
    uri : its address, see :func:`rotflex.hil.open`
    seconds : for how long it is sampled

    Raises
    ------
    RotflexError
        If the bench cannot be opened, or not be closed.
    """
    bench = hil.open(uri)
    if bench.connection.recorded is not None:
        raise ConfigurationError(f"{uri} is a recording: there is no board to be looked at.")
    is_file = uri.endswith(".toml") and not uri.startswith("virtual:")
    file = bench_file.load(uri) if is_file else BenchFile(uri if ":" in uri else f"{uri}:")
    driver = drivers.find(file.address)
    own = "" if driver is None else f", {driver.software()}"
    yield Diagnosis("software", Level.OK, f"rotflex {__version__}, Python {platform.python_version()}{own}.")
    bench.recorder.folder = None  # what is sampled here is of no use to anybody later
    with bench:
        yield from look(bench, file, seconds)
        if bench.safety.commissioned is not None:
            yield from _allowed(bench, bench.safety.commissioned(), file)


def _allowed(bench: Bench, why_not: str | None, file: BenchFile) -> Iterator[Diagnosis]:
    """Return what the bench may do."""
    if why_not:
        advice = "rotflex bench setup --watchdog bench.toml" if "--watchdog" in why_not else "rotflex bench setup"
        yield Diagnosis("commissioned", Level.WARN, why_not, advice)
    else:
        yield Diagnosis("commissioned", Level.OK, f"On {file.record.get('date')}, as it is wired now.")
    limits = bench.safety.limits
    message = (
        f"{limits.voltage:g} V, theta ±{limits.theta / DEG:.0f} deg, alpha ±{limits.alpha / DEG:.0f} deg, "
        f"{limits.rate:g} rad/s, {limits.duration:g} s a run"
    )
    yield Diagnosis("limits", Level.OK, f"{message}, until it is commissioned." if limits.why else f"{message}.")


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
    for finding in look(bench, work.file):
        work.dialogue.say(str(finding))
        if finding.level is Level.FAIL:
            failed.append(f"{finding.message} {finding.advice}")
    if failed:
        raise BenchError(" ".join([*failed, "Nothing was recorded."]))


def look(bench: Bench, file: BenchFile, seconds: float = _SAMPLED) -> Iterator[Diagnosis]:
    """Look at all that is asked of an open board; one thing that fails keeps none of the others from being looked at.

    Parameters
    ----------
    bench : at rest
    file : how it is wired
    seconds : for how long it is sampled
    """
    yield Diagnosis("board", Level.OK, "It opens, and takes 0 V for the motor.")
    for name, check in CHECKS.items():
        try:
            yield from check(bench, file, seconds)
        except RotflexError as error:
            yield Diagnosis(name, Level.FAIL, str(error), _CABLES)
    for refusal in bench.connection.refused.values():
        yield Diagnosis("board", Level.WARN, refusal)


def _encoders(bench: Bench, file: BenchFile, _seconds: float) -> Iterator[Diagnosis]:
    """Read both counters."""
    (servo, link), wired = bench.connection.counts(), file.wiring
    message = f"Servo (encoder {wired['servo_encoder']}) at {servo} counts, link (encoder {wired['link_encoder']}) at "
    yield Diagnosis("encoders", Level.OK, f"{message}{link}.", "Turn the arm and see them count: rotflex bench watch.")


def _loopback(bench: Bench, file: BenchFile, _seconds: float) -> Iterator[Diagnosis]:
    """Write voltages to the output that a cable joins to an input, where one is named, and read them there."""
    if file.loopback is None:
        return
    try:
        for volts in _TEST_VOLTAGES:
            steps.write_loopback(bench, file, volts)
            read = steps.read_volts(bench, file.loopback[1])
            if abs(read - volts) > steps.TOLERANCE:
                raise BenchError(
                    f"{volts:g} V on analog output {file.loopback[0]} came in as {read:.2f} V at analog input "
                    f"{file.loopback[1]}: look at the cable between them, and at the board's ranges."
                )
    finally:
        steps.write_loopback(bench, file, 0.0)
    yield Diagnosis("loopback", Level.OK, f"What is written comes in, within {steps.TOLERANCE:g} V.")


def _samples(bench: Bench, _file: BenchFile, seconds: float) -> Iterator[Diagnosis]:
    """Look how steadily samples come."""
    number = max(round(seconds / SAMPLE_TIME), 2)
    recording = listen(bench, number, SAMPLE_TIME, {"experiment": "doctor"}, progress=False)
    yield judge_samples(recording.metadata, number)


def judge_samples(metadata: Mapping[str, Any], number: int) -> Diagnosis:
    """Judge how so many samples came, by their recording's metadata."""
    timing = metadata.get(unanswered.TIMING)
    if timing is None:
        message = "They come, and time waits for the program: there is no period to be measured."
        return Diagnosis(_SAMPLES, Level.OK, message)
    period, late = timing["period"], unanswered.in_words(metadata, number)
    message = (
        f"The period is {period['p50'] * 1e3:.3f} ms (p50), {period['p99'] * 1e3:.3f} ms (p99), "
        f"{period['max'] * 1e3:.3f} ms at most, by a {timing['clock']} clock. {unanswered.of_clock(timing['drift'])}"
    )
    is_off = abs(period["p50"] / SAMPLE_TIME - 1) > _PERIOD_OFF
    level = Level.FAIL if is_off or unanswered.too_many(metadata, number) else Level.WARN if late else Level.OK
    return Diagnosis(_SAMPLES, level, message, late or (unanswered.HELPS if is_off else ""))


def _watchdog(bench: Bench, file: BenchFile, _seconds: float) -> Iterator[Diagnosis]:
    """Look whether the watchdog expires when it is left alone, and what becomes of the voltage at the loopback."""
    trouble = steps.leave_alone(bench, file, 0.0)
    if trouble is None:
        untested = "" if bench.safety.commissioned is None else " Only set-up tests whether it stops the motor."
        yield Diagnosis("watchdog", Level.OK, f"It expires when it is left alone.{untested}")
    else:
        level = Level.WARN if "@" in file.address else Level.FAIL  # the maker's simulator harms nobody
        yield Diagnosis("watchdog", level, trouble, _NOTHING_STOPS)


#: What is asked of an open board, by name.
CHECKS: dict[str, Callable[[Bench, BenchFile, float], Iterator[Diagnosis]]] = {
    "encoders": _encoders,
    "loopback": _loopback,
    _SAMPLES: _samples,
    "watchdog": _watchdog,
}

"""What a laboratory's engineer asks of a bench at first: is all there, and does it work? The motor is never driven.

Each answer is a :class:`Finding`. What stands on something that has failed is left out.
"""

from __future__ import annotations

import contextlib
import io
import math
import platform
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from rotflex import __version__, hil
from rotflex.bench_doctor import on_the_board
from rotflex.bench_doctor.findings import Finding, Level
from rotflex.errors import RotflexError
from rotflex.hil import bench_file, drivers, waiting
from rotflex.hil.bench import Bench, Limits
from rotflex.hil.bench_file import BenchFile
from rotflex.specifications import SAMPLE_TIME
from rotflex.units import DEG

__all__ = ["Finding", "Level", "examine"]

FAST = 0.001  #: s: the quicker of the two sample times that are tried
_AS_USUAL = BenchFile("usual:board")  # wired as benches are unless a file says otherwise
_CABLES = "Look at its power and its cables, and whether another program has it."


def examine(uri: str, seconds: float = 3.0) -> Iterator[Finding]:
    """Look at a bench, one thing after the other.

    Parameters
    ----------
    uri : its address, see :func:`rotflex.hil.open`
    seconds : for how long it is sampled at each of two rates
    """
    try:
        told = bench_file.load(uri) if _is_file(uri) else None
        bench = hil.open(uri)
    except RotflexError as error:
        yield Finding("address", Level.FAIL, str(error), "Put the address or the file right.")
        return
    yield Finding("bench", Level.OK, _which(bench, told))
    software = _software(told.address if told else uri)
    yield software
    if bench.recorded is not None:
        said = "A recording is in the plant's place: there is no board to be looked at."
        yield Finding("board", Level.OK, said)
        return
    limits, commissioned = bench.limits, bench.safety.commissioned
    bench.safety = replace(bench.safety, folder=None)  # what is sampled here is of no use to anybody later
    if software.level is not Level.FAIL:
        yield from _on_the_board(bench, told or _AS_USUAL, seconds)
    yield _commissioned("" if commissioned is None else commissioned(), told)
    yield Finding("limits", Level.OK, _in_words(limits))
    yield _unfinished()


def _is_file(uri: str) -> bool:
    return uri.endswith(".toml") and not uri.startswith(("virtual:", "replay:"))


def _which(bench: Bench, told: BenchFile | None) -> str:
    """Which bench it is."""
    known = dict(bench.identity)
    if told is not None:
        known |= {name: told.parts[name] for name in ("amplifier", "cable_gain")}
        known |= {name: told.wiring[name] for name in ("motor_sign", "servo_sign", "link_sign")}
    return ", ".join(f"{name} {value}" for name, value in known.items()) + "."


def _software(address: str) -> Finding:
    """Whether what the bench stands on is installed."""
    what = "software"
    found = f"rotflex {__version__}, Python {platform.python_version()}"
    driver = drivers.find(address)
    if driver is not None:
        try:
            found += f", {driver.software()}"
        except RotflexError as error:
            return Finding(what, Level.FAIL, str(error), "Install it, and ask again.")
    return Finding(what, Level.OK, found + ".")


def _on_the_board(bench: Bench, told: BenchFile, seconds: float) -> Iterator[Finding]:
    """All that is asked of an open board."""
    what = "board"
    with contextlib.ExitStack() as opened:
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # what waits is told further down
                opened.enter_context(bench)
        except RotflexError as error:
            yield Finding(what, Level.FAIL, str(error), _CABLES)
            return
        yield Finding(what, Level.OK, "It opens, and takes 0 V for the motor.")
        for refusal in bench.refused.values():
            yield Finding(what, Level.WARN, refusal)
        asked = {
            "encoders": partial(on_the_board.encoders, bench, told),
            "loopback": partial(on_the_board.loopback, bench, told),
            "samples": partial(on_the_board.samples, bench, SAMPLE_TIME, seconds),
            "quick samples": partial(on_the_board.samples, bench, FAST, seconds),
            "watchdog": partial(on_the_board.watchdog, bench, told),
        }
        for name, look in asked.items():
            try:
                yield from look()
            except RotflexError as error:
                yield Finding(name, Level.FAIL, str(error), _CABLES)
        try:
            opened.close()
        except RotflexError as error:
            yield Finding(what, Level.FAIL, str(error), "Switch the amplifier off before anything else.")


def _commissioned(why_not: str, told: BenchFile | None) -> Finding:
    what = "commissioned"
    if why_not:
        mended = "rotflex bench setup --watchdog bench.toml" if "--watchdog" in why_not else "rotflex bench setup"
        return Finding(what, Level.WARN, why_not, mended)
    if told is not None:
        return Finding(what, Level.OK, f"On {told.record.get('date')}, as it is wired now.")
    return Finding(what, Level.OK, "This bench is asked for none.")


def _in_words(limits: Limits) -> str:
    """Limits, for people."""
    known = {
        "{value:g} V": limits.voltage,
        "theta ±{value:.0f} deg": limits.theta / DEG,
        "alpha ±{value:.0f} deg": limits.alpha / DEG,
        "{value:g} rad/s": limits.rate,
        "{value:g} s a run": limits.duration,
    }
    listed = ", ".join(text.format(value=value) for text, value in known.items() if value < math.inf)
    return f"{listed}, until it is commissioned." if limits.why else f"{listed}."


def _unfinished() -> Finding:
    """What killed programs left behind."""
    what = "unfinished runs"
    waits = waiting.waiting(waiting.place())
    if not waits:
        return Finding(what, Level.OK, "None.")
    last = f"{waits[-1].begun:%Y-%m-%d %H:%M}"
    said = f"{waiting.counted(waits)} of runs that did not end as they should, the last on {last}."
    return Finding(what, Level.WARN, said, "rotflex bench unfinished --out FOLDER")

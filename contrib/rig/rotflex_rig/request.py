"""A run as plain data: experiment, settings, controller as numbers, and the command itself.

Nothing of it is code. Whatever is not as it should be is refused with the reason, at the student's, at the server and
once more at the bench.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from rotflex.controller import Controller, runnable
from rotflex.errors import BenchError, RotflexError
from rotflex.hil import controllers
from rotflex.hil.guard import SLOWEST
from rotflex.hil.recorder import LONGEST
from rotflex.hil.replay import SETTINGS
from rotflex.recording import Channel, Recording
from rotflex.units import Vector

MOST_BYTES = 1_000_000  #: of a run as JSON
FASTEST = 0.001  #: s, between two samples
EXPERIMENTS = ("sweep", "free decay", "validation", "tracking", "follow")
_MOST_STATES = 30  # of a controller
_MOST_RUNS = 1000
_LARGEST = 1e9  # of any number
_SHOWN = 60  # characters, of a name in a message
_KEYS = {"settings", "controller", "reference", "sample_time", "run"}
_BY_HAND = (
    "Nobody stands at the rig's bench, so {name} does not run there. Use experiments.sweep, free_decay, validation, "
    "tracking or follow; or open a virtual bench for this."
)


@dataclass(frozen=True)
class Request:
    """A run that somebody asks for.

    Attributes
    ----------
    settings : what its recording says of itself; "experiment" is its name
    controller : what is to run
    reference : (n,) rad; V for an open loop
    sample_time : s
    run : number of the run, as in ``lab.bench(run=2)``
    """

    settings: dict[str, Any]
    controller: Controller
    reference: Vector
    sample_time: float
    run: int

    @property
    def seconds(self) -> float:
        """How long it takes, s."""
        return self.reference.size * self.sample_time


def packed(
    settings: Mapping[str, Any], controller: Controller | None, reference: Vector, sample_time: float, run: int
) -> bytes:
    """Return a run as JSON.

    Raises
    ------
    BenchError
        If a rig does not run it; the message says what to do instead.
    """
    name = settings.get("experiment")
    if controller is None or name not in EXPERIMENTS:
        raise BenchError(_BY_HAND.format(name=name))
    asked = {
        "settings": dict(settings),
        "controller": controllers.plain(controller),
        "reference": reference.tolist(),
        "sample_time": sample_time,
        "run": run,
    }
    body = json.dumps(asked, sort_keys=True, default=lambda value: value.tolist()).encode()
    read(body)  # what the rig would refuse is said now
    return body


def read(body: bytes) -> Request:
    """Read a run from JSON.

    Raises
    ------
    BenchError
        If it is none, or one that no rig runs; the message says why.
    """
    if len(body) > MOST_BYTES:
        raise BenchError(f"The run has {len(body) / 1e6:.1f} MB; a rig takes at most {MOST_BYTES / 1e6:g} MB.")
    try:
        asked = json.loads(body, parse_constant=_not_finite)
    except (ValueError, RecursionError) as error:
        raise BenchError(f"The run is not JSON: {error}.") from None
    if not isinstance(asked, dict) or set(asked) != _KEYS:
        raise BenchError(f"A run has {', '.join(sorted(_KEYS))}, and nothing else.")
    settings, sample_time, run = asked["settings"], asked["sample_time"], asked["run"]
    if not isinstance(settings, dict) or settings.get("experiment") not in EXPERIMENTS:
        raise BenchError(f"A rig runs {', '.join(EXPERIMENTS)}.")
    if unknown := set(settings) - {"experiment", "controller", *SETTINGS}:
        raise BenchError(f"No experiment has the setting {min(unknown)[:_SHOWN]!r}.")
    if not _is_number(sample_time) or not FASTEST <= sample_time <= SLOWEST:
        raise BenchError(f"The sample time must be from {1e3 * FASTEST:g} to {1e3 * SLOWEST:g} ms.")
    if type(run) is not int or not 1 <= run <= _MOST_RUNS:
        raise BenchError(f"The number of the run must be a whole number from 1 to {_MOST_RUNS}.")
    most = int(LONGEST / sample_time) + 1
    reference = asked["reference"]
    if not isinstance(reference, list) or len(reference) < 2 or not all(map(_is_number, reference)):
        raise BenchError("The command must be a list of at least two finite numbers.")
    if len(reference) > most:
        raise BenchError(f"A run on a rig takes at most {LONGEST:g} s: choose a smaller duration.")
    controller = _controller(asked["controller"], sample_time)
    return Request(settings, controller, np.array(reference, dtype=float), sample_time, run)


def recording_to_bytes(recording: Recording) -> bytes:
    """Return a recording as bytes, to the last bit; a ``.mat`` file has angles in degrees, and rounds."""
    arrays: dict[str, Any] = {f"channel {name} {one.unit}": one.values for name, one in recording.channels.items()}
    file = io.BytesIO()
    np.savez_compressed(file, time=recording.time, metadata=json.dumps(recording.metadata), **arrays)
    return file.getvalue()


def recording_of_bytes(content: bytes) -> Recording:
    """Return the recording of :func:`recording_to_bytes`."""
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        named = {key: key.split(" ", 2)[1:] for key in arrays.files if key.startswith("channel ")}
        channels = {name: Channel(arrays[key], unit) for key, (name, unit) in named.items()}
        return Recording(arrays["time"], channels, json.loads(str(arrays["metadata"])))


def _controller(data: Any, sample_time: float) -> Controller:
    try:
        if len(data.get("A") or data.get("Phi") or ()) > _MOST_STATES:
            raise BenchError(f"A rig takes controllers of at most {_MOST_STATES} states.")
        for name, value in {**data, **data.get("controller", {})}.items():
            if name not in ("kind", "feedback", "controller") and value is not None and not _are_numbers(value):
                raise BenchError(f"A controller is made of finite numbers; {name[:_SHOWN]!r} is none.")
        return runnable(controllers.of_plain(data), sample_time)
    except RotflexError as error:
        raise BenchError(str(error)) from None
    except (TypeError, ValueError, LookupError, ArithmeticError, AttributeError, RecursionError) as error:
        raise BenchError(f"The controller cannot be made of these numbers: {error}.") from None


def _are_numbers(value: Any) -> bool:
    numbers = np.asarray(value)
    return numbers.dtype.kind in "if" and bool(np.isfinite(numbers).all())


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) < _LARGEST


def _not_finite(text: str) -> NoReturn:
    raise ValueError(f"{text} is no finite number")

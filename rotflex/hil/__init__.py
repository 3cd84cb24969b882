"""Hardware in the loop: boards behind one interface, and the calibrated bench above them.

``open("virtual")`` gives a bench; the address says which one:

=====================================  ============================================================
``virtual``                            the student's own virtual bench (the caller gives the seed)
``virtual:?seed=7``                    the bench of another seed
``virtual:?seed=7&arm_position=2``     with the top arm elsewhere
``virtual:?preset=real_bench``         parameters fitted to a real bench
``virtual:?encoder=EHR``               with finer encoders
``virtual:?run=2``                     another run: friction is not what it was in the first
``virtual:?clock=wall``                in real time
``replay:file.mat``                    a recording in the plant's place
``replay:file.mat?clock=wall``         in real time
=====================================  ============================================================
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

from rotflex.config import Joint, joint, one_of, srv02
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.clock import SimulatedClock, TimeSource, WallClock
from rotflex.hil.replay import RecordedPlant
from rotflex.hil.student_benches import DRAW, DRAWS, FIRST_RUN, student_bench
from rotflex.hil.student_benches import preset as named_bench
from rotflex.hil.virtual import VirtualBoard
from rotflex.recording import Recording

__all__ = ["Bench", "open"]

_CLOCKS: dict[str, Callable[[], TimeSource]] = {"simulated": SimulatedClock, "wall": WallClock}
_OPTIONS = ("seed", "arm_position", "preset", "run", "encoder", "clock")


def open(
    uri: str = "virtual",
    seed: int | None = None,
    preset: str | None = None,
    draw: int = DRAW,
    run: int = FIRST_RUN,
) -> Bench:
    """The bench at an address, to be used in a ``with`` statement.

    Parameters
    ----------
    uri : as in the table above
    seed, preset : for a virtual bench whose address names neither; the preset counts, where there are both
    draw : version of how benches are drawn from seeds
    run : number of the run, for a virtual bench whose address names none; the same number gives the same recording

    Raises
    ------
    BenchError
        If the address is not understood; the message says what is.
    ConfigurationError
        If a value in it does not exist.
    """
    scheme, _, rest = uri.partition(":")
    if scheme == "replay":
        return _replay(uri, rest)
    if scheme != "virtual":
        raise BenchError(
            f"There is no bench at {uri!r}: an address begins with virtual, as in 'virtual:?seed=7', or with "
            "replay, as in 'replay:recording.mat'."
        )
    options = _options(uri, rest, _OPTIONS, "virtual:?seed=7")
    clock = one_of("clock", options.get("clock", "simulated"), _CLOCKS)
    encoder = options.get("encoder", "E")
    identity: dict[str, str | int] = {"uri": uri}
    name = options.get("preset", None if "seed" in options else preset)
    if name is not None:
        if "arm_position" in options:
            raise _both_told(uri)
        spec = named_bench(name)
        identity["preset"] = name
    else:
        chosen = _integer("seed", options.get("seed", seed if seed is not None else 0))
        position = options.get("arm_position")
        spec = student_bench(chosen, None if position is None else _integer("arm_position", position), draw)
        identity["seed"] = chosen
        identity["draw"] = draw
    number = _integer("run", options.get("run", run))
    spec = spec.run(number)
    identity |= {"run": number, "arm_position": spec.joint.arm_position, "encoder": encoder, "clock": clock}
    servo = srv02(encoder=encoder)
    return Bench(
        connect=lambda: VirtualBoard(spec.parameters, servo, clock=_CLOCKS[clock](), timing=spec.timing),
        servo=servo,
        joint=spec.joint,
        identity=identity,
    )


def _replay(uri: str, rest: str) -> Bench:
    path, mark, query = rest.partition("?")
    clock = one_of(
        "clock",
        _options(uri, mark + query, ("clock",), "replay:file.mat?clock=wall").get("clock", "simulated"),
        _CLOCKS,
    )
    recording = Recording.load(path)
    known = recording.metadata.get("bench")
    about: dict[str, Any] = known if isinstance(known, dict) else {}
    encoder = about.get("encoder", "E")
    position = about.get("arm_position", 1)
    if encoder not in ("E", "EHR") or position not in (1, 2, 3):
        raise BenchError(f"{path} says of its bench what cannot be: encoder {encoder!r}, arm position {position!r}.")
    servo = srv02(encoder=encoder)
    return Bench(
        connect=lambda: VirtualBoard(RecordedPlant(recording), servo, clock=_CLOCKS[clock]()),
        servo=servo,
        joint=_arm(about, position),
        identity={"uri": uri, "recording": Path(path).name, "clock": clock},
    )


def _arm(about: Mapping[str, Any], position: int) -> Joint:
    """The arm of the bench that a recording says it is of: the drawn one, where it names a draw."""
    seed, draw = about.get("seed"), about.get("draw")
    if isinstance(seed, int) and seed >= 0 and isinstance(draw, int) and draw in DRAWS:
        return student_bench(seed, position, draw).joint
    return joint(position)


def _options(uri: str, rest: str, known: Collection[str], example: str) -> dict[str, str]:
    """The options of an address."""
    pairs = parse_qsl(rest.removeprefix("?"), keep_blank_values=True)
    options = dict(pairs)
    unknown = [name for name in options if name not in known]
    if unknown or len(options) != len(pairs) or (rest and not rest.startswith("?")):
        raise BenchError(
            f"The address {uri!r} is not understood. Options come after a '?', as in {example!r}, each once, joined by "
            f"&: {', '.join(known)}."
        )
    if "preset" in options and ("seed" in options or "arm_position" in options):
        raise _both_told(uri)
    return options


def _both_told(uri: str) -> BenchError:
    return BenchError(f"The address {uri!r} names a preset and a draw; a preset has its own parameters.")


def _integer(name: str, value: str | int) -> int:
    try:
        number = int(value)
    except ValueError:
        number = -1
    if number < 0:
        raise BenchError(f"{name} must be a whole number, not negative; it is {value!r}.")
    return number

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
``replay:file.mat``                    a recording in the plant's place, for what it is a recording of
``replay:file.mat?clock=wall``         in real time
``quanser:q2_usb/0``                   a board of the maker's, through the maker's own Python package
``serial:/dev/ttyACM0?supply=12``      a board of another package, here ``contrib/serial`` (``rotflex.hil.drivers``)
``bench.toml``                         a laboratory's bench, with its wiring and its commissioning
``virtual:twin.toml``                  a plant that was fitted to recordings; options follow, as ``?clock=wall``
=====================================  ============================================================
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rotflex.config import Joint, Servo, joint, one_of, srv02
from rotflex.errors import BenchError
from rotflex.hil import drivers
from rotflex.hil.bench import Bench, Limits
from rotflex.hil.bench_file import load as load_bench_file
from rotflex.hil.clock import SimulatedClock, TimeSource, WallClock
from rotflex.hil.own_plant import OwnPlant
from rotflex.hil.real import Setup
from rotflex.hil.replay import RecordedPlant
from rotflex.hil.student_benches import DRAW, DRAWS, FIRST_RUN, VirtualPlantSpec, student_bench
from rotflex.hil.student_benches import preset as named_bench
from rotflex.hil.twin import load as load_twin
from rotflex.hil.virtual import VirtualBoard
from rotflex.plant import Moving, PlantParameters
from rotflex.recording import Recording

__all__ = ["Bench", "open"]


def __dir__() -> list[str]:
    return __all__


_CLOCKS: dict[str, Callable[[], TimeSource]] = {"simulated": SimulatedClock, "wall": WallClock}
_OPTIONS = ("seed", "arm_position", "preset", "run", "encoder", "clock")


def open(
    uri: str = "virtual",
    seed: int | None = None,
    preset: str | None = None,
    draw: int = DRAW,
    run: int = FIRST_RUN,
    plant: VirtualPlantSpec | PlantParameters | Moving | None = None,
    servo: Servo | None = None,
    setup: Setup | None = None,
) -> Bench:
    """The bench at an address, to be used in a ``with`` statement.

    Parameters
    ----------
    uri : as in the table above
    seed, preset : for a virtual bench whose address names neither; the preset counts, where there are both
    draw : version of how benches are drawn from seeds
    run : number of the run, for a virtual bench whose address names none; the same number gives the same recording
    plant : a plant of one's own on a virtual bench, in place of a drawn one: parameters (with the arm of position 1 as
        what is told, and outputs at once), all that a bench is made of, or an object that has ``state`` (theta, alpha
        and their rates, rad and rad/s) and ``advance(voltage, duration)`` (V, s). Each experiment begins with a copy of
        that object
    servo : nominal servo of a virtual bench; the data sheet's with the address's encoder unless given
    setup : what is known of a real bench: its parts, wiring, and whether it was commissioned

    Raises
    ------
    BenchError
        If the address is not understood; the message says what is.
    ConfigurationError
        If a value in it does not exist.
    """
    scheme, _colon, rest = uri.partition(":")
    given = {"plant": plant, "servo": servo, "setup": setup}
    if uri.endswith(".toml") and scheme not in ("virtual", "replay"):
        _take(uri, given, why="the file says what is known of the bench.")
        return _of_file(uri)
    if scheme == "virtual" and rest.partition("?")[0].endswith(".toml"):
        _take(uri, given, why="the file has the plant and its servo.")
        return _twin(uri, rest, run)
    if scheme == "replay":
        _take(uri, given, why="a recording is in the plant's place, and says what it is of.")
        return _replay(uri, rest)
    if scheme != "virtual":
        driver = drivers.find(uri)
        if driver is None:
            raise drivers.unknown(uri)
        why = "a real bench has its own plant; its parts stand in setup=Setup(servo=…, joint=…)."
        _take(uri, given, "setup", why=why)
        return driver.bench(uri, setup)
    _take(uri, given, "plant", "servo", why="a setup is of a real bench.")
    options = drivers.options(uri, rest, _OPTIONS, "virtual:?seed=7")
    clock = one_of("clock", options.get("clock", "simulated"), _CLOCKS)
    identity: dict[str, Any] = {"uri": uri}
    name = options.get("preset", None if "seed" in options else preset)
    if plant is not None and not isinstance(plant, VirtualPlantSpec | PlantParameters):
        OwnPlant(plant)  # what is wrong with it is said now
        _refuse_draw(uri, options, "seed", "preset", "arm_position", "run")
        parts = servo or srv02(encoder=options.get("encoder", "E"))
        identity |= {"plant": type(plant).__name__, "encoder": parts.encoder, "clock": clock}
        return Bench(
            connect=lambda: VirtualBoard(OwnPlant(plant), parts, clock=_CLOCKS[clock]()),
            servo=parts,
            joint=joint(1),
            identity=identity,
            virtual=True,
        )
    if plant is not None:
        spec, about = _own(uri, options, plant)
    elif name is not None:
        if "seed" in options or "arm_position" in options:
            raise BenchError(f"The address {uri!r} names a preset and a draw; a preset has its own parameters.")
        spec, about = named_bench(name), {"preset": name}
    else:
        chosen = _integer("seed", options.get("seed", seed if seed is not None else 0))
        position = options.get("arm_position")
        spec = student_bench(chosen, None if position is None else _integer("arm_position", position), draw)
        about = {"seed": chosen, "draw": draw}
    number = _integer("run", options.get("run", run))
    spec = spec.run(number)
    parts = servo or srv02(encoder=options.get("encoder", "E"))
    identity |= about
    identity |= {"run": number, "arm_position": spec.joint.arm_position, "encoder": parts.encoder, "clock": clock}
    return Bench(
        connect=lambda: VirtualBoard(spec.parameters, parts, clock=_CLOCKS[clock](), timing=spec.timing),
        servo=parts,
        joint=spec.joint,
        identity=identity,
        virtual=True,
    )


def _take(uri: str, given: Mapping[str, object], *taken: str, why: str) -> None:
    """That nothing was given that this address has no use for."""
    for name, value in given.items():
        if value is not None and name not in taken:
            raise BenchError(f"The address {uri!r} takes no {name}=: {why}")


def _of_file(path: str) -> Bench:
    told = load_bench_file(path)
    bench = open(told.address, setup=told.setup())
    bench.identity["name"] = told.name
    return bench


def _twin(uri: str, rest: str, run: int) -> Bench:
    path, mark, query = rest.partition("?")
    options = drivers.options(uri, mark + query, ("run", "clock"), "virtual:twin.toml?clock=wall")
    known = load_twin(path)
    number = _integer("run", options.get("run", run))
    bench = open("virtual:" + mark + query, plant=known.spec, servo=known.servo, run=number)
    bench.identity["uri"] = uri
    if known.name:
        bench.identity["name"] = known.name
    return bench


def _own(
    uri: str, options: Mapping[str, str], plant: VirtualPlantSpec | PlantParameters
) -> tuple[VirtualPlantSpec, dict[str, Any]]:
    """A bench of one's own, and how it is known."""
    _refuse_draw(uri, options, "seed", "preset", "arm_position")
    spec = VirtualPlantSpec(joint(1), plant) if isinstance(plant, PlantParameters) else plant
    return spec, {"plant": {**asdict(spec.parameters), "delay": spec.timing.delay}}


def _refuse_draw(uri: str, options: Mapping[str, str], *drawn: str) -> None:
    """Raise BenchError where an address says how to draw a plant, and one was given."""
    for name in drawn:
        if name in options:
            raise BenchError(
                f"The address {uri!r} says {name}=, and a plant was given as well, which has its own parameters: "
                "leave one of them out."
            )


def _replay(uri: str, rest: str) -> Bench:
    path, mark, query = rest.partition("?")
    options = drivers.options(uri, mark + query, ("clock",), "replay:file.mat?clock=wall")
    clock = one_of("clock", options.get("clock", "simulated"), _CLOCKS)
    recording = Recording.load(path)
    known = recording.metadata.get("bench")
    about: dict[str, Any] = known if isinstance(known, dict) else {}
    encoder = about.get("encoder", "E")
    position = about.get("arm_position", 1)
    if encoder not in ("E", "EHR") or position not in (1, 2, 3):
        raise BenchError(f"{path} says of its bench what cannot be: encoder {encoder!r}, arm position {position!r}.")
    servo, plant = srv02(encoder=encoder), RecordedPlant(recording, Path(path).name)

    def connect() -> VirtualBoard:
        plant.rewind()
        return VirtualBoard(plant, servo, clock=_CLOCKS[clock]())

    return Bench(
        connect=connect,
        servo=servo,
        joint=_arm(about, position),
        identity={"uri": uri, "recording": plant.name, "clock": clock},
        limits=Limits(theta=math.inf, alpha=math.inf),  # there is nothing to come to harm
        recorded=plant,
        virtual=True,
    )


def _arm(about: Mapping[str, Any], position: int) -> Joint:
    """The arm of the bench that a recording says it is of: the drawn one, where it names a draw."""
    seed, draw = about.get("seed"), about.get("draw")
    if isinstance(seed, int) and seed >= 0 and isinstance(draw, int) and draw in DRAWS:
        return student_bench(seed, position, draw).joint
    return joint(position)


def _integer(name: str, value: str | int) -> int:
    try:
        number = int(value)
    except ValueError:
        number = -1
    if number < 0:
        raise BenchError(f"{name} must be a whole number, not negative; it is {value!r}.")
    return number

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

from numpy.typing import ArrayLike

from rotflex.config import Joint, Servo, joint, one_of, srv02
from rotflex.errors import BenchError
from rotflex.hil import bench_file, drivers
from rotflex.hil.bench import Bench, Connection, Limits, Push, Safety
from rotflex.hil.real import Setup
from rotflex.hil.replay import RecordedPlant
from rotflex.hil.student_benches import DRAW, FIRST_RUN, VirtualPlantSpec, student_bench
from rotflex.hil.student_benches import preset as named_bench
from rotflex.hil.virtual import OwnPlant, SimulatedClock, VirtualBoard, WallClock
from rotflex.plant import Moving, PlantParameters
from rotflex.recording import Recording
from rotflex.unanswered import table_of

__all__ = ["Bench", "open"]


def __dir__() -> list[str]:
    return __all__


_CLOCKS: dict[str, Callable[[], SimulatedClock | WallClock]] = {"simulated": SimulatedClock, "wall": WallClock}
_OWN_PARAMETERS = "a plant was given as well, which has its own parameters."
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
    disturbance: ArrayLike | Push | None = None,
) -> Bench:
    """Return the bench at an address, to be used in a ``with`` statement.

    Parameters
    ----------
    uri : as in the table above
    seed, preset : for a virtual bench, where its address names neither; the preset counts, where there are both
    draw : version of how benches are drawn from seeds
    run : number of the run, where a virtual bench's address names none; the same number gives the same recording
    plant : a plant of one's own on a virtual bench, in place of a drawn one: parameters (with the arm of position 1 as
        what is told, and outputs at once), all that a bench is made of, or an object that has ``state`` (theta, alpha
        and their rates, rad and rad/s) and ``advance(voltage, duration)`` (V, s). Each experiment begins with a copy of
        that object
    servo : nominal servo of a virtual bench; the data sheet's with the address's encoder unless given
    setup : what is known of a real bench: its parts, wiring, and whether it was commissioned
    disturbance : torque on the link of a virtual bench, see :meth:`Bench.disturb`; the ``tau_link`` of a recording
        plays that push again, and gives the same recording

    Raises
    ------
    BenchError
        If the address is not understood; the message says what is. If a bench cannot be disturbed.
    ConfigurationError
        If a value in it does not exist.
    """
    scheme, _colon, rest = uri.partition(":")
    path, mark, query = rest.partition("?")
    given = {"plant": plant, "servo": servo, "setup": setup}
    if uri.endswith(".toml") and scheme not in ("virtual", "replay"):
        _refuse(uri, given, "the file says what is known of the bench.")
        file = bench_file.load(uri)
        bench = open(file.address, setup=file.setup())
        bench.identity["name"] = file.name
    elif scheme == "virtual" and path.endswith(".toml"):
        _refuse(uri, given, "the file has the plant and its servo.")
        bench = _twin(uri, path, mark + query, run)
    elif scheme == "virtual":
        _refuse(uri, {"setup": setup}, "a setup is of a real bench.")
        bench = _virtual(uri, rest, seed, preset, draw, run, plant, servo)
    elif scheme == "replay":
        _refuse(uri, given, "a recording is in the plant's place, and says what it is of.")
        bench = _replay(uri, path, mark + query)
    else:
        driver = drivers.find(uri)
        if driver is None:
            raise drivers.unknown(uri)
        parts = "a real bench has its own plant; its parts stand in setup=Setup(servo=…, joint=…)."
        _refuse(uri, {"plant": plant, "servo": servo}, parts)
        bench = driver.bench(uri, setup)
    if disturbance is not None:
        bench.disturb(disturbance)
    return bench


def _virtual(
    uri: str,
    query: str,
    seed: int | None,
    preset: str | None,
    draw: int,
    run: int,
    plant: VirtualPlantSpec | PlantParameters | Moving | None,
    servo: Servo | None,
) -> Bench:
    """Return a virtual bench, see :func:`open`."""
    options = drivers.options(uri, query, _OPTIONS, "virtual:?seed=7")
    clock = one_of("clock", options.get("clock", "simulated"), _CLOCKS)
    fitted = servo or srv02(encoder=options.get("encoder", "E"))
    name, position = options.get("preset", None if "seed" in options else preset), options.get("arm_position")
    about: dict[str, Any]
    if plant is not None:
        drawn = {name: options.get(name) for name in ("seed", "preset", "arm_position")}
        _refuse(uri, drawn, _OWN_PARAMETERS)
    if isinstance(plant, VirtualPlantSpec | PlantParameters):
        spec = plant if isinstance(plant, VirtualPlantSpec) else VirtualPlantSpec(joint(1), plant)
        about = {"plant": {**asdict(spec.parameters), "delay": spec.timing.delay}}
    elif plant is not None:
        OwnPlant(plant)  # what is wrong with it is said now
        _refuse(uri, {"run": options.get("run")}, _OWN_PARAMETERS)
        identity = {"uri": uri, "plant": type(plant).__name__, "encoder": fitted.encoder, "clock": clock}
        connection = Connection(
            lambda: VirtualBoard(OwnPlant(plant), fitted, clock=_CLOCKS[clock]()), fitted, virtual=True
        )
        return Bench(connection, fitted, joint(1), identity)
    elif name is not None:
        if "seed" in options or position is not None:
            raise BenchError(f"The address {uri!r} names a preset and a draw; a preset has its own parameters.")
        spec, about = named_bench(name), {"preset": name}
    else:
        chosen = _integer("seed", options.get("seed", seed or 0))
        spec = student_bench(chosen, None if position is None else _integer("arm_position", position), draw)
        about = {"seed": chosen, "draw": draw}
    number = _integer("run", options.get("run", run))
    spec = spec.run(number)
    about |= {"run": number, "arm_position": spec.joint.arm_position}
    identity = {"uri": uri, **about, "encoder": fitted.encoder, "clock": clock}

    def connect() -> VirtualBoard:
        return VirtualBoard(spec.parameters, fitted, clock=_CLOCKS[clock](), timing=spec.timing)

    return Bench(Connection(connect, fitted, virtual=True), fitted, spec.joint, identity)


def _refuse(uri: str, given: Mapping[str, object], why: str) -> None:
    """Raise BenchError where something was given that this address has no use for."""
    for name, value in given.items():
        if value is not None:
            raise BenchError(f"The address {uri!r} takes no {name}=: {why}")


def _twin(uri: str, path: str, query: str, run: int) -> Bench:
    drivers.options(uri, query, ("run", "clock"), "virtual:twin.toml?clock=wall")
    twin = bench_file.load_twin(path)
    bench = open("virtual:" + query, plant=twin.spec, servo=twin.servo, run=run)
    bench.identity["uri"] = uri
    if twin.name:
        bench.identity["name"] = twin.name
    return bench


def _replay(uri: str, path: str, query: str) -> Bench:
    options = drivers.options(uri, query, ("clock",), "replay:file.mat?clock=wall")
    clock = one_of("clock", options.get("clock", "simulated"), _CLOCKS)
    recording = Recording.load(path)
    about = table_of(recording.metadata, "bench")
    encoder, position = about.get("encoder", "E"), about.get("arm_position", 1)
    if encoder not in ("E", "EHR") or position not in (1, 2, 3):
        raise BenchError(f"{path} says of its bench what cannot be: encoder {encoder!r}, arm position {position!r}.")
    arm, seed, draw = joint(position), about.get("seed"), about.get("draw")
    if isinstance(seed, int) and seed >= 0 and draw == DRAW:
        arm = student_bench(seed, position).joint
    name = Path(path).name
    plant, identity = RecordedPlant(recording, name), {"uri": uri, "recording": name, "clock": clock}
    return recorded_bench(plant, srv02(encoder=encoder), arm, identity)


def recorded_bench(plant: RecordedPlant, servo: Servo, arm: Joint, identity: Mapping[str, Any]) -> Bench:
    """Return a bench with a recording in the plant's place.

    Parameters
    ----------
    plant : the recording
    servo, arm : the parts of the bench that was recorded
    identity : plain data that says which bench this is; its "clock" is simulated or wall
    """

    def connect() -> VirtualBoard:
        plant.rewind()
        return VirtualBoard(plant, servo, clock=_CLOCKS[identity["clock"]]())

    no_limits = Limits(theta=math.inf, alpha=math.inf)  # there is nothing to come to harm
    return Bench(Connection(connect, servo, virtual=True, recorded=plant), servo, arm, identity, Safety(no_limits))


def _integer(name: str, value: str | int) -> int:
    if not (str(value).isascii() and str(value).isdecimal()):
        raise BenchError(f"{name} must be a whole number, not negative; it is {value!r}.")
    return int(value)

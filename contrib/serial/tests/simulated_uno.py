"""The real firmware on a simulated Arduino Uno (simavr), with a plant on its pins, in lockstep with the program.

Time is the controller's own: it passes only while the program waits for the line, or by :meth:`SimulatedUno.run`.
Nothing here depends on how quick the computer is.
"""

import ctypes
import os
import shutil
import subprocess
import weakref
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import pytest

from rotflex.config import Servo, srv02
from rotflex.hil.virtual import TICK
from rotflex.plant import Moving, Plant, PlantParameters

FIRMWARE = Path(__file__).parents[1] / "firmware"
CYCLES = 16_000_000  #: a second
MS = CYCLES // 1000
SUPPLY = 12.0  #: V, of the motor's driver
_STEP = round(8 * TICK * CYCLES)  # of the plant: 1/8 ms
_SOURCE = Path(__file__).parent / "uno" / "uno.c"
_ROOM = 4096


def lacking() -> str:
    """What the simulation needs and this computer does not have, in words; empty, if nothing."""
    programs = [name for name in ("avr-gcc", "avr-size", "make", "cc") if shutil.which(name) is None]
    headers = [] if Path("/usr/include/simavr/sim_avr.h").exists() else ["libsimavr-dev"]
    libc = [] if any(Path("/usr/lib/avr/include").glob("avr/io.h")) else ["avr-libc"]
    missing = programs + headers + libc
    if not missing:
        return ""
    return (
        f"The firmware cannot be simulated here, without {', '.join(missing)}: run sh tools/system_packages.sh --all."
    )


#: For tests that need it.
needs_simavr = pytest.mark.skipif(bool(lacking()), reason=lacking() or "all is there")


@cache
def firmware(defines: str = "") -> Path:
    """The firmware, built from its source by its own Makefile."""
    folder = Path(mkdtemp(prefix="rotflex-firmware-"))
    _build(["make", "-s", "-C", str(FIRMWARE), f"BUILD={folder}", f"DEFINES={defines}"])
    return folder / "rotflex.elf"


@cache
def _library() -> ctypes.CDLL:
    built = Path(mkdtemp(prefix="rotflex-uno-")) / "uno.so"
    _build(["cc", "-O2", "-Wall", "-shared", "-fPIC", "-o", str(built), str(_SOURCE), "-lsimavr", "-lelf"])
    library = ctypes.CDLL(os.fspath(built))
    pointer, cycles = ctypes.c_void_p, ctypes.c_uint64
    signatures: dict[str, tuple[Any, list[Any]]] = {
        "uno_open": (pointer, [ctypes.c_char_p]),
        "uno_close": (None, [pointer]),
        "uno_now": (cycles, [pointer]),
        "uno_feed": (None, [pointer, ctypes.c_char_p, ctypes.c_uint32]),
        "uno_take": (ctypes.c_uint32, [pointer, ctypes.c_char_p, ctypes.c_uint32]),
        "uno_turn": (None, [pointer, ctypes.c_int, ctypes.c_int32, cycles]),
        "uno_run": (ctypes.c_bool, [pointer, cycles]),
        "uno_duty": (ctypes.c_double, [pointer]),
        "uno_lines": (ctypes.c_int, [pointer]),
        "uno_analog": (None, [pointer, ctypes.c_int, ctypes.c_uint32]),
        "uno_reset": (None, [pointer]),
        "uno_hang": (None, [pointer, ctypes.c_bool]),
        "uno_mend": (None, [pointer]),
    }
    for name, (result, arguments) in signatures.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


def _build(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


class SimulatedUno:
    """An Uno with the firmware on it.

    Parameters
    ----------
    plant : what its motor drives and its encoders see; None for nothing
    supply : of the motor's driver, V
    defines : for the firmware's compiler, as ``-DPROTOCOL_VERSION=2``
    """

    def __init__(
        self,
        plant: PlantParameters | Moving | None = None,
        supply: float = SUPPLY,
        servo: Servo | None = None,
        defines: str = "",
    ) -> None:
        self.plant: Moving | None = Plant(plant) if isinstance(plant, PlantParameters) else plant
        self.supply = supply
        self._firmware = os.fspath(firmware(defines)).encode()
        self._K_enc = (servo or srv02()).K_enc
        self._uno = _library()
        self._handle = self._uno.uno_open(self._firmware)
        assert self._handle, "simavr cannot load the firmware"
        weakref.finalize(self, self._uno.uno_close, self._handle)

    @property
    def cycles(self) -> int:
        """The controller's time, in cycles."""
        return int(self._uno.uno_now(self._handle))

    @property
    def now(self) -> float:
        """The controller's time, s."""
        return self.cycles / CYCLES

    @property
    def voltage(self) -> float:
        """What its pins have the driver give to the motor, V."""
        return float(self._uno.uno_duty(self._handle)) * self.supply

    @property
    def lines(self) -> int:
        """The digital outputs' levels as bits."""
        return int(self._uno.uno_lines(self._handle))

    def step(self, longest: int = _STEP) -> None:
        """Run for a short while, with the plant."""
        if self.plant is not None:
            longest = _STEP
            before = self.plant.state
            after = self.plant.advance(self.voltage, 8 * TICK)
            if after[:2] != before[:2]:
                self.turn(0, round(after.theta / self._K_enc), _STEP)
                self.turn(1, round(-after.alpha / self._K_enc), _STEP)
        assert self._uno.uno_run(self._handle, self.cycles + longest), "the simulated controller has stopped"

    def run(self, duration: float) -> None:
        """Run for a time (s)."""
        end = self.cycles + round(duration * CYCLES)
        while self.cycles < end:
            self.step(min(_STEP, end - self.cycles))

    def turn(self, encoder: int, position: int, cycles: int) -> None:
        """Turn an encoder to a position (counts), evenly in so many cycles."""
        self._uno.uno_turn(self._handle, encoder, position, cycles)

    def feed(self, content: bytes) -> None:
        """Put bytes on the line to it."""
        self._uno.uno_feed(self._handle, content, len(content))

    def take(self) -> bytes:
        """What has come from it."""
        room = ctypes.create_string_buffer(_ROOM)
        length = self._uno.uno_take(self._handle, room, _ROOM)
        return room.raw[:length]

    def analog(self, pin: int, volts: float) -> None:
        """Put a voltage on pin A0, A1, ..."""
        self._uno.uno_analog(self._handle, pin, round(volts * 1000))

    def reset(self) -> None:
        """Press the reset button."""
        self._uno.uno_reset(self._handle)

    def hang(self, interrupts: bool) -> None:
        """Let its program hang where it is, with interrupts served or not."""
        self._uno.uno_hang(self._handle, interrupts)

    def mend(self) -> None:
        """Its program would not hang there again."""
        self._uno.uno_mend(self._handle)


class SimulatedPort:
    """The line to a simulated Uno: the controller's time passes while somebody waits.

    Attributes
    ----------
    to_board, from_board : what becomes of bytes on the way; faults are put here
    open : whether it is
    """

    def __init__(self, uno: SimulatedUno) -> None:
        self.uno = uno
        self.open = True
        self.to_board: Callable[[bytes], bytes] = bytes
        self.from_board: Callable[[bytes], bytes] = bytes

    def now(self) -> float:
        return self.uno.now

    def write(self, content: bytes) -> None:
        assert self.open
        self.uno.feed(self.to_board(content))

    def read(self, until: float) -> bytes:
        assert self.open
        while True:
            content = self.from_board(self.uno.take())
            if content or self.uno.now >= until:
                return content
            self.uno.step()

    def close(self) -> None:
        self.open = False

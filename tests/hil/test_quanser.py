"""The adapter to the maker's package: what it says when that is missing, its errors' words, and 0 V after an expiry."""

from __future__ import annotations

import importlib
from types import ModuleType

import miswired
import numpy as np
import pytest
import quanser_double
from quanser_double import VARIANTS, output

from rotflex import experiments, hil
from rotflex.errors import BenchError, HILError, LimitExceeded
from rotflex.hil import quanser
from rotflex.hil.controllers import OpenLoop, StateFeedback
from rotflex.hil.loop import run
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard
from rotflex.units import DEG

pytestmark = pytest.mark.usefixtures("settings")

SIMULATOR = "quanser:qpid_e/0@tcpip://localhost:18000?nagle='off'"
GAIN = [18.24, -17.15, 1.59, 0.63]
MOTOR = np.array([0], dtype=np.uint32)
COMMISSIONED = Setup(commissioned=lambda: "")


def physical() -> VirtualBoard:
    bench = preset("real_bench")
    return VirtualBoard(bench.parameters, timing=bench.timing)


@pytest.fixture
def installed(monkeypatch):
    """The maker's package is there; gives a function that chooses what its watchdog does, and the cards."""

    def install(variant: quanser_double.Variant | None = None) -> list[quanser_double.HIL]:
        return quanser_double.install(monkeypatch, physical, variant)

    return install


def test_opening_an_address_imports_nothing(monkeypatch):
    monkeypatch.setattr(importlib, "import_module", lambda name: pytest.fail(f"{name} was imported"))
    bench = hil.open("quanser:q2_usb/0")
    assert bench.identity == {"uri": "quanser:q2_usb/0", "arm_position": 1, "encoder": "E", "clock": "wall"}


@pytest.mark.parametrize("kind", [ModuleNotFoundError, ImportError, OSError])
def test_a_package_that_is_missing_or_broken_is_told_with_what_to_install(kind, monkeypatch):
    def refuse(name: str) -> ModuleType:
        raise kind("cannot load hil.dll")

    monkeypatch.setattr(importlib, "import_module", refuse)
    with pytest.raises(BenchError) as caught, hil.open("quanser:q2_usb/0"):
        pytest.fail("the block must not be entered")
    for word in ("cannot load hil.dll", "Quanser SDK", "QSDK_DIR", "pip install"):
        assert word in str(caught.value)


def test_an_error_of_the_boards_is_told_in_the_makers_words(installed):
    installed()
    with pytest.raises(HILError, match=r"open.* q9 .*-1075"):
        quanser.connect("q9", "0")
    board = quanser.connect("q2_usb", "0")
    with pytest.raises(HILError, match=r"task_stop.* 7 .*-1001"):
        board.task_stop(7)
    with pytest.raises(HILError, match="write_analog"):
        board.write_analog(MOTOR, 1, [0.0])  # type: ignore[arg-type]


def test_experiments_run_on_the_makers_simulator_as_on_the_virtual_bench(installed):
    """Time waits there, so that both give the same to the last bit."""
    cards = installed()
    with hil.open(SIMULATOR, setup=COMMISSIONED) as bench:
        ours = experiments.tracking(bench, GAIN, duration=2.0, progress=False)
    with hil.open("virtual:?preset=real_bench") as bench:
        virtual = experiments.tracking(bench, GAIN, duration=2.0, progress=False)
    for name in virtual.channels:
        assert ours[name].tolist() == virtual[name].tolist()
    assert ours.metadata["bench"]["uri"] == SIMULATOR
    assert output(cards[0]) == 0.0 and not cards[0].is_valid()


def test_without_a_record_of_commissioning_no_loop_is_closed_and_a_voltage_may_be_set(installed):
    cards = installed()
    with hil.open(SIMULATOR) as bench:
        with pytest.raises(BenchError, match="has not been commissioned as it is wired now, so no loop is closed"):
            run(bench, StateFeedback(GAIN), np.zeros(50), progress=False)
        assert len(run(bench, OpenLoop(), np.full(50, 0.5), progress=False)) == 50
        assert len(experiments.watch(bench, 0.1, progress=False)) == 51
    assert output(cards[0]) == 0.0


@pytest.mark.parametrize("signs", miswired.SIGNS)
def test_a_program_of_ones_own_does_no_harm_on_a_bench_that_was_not_commissioned(monkeypatch, signs):
    """`loop.run` closes no loop there; a hand-written one, whatever sign is wrong, gets little voltage and room."""
    laboratory = miswired.Laboratory(*signs)
    cards = quanser_double.install(monkeypatch, laboratory)
    controller = StateFeedback(GAIN, sample_time=0.002)
    stopped = ""
    with hil.open(SIMULATOR) as bench:
        bench.start(0.002)
        try:
            for _sample in range(1000):
                measured = bench.read()
                bench.write(controller(2.5 * DEG, measured.theta, measured.alpha))
        except LimitExceeded as error:
            stopped = str(error)
    assert laboratory.moved < 45 * DEG
    assert output(cards[0]) == 0.0
    motor, servo, link = signs
    if motor != servo:
        assert stopped
    elif motor == link:  # with the link's sign alone wrong, friction may hold the servo near where it should be
        assert stopped or laboratory.moved < 5 * DEG
    else:  # as wired, and its mirror image
        assert not stopped


def test_more_than_an_uncommissioned_bench_allows_is_refused_and_not_cut_in_silence(installed):
    cards = installed()
    with hil.open(SIMULATOR) as bench:
        bench.start(0.002)
        bench.read()
        with pytest.raises(LimitExceeded, match=r"asked for -2\.5 V, and the limit is ±1 V.*has not been commissioned"):
            bench.write(-2.5)
        assert output(cards[0]) == 0.0
        with pytest.raises(LimitExceeded, match=r"its limit is ±40 deg\. This bench has not been commissioned"):
            run(bench, OpenLoop(), np.full(2000, 0.95), progress=False)
    assert output(cards[0]) == 0.0


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("again", [False, True])
def test_whatever_an_expired_watchdog_does_the_bench_ends_at_0_V_and_can_run_again(installed, variant, again):
    cards = installed(VARIANTS[variant])
    with hil.open(SIMULATOR, setup=COMMISSIONED) as bench:
        bench.start(0.002)
        for _sample in range(20):
            bench.read()
            bench.write(3.0)
        inner = cards[0]._inner
        assert inner is not None and output(cards[0]) == 3.0
        inner.clock.wait_until(inner.clock.now() + 1.0)  # the program says no word
        with pytest.raises(HILError, match="watchdog"):
            bench.write(1.0) if again else bench.read()
        if again:
            bench.stop()
            assert output(cards[0]) == 0.0
            assert len(run(bench, OpenLoop(), np.full(50, 0.5), progress=False)) == 50
    assert output(cards[0]) == 0.0
    inner.clock.wait_until(inner.clock.now() + 1.0)
    inner._catch_up(inner.clock.now())
    assert output(cards[0]) == 0.0

"""What is said of isolation is so: of each layer by itself, of the system calls' filter, and of all together."""

import json
import os
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest

from labcourse.errors import IsolationError
from labcourse.grading.isolation import attacks, bubblewrap, sandbox, seccomp, selftest
from labcourse.grading.isolation.process import Ending, Limits, Outcome
from labcourse.grading.isolation.selftest import Attempt, Layer
from labcourse.grading.running import isolation_report
from labcourse.grading.running.isolation_report import IsolationState

STATUS = "Name:\tcat\nCapInh:\t0000000000000000\nCapEff:\t0000000000000000\nCapAmb:\t0000000000000000\nNoNewPrivs:\t1\n"
MEMORY = f"Max address space         {Limits().memory}           {Limits().memory}           bytes\n"
NETWORK = "Inter-|   Receive\n face |bytes\n    lo:       0       0    0    0    0     0          0         0   0  0\n"
MOUNTS = "overlay / overlay ro,relatime 0 0\ntmpfs /tmp tmpfs rw,nosuid 0 0\n"
MOUNTS += "tmpfs /dev/shm tmpfs rw,nosuid 0 0\nproc /proc proc rw,nosuid 0 0\n"
ETHERNET = "  eth0:       0       0    0    0    0     0          0         0   0  0\n"


def seen(status=STATUS, memory=MEMORY, network=NETWORK, mounts=MOUNTS, processes=5, user=1000) -> str:
    listed = "".join(f"/proc/{number}\n" for number in range(1, processes + 1))
    return f"{status}{memory}{network}{mounts}\n=\n{listed}{user}\n"


@pytest.fixture
def said(monkeypatch):
    """What is said of the layers, where a trusted program sees something."""

    def look(output, file=b"seen\n"):
        def run(command, *, visible, wanted, limits):
            assert limits.memory == Limits().memory and wanted["seen"] >= len(b"seen\n")
            return Outcome(Ending.FINISHED, 0, {"seen": file}, {}, output.encode(), 0.1)

        monkeypatch.setattr(sandbox, "run", run)
        return {layer.name: layer for layer in selftest._inside_layers()}

    return look


def test_where_all_is_well_every_layer_is_called_good(said):
    found = said(seen())
    assert list(found) == ["file system", "network", "processes", "privileges", "limits", "system calls"]
    assert all(layer.good and layer.remedy == "" for layer in found.values())
    assert found["network"].state == "interfaces: lo"
    assert found["processes"].state == "5 to be seen, all of the sandbox"
    assert [layer.needed for layer in found.values()] == [True] * 5 + [False]


@pytest.mark.parametrize(
    ("name", "otherwise"),
    [
        ("file system", {"mounts": MOUNTS.replace("/ overlay ro", "/ overlay rw")}),
        ("file system", {"mounts": MOUNTS + "disk /tmp/of/another ext4 rw,relatime 0 0\n"}),
        ("file system", {"mounts": ""}),
        ("network", {"network": NETWORK + ETHERNET}),
        ("network", {"network": ""}),
        ("processes", {"processes": 6}),  # five are a handful of its own
        ("processes", {"processes": 0}),
        ("privileges", {"status": STATUS.replace("CapEff:\t0000000000000000", "CapEff:\t00000000a80425fb")}),
        ("privileges", {"status": STATUS.replace("NoNewPrivs:\t1", "NoNewPrivs:\t0")}),
        ("privileges", {"status": ""}),
        ("privileges", {"user": 0}),
        ("limits", {"memory": MEMORY.replace(str(Limits().memory), str(Limits().memory * 10))}),
        ("limits", {"memory": ""}),
    ],
)
def test_a_layer_that_is_not_there_is_said_not_to_be_and_no_other(said, name, otherwise):
    found = said(seen(**otherwise))
    assert [layer.name for layer in found.values() if not layer.good] == [name]
    assert found[name].state.startswith("not so: ") and "Do not grade here" in found[name].remedy


@pytest.mark.parametrize("file", [None, b"", b"other\n"])
def test_a_sandbox_in_which_a_trusted_program_does_not_run_is_said_to_be_none(said, file):
    (layer,) = said("sh: not found", file=file).values()
    assert (layer.name, layer.good, layer.needed) == ("sandbox", False, True)
    assert layer.state == "a trusted program does not run in it: sh: not found" and layer.remedy


@pytest.mark.parametrize(
    ("release", "good"), [("5.13.19", False), ("5.14.0-1", True), ("6.1.2", True), ("4.19", False)]
)
def test_the_oldest_kernel_is_5_14(release, good, monkeypatch):
    monkeypatch.setattr(selftest.platform, "release", lambda: release)
    layer = selftest._system_layer()
    assert layer.good == good and release in layer.state and bool(layer.remedy) != good


@pytest.mark.parametrize(
    ("version", "good"), [("0.7.9", False), ("0.8.0", True), ("0.11.0", True), ("1.0", True), ("unknown", False)]
)
def test_the_oldest_bubblewrap_is_0_8(version, good, monkeypatch):
    reported = SimpleNamespace(stdout=f"bubblewrap {version}\n")
    monkeypatch.setattr(selftest.shutil, "which", lambda name: "/usr/bin/bwrap")
    monkeypatch.setattr(selftest.subprocess, "run", lambda *given, **more: reported)
    layer = selftest._bubblewrap_layer()
    assert (layer.good, layer.state) == (good, f"bubblewrap {version} (/usr/bin/bwrap)")
    assert layer.remedy == ("" if good else bubblewrap.INSTALL)


@pytest.mark.isolation
@pytest.mark.skipif(os.geteuid() != 0, reason="only root becomes another user")
def test_a_missing_setpriv_is_a_missing_layer_and_its_remedy_is_named(monkeypatch):
    monkeypatch.setattr(bubblewrap, "setpriv_prefix", lambda user: ["/nowhere/setpriv"])
    (missing,) = [layer for layer in selftest.layers() if layer.needed and not layer.good]
    assert missing.name == "user" and "util-linux" in missing.remedy


GOOD = Layer("network", True, "interfaces: lo")
LACKING = Layer("limits", False, "not so: memory", "Report it.")
OPTIONAL = Layer("system calls", False, "not filtered", "Use another machine.", needed=False)
HELD = Attempt("files: make a file", True, "read-only")
BROKE_OUT = Attempt("memory: take too much", False, "it was heard")
MAY_BREAK = Attempt("system calls: read inherited keys", False, "it succeeded", needed=False)


@pytest.mark.parametrize(
    ("found", "attempts", "good"),
    [
        ((GOOD, OPTIONAL), (HELD, MAY_BREAK), True),
        ((LACKING, GOOD), (HELD,), False),
        ((GOOD,), (HELD, BROKE_OUT), False),
    ],
)
def test_what_is_shown_of_all_is_what_was_found(found, attempts, good, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "200")
    examined = IsolationState(found, attempts)
    assert examined.good == good and examined.as_data()["good"] == good
    isolation_report.print_state(examined)
    shown = capsys.readouterr().out
    assert ("can be run in isolation here." in shown) == good
    assert ("cannot be run in isolation here: nothing is graded." in shown) != good
    listed = [(layer.name, layer.good, layer.needed) for layer in found]
    listed += [(attempt.name, attempt.contained, attempt.needed) for attempt in attempts]
    for name, holds, needed in listed:
        (line,) = [line for line in shown.splitlines() if f"│ {name} " in line]
        assert [word in line for word in ("good", " NO ", "optional")].index(True) == (0 if holds else 2 - needed)
    for layer in found:
        assert (f"{layer.name}: {layer.remedy}" in shown) == (not layer.good)


@pytest.mark.parametrize(
    ("found", "attempts", "lacking"),
    [
        ((GOOD, OPTIONAL), (HELD, MAY_BREAK), None),
        ((GOOD, LACKING, OPTIONAL), (), LACKING.name),
        ((GOOD,), (HELD, BROKE_OUT), BROKE_OUT.name),
    ],
)
def test_grading_begins_where_all_holds_that_is_needed_and_not_otherwise(found, attempts, lacking, monkeypatch):
    monkeypatch.setattr(isolation_report, "examine", lambda: IsolationState(found, attempts))
    if lacking is None:
        isolation_report.check()
        return
    with pytest.raises(IsolationError, match=f"{lacking}: ") as caught:
        isolation_report.check()
    assert caught.value.layer == lacking


@pytest.mark.parametrize(("found", "tried"), [((GOOD,), 1), ((GOOD, OPTIONAL), 1), ((GOOD, LACKING), 0)])
def test_breaking_out_is_tried_where_every_needed_layer_is_there(found, tried, monkeypatch):
    calls = []
    monkeypatch.setattr(selftest, "layers", lambda: list(found))
    monkeypatch.setattr(selftest, "attempts", lambda: calls.append(1) or [HELD])
    examined = isolation_report.examine()
    assert len(calls) == tried and examined == IsolationState(found, (HELD,) * tried)


@pytest.mark.parametrize("filtering", [True, False])
def test_what_only_a_filter_holds_is_needed_where_there_is_one(filtering, monkeypatch):
    results = json.dumps({name: (True, "refused") for name in attacks.ATTACKS}).encode()
    outcome = Outcome(Ending.FINISHED, 0, {"attempts.json": results}, {}, b"", 1.0)
    monkeypatch.setattr(sandbox, "run", lambda command, **more: outcome)
    monkeypatch.setattr(bubblewrap, "visible_paths", lambda visible: [])
    monkeypatch.setattr(seccomp, "program", lambda machine: b"..." if filtering else None)
    needed = {attempt.name: attempt.needed for attempt in selftest._attempts_inside()}
    assert needed == {name: filtering or name != attacks.READ_KEYS for name in attacks.ATTACKS}


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
@pytest.mark.parametrize(
    ("ending", "file", "none_left", "in_time"),
    [
        (Ending.DEADLINE, b"started\n", True, True),
        (Ending.FINISHED, b"started\n", True, False),
        (Ending.DEADLINE, b"", False, True),
    ],
)
def test_what_was_left_behind_is_judged_by_its_ending_and_its_file(ending, file, none_left, in_time, monkeypatch):
    outcome = Outcome(ending, None, {"started": file}, {}, b"", 1.0)
    monkeypatch.setattr(sandbox, "run", lambda command, **more: outcome)
    outliving, time = selftest._attempts_to_outlive()
    assert (outliving.contained, time.contained) == (none_left, in_time)
    assert outliving.result.startswith("0 processes left" if none_left else "no process was started")
    assert time.result == f"{ending.value}, after 1.0 s"


def test_a_self_test_that_did_not_come_to_its_end_is_no_good_one(monkeypatch):
    outcome = Outcome(Ending.DEADLINE, None, {"attempts.json": b"{}"}, {}, b"stuck", 1.0)
    monkeypatch.setattr(sandbox, "run", lambda command, **more: outcome)
    monkeypatch.setattr(bubblewrap, "visible_paths", lambda visible: [])
    with pytest.raises(IsolationError, match="end: stuck"):
        selftest._attempts_inside()
    monkeypatch.setattr(sandbox, "run", lambda command, **more: replace(outcome, files={}, output=b""))
    with pytest.raises(IsolationError, match=f"end: {Ending.DEADLINE.value}"):
        selftest._attempts_inside()

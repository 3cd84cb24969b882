"""Small faults put into the code one at a time: which do the tests notice?

    python benchmarks/faults.py [--faults 150] [--seed 1] [--place marking --place key] [--processes 2]
    python benchmarks/faults.py --picked FAULTS.json      faults that a person picked, instead
    python benchmarks/faults.py --again REPORT.json       those that went unnoticed the last time

For this coverage.py is needed: `pip install coverage`. All happens in copies of the project, and nothing in it is
touched. First the tests are run once, to see which execute which line; that takes a quarter of an hour, and is kept in
the folder `--map` for the next time (delete it when tests or code have changed much). Then, for each fault, the tests
that execute its line are run, the quickest first, until one fails; if none does, those of the folder that mirrors the
file's own, but for those that take the longest. A test that does not end in time has noticed, too. `--report` names
the file with all that came out; where it is there already, what is in it is not tried again.

Faults are drawn from all that the operators of ``fault_operators.py`` make of the chosen places: for each fault in
turn the next place, then an operator, then one of its faults there, each as likely as the others. A file of picked
faults is a list of {"file": ..., "old": ..., "new": ..., "why": ...}; `old` has to be there once.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from itertools import cycle
from pathlib import Path
from queue import SimpleQueue

import fault_tests
from fault_operators import OPERATORS, Fault, faults
from fault_tests import HERE, ROOT, TestMap, mirrored

#: What is drawn from: files, and folders with all that is in them.
PLACES = {
    "marking": ("rotflex/instructor/marking", "rotflex/instructor/verdicts.py"),
    "batch": (
        "rotflex/instructor/batch.py",
        "rotflex/instructor/graded_run.py",
        "rotflex/instructor/stages.py",
        "rotflex/instructor/regrade.py",
        "rotflex/instructor/running/bundle.py",
        "rotflex/instructor/running/bundles.py",
        "rotflex/instructor/running/prepared.py",
        "rotflex/instructor/running/runner.py",
        "rotflex/instructor/running/supplied.py",
    ),
    "intake": ("rotflex/instructor/running/intake",),
    "reports": ("rotflex/instructor/reports",),
    "key": ("solutions",),
    "gradebook": ("rotflex/instructor/gradebook",),
    "bench": ("rotflex/hil", "rotflex/plant.py"),
    "limits": ("rotflex/instructor/isolation", "rotflex/courseware"),
}
_PASSED_OVER = (
    "rotflex/instructor/gradebook/migrations",
    "rotflex/instructor/isolation/attacks.py",
    "rotflex/courseware/scene",
    "solutions/conftest.py",
)
_NOT_COPIED = (".git", ".venv", "work", ".mypy_cache", ".ruff_cache", ".pytest_cache", "__pycache__")
_PYTEST = ["-m", "pytest", "-p", "fault_plugin", "-p", "no:cacheprovider", "-p", "no:xdist", "-q", "--tb=line"]
_PYTEST += ["-o", "addopts=--strict-markers --import-mode=importlib"]
_SLOW = 150.0  #: s, of all tests together that are run for a fault because they execute its line, or as they mirror it
_PATIENCE, _AT_LEAST = 5.0, 120.0  #: how many times longer than without a fault tests may take, and s
_FAILED, _NONE_COLLECTED = 1, 5


@dataclass(frozen=True)
class Outcome:
    """What became of a fault.

    Attributes
    ----------
    fault : as it was put in
    noticed : whether a test failed or did not end
    by : what noticed, or what was run in vain
    seconds : it took
    why : what a person said of it
    """

    fault: Fault
    noticed: bool
    by: str
    seconds: float
    why: str = ""

    def __str__(self) -> str:
        fault = self.fault
        before, after = (" ".join(text.split()) for text in (fault.old, fault.new))
        verdict = "noticed " if self.noticed else "UNNOTICED"
        return f"{verdict} {fault.file}:{fault.line} {fault.operator}: {before[:90]} → {after[:90]}   [{self.by}]"


# --- which faults -----------------------------------------------------------------------------------------------------


def drawn(number: int, seed: int, places: Sequence[str]) -> list[Fault]:
    """Faults drawn from some places; the same for the same seed and code."""
    rng = random.Random(seed)
    left: dict[str, dict[str, list[Fault]]] = {place: {operator: [] for operator in OPERATORS} for place in places}
    for place in places:
        for file in _files(place):
            for one in faults((ROOT / file).read_text(encoding="utf-8"), file):
                left[place][one.operator].append(one)
    chosen: list[Fault] = []
    for place in cycle(places):
        operators = [name for name, some in left[place].items() if some]
        if len(chosen) >= number or not any(some for of in left.values() for some in of.values()):
            return chosen
        if operators:
            some = left[place][rng.choice(operators)]
            chosen.append(some.pop(rng.randrange(len(some))))
    return chosen


def _files(place: str) -> Iterator[str]:
    for name in PLACES[place]:
        paths = [ROOT / name] if name.endswith(".py") else sorted((ROOT / name).rglob("*.py"))
        for path in paths:
            file = path.relative_to(ROOT).as_posix()
            if not file.startswith(_PASSED_OVER):
                yield file


def picked(path: Path) -> list[tuple[Fault, str]]:
    """Faults that a person picked, with what they said of them."""
    found = []
    for one in json.loads(path.read_text(encoding="utf-8")):
        source = (ROOT / one["file"]).read_text(encoding="utf-8")
        if source.count(one["old"]) != 1:
            sys.exit(f"{one['file']} has this {source.count(one['old'])} times, not once: {one['old']}")
        start = source.index(one["old"])
        line = source.count("\n", 0, start) + 1
        last = line + one["old"].count("\n")
        found.append((Fault(one["file"], line, last, "picked", one["old"], one["new"], start), one.get("why", "")))
    return found


def unnoticed(path: Path) -> list[tuple[Fault, str]]:
    """Those that a report calls unnoticed, where the code is now."""
    found = []
    for one in reported(path):
        if not one.noticed:
            before = one.fault
            now = faults((ROOT / before.file).read_text(encoding="utf-8"), before.file)
            same = [new for new in now if (new.operator, new.old, new.new) == (before.operator, before.old, before.new)]
            found += [(new, one.why) for new in sorted(same, key=lambda new: abs(new.line - before.line))[:1]]
    return found


def reported(path: Path) -> list[Outcome]:
    """What came out until now."""
    found = json.loads(path.read_text(encoding="utf-8"))
    return [Outcome(Fault(**one.pop("fault")), **one) for one in found]


# --- what the tests say -----------------------------------------------------------------------------------------------


def environment(tree: Path) -> dict[str, str]:
    """Of tests in a copy: its own code, and one thread."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    paths = {"PYTHONPATH": os.pathsep.join([str(tree), str(HERE)]), "ROTFLEX_PROGRESS": "off"}
    recordings = ROOT.parent / "shared" / "reference" / "recordings"
    return {"ROTFLEX_RECORDINGS": str(recordings)} | dict(os.environ) | threads | paths


def copied(scratch: Path, name: str) -> Path:
    """A copy of the project."""
    tree = scratch / name / ROOT.name
    shutil.copytree(ROOT, tree, symlinks=True, ignore=shutil.ignore_patterns(*_NOT_COPIED))
    return tree


def run(tree: Path, arguments: Sequence[str], more: dict[str, str], seconds: float) -> tuple[bool, str]:
    """Whether tests fail or do not end in time, and which one."""
    command = [sys.executable, *_PYTEST, *fault_tests.IGNORED, "-x", *arguments]
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as said:
        child = subprocess.Popen(
            command, cwd=tree, env=environment(tree) | more, stdout=said, stderr=said, start_new_session=True
        )
        code = None
        for _second in range(round(seconds)):  # one by one: time in which all of this was paused does not count
            with contextlib.suppress(subprocess.TimeoutExpired):
                code = child.wait(1)
                break
        if code is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            return True, "it did not end in time"
        said.seek(0)
        lines = said.read().splitlines()
    if code == _NONE_COLLECTED:
        return False, "no test"
    failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    return code != 0, (failed or lines[-1:] or [""])[0][:200]


def tried(fault: Fault, why: str, tree: Path, known: TestMap, scratch: Path) -> Outcome:
    """Put a fault in, run what concerns it, and take it out."""
    begun = time.monotonic()
    path = tree / fault.file
    source = path.read_text(encoding="utf-8")
    compile(changed := fault.put_into(source), fault.file, "exec")
    executing = known.quickest_first(known.executing(fault.file, fault.line, fault.last, tree))
    while sum(known.seconds[one] for one in executing) > _SLOW:
        executing.pop()
    try:
        _write(path, changed)
        noticed, by = False, "no test executes it"
        if executing:
            chosen = scratch / f"{tree.parent.name}.json"
            chosen.write_text(json.dumps(executing), encoding="utf-8")
            files = list(dict.fromkeys(one.partition("::")[0] for one in executing))
            seconds = _PATIENCE * sum(known.seconds[one] for one in executing) + _AT_LEAST
            noticed, by = run(tree, files, {"FAULTS_CHOSEN": str(chosen)}, seconds)
        if not noticed and (folders := mirrored(fault.file, tree)):
            left_out = scratch / f"{tree.parent.name}-left-out.json"
            left_out.write_text(json.dumps(known.too_slow_or_failing(folders, executing, _SLOW)), encoding="utf-8")
            noticed, said = run(tree, folders, {"FAULTS_LEFT_OUT": str(left_out)}, _PATIENCE * _SLOW + _AT_LEAST)
            by = said if noticed else f"{len(executing)} tests that execute it, {' '.join(folders)}: {said}"
    finally:
        _write(path, source)
    return Outcome(fault, noticed, by, time.monotonic() - begun, why)


def _write(path: Path, source: str) -> None:
    """A source, and no compiled one of before."""
    path.write_text(source, encoding="utf-8")
    for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
        compiled.unlink()


def outcomes(wanted: Sequence[tuple[Fault, str]], folder: Path | None, processes: int) -> Iterator[Outcome]:
    """What becomes of each fault, as soon as it is known."""
    with tempfile.TemporaryDirectory(prefix="rotflex-faults-") as name:
        scratch = Path(name)
        folder = folder or scratch / "map"
        tree = copied(scratch, "0")
        if not (folder / "tree").exists():
            print("Which test executes what?", flush=True)
            fault_tests.measure(tree, folder, _PYTEST, environment(tree))
        known = fault_tests.read(folder)
        trees: SimpleQueue[Path] = SimpleQueue()
        for one in [tree, *(copied(scratch, str(n)) for n in range(1, processes))]:
            trees.put(one)

        def one_of(fault: Fault, why: str) -> Outcome:
            tree = trees.get()
            try:
                return tried(fault, why, tree, known, scratch)
            finally:
                trees.put(tree)

        with ThreadPoolExecutor(processes) as pool:
            for done in as_completed([pool.submit(one_of, *one) for one in wanted]):
                yield done.result()


def main() -> int:
    """Try faults, and print what became of each and how many were noticed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--place", action="append", choices=PLACES)
    parser.add_argument("--picked", type=Path)
    parser.add_argument("--again", type=Path)
    parser.add_argument("--map", type=Path)
    parser.add_argument("--report", type=Path)
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    if options.picked or options.again:
        wanted = picked(options.picked) if options.picked else unnoticed(options.again)
    else:
        wanted = [(one, "") for one in drawn(options.faults, options.seed, options.place or list(PLACES))]
    done = reported(options.report) if options.report and options.report.exists() else []
    tried_before = {one.fault for one in done}
    wanted = [one for one in wanted if one[0] not in tried_before]
    for one in outcomes(wanted, options.map and options.map.resolve(), options.processes):
        done.append(one)
        print(one, flush=True)
        if options.report:
            options.report.write_text(json.dumps([asdict(each) for each in done], indent=1), encoding="utf-8")
    seen, all_of = (
        Counter(one.fault.operator for one in done if one.noticed),
        Counter(one.fault.operator for one in done),
    )
    print(*(f"{operator}: {seen[operator]} of {number}" for operator, number in sorted(all_of.items())), sep="\n")
    print(f"noticed: {seen.total()} of {all_of.total()} ({seen.total() / max(1, all_of.total()):.1%})")
    return 0


if __name__ == "__main__":
    sys.exit(main())

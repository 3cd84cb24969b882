"""The hostile class and what it is set loose upon: secrets, files, processes; graded by the command as an
instructor runs it.
"""

import contextlib
import csv
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import hostile
import matplotlib
from checkout import ROOT
from hostile import HONEST, QUESTIONS, Attack
from hostile_answers import FORGED, TEXT
from hostile_cells import CELLS
from hostile_code import CODE
from hostile_files import FORMS, NAMES, OWN_FILES, REFUSED, WORDS, remove
from hostile_reach import REACH

CLASS: dict[str, Attack] = {**CODE, **CELLS, **REACH, **FORGED, **TEXT, **FORMS, **OWN_FILES, **WORDS, **NAMES}
#: One or more attacks of each kind, for a landing; all others are made by `make test-all`.
OF_EACH_KIND: dict[str, Attack] = {
    name: CLASS[name]
    for name in (
        "lingers",  # it goes on afterwards. What else may happen to a run is tried in tests/grading/running.
        # it patches, lies, plants
        *("patches-lab", "patches-the-shell", "liars", "plants-modules"),
        # cells of its own before all others; reports of cells
        *("before-the-first-cell", "forged-reports", "reports-are-the-key"),
        # it reaches for secrets, memories and files outside
        *REACH,
        # answers written by hand: not a file, odd, of somebody else; markup
        *("a-link-to-the-key", "odd-parts", "somebody-else", "markup"),
        # what lies beside the notebooks: modules, paths that lead away
        *("own-modules", "own-files-lead-away"),
        # words; names
        *("words-of-scripts", "&lt;img src=x onerror=alert(1)&gt;", "=1+1", "-rf"),
    )
}
PROBE_SEED = 20_240_229
CELL_TIMEOUT, DEADLINE = 4, 30  # s


@dataclass
class Graded:
    """A class that was graded, and what was found around it before and afterwards."""

    attacks: Mapping[str, Attack]
    source: Path
    out: Path
    alone: Path
    done: subprocess.CompletedProcess
    canaries: dict[str, str]
    outside: dict
    before: dict = field(default_factory=dict)
    after: dict = field(default_factory=dict)
    strays: list[str] = field(default_factory=list)

    def marks(self, student: str, out: Path | None = None) -> dict:
        return json.loads(((out or self.out) / student / "marks.json").read_text(encoding="utf-8"))

    def report(self, student: str) -> dict:
        """What the student's code found."""
        marks = {(mark["question"], mark["part"]): mark for mark in self.marks(student)["marks"]}
        return json.loads(marks["2.11", "explanation"]["given"] or "{}")

    def files(self) -> list[Path]:
        return [path for path in self.out.rglob("*") if path.is_file() and path.suffix in (".json", ".html", ".csv")]

    def undeserved(self, student: str) -> float:
        """Points that nobody deserves who did what this student did."""
        earned = by_question(self.marks(student))
        return sum(max(0.0, earned[number] - self.attacks[student].earns.get(number, 0)) for number in earned)


def by_question(marks: dict) -> dict[str, float]:
    earned = dict.fromkeys(QUESTIONS, 0.0)
    for mark in marks["marks"]:
        earned[mark["question"]] += mark["points"]
    return earned


@contextlib.contextmanager
def graded(attacks: Mapping[str, Attack]) -> Iterator[Graded]:
    """Grade a class by the command as an instructor runs it, after its two honest members were graded alone."""
    # Neither where temporary files are, nor below: there, a sandbox has something of its own.
    folder = Path(tempfile.mkdtemp(prefix="rotflex-hostile-", dir="/var/tmp"))
    token = f"token{os.urandom(8).hex()}"
    witness = subprocess.Popen([sys.executable, "-S", "-c", "import time; time.sleep(3000)", f"witness-{token}"])
    open_to_all = folder / "open"
    open_to_all.mkdir()
    try:
        folder.chmod(0o755)
        yield grade(attacks, folder, open_to_all, token, witness.pid)
    finally:
        witness.kill()
        witness.wait()
        remove(folder)


def grade(attacks: Mapping[str, Attack], folder: Path, open_to_all: Path, token: str, witness: int) -> Graded:
    """Grade two honest students alone, and then together with attackers; what was outside before, and afterwards."""
    names = ("key", "neighbour", "home", "gradebook", "environment", "marks")
    canaries = {name: hostile.new_canary() for name in names}
    source = hostile.course(folder / "course", canaries["key"])
    home, out, submissions = folder / "home", folder / "marks", folder / "submissions"
    for place in (home, out, submissions):
        place.mkdir()
    (home / ".netrc").write_text(canaries["home"])
    (out / "earlier.json").write_text(json.dumps(canaries["marks"]))
    marker = open_to_all / "marker"
    marker.write_text(token)
    for place in (open_to_all, marker):
        place.chmod(0o777)
    for student in HONEST:
        work = hostile.filled_in(source, hostile.honest(student, canaries["neighbour"]))
        hostile.save(folder / "alone" / student, {name: json.dumps(notebook) for name, notebook in work.items()})
    shutil.copytree(folder / "alone", submissions, dirs_exist_ok=True)
    environment = {**os.environ, "HOME": str(home), "MPLCONFIGDIR": matplotlib.get_cachedir()}
    environment["LABCOURSE_SECRET"] = canaries["environment"]
    outside = {
        "marker": str(marker),
        "namespaces": hostile.namespaces(),
        "witness": f"witness-{token}",
        "token": token,
        "neighbour": HONEST[0],
        "secrets": [
            str(source / "key.py"),
            str(source / hostile.STIFFNESS),
            str(out / "gradebook.sqlite"),
            str(out / "earlier.json"),
            str(submissions / HONEST[0] / hostile.STIFFNESS),
            str(home / ".netrc"),
            "/etc/shadow",
        ],
        "targets": [str(path) for path in (open_to_all, marker, out, submissions, source, home)],
        "processes": [witness, os.getpid(), os.getppid()],
        "variables": ["LABCOURSE_SECRET"],
    }
    for student, attack in attacks.items():
        hand_in(submissions, source, student, attack, outside)
    for name in REFUSED:
        with contextlib.suppress(OSError):
            (submissions / name).mkdir()
    with (folder / "roster.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["id", "name", "user ID"])  # the last is kept, and stands in no report
        table.writerow([HONEST[0], "Ada", canaries["gradebook"]])
        table.writerows([student, "", ""] for student in (*HONEST[1:], *attacks))
    for book in (out, folder / "marks-alone"):
        command = ["roster", book / "gradebook.sqlite", folder / "roster.csv"]
        book.mkdir(exist_ok=True)
        _rotflex(command, environment).check_returncode()
    watched = (source, submissions, open_to_all, home)
    _grade_folder(folder / "alone", folder / "marks-alone", source, environment)
    before = hostile.state(watched)
    done = _grade_folder(submissions, out, source, environment)
    result = Graded(attacks, source, out, folder / "marks-alone", done, canaries, outside)
    result.before, result.after = before, hostile.state(watched)
    system = (
        "/",
        "/etc",
        "/var",
        "/usr/lib",
        "/tmp",
        "/var/tmp",
        "/dev/shm",
        sys.prefix,
        sysconfig.get_path("purelib"),
    )
    places = [folder, out, Path.home(), *map(Path, system), ROOT / "rotflex"]
    result.strays = [str(path) for place in places for path in place.glob(f"*{token}*")]
    return result


def hand_in(submissions: Path, source: Path, student: str, attack: Attack, outside: dict) -> None:
    """What a student hands in, as a folder or a zip among the submissions."""
    work = hostile.filled_in(source, hostile.written(student, attack, outside))
    hostile.add_cells(work, attack.adds, outside)
    attack.spoil(work)
    files = {name: json.dumps(notebook) for name, notebook in work.items()}
    path = submissions / (f"{student}.zip" if attack.zipped else student)
    if attack.zipped:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
            for name, text in files.items():
                packed.writestr(name, text)
    else:
        hostile.save(path, files)
    attack.lay(path, outside)


def _grade_folder(submissions: Path, out: Path, source: Path, environment: dict) -> subprocess.CompletedProcess:
    command = ["grade", out, submissions, "--solutions", source, "--jobs", "2"]
    command += ["--cell-timeout", str(CELL_TIMEOUT), "--deadline", str(DEADLINE), "--probe-seed", str(PROBE_SEED)]
    return _rotflex(command, environment)


def _rotflex(command: list, environment: dict) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "rotflex.cli", *command],
        env=environment,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=1500,
    )

"""Compare the marks of all hand-ins that the tests make between a commit and this checkout.

    python tools/compare_marks.py COMMIT FOLDER

A worktree of the commit builds the hand-ins in FOLDER, and marks them; then this checkout marks the same hand-ins. Each
mark, problem or note that differs is printed, and the number of hand-ins; the exit code is 1 if there are differences.
Hand-ins are those of the honest class, the hostile class, single slips, other right ways, and a term's six days; the
term is lived by each program itself. It takes about an hour. FOLDER must not be below the system's temporary folder,
which a sandbox does not see; what is there already is used again.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import unicodedata
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
CLASSES = ("honest", "hostile")
STUDENTS = ("ada", "bob", "carla")


def build(folder: Path) -> None:
    """Make all hand-ins below a folder, with the tests' helpers of the checkout that is imported."""
    from remembered import remembered

    for name, make in (("honest", _build_honest), ("hostile", _build_hostile), ("answers", _build_answers)):
        if not (folder / name).exists():
            with remembered():
                make(folder / name)


def _build_honest(folder: Path) -> None:
    import honest_class
    from checkout import ROOT as CHECKOUT
    from honest_marks import build as build_class

    pandas = importlib.util.find_spec("pandas") is not None  # some ways of earlier commits need it, or its absence
    ways = [way for way in honest_class.WAYS if getattr(way, "pandas", None) in (None, pandas)]
    build_class(ways, honest_class.solved_notebooks(CHECKOUT), folder / "in")


def _build_hostile(folder: Path) -> None:
    import hostile_outside

    (open_to_all := folder / "open").mkdir(parents=True)
    # Earlier commits give their attackers something to reach for over the network.
    listeners = [made(open_to_all, "token")] if (made := getattr(hostile_outside, "Listeners", None)) else []
    hostile_outside.grade(hostile_outside.CLASS, folder, open_to_all, "token", os.getpid(), *listeners)
    for one in listeners:
        one.close()
    (folder / "submissions").rename(folder / "in")


def _build_answers(folder: Path) -> None:
    from right_ways import WAYS, rewritten, worked
    from single_slip_marks import answers_with
    from single_slips import SLIPS, STUDENT

    folder.mkdir(parents=True)
    names: list[tuple[str, str]] = []

    def keep(name: str, student: str, data: bytes) -> None:
        (folder / f"{len(names)}.json").write_bytes(data)
        names.append((name, student))

    for slip in (None, *SLIPS):
        keep(f"slip: {slip.name if slip else 'none'}", STUDENT, answers_with(slip))
    with tempfile.TemporaryDirectory() as temporary:
        usual = {one: worked(one, _new(Path(temporary))) for one in STUDENTS}
        for number, way in enumerate(WAYS):
            student = STUDENTS[number % len(STUDENTS)]
            own, data = usual[student]
            place = _new(Path(temporary))
            changed = rewritten(student, place, way.written, own, data)[0] if way.written else None
            keep(f"right: {way}", student, changed or worked(student, place, way)[1])
    (folder / "names.json").write_text(json.dumps(names), encoding="utf-8")


def _new(folder: Path) -> Path:
    return Path(tempfile.mkdtemp(dir=folder))


def mark(folder: Path, out: Path) -> None:
    """Mark all hand-ins below a folder with the program that is imported, and write what each was given.

    What is there already is not marked again: each group is written as soon as it is done.
    """
    found = json.loads(out.read_text(encoding="utf-8")) if out.exists() else {}
    groups: dict[str, Callable[[], dict[str, Any]]] = {
        "term": _marks_of_term,
        **{name: partial(_marks_of_class, name, folder / name) for name in CLASSES},
        "answers": partial(_marks_of_answers, folder / "answers"),
    }
    for name, marks in groups.items():
        if name not in found:
            found[name] = marks()
            out.write_text(json.dumps(found, indent=1, ensure_ascii=False), encoding="utf-8")


def _marks_of_class(name: str, folder: Path) -> dict[str, Any]:
    from made_courses import OURS

    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        source, out = OURS.folder, Path(temporary, "out")
        if name == "hostile":
            import hostile

            source = hostile.course(Path(temporary, "course"), hostile.new_canary())
        book, options = out / "gradebook.sqlite", ["--jobs", "2", "--cell-timeout", "45"]
        if name == "hostile":
            options = ["--jobs", "2", "--cell-timeout", "4", "--deadline", "30", "--probe-seed", "1"]
        out.mkdir()
        _rotflex("roster", book, folder / "roster.csv")
        _rotflex("grade", book, folder / "in", "--out", out, "--solutions", source, *options)
        return dict(map(_as_data, sorted(out.glob("*/marks.json"))))


def _as_data(path: Path) -> tuple[str, dict[str, Any]]:
    content = json.loads(path.read_text(encoding="utf-8"))
    return unicodedata.normalize("NFC", content["student"]), _shape(content)


def _shape(content: dict[str, Any]) -> dict[str, Any]:
    marks = {
        f"{one['question']} {one['part']}": [one["points"], one["out_of"], one["status"], one["reason"]]
        for one in content["marks"]
    }
    return {**marks, "problems": content["problems"], "notes": content["notes"]}


def _rotflex(*words: object) -> None:
    command = [sys.executable, "-m", "rotflex.cli", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")


def _marks_of_answers(folder: Path) -> dict[str, Any]:
    from made_courses import OURS

    from labcourse.grading.marking.decoding import decode
    from rotflex.hil.student_benches import student_seed
    from solutions.true_bench import TrueBench

    names = json.loads((folder / "names.json").read_text(encoding="utf-8"))
    benches = {student: TrueBench(student) for student in {student for _name, student in names}}
    found = {}
    for number, (name, student) in enumerate(names):
        seed = student_seed(student)
        claims = decode((folder / f"{number}.json").read_bytes(), seed, OURS.catalogue)
        found[name] = {
            f"{one.question} {one.part}": [one.points, one.out_of, one.status.value, _in_words(one.reason)]
            for one in _marked(OURS, claims, benches[student], seed)
        }
    return found


def _marked(course: Any, claims: Any, bench: Any, seed: int) -> Any:
    """Mark claims by a course's key, also with commits from before a submission was one object."""
    from labcourse.grading.marking.marking import mark

    try:
        from labcourse.grading.submission import Submission
    except ImportError:
        return mark(course, claims, bench, seed)
    return mark(course, claims, bench, Submission(student="", probe_seed=seed))


def _in_words(reason: Any) -> str:
    """Return the reason of a mark as a text, which it is in commits before problems were data."""
    if isinstance(reason, str):
        return reason
    from labcourse.sentences import sentence

    return sentence(reason)


def _marks_of_term() -> dict[str, Any]:
    import pytest
    from term_class import TermClass
    from term_table import CLASS, TERM

    found = {}
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        term = TermClass(Path(folder), patch)
        for number, day in enumerate(TERM, 1):
            term.live(day)
            for student in CLASS:
                if data := term.data(student):
                    found[f"day {number}, {student}"] = _shape(data)
    return found


def differences(before: dict[str, Any], after: dict[str, Any]) -> Iterator[str]:
    """Yield a line for each mark, problem or note that is not in both."""
    for group in before.keys() | after.keys():
        old, new = before.get(group, {}), after.get(group, {})
        for student in sorted(old.keys() | new.keys()):
            mine, theirs = old.get(student, {}), new.get(student, {})
            for what in sorted(mine.keys() | theirs.keys()):
                if mine.get(what) != theirs.get(what):
                    yield f"{group}, {student}, {what}:\n  before {mine.get(what)}\n  after  {theirs.get(what)}"


def _in(tree: Path, *words: object) -> None:
    """Run this file with the packages, solutions and tests of a checkout."""
    places = [tree / "tests" / "helpers", tree]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, places)), "TQDM_DISABLE": "1"}
    environment |= {"LABCOURSE_PROGRAM": "rotflex", "LABCOURSE_COURSE": "rotflex.course"}
    subprocess.run([sys.executable, __file__, *map(str, words)], cwd=tree, env=environment, check=True)


def main(words: list[str]) -> int:
    """Do one of the steps, or all of them."""
    if words[0] == "--build":
        build(Path(words[1]))
        return 0
    if words[0] == "--mark":
        mark(Path(words[1]), Path(words[2]))
        return 0
    commit, folder = words[0], Path(words[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    before, after = folder / "before.json", folder / "after.json"
    groups = json.loads(before.read_text(encoding="utf-8")) if before.exists() else {}
    if not {"term", *CLASSES, "answers"} <= groups.keys():
        with _worktree(commit) as tree:
            _in(tree, "--build", folder)
            _in(tree, "--mark", folder, before)
    _in(ROOT, "--mark", folder, after)
    found = [json.loads(path.read_text(encoding="utf-8")) for path in (before, after)]
    lines = list(differences(*found))
    print(*lines, sep="\n")
    counts = ", ".join(f"{group} {len(students)}" for group, students in found[0].items())
    print(f"Hand-ins: {counts}. Differences: {len(lines)}.")
    return 1 if lines else 0


@contextlib.contextmanager
def _worktree(commit: str) -> Iterator[Path]:
    """Check a commit out beside this checkout until the block ends."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder, "tree")
        subprocess.run(["git", "worktree", "add", "--quiet", "--detach", tree, commit], cwd=ROOT, check=True)
        try:
            yield tree
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

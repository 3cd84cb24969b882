"""The class of ``scored_class.py`` put into a gradebook: its course, files, recordings and the machine's marks."""

import json
from collections.abc import Iterator, Mapping
from datetime import timedelta
from hashlib import sha256
from pathlib import Path
from typing import Any

from checkout import ROOT
from gradebooks import record
from honest_hand_in import Notebook, solved_notebooks, written
from made_courses import OURS, copied
from scored_class import (
    ABSENT,
    BY_MACHINE,
    COPIES,
    COURSE_TOML,
    FOR_A_PERSON,
    MISSING,
    PARTS,
    Drawn,
    Student,
)

from labcourse.answers.forms import encode_recording
from labcourse.benches import BenchPolicy
from labcourse.grading.gradebook import Delivery, Gradebook, Graded, MarkRecord, RunRecord
from labcourse.grading.graded_run import Facts
from rotflex import experiments, hil
from rotflex.hil.student_benches import DRAW, student_seed


def course(folder: Path) -> Path:
    """This course's folder, with the settings of a term."""
    made = copied(folder, notebooks=[path.name for path in OURS.notebooks])
    for name in ("rubric.toml", "outcomes.toml", "sheets.toml"):
        (made / name).write_bytes((OURS.folder / name).read_bytes())
    (made / "course.toml").write_text(COURSE_TOML, encoding="utf-8")
    return made


def roster(drawn: Drawn) -> str:
    """A CSV; who is s04 here is known by another name to a platform."""
    lines = ["id,name,email,section,aliases"]
    for one in drawn.students.values():
        lines.append(f'{one.name},"Name of {one.name}",{one.name}@uni.example,{one.section},platform-{one.name[1:]}')
    return "\n".join([*lines, *(f"{name},Nobody {name},,A," for name in ABSENT)])


def fill(book: Gradebook, drawn: Drawn) -> None:
    """Put everybody's files, runs and machine's marks into a gradebook."""
    sweeps = _sweeps(drawn)
    notebooks = {name: _bare(content) for name, content in solved_notebooks(ROOT).items()}
    for one in drawn.students.values():
        for files in _versions(one, notebooks):
            book.deliver(one.name, files)
        record(book, _graded(one, sweeps[one.name]))


def _bare(notebook: Notebook) -> bytes:
    """Write a notebook without what its cells gave out."""
    content = json.loads(written(notebook))
    for cell in content["cells"]:
        if "outputs" in cell:
            cell["outputs"] = []
    return json.dumps(content).encode()


def _sweeps(drawn: Drawn) -> dict[str, dict[str, Any]]:
    """Everybody's recording for 2.9, on their own bench; or a class-mate's, in other units."""
    found = {}
    (part,) = (one for one in OURS.catalogue.find("2.9").parts if one.kind == "recording")
    for name in drawn.students:
        with hil.open("virtual", seed=student_seed(name), draw=DRAW) as bench:
            recording = experiments.sweep(bench, f_start=1.0, f_stop=5.0, duration=1.5, progress=False)
        found[name] = {"kind": "recording", **encode_recording(part, recording)[0]}
    for name, (mate, what) in COPIES.items():
        if what == "recording":
            theirs = json.loads(json.dumps(found[mate]))
            for channel in theirs["channels"].values():
                channel["values"] = [float(f"{57.3 * value:.4g}") for value in channel["values"]]
            found[name] = theirs
    return found


def _versions(one: Student, files: Mapping[str, bytes]) -> Iterator[list[Delivery]]:
    """What a student hands in: a version before the one that counts, that one, and by some the same once more."""
    first, counts, again = [], [], []
    for name, content in files.items():
        when = one.received.get(name.removesuffix(".ipynb"))
        if when is None:
            continue
        old = content + b"\n"
        first.append(Delivery(name, sha256(old).hexdigest(), old, when - timedelta(days=30), "a zip"))
        counts.append(Delivery(name, sha256(content).hexdigest(), content, when, "a zip"))
        again.append(Delivery(name, sha256(content).hexdigest(), content, when + timedelta(days=40), "a zip"))
    yield from (one_go for one_go in (first, counts, again if int(one.name[1:]) % 3 == 0 else []) if one_go)


def _graded(one: Student, sweep: Mapping[str, Any]) -> Graded:
    marks = []
    words: dict[str, dict[str, Any]] = {}
    for (number, name), part in PARTS.items():
        person = one.persons.get((number, name))
        if person is not None:
            status = FOR_A_PERSON if person.text else MISSING
            marks.append(MarkRecord(number, name, status, 0.0, part.points, "A person reads this.", person.text))
            if person.text and part.kind == "prose":
                words.setdefault(number, {})[name] = {"text": person.text, "pictures": {}}
        elif part.points:
            status = one.machine[number, name]
            points = BY_MACHINE.get(status, 0.0) * part.points
            marks.append(MarkRecord(number, name, status, points, part.points, f"So it is {status}.", "x = 1"))
    cells = Facts(bench_of=one.name, policy=BenchPolicy(draw=DRAW)).as_json()
    run = RunRecord(
        *(f"run of {one.name}", one.name, "newest", "m", "rotflex 0", 7, "Run in isolation."),
        answers=_answers(one, sweep),
        cells=cells,
        words=words,
    )
    return Graded(run, tuple(marks), "key 1")


def _answers(one: Student, sweep: Mapping[str, Any]) -> bytes:
    given: dict[str, dict[str, Any]] = {"2.9": {"sweep": sweep}}
    for (number, name), value in one.numbers.items():
        given.setdefault(number, {})[name] = {"kind": "number", "value": value}
    about = {"format": 2, "student": one.name, "bench": {}, "software": "rotflex 0", "probe_seed": 7}
    predictions = {number: {"said": said} for number, said in one.predictions.items()}
    return json.dumps({**about, "answers": given, "predictions": predictions}).encode()

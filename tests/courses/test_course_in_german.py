"""A course is handed out in German: translated, released, checked at home, handed in and marked.

The same answers in the English release, which was handed out before, get the same marks.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import polib
import pytest
from checkout import ROOT

NOTEBOOK = "01_spring.ipynb"
#: All right; a stiffness that is off, and what follows from it; nothing written. And their points, by hand (of 8, of
#: which 1 waits for a person).
STUDENTS = {"ada": 7, "bob": 5, "eve": 0}
#: Everybody's spring is the same, so that marks can be compared to the last word.
BENCH = '[bench]\nwhich = "same"\nseed = 7\n'
GERMAN = {
    "A mass on a spring": "Eine Masse an einer Feder",
    "A mass of half a kilogram hangs on a spring. It is pulled aside by 4 cm and let go.": (
        "Eine Masse von einem halben Kilogramm hängt an einer Feder. Sie wird um 4 cm ausgelenkt und losgelassen."
    ),
    "1.1 The motion after release": "1.1 Die Bewegung nach dem Loslassen",
    "Let the mass go with `lab.bench().release()`, and keep the recording as `run`.": (
        "Lass die Masse mit `lab.bench().release()` los und behalte die Aufzeichnung als `run`."
    ),
    "1.2 Stiffness": "1.2 Steifigkeit",
    "Find the period in your recording, and from it the stiffness `k` of your spring in N/m. The mass is `MASS`.": (
        "Finde die Periode in deiner Aufzeichnung und daraus die Steifigkeit `k` in N/m. Die Masse ist `MASS`."
    ),
    "1.3 Natural frequency": "1.3 Eigenfrequenz",
    "Give the natural frequency as an expression, `formula`, in the symbols `k` and `m`; and as a number, `omega` in "
    "rad/s,\nfor your own spring.": (
        "Gib die Eigenfrequenz als Ausdruck `formula` in den Symbolen `k` und `m` an und als Zahl, `omega` in rad/s."
    ),
    "1.4 What was left out": "1.4 Was weggelassen wurde",
    "Why would a real mass come to rest? Answer in a sentence or two, as the text `why`.": (
        "Warum käme eine echte Masse zur Ruhe? Antworte in einem Satz oder zweien, als Text `grund`."  # refused
    ),
}

REFUSED = "cell 'q1-4-text': “Why would a real mass come to rest? Ans…”: the code `why` is missing; the code `grund`"


def rotflex(*arguments: object, cwd: Path = ROOT, good: tuple[int, ...] = (0,), **settings: str) -> str:
    """What a command prints, on either channel."""
    left_out = ("ROTFLEX_COURSE", "ROTFLEX_LANGUAGE")
    environment = {name: value for name, value in os.environ.items() if name not in left_out}
    done = subprocess.run(
        [sys.executable, "-m", "rotflex.cli", *map(str, arguments)],
        cwd=cwd,
        env=environment | {"PYTHONPATH": str(ROOT)} | settings,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode in good, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder above the course's: an English release in ``en``, and then a German one in ``de``."""
    folder = tmp_path_factory.mktemp("german") / "spring"
    shutil.copytree(
        ROOT / "tests" / "courses" / "spring", folder, ignore=shutil.ignore_patterns("notebooks", "__pycache__")
    )
    solutions = folder / "solutions"
    (solutions / "course.toml").write_text(BENCH, encoding="utf-8")
    rotflex("release", folder / "en", "--course", solutions)
    (solutions / "course.toml").write_text(f'[course]\nlanguage = "de"\n{BENCH}', encoding="utf-8")
    assert "0 of 5 text cells are translated" in rotflex("translate", "de", "--course", solutions)
    path = solutions / "locale" / "de" / "notebooks" / "01_spring.po"
    entries = polib.pofile(str(path))
    assert {entry.msgid for entry in entries} == set(GERMAN)
    for entry in entries:
        entry.msgstr = GERMAN[entry.msgid]
    entries.save(str(path))
    (folder / "said").write_text(rotflex("release", folder / "de", "--course", solutions), encoding="utf-8")
    return folder


def cells(course: Path, language: str) -> dict[str, str]:
    """Id → source, of the notebook that was released in a language."""
    path = course / language / "spring-course" / "notebooks" / NOTEBOOK
    made = json.loads(path.read_text(encoding="utf-8"))
    return {cell["id"]: "".join(cell["source"]) for cell in made["cells"]}


def test_the_release_is_in_german_but_for_what_is_refused_and_that_is_told(course):
    english, german = cells(course, "en"), cells(course, "de")
    assert list(english) == list(german)
    assert german["title"].startswith("# Eine Masse an einer Feder\n\nEine Masse von einem halben")
    translated = {"title", "q1-1-text", "q1-2-text", "q1-3-text"}
    assert {name for name in english if english[name] != german[name]} == translated
    said = (course / "said").read_text(encoding="utf-8")
    assert "Language de: 4 of 5 text cells are translated; the others are as in the source." in said
    assert REFUSED in said


def test_what_is_refused_or_of_the_notebook_as_it_was_is_told(course, tmp_path):
    changed = Path(shutil.copytree(course, tmp_path / "changed")) / "solutions"
    path = changed / NOTEBOOK
    path.write_text(path.read_text(encoding="utf-8").replace("hangs on a spring", "hangs there"), encoding="utf-8")
    found = rotflex("check-course", "--no-run", "--course", changed, good=(1,)).splitlines()
    file = "locale/de/notebooks/01_spring.po"
    assert f"{file}: the notebook was changed since: say rotflex translate de." in found
    assert f"{file}: {REFUSED} is not in the source. The cell stays as it is." in found
    assert found[-1] == "2 found."


def written(course: Path, language: str, who: str) -> str:
    """A student's notebook, in a release's language."""
    path = course / language / "spring-course" / "notebooks" / NOTEBOOK
    made = json.loads(path.read_text(encoding="utf-8"))
    solved = json.loads((course / "solutions" / NOTEBOOK).read_text(encoding="utf-8"))["cells"]
    answers = {cell["id"]: "".join(cell["source"]) for cell in solved if "### BEGIN" in "".join(cell["source"])}
    for cell in made["cells"]:
        if who != "eve" and cell["id"] in answers:
            cell["source"] = answers[cell["id"]]
            if who == "bob":
                cell["source"] = cell["source"].replace("k = MASS", "k = 1.08 * MASS")
    return json.dumps(made)


@pytest.mark.usefixtures("sandbox")
def test_the_same_answers_get_the_same_marks_in_either_language(course, tmp_path):
    for language in ("de", "en"):
        for who in STUDENTS:
            folder = tmp_path / "work" / f"{who}-{language}"
            folder.mkdir(parents=True)
            (folder / NOTEBOOK).write_text(written(course, language, who), encoding="utf-8")
            about = course / language / "spring-course" / "notebooks" / "course.json"
            shutil.copyfile(about, folder / "course.json")
    out = tmp_path / "marks"
    rotflex("grade", tmp_path / "work", "--out", out, "--course", course / "solutions", "--jobs", 2)
    with (out / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = {row["student"]: row for row in csv.DictReader(file)}
    for who, total in STUDENTS.items():
        marked = [json.loads((out / f"{who}-{one}" / "marks.json").read_text("utf-8"))["marks"] for one in ("de", "en")]
        assert len(marked[0]) == 5 and marked[0] == marked[1]
        assert float(rows[f"{who}-de"]["total"]) == float(rows[f"{who}-en"]["total"]) == total
        assert '<html lang="de">' in (out / f"{who}-de" / "feedback.html").read_text(encoding="utf-8")
        # Each was recognised as what it is, and nothing of the course's taken for changed.
        assert "changed" not in rows[f"{who}-de"]["notes"] + rows[f"{who}-en"]["notes"]
        assert "earlier release" not in rows[f"{who}-de"]["notes"]
        assert "earlier release" in rows[f"{who}-en"]["notes"]


def test_a_students_check_runs_the_german_notebook(course, tmp_path):
    released = Path(shutil.copytree(course / "de" / "spring-course", tmp_path / "course"))
    own = Path(shutil.copytree(released / "notebooks", tmp_path / "own"))
    (own / NOTEBOOK).write_text(written(course, "de", "ada"), encoding="utf-8")
    said = rotflex("check", cwd=own, PYTHONPATH=str(released))
    assert "01_spring  vollständig" in said and "geändert" not in said

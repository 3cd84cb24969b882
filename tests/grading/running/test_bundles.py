"""Work is run and marked under the release that it was begun with, though the course has changed since.

The course is the mass on a spring. Its second release has a question more, other words and packages, and one spring for
everybody.
"""

import io
import json
import os
import shutil
import subprocess
import sys
import zipfile
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from checkout import ROOT

from labcourse.answers.notebooks import Notebook
from labcourse.benches import BenchPolicy
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE
from labcourse.grading import course as courses
from labcourse.grading.marking import decoding, marking
from labcourse.grading.release import releases
from labcourse.grading.running import bundle, runner
from labcourse.grading.running.bundle import Bundles
from labcourse.grading.running.prepared import prepare
from labcourse.grading.running.runner import Job
from labcourse.grading.submission import Submission
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence

pytestmark = pytest.mark.slow

NOTEBOOK = "01_spring.ipynb"
SEED = 7  #: of everybody's spring, in the second release
FIRST, SECOND = "2026 spring", "2026 autumn"
_OTHER_TITLE = "Half a kilogram hangs on a spring."
_FIFTH = """
        Question("1.5", "1", "01_spring", "Period", ("measures",), (
            number("period", "s", (0.01, 10.0), "measures", "The period of your spring."),
        )),
    ],
"""


@dataclass(frozen=True)
class TwoReleases:
    """The course's folder, as it is after the second release, and the two folders that students have."""

    course: Path
    first: Path
    second: Path

    def about(self, which: Path) -> dict[str, Any]:
        return json.loads((which / "notebooks" / "course.json").read_text(encoding="utf-8"))

    def notebook(self, which: Path) -> dict[str, Any]:
        return json.loads((which / "notebooks" / NOTEBOOK).read_text(encoding="utf-8"))

    def hand_in(self, which: Path, answers: dict[str, str], **course: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """A release's notebook with answers (by cell), and what ``course.json`` says."""
        notebook = self.notebook(which)
        for cell in notebook["cells"]:
            cell["source"] = answers.get(cell["id"], cell["source"])
        return {NOTEBOOK: Notebook.read(json.dumps(notebook).encode()).cells}, course


def release(course: Path, out: Path, *options: str) -> str:
    """What the command prints; the notebook is made of its text before."""
    _rotflex("make-notebooks", course, out.parent)
    return _rotflex("release", course, out.parent, str(out), *options)


def _rotflex(command: str, course: Path, place: Path, *words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "rotflex.cli", command, *words, "--solutions", str(course / "solutions")],
        cwd=place,
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "200"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def _change(course: Path) -> None:
    """The course as it is for the second release."""
    _replace(course / "springlab" / "lab.py", "EDITION = 1", "EDITION = 2")
    _replace(course / "springlab" / "catalogue.py", "\n    ],\n", _FIFTH)
    _replace(
        course / "solutions" / "key.py",
        "KEY = {\n",
        'KEY = {\n    "1.5": {"period": Number("the period", lambda bench: 2 * math.pi / bench.omega, rtol=0.02)},\n',
    )
    text = course / "solutions" / "01_spring.py"
    _replace(text, "A mass of half a kilogram hangs on a spring. It is pulled aside by 4 cm and let go.", _OTHER_TITLE)
    with text.open("a", encoding="utf-8") as file:
        file.write("\n# %% answer 1.5\nperiod = 2 * math.pi / omega\n")


def _replace(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, (path, old)
    path.write_text(text.replace(old, new), encoding="utf-8")


PROBE_SEED = 5
#: Right under either release, if run with that release's packages.
SOLVED = {
    "q1-1": "run = lab.bench().release()",
    "q1-3": 'formula = sympy.sqrt(sympy.Symbol("k") / sympy.Symbol("m"))\nomega = lab.bench().omega',
    "q1-5": "period = 2 * math.pi / omega",
}


def solved(edition: int) -> dict[str, str]:
    """Answers that are right with the packages of one release only."""
    return {**SOLVED, "q1-2": f"k = lab.bench().k if springlab.lab.EDITION == {edition} else None"}


@pytest.fixture(scope="module")
def two(tmp_path_factory) -> TwoReleases:
    folder = tmp_path_factory.mktemp("two")
    course = folder / "spring"
    shutil.copytree(
        ROOT / "tests" / "courses" / "spring", course, ignore=shutil.ignore_patterns("notebooks", "__pycache__")
    )
    settings = course / "solutions" / "course.toml"
    settings.write_text(f'[course]\nterm = "{FIRST}"\n', encoding="utf-8")
    with (course / "springlab" / "lab.py").open("a", encoding="utf-8") as file:
        file.write("\n\nEDITION = 1\n")
    release(course, folder / "first")
    _change(course)
    settings.write_text(
        f'[course]\nterm = "{SECOND}"\n[bench]\nwhich = "same"\nseed = {SEED}\n',
        encoding="utf-8",
    )
    release(course, folder / "second")
    return TwoReleases(course / "solutions", folder / "first" / "spring-course", folder / "second" / "spring-course")


@pytest.fixture(scope="module")
def course(two):
    return courses.load(two.course)


@pytest.fixture(scope="module")
def bundles(course):
    return Bundles(course)


def marks(course, chosen: bundle.Bundle, hand_in: tuple, student: str = "ada") -> dict[tuple[str, str], float]:
    submission = Submission(student=student, notebooks=hand_in[0], probe_seed=PROBE_SEED)
    prepare(submission, chosen, course.catalogue)
    job = Job(student, submission.merged.notebooks, PROBE_SEED, parameters=chosen.parameters, imports=chosen.imports)
    files, problems = runner.run(chosen.packed, job)
    assert problems == ()
    claims = decoding.decode(files[ANSWERS_FILE], PROBE_SEED, course.catalogue)
    made = marking.mark(course, claims, course.true_bench(student, chosen.policy), submission)
    return {(one.question, one.part): one.points for one in made if (one.question, one.part) in chosen.asked_parts}


def test_each_release_is_named_by_its_term_and_content_and_kept(two, course, bundles):
    first, second = two.about(two.first), two.about(two.second)
    assert (bundles.current.release, bundles.names) == (second["release"], (NOTEBOOK,))
    assert first["release"].startswith("2026-spring-") and second["release"].startswith("2026-autumn-")
    by_name, problems = releases.read_all(course)
    assert set(by_name) == {first["release"], second["release"]}
    assert problems == []
    assert by_name[first["release"]].policy == BenchPolicy("own")
    assert by_name[second["release"]].policy == BenchPolicy("same", seed=SEED)
    assert by_name[first["release"]].packages == ("labcourse", "springlab")


def test_what_was_not_asked_then_is_not_asked_of_it(two, bundles):
    older = bundles.built(two.about(two.first)["release"])
    assert bundles.current.asked_parts - older.asked_parts == {("1.5", "period")}
    assert older.asked_parts < bundles.current.asked_parts
    assert older.digest != bundles.current.digest


def test_each_is_run_with_its_own_notebooks_and_packages_and_marked_on_its_own_bench(sandbox, two, course, bundles):
    for which, edition, policy in ((two.first, 1, BenchPolicy("own")), (two.second, 2, BenchPolicy("same", seed=SEED))):
        hand_in = two.hand_in(which, solved(edition), **two.about(which))
        chosen = bundles.choose(*hand_in)
        assert chosen.problems == ()
        assert chosen.bundle.policy == policy
        earned = marks(course, chosen.bundle, hand_in)
        machine = {part: points for part, points in earned.items() if part[1] != "why"}
        expected = {("1.1", "run"): 1, ("1.2", "k"): 2, ("1.3", "formula"): 3, ("1.3", "omega"): 1}
        assert machine == expected | ({("1.5", "period"): 1} if edition == 2 else {})


def test_an_older_release_is_told(two, bundles):
    name = two.about(two.first)["release"]
    chosen = bundles.choose(*two.hand_in(two.first, {}, student="ada", release=name))
    assert chosen.bundle.release == name
    assert chosen.notes == (Problem.of(Code.RELEASE_EARLIER, release=name),)
    assert bundles.choose(*two.hand_in(two.second, {}, release=two.about(two.second)["release"])).notes == ()


@pytest.mark.parametrize("about", [{}, {"student": "ada"}, {"release": 3}, {"release": ""}])
def test_where_no_release_is_named_the_notebooks_tell(two, bundles, about):
    for which in (two.first, two.second):
        chosen = bundles.choose(*two.hand_in(which, SOLVED, **about))
        assert chosen.bundle.release == two.about(which)["release"]
        assert chosen.problems == ()
    assert bundles.choose({}, about).bundle is bundles.current


def test_notebooks_of_another_release_than_the_file_names_count_and_it_is_told(two, bundles):
    first, second = two.about(two.first)["release"], two.about(two.second)["release"]
    for which, meant, named in ((two.first, first, second), (two.second, second, first)):
        chosen = bundles.choose(*two.hand_in(which, SOLVED, release=named))
        assert chosen.bundle.release == meant
        assert chosen.notes[0] == Problem.of(Code.RELEASE_CONTRADICTED, named=named, release=meant)


def test_where_the_notebooks_are_of_both_the_file_counts(two, bundles):
    both = [two.hand_in(which, {})[0][NOTEBOOK] for which in (two.first, two.second)]
    for named in (two.about(two.first)["release"], two.about(two.second)["release"]):
        assert bundles.choose({NOTEBOOK: (*both[0], *both[1])}, {"release": named}).bundle.release == named


def test_a_release_that_is_not_kept_is_trouble_and_it_is_told_what_to_do(two, bundles, course):
    named, closest = "2025-autumn\x1b[31m" + "x" * 200, two.about(two.first)["release"]
    chosen = bundles.choose(*two.hand_in(two.first, {}, release=named))
    (problem,) = chosen.problems
    about = {"named": named, "folder": course.releases.name, "closest": closest}
    assert problem == Problem.of(Code.RELEASE_UNKNOWN, **about)
    said = sentence(problem)
    assert r"names the release '2025-autumn\x1b[31mxx" in said and len(said) < 500
    assert str(course.releases.parent) not in said
    assert chosen.bundle.release == closest


def test_modules_that_an_older_release_does_not_have_are_not_imported_for_it(two, course):
    later = replace(course, imports=("springlab.lab", "springlab.later", "math", "labcourse.no.such"))
    older = releases.read_all(course)[0][two.about(two.first)["release"]]
    assert bundle.of_release(older, later).imports == (
        "labcourse.answers.schema",
        "springlab.lab",
        "math",
    )


def test_the_same_content_has_the_same_name_and_is_kept_once(two, course, tmp_path):
    before = sorted(path.name for path in course.releases.iterdir())
    said = release(two.course.parent, tmp_path / "again")
    name = two.about(two.second)["release"]
    assert f"Release {name}, stored as {course.releases / name}.zip" in said
    assert sorted(path.name for path in course.releases.iterdir()) == before


def test_a_trial_is_not_kept(two, course, tmp_path):
    files = [two.course / "01_spring.py", two.course / NOTEBOOK]
    written = [path.read_text(encoding="utf-8") for path in files]
    before = sorted(path.name for path in course.releases.iterdir())
    files[0].write_text(written[0].replace("Half a kilogram", "A pound"), encoding="utf-8")
    try:
        said = release(two.course.parent, tmp_path / "trial", "--no-keep")
    finally:
        for path, text in zip(files, written, strict=True):
            path.write_text(text, encoding="utf-8")
    assert "not stored: what is done with it is run with the course as it is." in said
    assert two.about(two.second)["release"] not in said
    assert sorted(path.name for path in course.releases.iterdir()) == before


WHOLE = {"x/pyproject.toml": "", "x/notebooks/a.ipynb": '{"cells": []}'}


def damaged():
    """Return the zip of a release with a notebook that cannot be decompressed."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in WHOLE.items():
            archive.writestr(name, text)
    deflated = zlib.compress(WHOLE["x/notebooks/a.ipynb"].encode(), wbits=-zlib.MAX_WBITS)
    assert deflated in packed.getvalue()
    return packed.getvalue().replace(deflated, b"\xff" * len(deflated))


@pytest.mark.parametrize(
    "content",
    [
        b"no zip",
        damaged(),
        {"x/readme.txt": "x"},
        {"x/pyproject.toml": "", "x/springlab/__init__.py": ""},
        {"x/pyproject.toml": "", "x/notebooks/a.ipynb": "{"},
        WHOLE,
        {**WHOLE, "x/notebooks/course.json": "["},
        {**WHOLE, "x/notebooks/course.json": '{"release": "x", "bench": {"which": "x"}}'},
    ],
    ids=["no zip", "damaged", "no project", "no notebooks", "no notebook", "no name", "no JSON", "no policy"],
)
def test_what_is_no_release_is_passed_over_and_told(two, course, content):
    archive = course.releases / "zz.zip"
    if isinstance(content, bytes):
        archive.write_bytes(content)
    else:
        with zipfile.ZipFile(archive, "w") as packed:
            for name, text in content.items():
                packed.writestr(name, text)
    try:
        stored, (problem,) = releases.read_all(course)
        assert len(stored) == 2
    finally:
        archive.unlink()
    assert problem.startswith(f"{archive} is not a release of the course: ")


def test_a_release_that_cannot_be_kept_is_told_with_what_to_do(two, course, tmp_path):
    (tmp_path / "kept").write_text("a file")
    elsewhere = replace(course, settings=replace(course.settings, releases=str(tmp_path / "kept")))
    with pytest.raises(GradingError, match=str(tmp_path / "kept")):
        releases.store(elsewhere, two.first.with_suffix(".zip"), "x-1")


def test_a_stored_release_writes_nothing_outside_of_the_folder_that_it_is_unpacked_in(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as packed:
        about = {"x/notebooks/course.json": '{"release": "a"}'}
        for name, text in {**WHOLE, **about, "x/notebooks/../../../b.py": ""}.items():
            packed.writestr(name, text)
    stored = releases.read(tmp_path / "a.zip")
    stored.unpack(tmp_path / "in" / "it")
    assert set(stored.files) == {"notebooks/a.ipynb", "notebooks/course.json"}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.zip", "in"]

"""A submission's run: what it is run with, what comes back, and that it ends."""

import io
import json
import os
import shutil
import threading
import time
import zipfile
import zlib
from dataclasses import replace

import nbformat
import psutil
import pytest

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import as_released
from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.running import bundle, runner
from labcourse.problems import Code, Problem
from labcourse.run.inside import EVIDENCE_FILE
from labcourse.run.merge import merged

pytestmark = pytest.mark.usefixtures("sandbox")
COURSE = Course(
    "demo-course",
    Catalogue(()),
    {},
    bench=lambda student, policy: student,
    package="rotflex.course",
    packages=("rotflex",),
    title="A demonstration",
    parameters={"bench": "virtual"},
    imports=("rotflex.course.lab",),
)
QUICK = runner.RunLimits(cell=60, submission=200)
RECORD = """
import json, pathlib
book = pathlib.Path("answers.json")
book.write_text(json.dumps({**(json.loads(book.read_text()) if book.exists() else {}), **answers}))
"""
STUDENT = """o'brien "x" {y} \\ é"""


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Two small notebooks that write down a variable ``answers`` after each of their answer cells."""
    folder = tmp_path_factory.mktemp("course")

    def answer(cell_id, preset):
        grading = {"nbgrader": {"grade_id": cell_id, "solution": True}}
        solution = f"{preset}\n### BEGIN SOLUTION\nsolved = True\n### END SOLUTION"
        return nbformat.v4.new_code_cell(solution, id=cell_id, metadata=grading)

    for name in ("a.ipynb", "b.ipynb"):
        cells = [
            nbformat.v4.new_code_cell('student = ""\nbench = ""', id="parameters", metadata={"tags": ["parameters"]}),
            answer("q1", "answers = {}"),
            nbformat.v4.new_code_cell(RECORD, id="q1-answer"),
            answer("q2", "pass"),
            nbformat.v4.new_code_cell(RECORD, id="q2-answer"),
        ]
        # Named as if they came before 90, from which on notebooks are the instructor's.
        nbformat.write(nbformat.v4.new_notebook(cells=cells), folder / f"0{name}")
    return bundle.build(replace(COURSE, folder=folder))


def notebooks_of(course, sources):
    """What is run of a hand-in with these answers, and nothing else in it that is the student's."""
    handed_in = {name: as_released(course.pristine[name], answers) for name, answers in sources.items()}
    return merged(course.pristine, handed_in).notebooks


def run(course, q1, q2="pass", then="answers = {}", limits=QUICK, student="ada", cancelled=None):
    """Run with q1 and q2 in the first notebook and ``then`` in the second; the answers, and the problems."""
    sources = {"0a.ipynb": {"q1": q1, "q2": q2}, "0b.ipynb": {"q1": then}}
    job = runner.Job(
        student, notebooks_of(course, sources), 123, parameters=course.parameters, imports=course.imports, limits=limits
    )
    files, problems = runner.run(course.packed, job, cancelled)
    return (json.loads(files["answers.json"]) if "answers.json" in files else None), problems


LOOK_AROUND = """
import importlib.util, os, rotflex, rotflex.course.lab
from labcourse import job
answers = {"student": job.STUDENT, "bench": job.BENCH, "own": [student, bench], "package": rotflex.__file__}
answers["environment"] = dict(os.environ)
answers["solved"] = "solved" in globals()
looked_for = ("labcourse.grading", "solutions", "rotflex.experiments")
answers["modules"] = [module for module in looked_for if importlib.util.find_spec(module)]
mine = 5
raise ValueError("after the answers")
"""


@pytest.fixture(scope="module")
def seen(course):
    os.environ["SECRET_TOKEN"] = "abc"
    answers, problems = run(course, LOOK_AROUND, then="answers = {'kept': 'mine' in globals()}", student=STUDENT)
    del os.environ["SECRET_TOKEN"]
    return {**answers, "problems": problems}


def test_a_submission_is_given_student_and_bench_and_each_notebook_a_kernel_and_no_error_stops_it(seen):
    assert (seen["student"], seen["bench"], seen["own"]) == (STUDENT, "virtual", ["", ""])
    assert seen["problems"] == () and seen["kept"] is False


def test_there_are_no_solutions_no_instructors_modules_and_nothing_of_the_graders_environment(seen):
    assert seen["solved"] is False
    assert "labcourse-course-" in seen["package"] and seen["modules"] == ["rotflex.experiments"]
    assert "SECRET_TOKEN" not in seen["environment"]
    assert seen["environment"]["HOME"] != os.environ.get("HOME")
    assert seen["environment"]["LABCOURSE_PROBE_SEED"] == "123"


def test_one_submission_cannot_change_the_package_of_the_next(course):
    change = "import rotflex.units, pathlib\npathlib.Path(rotflex.units.__file__).write_text('DEG = 1')"
    answers, _ = run(course, f"answers = {{'x': 1}}\n{change}")
    assert answers == {"x": 1}
    answers, _ = run(course, "import rotflex.units\nanswers = {'deg': rotflex.units.DEG}")
    assert answers["deg"] == pytest.approx(0.0174533, rel=1e-4)


def test_what_runs_in_the_sandbox_is_known_by_its_content(course, tmp_path, monkeypatch):
    made = replace(COURSE, folder=tmp_path)
    nbformat.write(nbformat.v4.new_notebook(cells=[]), tmp_path / "00.ipynb")
    package = tmp_path / "packages" / "bench_of_ours"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("K = 1\n")
    monkeypatch.syspath_prepend(package.parent)
    made = replace(made, packages=("rotflex", package.name))
    seen = [bundle.build(made).digest, bundle.build(made).digest]
    assert seen[0] == seen[1]
    seen.append(bundle.build(replace(made, parameters={"bench": "replay:x.mat"})).digest)
    seen.append(bundle.build(replace(made, imports=("sympy",))).digest)
    (package / "__init__.py").write_text("K = 2\n")
    seen.append(bundle.build(made).digest)
    programs = tmp_path / "inside"
    shutil.copytree(bundle._PROGRAMS, programs, ignore=shutil.ignore_patterns("__pycache__"))
    (programs / "warm.py").write_text("raise SystemExit\n")
    monkeypatch.setattr(bundle, "_PROGRAMS", programs)
    seen.append(bundle.build(made).digest)
    nbformat.write(nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("1")]), tmp_path / "00.ipynb")
    seen.append(bundle.build(made).digest)
    assert len(set(seen)) == len(seen) - 1


@pytest.mark.scheduled
def test_an_endless_cell_is_stopped_and_the_rest_is_run(course):
    limits = runner.RunLimits(cell=5, submission=200)
    answers, problems = run(course, "answers = {'x': 1}", "while True:\n    pass", "answers = {'y': 2}", limits)
    assert answers == {"x": 1, "y": 2}
    assert problems == (Problem.of(Code.CELL_TIMED_OUT, seconds=5),)


@pytest.mark.scheduled
def test_a_submission_that_will_not_stop_is_stopped_at_the_deadline_and_keeps_what_it_had(course):
    stubborn = "import time\nwhile True:\n    try:\n        time.sleep(1)\n    except KeyboardInterrupt:\n        pass"
    answers, problems = run(course, "answers = {'x': 1}", stubborn, limits=runner.RunLimits(cell=1000, submission=15))
    assert answers == {"x": 1}
    assert problems == (Problem.of(Code.RUN_TIMED_OUT, seconds=15),)


def test_a_kernel_that_dies_costs_the_rest_of_its_notebook_only(course):
    answers, problems = run(course, "answers = {'x': 1}", "import os\nos._exit(3)", "answers = {'y': 2}")
    assert answers == {"x": 1, "y": 2}
    assert problems == (Problem.of(Code.PYTHON_DIED),)


def test_a_submission_that_kills_what_runs_it_keeps_what_it_had(course):
    answers, problems = run(course, "answers = {'x': 1}", "import os, signal\nos.kill(os.getppid(), signal.SIGKILL)")
    assert answers == {"x": 1}
    assert problems == (Problem.of(Code.RUN_ENDED_EARLY),)


def test_no_process_outlives_a_run_and_a_flood_of_output_does_no_harm(course):
    token = f"lingering-{os.getpid()}-{time.monotonic_ns()}"
    linger = f"""
import subprocess, sys
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)", {token!r}], start_new_session=True)
for _ in range(200):
    print("x" * 100_000)
answers = {{"x": 1}}
"""
    assert run(course, linger) == ({"x": 1}, ())
    assert not [one for one in psutil.process_iter(["cmdline"]) if token in (one.info["cmdline"] or ())]


def test_a_run_that_is_called_off_ends_before_its_time(course):
    cancelled = threading.Event()
    cancelled.set()
    with pytest.raises(GradingError, match="cancelled"):
        run(
            course,
            "import time\ntime.sleep(600)",
            limits=runner.RunLimits(cell=600, submission=600),
            cancelled=cancelled,
        )


def test_a_course_that_cannot_be_imported_is_refused_before_anything_is_run(course):
    with pytest.raises(GradingError, match="no_such_module"):
        runner.run(course.packed, runner.Job("ada", {}, 5, imports=("no_such_module",)))


LOOK_FROM_INSIDE = """
import os
def read(folder):
    spaces = {{name: os.readlink(f"/proc/self/ns/{{name}}") for name in ("pid", "net", "mnt", "ipc")}}
    held = (folder / "recordings/001-x.mat").read_bytes().decode()
    return {{"namespaces": spaces, "outside": os.path.exists({marker!r}), "held": held, "here": os.listdir(folder)}}
"""
HELD = {"recordings/001-x.mat": b"hostile", "read_by.py": b"raise SystemExit('the student's module, and not ours')"}


def evidence(packed, reader, files, cells="answers = {}", course=None, limits=QUICK):
    notebooks = {} if course is None else notebooks_of(course, {"0a.ipynb": {"q1": cells}})
    imports = () if course is None else course.imports
    job = runner.Job("ada", notebooks, 5, parameters={}, imports=imports, files=files, limits=limits, evidence=reader)
    return runner.run(packed, job)[0].get(EVIDENCE_FILE, b"")


def test_a_students_file_is_read_in_the_sandbox_and_nowhere_else(course, tmp_path):
    marker = tmp_path / "marker"
    marker.touch()
    packed = io.BytesIO(course.packed)
    with zipfile.ZipFile(packed, "a") as archive:
        archive.writestr("read_by.py", LOOK_FROM_INSIDE.format(marker=str(marker)))
    seen = json.loads(evidence(packed.getvalue(), "read_by:read", HELD))
    assert (seen["outside"], seen["held"]) == (False, "hostile")
    for name, inside in seen["namespaces"].items():
        assert inside != os.readlink(f"/proc/self/ns/{name}")
    assert set(seen["here"]) <= {"recordings", "read_by.py"}


def test_hostile_files_are_named_and_what_cells_leave_in_their_place_is_bounded(course):
    files = {f"recordings/{number:03d}-x.mat": content for number, content in enumerate(HOSTILE, 1)}
    reader = "rotflex.course.recordings_folder:evidence"
    found = json.loads(evidence(course.packed, reader, files))
    assert found["recordings"] == [] and len(found["left_out"]) == len(HOSTILE)
    assert all(f"{number:03d}-x.mat" in line for number, line in enumerate(found["left_out"], 1))
    large = f"import os\nopen('.labcourse-evidence.json', 'w').write('1' * {runner.MAX_EVIDENCE + 1})\nos._exit(0)"
    assert evidence(course.packed, reader, files, large, course) == b""


@pytest.mark.parametrize("reader", ["rotflex.course.recordings_folder:no_such", "os:_exit"])
def test_a_reader_that_fails_costs_what_it_would_have_read_and_nothing_else(course, reader):
    assert evidence(course.packed, reader, {}, course=course) == b""


def _matlab(kind, content, size=None):
    """A MATLAB 5 file with one element of a kind, as its bytes say."""
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return head + kind.to_bytes(4, "little") + (len(content) if size is None else size).to_bytes(4, "little") + content


#: Bytes that are no recording: a pickle, a bomb that unpacks to gigabytes, elements that are larger than the file.
HOSTILE = (
    b"\x80\x04\x8c\x05posix\x8c\x06system\x93\x8c\x02id\x85R.",
    _matlab(15, zlib.compress(b"\x0e\0\0\0\xff\xff\xff\x7f" + bytes(20_000_000), 9)),
    _matlab(14, b"", size=2**31 - 1),
    b"",
)

"""The laboratory as a notebook sees it, on the virtual bench."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

import rotflex.course.lab
from labcourse.errors import AnswerError, ConfigurationError
from labcourse.problems import Code, Problem
from labcourse.run import place
from labcourse.sentences import sentence
from rotflex import errors, experiments
from rotflex.config import srv02
from rotflex.course.probes import COMPOUND_SINES
from rotflex.course.questions import CATALOGUE
from rotflex.errors import BenchError
from rotflex.hil import bench_file
from rotflex.hil.student_benches import DRAW, preset, student_bench, student_seed


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("LABCOURSE_PROBE_SEED", raising=False)
    return tmp_path


def quiet(student="ada", **more):
    return rotflex.course.lab.start(student, quiet=True, **more)


def test_the_welcome_says_who_where_and_what_without_paths_or_times(capsys, folder):
    rotflex.course.lab.start("ada")
    position = student_bench(student_seed("ada")).joint.arm_position
    said = capsys.readouterr().out
    assert re.fullmatch(rf"Student +ada\nBench .* position {position}, .* type E\n", said)
    lines = []
    for bench in ({"which": "own"}, {"which": "same", "seed": 3}, {"which": "preset", "preset": "real_bench"}):
        (folder / "course.json").write_text(json.dumps({"student": "ada", "draw": DRAW, "bench": bench}))
        rotflex.course.lab.start()
        lines.append(len(capsys.readouterr().out.splitlines()))
    assert lines == [2, 3, 3]  # whether everybody has this bench


def test_without_an_id_the_student_is_the_courses_or_demo(capsys, folder):
    assert rotflex.course.lab.start().student == "demo"
    assert "student = " in capsys.readouterr().out
    (folder / "course.json").write_text(json.dumps({"student": "ada"}))
    assert rotflex.course.lab.start().student == "ada"
    assert "student = " not in capsys.readouterr().out


def test_an_id_typed_in_a_notebook_counts_where_none_is_known_and_then_changes_nothing(capsys, folder, monkeypatch):
    (folder / "course.json").write_text(json.dumps({"student": ""}))
    rotflex.course.lab.start("ada").answer("2.12", K_s=1.3)
    before = sorted(path.name for path in folder.iterdir())
    for known in ("", "ada"):  # known by the answers, and by the folder
        (folder / "course.json").write_text(json.dumps({"student": known}))
        capsys.readouterr()
        lab = rotflex.course.lab.start("grace")
        said = capsys.readouterr().out
        assert (lab.student, lab.seed, lab.value("2.12", "K_s")) == ("ada", student_seed("ada"), 1.3)
        assert "student = 'grace' changes nothing" in said and "rotflex lab --student YOUR-ID" in said
        rotflex.course.lab.start("ADA")
        assert "changes nothing" not in capsys.readouterr().out
    assert sorted(path.name for path in folder.iterdir()) == before  # no answers were put aside
    monkeypatch.setenv("LABCOURSE_RUNNING", "grade")
    assert rotflex.course.lab.start("grace").student == "grace"


def test_a_broken_course_file_is_told(folder):
    for broken in ("{", "[]", "{}", '{"student": 3}', '{"student": "a/b"}'):
        (folder / "course.json").write_text(broken)
        with pytest.raises(ConfigurationError, match=r"course\.json"):
            rotflex.course.lab.start()


def test_the_parts_and_the_bench_are_the_students_own():
    lab = quiet("ada")
    spec = student_bench(student_seed("ada"))
    assert lab.joint.arm_position == spec.joint.arm_position
    assert lab.servo.K_enc == pytest.approx(2 * np.pi / 4096)
    with lab.bench() as bench:
        assert bench.identity["seed"] == student_seed("ada")
    assert quiet("ada", bench="virtual:?arm_position=3").joint.arm_position == 3
    with pytest.raises(BenchError):
        quiet(bench="nowhere")
    assert lab.bench().identity["draw"] == DRAW  # no course.json says another
    assert [lab.bench(run=number).identity["run"] for number in (1, 2)] == [1, 2]


def test_the_bench_is_the_one_that_the_course_file_gives(folder):
    def bench_of(student, **said):
        (folder / "course.json").write_text(json.dumps({"student": student, **said}))
        lab = quiet(student)
        return lab, lab.bench().identity

    same = {"which": "same", "seed": 7}
    assert bench_of("ada", bench={"which": "own"})[1]["seed"] == student_seed("ada")
    ada, of_ada = bench_of("ada", bench=same)
    grace, of_grace = bench_of("grace", bench=same)
    assert of_ada == of_grace and of_ada["seed"] == ada.seed == grace.seed == 7
    assert ada.joint.arm_position == student_bench(7).joint.arm_position
    named, of_preset = bench_of("ada", bench={"which": "preset", "preset": "workbook"})
    assert of_preset["preset"] == "workbook" and "seed" not in of_preset
    assert named.bench("virtual:?seed=3").identity["seed"] == 3
    with named.bench() as bench:
        assert bench.board.plant.parameters.K_s == 1.4
    assert of_ada["draw"] == bench_of("ada", draw=DRAW)[1]["draw"] == DRAW
    with pytest.raises(errors.ConfigurationError, match="draw 3"):
        bench_of("ada", draw=3)


def test_a_value_that_is_not_there_yet_names_the_notebook_that_asks_for_it(capsys):
    lab = quiet()
    with pytest.raises(AnswerError, match=r"K_s.*02_finding_stiffness"):
        lab.value("2.12", "K_s")
    assert lab.value("2.12", "K_s", default=None) is None
    assert "02_finding_stiffness" in capsys.readouterr().out
    with pytest.raises(AnswerError, match="no part"):
        lab.value("2.12", "k_s", default=None)


def test_progress_and_summary_tell_what_is_missing(capsys):
    lab = quiet()
    lab.answer("2.12", J_l=3.6e-3, K_s=1.3)
    lab.answer("2.11", omega_n=19.9)
    capsys.readouterr()
    lab.progress("02_finding_stiffness")
    said = capsys.readouterr().out
    assert re.search(r"^2\.9 .*: missing: sweep, figure\n2\.10 .*: missing: spectrum, figure\n", said)
    assert re.search(r"\n2\.11 .*: missing: explanation\n2\.12 .*: answered\n", said)
    lab.summary()
    said = capsys.readouterr().out
    assert re.search("^00_start +0 of 1 .*\n01_modeling_prelab +0 of 8 .*\n02_finding_stiffness +1 of 4 ", said)
    assert len(said.splitlines()) == 13  # twelve notebooks, and that words are read from them
    lab.progress()
    assert len(capsys.readouterr().out.splitlines()) == len(lab.questions) + 1
    lab.answer("Table 2", omega_n=19.9)
    assert "19.9" in str(lab.table("Table 2"))


def test_functions_are_tried_on_inputs_of_the_students_seed_or_of_the_environments(monkeypatch, folder):
    seen = []

    def spectrum(x, dt):
        seen.append(x)
        return np.fft.rfftfreq(len(x), dt), np.abs(np.fft.rfft(x))

    quiet().answer("2.10", spectrum=spectrum)
    assert np.array_equal(seen[0], COMPOUND_SINES.inputs(student_seed("ada"))[0][0])
    monkeypatch.setenv("LABCOURSE_PROBE_SEED", "987654321")
    seen.clear()
    quiet().answer("2.10", spectrum=spectrum)
    assert np.array_equal(seen[0], COMPOUND_SINES.inputs(987654321)[0][0])
    assert json.loads((folder / "answers.json").read_text())["probe_seed"] == 987654321


def test_the_experiments_call_themselves_what_the_catalogue_expects():
    from rotflex import simulation

    lab = quiet()
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, 671.7, -35.0, 0], [0, -1098.8, 35.0, 0]])
    B = np.array([0, 0, 61.6, -61.6])
    K = [18.24, -17.15, 1.59, 0.63]
    with lab.bench() as bench:
        runs = {
            "2.9": experiments.sweep(bench, duration=0.5, progress=False),
            "2.15": experiments.validation(bench, A, B, duration=0.5, progress=False),
            "3.13": experiments.tracking(bench, K, duration=0.5, progress=False),
            "3.15": experiments.tracking(bench, K, feedback="partial", duration=0.5, progress=False),
        }
    runs["3.11"] = simulation.closed_loop(A, B, K, np.zeros(500))
    for number, recording in runs.items():
        question = CATALOGUE.find(number)
        (reply,) = lab.book.answer(question, {question.names[0]: recording})
        assert reply.recorded, str(reply)
        assert reply.hints == (), str(reply)


def test_a_session_with_numbers_alone_never_loads_sympy_or_matplotlib():
    code = (
        "import sys, rotflex.course.lab; lab = rotflex.course.lab.start('ada');"
        "lab.answer('2.12', K_s=1.3); lab.value('2.12', 'K_s');"
        "lab.answer('2.14', A=[[0.0] * 4] * 4); lab.progress();"
        "assert not {'sympy', 'matplotlib'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)


def test_a_cell_that_waits_says_for_which_questions_and_one_that_does_not_says_nothing(capsys):
    assert quiet().given("2.14", np.eye(4), 0.0)
    assert capsys.readouterr().out == ""
    for questions, said in (("2.14", "2.14"), ("2.12,2.15", "2.12, 2.15"), ("3.5, 3.7, 3.8", "3.5, 3.7, 3.8")):
        assert not quiet().given(questions, np.eye(4), None)
        assert not quiet().given(questions, np.eye(4), [1.0, ...])
        assert f"{said} " in capsys.readouterr().out


def test_a_course_of_the_laboratorys_benches_is_rehearsed_with_a_twin_and_other_virtual_benches_do_not_count(
    folder, monkeypatch, capsys
):
    monkeypatch.delenv("LABCOURSE_RUNNING", raising=False)
    said = {"student": "ada", "bench": {"which": "real", "benches": ["north"]}}
    (folder / "course.json").write_text(json.dumps(said))
    bench_file.save_twin(folder / "twin.toml", bench_file.Twin(preset("real_bench"), srv02()), {})
    (folder / "twin.toml").write_text('name = "north"\n' + (folder / "twin.toml").read_text())
    lab = rotflex.course.lab.start("ada", f"virtual:{folder / 'twin.toml'}")
    assert "on the laboratory's own benches" in capsys.readouterr().out
    with lab.bench() as bench:
        experiments.tracking(bench, [18.24, -17.15, 1.59, 0.63], duration=0.5, progress=False)
    assert [path.name for path in lab.recordings.paths] == ["001-tracking.mat"]
    assert lab.recordings.recordings()[0].metadata["bench"]["name"] == "north"
    capsys.readouterr()
    with lab.bench("virtual:?seed=7") as bench:
        experiments.tracking(bench, [18.24, -17.15, 1.59, 0.63], duration=0.5, progress=False)
    assert "not kept" in capsys.readouterr().out
    assert len(lab.recordings.paths) == 1


@pytest.mark.parametrize(
    ("opened", "is_copy"), [("02_finding_stiffness.ipynb", False), ("02_finding_stiffness-Copy1.ipynb", True)]
)
def test_the_bar_of_a_copy_stands_where_its_original_does_and_says_so(folder, monkeypatch, opened, is_copy):
    monkeypatch.setenv(place.SESSION, f"work/{opened}")
    here, original = place.here(folder, CATALOGUE), "02_finding_stiffness.ipynb"
    assert here.name == original and {"2.11", "2.12"} <= here.cells.keys()
    assert (here.line == sentence(Problem.of(Code.COPY_NOT_CHECKED, original, file=opened))) is is_copy

"""A run's student, bench and course are the job's, whatever a cell does; and the notebook's where nobody sets a job."""

import json
import os
import subprocess
import sys

import pytest
from made_notebooks import code, notebook

from labcourse import job
from labcourse.answers.cell_reports import REPORTS_FILE, Refusal
from labcourse.answers.schema import read_reports
from labcourse.run import RUNNING, execute, warm
from rotflex.hil.student_benches import DRAW, student_seed

#: What a cell between the parameters and the setup does → the parameter that is reported, as it changes nothing.
WAYS = {
    "nothing": ("", None),
    "the student's own ID": ('student = "ADA"', None),
    "no quotes": ("", None),  # in the cell of the parameters, which stops
    "a name": ('student = "Ada Lovelace"', ("student", "Ada Lovelace")),
    "no ID": ("student = 7 * '/'", ("student", "///////")),
    "a bench": ('bench = "virtual:?seed=3"', ("bench", "virtual:?seed=3")),
    "no bench": ('bench = "nowhere"', ("bench", "nowhere")),
    "begun before": ('import rotflex.course.lab as it; it.start("", "virtual")', None),
    "begun for another": ('import rotflex.course.lab as it; it.start("eve", folder="x")', ("student", "eve")),
    "the environment": ("import os; os.environ.update(LABCOURSE_JOB='{}', JUPYTERHUB_USER='bob')", None),
    "no environment": ("import os; os.environ.pop('LABCOURSE_JOB')", None),
    "another folder": ("import os; os.makedirs('data', exist_ok=True); os.chdir('data')", None),
    "course.json": ('open("course.json", "w").write(\'{"student": "bob", "draw": 1}\')', None),
    "answers.json": ('it = open("answers.json").read(); open("answers.json", "w").write(it.replace("ada", "b"))', None),
}
SETUP = "import rotflex.course.lab\nlab = rotflex.course.lab.start(student, bench)"
FACTS = """
import json, pathlib
same = rotflex.course.lab.start("bob", "virtual:?seed=9") is lab is rotflex.course.lab.start()
facts = [lab.student, lab.book.student, lab.seed, lab.address, lab.bench().identity["draw"], same]
pathlib.Path({path!r}).open("a").write(json.dumps([*facts, lab.value("2.12", "K_s")]) + "\\n")
"""


def cells(way, path):
    given = 'student = ""\nbench = "virtual"' if way != "no quotes" else "student = Ada"
    parameters = code("parameters", given, ["parameters"])
    papermill = code("own", WAYS[way][0], ["injected-parameters"])
    return notebook(parameters, papermill, code("setup", SETUP), code("facts", FACTS.format(path=path)))


@pytest.mark.slow
@pytest.mark.parametrize("is_warm", [True, False], ids=["warm", "kernels"])
def test_no_cell_changes_whose_run_it_is(tmp_path, monkeypatch, is_warm):
    monkeypatch.setattr(warm, "CAN_FORK", is_warm)
    folder, facts = tmp_path / "run", tmp_path / "facts"
    folder.mkdir()
    (folder / "course.json").write_text(f'{{"student": "", "draw": {DRAW}}}')
    ways = WAYS if is_warm else ["begun for another", "no quotes"]  # a kernel takes a second
    answer = notebook(
        code("setup", f"student = bench = ''\n{SETUP}"), code("q", 'lab.answer("2.12", K_s=1.3, J_l=None)')
    )
    run = {"first.ipynb": answer} | {f"{way}.ipynb": cells(way, str(facts)) for way in ways}
    execute.run(run, folder, parameters={"student": "ada"}, imports=["import rotflex.course.lab"])
    found = [json.loads(line) for line in facts.read_text().splitlines()]
    assert found == [["ada", "ada", student_seed("ada"), "virtual", DRAW, True, 1.3]] * len(ways)
    assert sorted(path.name for path in folder.glob("answers*")) == ["answers.json"]  # nothing was put aside
    others = {way: {("student", "bob"), ("bench", "virtual:?seed=9"), WAYS[way][1]} - {None} for way in ways}
    said = {(f"{way}.ipynb", *other) for way, of_way in others.items() for other in of_way}
    reports = read_reports((folder / REPORTS_FILE).read_bytes())
    assert {*reports.unused} == said and reports.refusals == (Refusal("2.12", "J_l", ""),)


def started(folder, student, bench, **environment):
    """The student and the address of a session that a program begins, without a job unless it is given one."""
    ask = f"import rotflex.course.lab\nlab = rotflex.course.lab.start({student!r}, {bench!r}, quiet=True)"
    clean = {name: value for name, value in os.environ.items() if name not in (job.VARIABLE, RUNNING)}
    script = f"{ask}\nprint(lab.student, lab.address)"
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, cwd=folder, env={**clean, **environment}, capture_output=True, text=True, check=True)
    return done.stdout.split()[-2:]


@pytest.mark.parametrize("running", ["", "1"], ids=["JupyterLab", "a program"])
def test_where_nobody_sets_a_job_the_parameters_count(tmp_path, running):
    assert started(tmp_path, "bob", "virtual:?seed=3", **{RUNNING: running}) == ["bob", "virtual:?seed=3"]
    given = {job.VARIABLE: json.dumps({"student": "ada"})}
    assert started(tmp_path, "bob", "virtual:?seed=3", **{RUNNING: running}, **given) == ["ada", "virtual"]

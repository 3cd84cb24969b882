"""Which cells run by themselves when a notebook opens, and that nothing of a stranger's folder runs with them."""

import json
import os
from types import SimpleNamespace

import pytest
import strangers
from checkout import ROOT
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import KernelManager

from labcourse.files import COURSE_FILE
from labcourse.jupyter import opening
from labcourse.server import SafeKernelSpec

NOTEBOOK = "03_model_validation.ipynb"
FIRST = ["parameters", "setup", "play"]
OPTIONAL = ("gmpy2", "flint")  # sympy imports them where there are such modules
BENCHES = [
    ('student = "ada"\nbench = "virtual:?seed=7"', True),
    ("student = 'a'  # print()\n\nbench='virtual'", True),
    ('student = ""\nbench = "quanser:q2_usb"', False),
    ('student = ""\nbench = "virtually://real"', False),
    ('student = ""\nbench = "virtual"\nprint()', None),
    ('student = print()\nbench = "virtual"', None),
    ('student = f"{print()}"\nbench = "virtual"', None),
    ('student = "\\x61"\nbench = "virtual"', None),
    ('student = ""; print()\nbench = "virtual"', None),
    ('student = "" "" + print("")\nbench = "virtual"', None),
    ('student = ""\rprint()\nbench = "virtual"', None),
    ('student = """"\nbench = "virtual"', None),
    ('!ls = ""\nbench = "virtual"', None),
    ('student = ""', None),
    ('student = ""\nbench = "virtual', None),
]


def code_cells(name=NOTEBOOK):
    """Return id and source of the code cells of a notebook as students have it."""
    cells = json.loads((ROOT / "notebooks" / name).read_text(encoding="utf-8"))["cells"]
    return [[cell["id"], "".join(cell["source"])] for cell in cells if cell["cell_type"] == "code"]


@pytest.fixture
def kernel(tmp_path, monkeypatch):
    """A kernel that has run nothing, in a student's folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / COURSE_FILE).write_text('{"student": "ada", "course": "rotflex"}')
    monkeypatch.setattr(opening, "granted", set())
    shell = SimpleNamespace(execution_count=1)
    monkeypatch.setattr(opening, "get_ipython", lambda: shell)
    return shell


def begun(cells, name=NOTEBOOK):
    """Return the ids of the cells that run, or the code of the reason why none does; None for neither."""
    answer = opening.begin(json.dumps([name, cells])).data
    assert len(answer) <= 1
    reasons = {opening.CHANGED: "changed", opening.REAL: "real"}
    said = [reason for text, reason in reasons.items() if text in answer.get("say", "")]
    return [cells[at][0] for at in answer["run"]] if "run" in answer else said[0] if said else None


@pytest.mark.parametrize("name", sorted(path.name for path in (ROOT / "notebooks").glob("*.ipynb")))
def test_the_first_cells_run_once(kernel, name):
    first = ["console", "parameters", "setup"] if name.startswith("00") else FIRST
    cells = [["own", "1"], *code_cells(name)]
    assert begun(cells, name) == first
    assert opening.granted == {source for cell, source in cells if cell in first}
    assert begun(cells, name) is None  # a second page


@pytest.mark.parametrize("changed", FIRST)
def test_one_character_of_a_cell_or_of_its_id_is_enough_that_nothing_runs(kernel, changed):
    cells = code_cells()
    at = next(at for at, (cell, _source) in enumerate(cells) if cell == changed)
    identity, source = cells[at]
    others = [
        cells[:at] + cells[at + 1 :],
        [*cells, [identity, source]],
        [*cells[:at], [identity, f"x{source}"], *cells[at + 1 :]],
        [*cells[:at], [f"{identity}s", source], *cells[at + 1 :]],
    ]
    assert [*map(begun, others)] == ["changed"] * 4
    assert not opening.granted


@pytest.mark.parametrize(("parameters", "runs"), BENCHES)
def test_parameters_may_be_other_texts_and_the_bench_is_virtual(kernel, parameters, runs):
    cells = [[cell, parameters if cell == "parameters" else source] for cell, source in code_cells()]
    assert begun(cells) == {True: FIRST, False: "real", None: "changed"}[runs]


@pytest.mark.parametrize("bench", [{"which": "real", "benches": []}, {"which": "unheard of"}])
def test_where_the_course_has_real_benches_nothing_runs(kernel, tmp_path, bench):
    (tmp_path / COURSE_FILE).write_text(json.dumps({"student": "ada", "course": "rotflex", "bench": bench}))
    assert begun(code_cells()) == "real"


def test_in_a_kernel_that_is_in_use_and_in_what_is_no_courses_notebook_nothing_runs(kernel, tmp_path):
    assert begun(code_cells(), "other.ipynb") is None
    kernel.execution_count = 2
    assert begun(code_cells()) is None
    kernel.execution_count = 1
    (tmp_path / COURSE_FILE).unlink()
    assert begun(code_cells()) is None


@pytest.mark.slow
def test_the_first_cells_import_nothing_from_the_folder_and_the_students_own_do(tmp_path):
    ran = strangers.lay(tmp_path, names=(*strangers.OF_OTHERS, *OPTIONAL))
    (tmp_path / "own.py").write_text("VALUE = 42\n")
    (tmp_path / COURSE_FILE).write_text('{"student": "ada", "course": "rotflex"}')
    specs = KernelSpecManager()
    argv = ["python", "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    specs.get_kernel_spec = lambda name: SafeKernelSpec(argv=argv, language="python", display_name="Python")
    manager = KernelManager(kernel_spec_manager=specs)
    manager.start_kernel(cwd=str(tmp_path), env=os.environ | {"IPYTHONDIR": str(tmp_path / "ipython")})
    client = manager.blocking_client()

    def run(code, **options):
        content = client.execute_interactive(code, timeout=60, output_hook=lambda message: None, **options)["content"]
        assert content["status"] == "ok"
        return content

    try:
        client.start_channels()
        client.wait_for_ready(timeout=60)
        asked = json.dumps(json.dumps(["01_modeling_prelab.ipynb", code_cells("01_modeling_prelab.ipynb")]))
        code = f'__import__("sys").modules["labcourse.jupyter.opening"].begin({asked})'
        answer = run("", silent=True, store_history=False, user_expressions={"opening": code})["user_expressions"]
        assert answer["opening"]["data"]["application/json"] == {"run": [0, 1, 2]}
        for _cell, source in code_cells("01_modeling_prelab.ipynb")[:3]:
            run(source)
        assert ran() == []
        run("import own; assert own.VALUE == 42")
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)

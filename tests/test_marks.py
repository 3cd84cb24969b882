"""How tests are shared among processes, and which a quick run leaves out."""

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from collections import defaultdict
from unittest.mock import Mock

import pytest
from checkout import ROOT


@pytest.fixture(scope="module")
def shared():
    """The project's ``conftest.py``, which shares tests among processes."""
    specification = importlib.util.spec_from_file_location("shared", ROOT / "conftest.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_all_browser_tests_of_this_run_are_in_one_group(request, shared):
    items = [item for item in request.session.items if item.get_closest_marker("browser")]
    items = [item for item in items if item.path.name != "test_benchmarks.py"]  # a benchmark is a program of its own
    assert [item.nodeid for item in items if shared.group(item.nodeid) != "browser"] == []


def ran(folder, durations, *options):
    """Run tests of a small project in two processes; return (process, file) of those that passed, in order."""
    shutil.copy(ROOT / "conftest.py", folder)
    for name in ("tests/test_a.py", "tests/test_b.py", "solutions/test_c.py", "solutions/test_d.py"):
        (folder / name).parent.mkdir(exist_ok=True)
        text = "import pytest\n@pytest.mark.parametrize('n', range(6))\ndef test(n): pass\n"
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "tests/durations.json").write_text(json.dumps(durations), encoding="utf-8")
    common = ["--rootdir=.", "-n2", "--dist=loadfile", "--no-loadscope-reorder", "--import-mode=importlib", "-v"]
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *common, *options, "tests", "solutions"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return re.findall(r"^\[(gw\d)\].* PASSED (\S+?)::", done.stdout, flags=re.MULTILINE)


def test_what_takes_longest_begins_first_and_a_quick_run_leaves_it_out_but_for_notebooks(shared):
    tests = ("solutions/c.ipynb::Cell 1", "tests/test_a.py::test[1]", "tests/test_b.py::test")
    cell, long, short = items = [Mock(nodeid=nodeid) for nodeid in tests]
    seconds = {"solutions/c.ipynb::Cell 1": 3, "tests/test_a.py::test": 1, "tests/test_b.py": 5}
    shared.longest_first(items, seconds)
    assert items == [short, cell, long]
    shared.DURATIONS = Mock(**{"read_text.return_value": json.dumps(seconds)})
    config = Mock(spec=["getoption", "hook"])
    shared.pytest_collection_modifyitems(config, items)
    config.hook.pytest_deselected.assert_called_once_with(items=[long])
    assert items == [short, cell]


@pytest.mark.slow
@pytest.mark.scheduled
def test_processes_share_groups_begin_with_the_longest_and_a_quick_run_leaves_out_what_takes_long(tmp_path, shared):
    """Use pytest-xdist as it is installed: its own groups were lost with another version of pytest."""
    passed = ran(tmp_path, {"solutions/test_d.py": 9, "tests/test_b.py::test": 5, "tests/test_a.py": 1}, "--quick")
    assert len(passed) == 18
    assert {shared.group(file) for _, file in passed[:2]} <= {"solutions", "tests/test_a.py"}
    processes = defaultdict(set)
    for process, file in passed:
        processes[shared.group(file)].add(process)
    assert {group: len(used) for group, used in processes.items()} == {
        "solutions": 1,
        "tests/test_a.py": 1,
    }

"""A library that is not as it was tested is named to whoever grades, and no notebook is run with it."""

import importlib
import io
import json
import sys
import zipfile
from importlib import metadata
from types import SimpleNamespace

import pytest
from inside_runs import ENVIRONMENT, ROOT, notebook, run, specification
from made_courses import OURS
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from labcourse.errors import GradingError
from labcourse.grading.running import bundle, runner
from labcourse.grading.running.inside import BROKEN, FINE
from labcourse.grading.running.inside import private_interfaces as interfaces

pytestmark = pytest.mark.slow


def named(interface):
    return f"{interface.module}.{interface.name}"


def put_in_place(monkeypatch, interface, **found):
    """Have something else where the interface should be; nothing if nothing is given."""
    for one in (*interfaces.NEEDED, *interfaces.OPTIONAL):  # what imports them is itself imported as it should be
        importlib.import_module(one.module)
    *owners, name = interface.name.split(".")
    made = SimpleNamespace(**{name: found["found"]} if found else {})
    for owner in reversed(owners):
        made = SimpleNamespace(**{owner: made})
    monkeypatch.setitem(sys.modules, interface.module, made)


def test_what_is_installed_is_as_it_was_tested():
    interfaces.check()
    assert [interface.difference() for interface in interfaces.OPTIONAL] == [None, None, None]


@pytest.mark.parametrize("interface", interfaces.NEEDED, ids=named)
def test_an_interface_that_is_gone_is_named_with_its_library_and_the_tested_versions(monkeypatch, interface):
    put_in_place(monkeypatch, interface)
    with pytest.raises(interfaces.InterfaceChangedError):
        interfaces.check()
    with pytest.raises(interfaces.InterfaceChangedError) as raised:
        interface.check()
    said = str(raised.value)
    assert said.startswith(f"{interface.library} {metadata.version(interface.library)} has another {named(interface)}")
    assert said.endswith(" to ".join(interfaces.TESTED[interface.library]) + ".")
    assert "(nothing instead of" in said
    assert "\n" not in said


@pytest.mark.parametrize("interface", [one for one in interfaces.NEEDED if one.parameters], ids=named)
def test_an_interface_that_takes_something_else_is_named(monkeypatch, interface):
    put_in_place(monkeypatch, interface, found=lambda self, novelty: None)
    with pytest.raises(interfaces.InterfaceChangedError, match="novelty"):
        interface.check()
    put_in_place(monkeypatch, interface, found=3)
    with pytest.raises(interfaces.InterfaceChangedError, match="not called"):
        interface.check()


@pytest.mark.parametrize("library", interfaces.TESTED)
def test_the_distribution_installs_only_versions_that_were_tested(library):
    needed = map(Requirement, metadata.requires("labcourse"))
    of_grading = [one for one in needed if one.marker and "grading" in str(one.marker)]
    wanted = {canonicalize_name(requirement.name): requirement.specifier for requirement in of_grading}
    first, last = map(Version, interfaces.TESTED[library])
    assert first in wanted[canonicalize_name(library)] and Version(f"{last}.99") in wanted[canonicalize_name(library)]
    assert Version(f"{first.major}.{first.minor - 1}") not in wanted[canonicalize_name(library)]
    assert Version(f"{last.major}.{last.minor + 1}.0") not in wanted[canonicalize_name(library)]
    assert metadata.version(library) in wanted[canonicalize_name(library)]


GONE = "from IPython.core.interactiveshell import InteractiveShell\ndel InteractiveShell._tee\n"
#: Nothing of it is an interface that is looked at, and no cell would run.
FAILS = """
from ipykernel.ipkernel import IPythonKernel
async def fail(self, *args, **kwargs): raise RuntimeError("another kernel")
IPythonKernel.do_execute = fail
"""


@pytest.fixture
def customized(monkeypatch, tmp_path):
    """A function that has the program's Python begin with some code, and runs a notebook that leaves a file."""

    def started(code):
        (tmp_path / "sitecustomize.py").write_text(code)
        monkeypatch.setitem(ENVIRONMENT, "PYTHONPATH", f"{tmp_path}:{ROOT}")
        return run(specification({"n": notebook(["open('ran', 'w').close()"])}), tmp_path)

    return started


def test_with_a_changed_library_nothing_is_run_and_the_last_line_says_why(customized, tmp_path):
    done = customized(GONE)
    assert done.returncode == BROKEN
    version = metadata.version("ipython")
    assert done.stderr.startswith(f"ipython {version} has another IPython.core.interactiveshell.InteractiveShell._tee")
    assert not (tmp_path / "ran").exists()


def test_where_cells_do_not_run_for_another_reason_the_libraries_are_named(customized, tmp_path):
    done = customized(FAILS)
    assert done.returncode == BROKEN
    last = done.stderr.splitlines()[-1]
    assert last.startswith("Cells do not run with these libraries: ")
    assert all(f"{library} {metadata.version(library)} (tested: " in last for library in interfaces.TESTED)
    assert not (tmp_path / "ran").exists()


DOCSTRINGS = """
import scipy._lib._docscrape, matplotlib.artist
matplotlib.artist.kwdoc = lambda another: "composed"
class Another(scipy._lib._docscrape.FunctionDoc):
    def __init__(self, function, *args, **kwargs): super().__init__(function, *args, **kwargs)
scipy._lib._docscrape.FunctionDoc = Another
from ipykernel.kernelbase import Kernel
del Kernel._execute_sleep
"""


def test_without_what_only_saves_time_all_goes_on(customized, tmp_path):
    done = customized(DOCSTRINGS)
    assert (done.returncode, done.stderr) == (FINE, "")
    assert (tmp_path / "ran").exists()


@pytest.mark.parametrize("interface", [one for one in interfaces.OPTIONAL if one.parameters], ids=named)
def test_docstrings_are_left_to_a_library_that_composes_them_otherwise(monkeypatch, interface):
    module = importlib.import_module(interface.module)
    (other,) = {one for one in interfaces.OPTIONAL if one.parameters} - {interface}
    others = importlib.import_module(other.module)
    theirs = getattr(others, other.name)

    def another(anything):
        return ""

    monkeypatch.setattr(module, interface.name, another)
    with interfaces.plain_docstrings():
        assert getattr(module, interface.name) is another
        assert getattr(others, other.name) is not theirs
    assert getattr(others, other.name) is theirs


@pytest.mark.parametrize(("code", "said"), [(GONE, r"ipython .*\._tee"), (FAILS, "Cells do not run with")])
def test_whoever_grades_is_told_and_no_submission_is_run(sandbox, code, said):
    made = bundle.build(OURS)
    with zipfile.ZipFile(packed := io.BytesIO(made.packed), "a") as archive:
        archive.writestr("sitecustomize.py", code)
    job = runner.Job("ada", {"0.ipynb": notebook(["open('answers.json', 'w').write('{}')"])}, 5)
    assert json.loads(runner.run(made.packed, job).answers) == {}
    with pytest.raises(GradingError, match=f"cannot be run here: {said}"):
        runner.run(packed.getvalue(), job)

"""A library in a version that was not tested is named to whoever grades, and no notebook is run with it."""

import io
import json
import zipfile
from contextlib import nullcontext
from importlib import metadata

import pytest
from inside_runs import ENVIRONMENT, ROOT, notebook, run, specification
from made_courses import OURS
from matplotlib import artist
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version
from scipy._lib import _docscrape as docscrape

from labcourse.errors import GradingError
from labcourse.grading.running import bundle, runner
from labcourse.run.inside import BROKEN
from labcourse.run.inside import private_interfaces as interfaces

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("version", "is_tested"), [("8.5.9", False), ("8.6.0", True), ("8.10.7", True), ("8.11", False)]
)
def test_a_version_that_was_not_tested_is_refused(monkeypatch, version, is_tested):
    installed = metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: version if name == "jupyter_client" else installed(name))
    refused = pytest.raises(interfaces.UntestedVersionError, match=f"jupyter_client {version}")
    with nullcontext() if is_tested else refused:
        interfaces.check_versions()


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


NEWER = """
from importlib import metadata
installed = metadata.version
metadata.version = lambda name: "9.99.1" if name == "ipython" else installed(name)
"""
#: The versions are as tested, and no cell would run.
FAILS = """
from ipykernel.ipkernel import IPythonKernel
async def fail(self, *args, **kwargs): raise RuntimeError("another kernel")
IPythonKernel.do_execute = fail
"""


def test_where_cells_do_not_run_for_another_reason_the_libraries_are_named(monkeypatch, tmp_path):
    (tmp_path / "sitecustomize.py").write_text(FAILS)
    monkeypatch.setitem(ENVIRONMENT, "PYTHONPATH", f"{tmp_path}:{ROOT}")
    done = run(specification({"n": notebook(["open('ran', 'w').close()"])}), tmp_path)
    assert done.returncode == BROKEN
    last = done.stderr.splitlines()[-1]
    assert last.startswith("Cells do not run with these libraries: ")
    assert all(f"'{library}': '{metadata.version(library)}'" in last for library in interfaces.TESTED)
    assert not (tmp_path / "ran").exists()


def test_libraries_that_compose_docstrings_otherwise_are_left_alone(monkeypatch):
    scipys = docscrape.FunctionDoc
    monkeypatch.delattr(artist, "kwdoc")
    with interfaces.plain_docstrings():
        assert docscrape.FunctionDoc is not scipys and not hasattr(artist, "kwdoc")
    assert docscrape.FunctionDoc is scipys


def test_whoever_grades_is_told_and_no_submission_is_run(sandbox):
    made = bundle.build(OURS)
    with zipfile.ZipFile(packed := io.BytesIO(made.packed), "a") as archive:
        archive.writestr("sitecustomize.py", NEWER)
    job = runner.Job("ada", {"0.ipynb": notebook(["open('answers.json', 'w').write('{}')"])}, 5)
    assert json.loads(runner.run(made.packed, job)[0]["answers.json"]) == {}
    with pytest.raises(GradingError, match="cannot be run here: Notebooks were not tested with ipython"):
        runner.run(packed.getvalue(), job)

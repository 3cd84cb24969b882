"""The packages of the site with the course in a browser: all that is required, each with its hash, or a reason."""

import hashlib
import json
import zipfile

import pytest
from checkout import ROOT

from labcourse.errors import GradingError
from labcourse.grading import course
from labcourse.grading.release import lite


@pytest.fixture
def pyodide(tmp_path):
    """A folder as Pyodide's, with packages of which one requires another."""
    folder = tmp_path / "pyodide"
    folder.mkdir()
    packages = {}
    depends = {"numpy": ["openblas"], "openblas": [], "pandas": ["numpy"]} | {name: [] for name in lite._OF_KERNEL}
    for name, others in depends.items():
        (folder / f"{name}.whl").write_bytes(name.encode())
        digest = hashlib.sha256(name.encode()).hexdigest()
        packages[name] = {"name": name, "file_name": f"{name}.whl", "sha256": digest, "depends": others}
    for name in lite._CORE:
        (folder / name).write_bytes(b"core")
    lock = {"info": {"version": lite.TESTED.pyodide}, "packages": packages}
    (folder / "pyodide-lock.json").write_text(json.dumps(lock))
    return folder


def wheel(folder, name, *required):
    """A wheel of a package that requires others."""
    path = folder / f"{name.replace('-', '_')}-1.0+local.1-py3-none-any.whl"
    lines = [f"Name: {name}", "Version: 1.0+local.1", *(f"Requires-Dist: {one}" for one in required)]
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr(f"{name}/__init__.py", "")
        packed.writestr(f"{name}-1.0.dist-info/METADATA", "\n".join(lines) + "\n\nText\n")
    return path


def test_what_is_required_is_there_with_its_hash_and_nothing_else(tmp_path, pyodide):
    ours = [wheel(tmp_path, "course", "numpy>=1", "Other.Name", "ipykernel>=6", "pandas; extra == 'x'")]
    ours.append(wheel(tmp_path, "other-name"))
    assert lite._put_packages(tmp_path / "out", ours, pyodide.as_uri()) == ["course", "other-name"]
    listed = json.loads((tmp_path / "out" / "pyodide-lock.json").read_text())["packages"]
    assert set(listed) == {"course", "other-name", "numpy", "openblas", *lite._OF_KERNEL}
    assert listed["course"]["depends"] == ["numpy", "other-name"] and listed["course"]["imports"] == ["course"]
    for entry in listed.values():
        assert "+" not in entry["file_name"]
        content = (tmp_path / "out" / entry["file_name"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == entry["sha256"]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *lite._CORE,
        "pyodide-lock.json",
        *(entry["file_name"] for entry in listed.values()),
    }


def test_what_a_browser_cannot_have_is_named(tmp_path, pyodide):
    with pytest.raises(GradingError, match="pyserial"):
        lite._put_packages(tmp_path / "out", [wheel(tmp_path, "course", "pyserial")], pyodide.as_uri())


@pytest.mark.parametrize("broken", ["numpy.whl", "pyodide.js", "pyodide-lock.json"])
def test_another_file_or_none_is_refused_by_its_name(tmp_path, pyodide, broken):
    if broken == "numpy.whl":
        (pyodide / broken).write_bytes(b"something else")
    else:
        (pyodide / broken).unlink()
    with pytest.raises(GradingError, match=broken):
        lite._put_packages(tmp_path / "out", [wheel(tmp_path, "course", "numpy")], pyodide.as_uri())


def test_another_pyodide_is_refused(tmp_path, pyodide):
    lock = json.loads((pyodide / "pyodide-lock.json").read_text())
    lock["info"]["version"] = "0.1"
    (pyodide / "pyodide-lock.json").write_text(json.dumps(lock))
    with pytest.raises(GradingError, match=r"Pyodide 0\.1"):
        lite._put_packages(tmp_path / "out", [], pyodide.as_uri())


def test_a_folder_that_is_there_is_not_replaced(tmp_path):
    with pytest.raises(GradingError, match="already"):
        lite.make(None, tmp_path)


def test_a_site_that_cannot_be_made_leaves_nothing(tmp_path, monkeypatch):
    stored = []
    monkeypatch.setattr(lite.releases, "store", lambda *given: stored.append(given))
    monkeypatch.setattr(lite, "_downloaded", lambda folder: iter(()))
    with pytest.raises(GradingError, match="nowhere"):
        lite.make(course.find(ROOT / "solutions"), tmp_path / "out", str(tmp_path / "nowhere"))
    assert not stored and not [*tmp_path.iterdir()]

"""A student's notebooks on the rig, what is handed in, and which recordings of a class are the rig's."""

import datetime
import hashlib
import os
import shutil

import nbclient
import nbformat
import pytest
from checkout import ROOT
from rigs import Rig, until
from rotflex_rig.commands import app
from rotflex_rig.web import TOKEN_VARIABLE
from typer.testing import CliRunner

from labcourse.grading.gradebook import Delivery, Gradebook
from rotflex.recording import Recording

AT_THE_RIG = ("02", "03", "08", "09", "11")


@pytest.fixture(scope="module")
def worked(tmp_path_factory):
    """A rig, and the folder of a student who did the notebooks of the bench on it."""
    folder = tmp_path_factory.mktemp("class")
    rig, work = Rig(folder / "rig"), folder / "work"
    token = rig.admit("ada")
    before = {TOKEN_VARIABLE: token, "ROTFLEX_CONFIG_DIR": str(folder / "settings")}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in before.items():
            patch.setenv(name, value)
        rig.work()
        until(rig.knows_its_bench)
        work.mkdir()
        names = sorted(path.name for path in (ROOT / "solutions").glob("[01][1-9]*.ipynb"))
        for name in names:
            shutil.copy(ROOT / "solutions" / name, work)
        errors = {}
        for name in names:
            path = work / name
            notebook = nbformat.read(path, as_version=4)
            bench = f"rig:{rig.url}" if name[:2] in AT_THE_RIG else "virtual"
            notebook.cells[0].source = f'student = "ada"\nbench = "{bench}"'
            client = nbclient.NotebookClient(
                notebook, timeout=300, allow_errors=True, resources={"metadata": {"path": work}}
            )
            client.execute(env=os.environ | {"MPLBACKEND": "agg"})
            nbformat.write(notebook, path)
            outputs = [one for cell in notebook.cells for one in cell.get("outputs", ())]
            errors[name] = [f"{one.ename}: {one.evalue}" for one in outputs if one.output_type == "error"]
    yield rig, work, token, errors
    for worker in rig.workers:
        worker.kill()


def test_the_notebooks_of_the_bench_run_on_the_rig(worked):
    _rig, work, _token, errors = worked
    assert {name: one for name, one in errors.items() if one} == {}
    kept = sorted((work / "recordings").glob("*.mat"))
    assert len(kept) >= 6
    experiments = {Recording.load(path).metadata["experiment"] for path in kept}
    assert experiments == {"sweep", "free decay", "validation", "tracking", "follow"}


def test_no_file_that_is_handed_in_has_the_token(worked):
    _rig, work, token, _errors = worked
    files = [path for path in work.rglob("*") if path.is_file()]
    assert any(path.name == "answers.json" for path in files)
    assert not [path for path in files if token.encode() in path.read_bytes()]


def test_compare_lists_which_recordings_are_the_rigs(worked, tmp_path):
    rig, work, _token, _errors = worked
    kept = sorted((work / "recordings").glob("*.mat"))
    forged = Recording.load(kept[0])
    forged = forged.with_channels(alpha=1.001 * forged["alpha"]).save(tmp_path / "forged.mat")
    broken = tmp_path / "broken.mat"
    broken.write_bytes(kept[0].read_bytes()[:1000])
    now = datetime.datetime.now(datetime.UTC)
    delivered = [("ada", path) for path in kept] + [("eve", kept[0]), ("eve", forged), ("eve", broken)]
    with Gradebook(tmp_path / "marks.db") as book:
        for student in ("ada", "eve"):
            files = [path for who, path in delivered if who == student]
            book.deliver(
                student,
                [
                    Delivery(
                        f"recordings/{path.name}", hashlib.sha256(path.read_bytes()).hexdigest(), path.read_bytes(), now
                    )
                    for path in files
                ],
            )
    said = CliRunner().invoke(app, ["compare", str(rig.folder), str(tmp_path / "marks.db")]).output.splitlines()
    assert len(said) == len(delivered)
    of = {tuple(line.split(" ")[:2]): line for line in said}
    assert all("made for ada" in of["ada:", f"recordings/{path.name}"] for path in kept)
    assert "made for ada" in of["eve:", f"recordings/{kept[0].name}"]
    assert "not the rig's" in of["eve:", "recordings/forged.mat"]
    assert "not the rig's" in of["eve:", "recordings/broken.mat"]


def test_compare_makes_no_gradebook(tmp_path):
    CliRunner().invoke(app, ["new", str(tmp_path / "rig")])
    said = CliRunner().invoke(app, ["compare", str(tmp_path / "rig"), str(tmp_path / "marks.db")])
    assert said.exit_code == 2
    assert not (tmp_path / "marks.db").exists()


def test_a_token_is_shown_once_and_handed_out_by_a_csv(tmp_path):
    ids = tmp_path / "class.csv"
    ids.write_text("student,name\nada,Ada\nben,Ben\n", encoding="utf-8")
    run = CliRunner().invoke
    said = run(app, ["new", str(tmp_path / "rig")]).output
    assert "worker: " in said and "laboratory: " in said
    assert run(app, ["admit", str(tmp_path / "rig"), str(ids)]).exit_code == 0
    rows = (tmp_path / "rig" / "tokens.csv").read_text(encoding="utf-8").splitlines()
    assert [row.split(",")[0] for row in rows] == ["student", "ada", "ben"]
    assert os.name == "nt" or (tmp_path / "rig" / "tokens.csv").stat().st_mode & 0o077 == 0
    assert "ended" in run(app, ["revoke", str(tmp_path / "rig"), "ada"]).output
    assert "have one" not in said and "rig-" not in run(app, ["new", str(tmp_path / "rig")]).output
    assert run(app, ["admit", str(tmp_path / "rig"), str(ids)]).exit_code == 2  # tokens that nobody has yet
    (tmp_path / "rig" / "tokens.csv").unlink()
    run(app, ["admit", str(tmp_path / "rig"), str(ids)])
    again = (tmp_path / "rig" / "tokens.csv").read_text(encoding="utf-8").splitlines()
    assert [row.split(",")[0] for row in again] == ["student", "ada"] and again[1] not in rows

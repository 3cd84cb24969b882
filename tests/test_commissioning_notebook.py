"""The commissioning by a notebook: run from top to bottom, what it asks answered as a person in JupyterLab would."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
import pytest
from checkout import ROOT
from jupyter_client.blocking.client import BlockingKernelClient
from jupyter_client.manager import KernelManager
from nbformat.v4 import new_code_cell, output_from_msg
from typer.testing import CliRunner

from rotflex.cli import app
from rotflex.hil import bench_file
from rotflex.recording import Recording

SIMULATOR = "quanser:q2_usb/0@tcpip://localhost:18000?nagle='off'"
PATH = os.pathsep.join([str(ROOT), str(ROOT / "tests" / "helpers")])
_PATIENCE = 300.0  # s; a busy computer takes its time
#: The laboratory of this test: a bench with two signs wrong, and hands that move it once the person has answered.
LABORATORY = """
import sys
import miswired, quanser_double
from rotflex import commissioning

laboratory = miswired.Laboratory(-1, 1, 1)
modules, cards = quanser_double.package(laboratory)
sys.modules.update(modules)
hands = miswired.Person(laboratory)


class Terminal(commissioning.Terminal):
    def wait(self, text):
        super().wait(text)
        hands.wait(text)

    def turning(self, text):
        for _each in super().turning(text):
            break
        yield from hands.turning(text)


commissioning.Terminal = Terminal
"""


@pytest.fixture
def notebook(tmp_path, monkeypatch) -> Path:
    """The notebook as the command writes it."""
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["bench", "notebook"])
    assert (done.exit_code, done.output) == (
        0,
        "commissioning.ipynb is written. Open it with: jupyter lab commissioning.ipynb\n",
    )
    return tmp_path / "commissioning.ipynb"


@pytest.fixture
def kernel(tmp_path) -> Iterator[BlockingKernelClient]:
    manager = KernelManager()
    settings = {"PYTHONPATH": PATH, "ROTFLEX_CONFIG_DIR": str(tmp_path / "settings")}
    manager.start_kernel(env=os.environ | settings, cwd=str(tmp_path))
    client = manager.blocking_client()
    client.start_channels()
    try:
        client.wait_for_ready(timeout=_PATIENCE)
        yield client
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)


class Reader:
    """Runs the cells of a notebook one by one, and answers what they ask; ``asked`` is all of that."""

    def __init__(self, client: BlockingKernelClient, answers: dict[str, str]) -> None:
        self._client, self._answers = client, answers
        self.asked: list[str] = []

    def run(self, cell: Any) -> str:
        """The text that a cell printed."""
        cell.outputs = []

        def shown(message: dict[str, Any]) -> None:
            if message["msg_type"] in ("stream", "display_data", "execute_result", "error"):
                cell.outputs.append(output_from_msg(message))

        def asked(message: dict[str, Any]) -> None:
            prompt = message["content"]["prompt"]
            self.asked.append(prompt)
            self._client.input(self._answers.get(prompt, ""))

        self._client.execute_interactive(
            cell.source, allow_stdin=True, output_hook=shown, stdin_hook=asked, timeout=_PATIENCE
        )
        assert not [one for one in cell.outputs if one.output_type == "error"], cell.outputs
        return "".join(one.text for one in cell.outputs if one.output_type == "stream")


def test_the_notebook_commissions_a_bench_from_top_to_bottom(notebook, kernel, tmp_path):
    book = nbformat.read(notebook, as_version=4)
    nbformat.validate(book)
    reader = Reader(kernel, {"yes or no? ": "yes"})
    reader.run(new_code_cell(LABORATORY))
    said = {}
    for cell in book.cells:
        if cell.cell_type == "code":
            cell.source = cell.source.replace('"quanser:q2_usb/0"', repr(SIMULATOR))
            said[cell.id] = reader.run(cell)
    assert "warn commissioned" in said["doctor"] and "fail" not in said["doctor"]
    assert reader.asked.count("Then press Enter. ") == 4 and reader.asked.count("yes or no? ") == 2
    assert "Turn the servo with the arm on it COUNTER-CLOCKWISE" in said["commission"]
    assert "Motor: -1." in said["commission"] and "The link swings at" in said["commission"]
    assert "counts_per_turn         4096" in said["found"] and "motor_sign              -1" in said["found"]
    told = bench_file.load(tmp_path / "bench.toml")
    assert [told.wiring[name] for name in ("motor_sign", "servo_sign", "link_sign")] == [-1, 1, 1]
    assert told.setup().commissioned() is None
    assert Recording.load(tmp_path / "sweep.mat").metadata["experiment"] == "sweep"


def test_a_notebook_that_is_there_is_not_written_over(notebook):
    notebook.write_text("mine")
    done = CliRunner().invoke(app, ["bench", "notebook"])
    assert done.exit_code == 2 and "commissioning.ipynb is there already: name another --out" in done.output
    assert notebook.read_text() == "mine"

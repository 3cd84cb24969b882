"""The course in a browser, as a student meets it there: a site of a release, and a tab of JupyterLite."""

import contextlib
import json
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import browser
import pyodide_files
from checkout import ROOT
from honest_hand_in import solved_notebooks
from playwright.sync_api import BrowserContext, Page

from labcourse.grading import course
from labcourse.grading.release import lite

_IDLE = "() => window.jupyterapp?.shell.currentWidget?.sessionContext?.session?.kernel?.status === 'idle'"
_RUN = """async (code) => {
    const { kernel } = window.jupyterapp.shell.currentWidget.sessionContext.session;
    const future = kernel.requestExecute({ code });
    const said = [];
    future.onIOPub = ({ content }) => said.push(content.text ?? content.evalue ?? "");
    await future.done;
    return said.join("");
}"""
_FILL = """(sources) => {
    for (const { model } of window.jupyterapp.shell.currentWidget.content.widgets) {
        if (model.id in sources) model.sharedModel.setSource(sources[model.id]);
    }
}"""
_OPEN = """async (path) => {
    const { commands, shell } = window.jupyterapp;
    const panel = await commands.execute("docmanager:open", { path, factory: "Notebook" });
    await panel.context.ready;
    shell.activateById(panel.id);
}"""
_SHOWN = ".jp-NotebookPanel:not(.lm-mod-hidden)"
_OUTPUTS = """() => [...window.jupyterapp.shell.currentWidget.content.widgets]
    .filter(({ model }) => model.type === "code")
    .map(({ model }) => [model.id, JSON.stringify(model.outputs.toJSON())])"""


def site(folder: Path) -> Path:
    """Make the site in a folder that is not there yet, of a copy of the course; tests see its application."""
    copy = folder.with_name("course")
    ignored = shutil.ignore_patterns(".*", "build", "tests", "__pycache__", "releases")
    shutil.copytree(ROOT, copy, ignore=ignored)
    lite.make(course.find(copy / "solutions"), folder, str(pyodide_files.folder()))
    settings = json.loads((folder / "jupyter-lite.json").read_text(encoding="utf-8"))
    settings["jupyter-config-data"]["exposeAppInBrowser"] = True
    (folder / "jupyter-lite.json").write_text(json.dumps(settings), encoding="utf-8")
    return folder


class Tab:
    """A tab with the course in it.

    Attributes
    ----------
    page : playwright's
    errors : what was thrown and not caught in the page
    """

    def __init__(self, context: BrowserContext, address: str) -> None:
        self.page: Page = context.new_page()
        self.page.set_default_timeout(60_000)
        self.errors: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.goto(f"{address}lab/index.html?path=notebooks/00_start.ipynb")

    def name(self, student: str) -> None:
        """Say who works here, as the page asks."""
        field = self.page.locator(".jp-Dialog input")
        field.fill(student)
        self.page.locator(".jp-Dialog .jp-mod-accept").click()

    def ready(self) -> None:
        """Wait until a notebook is open, and its kernel waits for cells."""
        self.page.wait_for_function(_IDLE)

    def command(self, name: str) -> None:
        """Have JupyterLab do something, and wait until it is done."""
        self.page.evaluate("(name) => window.jupyterapp.commands.execute(name).then(() => 1)", name)

    def open(self, notebook: str, sources: Mapping[str, str]) -> None:
        """Open a notebook, end the kernel of the one before, and write other sources into some cells."""
        if notebook not in str(self.page.evaluate("() => window.jupyterapp.shell.currentWidget.context?.path")):
            self.page.evaluate("() => window.jupyterapp.shell.currentWidget.sessionContext.shutdown()")
            self.page.evaluate(_OPEN, f"notebooks/{notebook}")
        self.ready()
        self.page.evaluate(_FILL, dict(sources))

    def run_all(self) -> dict[str, str]:
        """Run all cells, save, and return what each code cell shows: its id → outputs, as JSON."""
        self.command("notebook:run-all-cells")
        self.command("docmanager:save")
        return dict(self.page.evaluate(_OUTPUTS))

    def run(self, code: str) -> str:
        """Run code in the notebook's kernel, and return what it prints, or why it stopped."""
        return str(self.page.evaluate(_RUN, code))

    def bar(self) -> Any:
        """The course bar, which is at the top."""
        self.page.evaluate(f"() => {{ document.querySelector('{_SHOWN} .jp-WindowedPanel-outer').scrollTop = 0; }}")
        return self.page.locator(f"{_SHOWN} .labcourse-bar").first

    def press(self, button: str, until: str) -> str:
        """Press a button of the bar, wait until what it shows matches a pattern, and return that."""
        self.bar().get_by_role("button", name=button, exact=True).click()
        pane = f"{_SHOWN} .labcourse-bar .pane"
        shown = self.page.locator(pane).first
        test = f"(words) => new RegExp(words).test(document.querySelector('{pane}').textContent)"
        self.page.wait_for_function(test, arg=until)
        return str(shown.text_content())


@contextlib.contextmanager
def profile(address: str) -> Iterator[tuple[BrowserContext, Tab]]:
    """Open the course in a fresh profile, until the block ends."""
    context = browser.chromium().new_context(viewport={"width": 1280, "height": 900}, accept_downloads=True)
    try:
        yield context, Tab(context, address)
    finally:
        context.close()


def solved(*numbers: str) -> dict[str, dict[str, str]]:
    """The solutions' answers: notebook → cell → source."""
    return {
        name: {cell["id"]: "".join(cell["source"]) for cell in notebook["cells"] if _is_answer(cell)}
        for name, notebook in solved_notebooks(ROOT).items()
        if name[:2] in numbers
    }


def _is_answer(cell: Mapping[str, Any]) -> bool:
    return bool(cell["metadata"].get("nbgrader", {}).get("solution"))


def not_there(outputs: Mapping[str, str]) -> dict[str, str]:
    """Of what cells show, that which is not as it should be."""
    bad = re.compile(r'"output_type": ?"error"|not answered yet|not recorded')
    return {cell: shown[:400] for cell, shown in outputs.items() if bad.search(shown)}

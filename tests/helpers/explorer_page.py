"""An explorer's page without JupyterLab: the scripts and the style sheet, in an empty page of headless Chromium."""

import contextlib
from collections.abc import Iterator
from typing import Any

import browser
import numpy as np
from checkout import ROOT

from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Scene

_SHOW = """async ([module, style, scene, data, width]) => {
    const { render } = await import(URL.createObjectURL(new Blob([module], { type: 'text/javascript' })));
    window.values = { scene, data: new DataView(Float32Array.from(data).buffer) };
    window.told = [];
    window.heard = {};
    const sheet = document.createElement('style');
    sheet.textContent = style;
    const el = document.createElement('div');
    el.style.width = width + 'px';
    document.body.style.margin = 0;
    document.body.replaceChildren(sheet, el);
    const model = { get: (name) => values[name], on: (what, call) => { heard[what] = call; }, off() {},
        send: (event) => told.push(event) };
    render({ model, el });
    await new Promise((done) => document.querySelector('.labcourse-explorer').addEventListener('painted', done));
}"""
_UPDATE = """async ([scene, data]) => {
    window.values = { ...window.values, scene, data: new DataView(Float32Array.from(data).buffer) };
    heard['change:scene']();
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
}"""


@contextlib.contextmanager
def opened() -> Iterator[Any]:
    """An empty page, until the block ends."""
    page = browser.chromium().new_page(viewport={"width": 1280, "height": 720})
    yield page
    page.close()


def show(page: Any, scene: Scene, width: int = 836) -> None:
    """Show a scene, so many px wide. What the page tells Python is then in ``window.told``."""
    style = (ROOT / "labcourse" / "scene" / "explorer.css").read_text(encoding="utf-8")
    page.evaluate(_SHOW, [Explorer._esm, style, *_sent(scene, {}), width])


def update(page: Any, scene: Scene, **more: Any) -> None:
    """Show another scene in its place; ``more`` is what else an explorer puts into it: notice, version, answered."""
    page.evaluate(_UPDATE, list(_sent(scene, more)))


def _sent(scene: Scene, more: dict[str, Any]) -> tuple[dict[str, Any], list[float]]:
    fixed, data = scene.packed()
    about = {"notice": {"kind": "info", "text": ""}, "version": 1, "answered": {}}
    return fixed | about | more, np.frombuffer(data, np.float32).tolist()

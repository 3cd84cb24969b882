"""What a browser's page needs: a bench, a run, a pulled arm and dragged poles, without what a notebook has besides."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import asyncio, sys

class Blocked:
    names = {"control", "sympy", "tqdm", "matplotlib", "PIL", "IPython", "ipywidgets", "traitlets", "anywidget"}
    names |= {"pydantic"}

    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in self.names or name in ("scipy.signal", "scipy.special", "scipy.optimize"):
            raise ImportError(f"{name} is not here")

sys.meta_path.insert(0, Blocked())
from types import SimpleNamespace
from rotflex import experiments, hil
from rotflex.widgets import another_arm
from rotflex.widgets.console import BenchConsole
from rotflex.widgets.poles import OtherPoles, PoleExplorer

bench = lambda address="virtual": hil.open(address, seed=5)
with bench() as opened:
    alone = experiments.free_decay(opened, progress=False)
for kind in (PoleExplorer, OtherPoles):
    told, explorer = [], kind(*another_arm.model())
    explorer.tell = lambda scene, data: told.append((scene, data))
    for event in ({"kind": "moved", "name": "p3", "x": -50.0, "y": 0.0}, {"kind": "set", "name": "zeta", "value": 0.7}):
        explorer.hear(event)
    if kind is PoleExplorer:
        explorer.hear({"kind": "set", "name": "beside", "value": "cloud"})
    assert explorer.wanted.p3 == -50.0 and len(told) >= 2 and len(told[-1][1]) > 10_000
    assert not [scene for scene, _data in told if scene["notice"]["text"]]

async def watched():
    console = BenchConsole(SimpleNamespace(address="virtual", bench=bench))
    pull = {"kind": "grab", "name": "arm", "x": -0.6, "y": 0.6}
    console.hear({**pull, "begins": True})
    while not console.running or abs(console._run.samples()[2]).max(initial=0) < 0.1:
        console.hear(pull)
        await asyncio.sleep(0.02)
    console.hear({"kind": "press", "name": "stop"})
    await asyncio.wait_for(console._task, 60)
    assert console.scene["notice"]["text"].startswith("You stopped it.")
    console.set("experiment", "free decay")
    console.start()
    console.stop()
    await asyncio.wait_for(console._task, 60)
    console.close()

asyncio.run(watched())
console = BenchConsole(SimpleNamespace(address="virtual", bench=bench), experiment="free decay")
console.hear({"kind": "press", "name": "start"})
assert (console.recording["alpha"] == alone["alpha"]).all()
print("done")
"""


def test_a_page_without_jupyter_needs_numpy_and_scipys_linear_algebra_alone():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("done\n", "")

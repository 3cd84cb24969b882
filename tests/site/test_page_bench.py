"""What the worker of the page "Try it" runs, on the computer's Python."""

import asyncio
import importlib.util
import json

from checkout import ROOT

PATH = ROOT / "tools" / "website" / "page" / "bench.py"


def page(show):
    spec = importlib.util.spec_from_file_location("bench_of_the_page", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Page(show)


def names(scene):
    return [one["name"] for row in scene["controls"] for one in row]


def test_an_id_opens_bench_and_poles_and_events_change_what_is_shown():
    shown = {}

    async def visit():
        opened = page(lambda name, scene, data: shown.__setitem__(name, (json.loads(scene), data)))
        assert "a/b" in await opened.open("a/b") and not shown
        assert await opened.open("ada") == "" and opened.pulls
        before = shown["poles"][0]
        opened.receive("poles", json.dumps({"kind": "moved", "name": "p3", "x": -60.0, "y": 0.0, "n": 1}))
        opened.receive("bench", json.dumps({"kind": "set", "name": "experiment", "value": "sweep", "n": 1}))
        await asyncio.sleep(0)
        return before

    before = asyncio.run(visit())
    assert shown["poles"][0]["alt"] != before["alt"] and shown["poles"][0]["answered"]["n"] == 1
    bench = shown["bench"][0]
    assert bench["controls"][0][0]["value"] == "sweep"
    assert names(bench) == ["experiment", "start", "stop"]  # nothing is saved
    assert bench["columns"][0]["panels"][0]["grabs"]
    assert [one["title"] for one in shown["poles"][0]["readouts"]] == ["Specifications"]

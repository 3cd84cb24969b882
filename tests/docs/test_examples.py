"""The documentation: links lead somewhere, Python runs, commands and their options exist.

The ``python`` fences of a page are run one after the other, as in one session, in an empty folder. One that cannot
stand alone has its reason in the line before, ``<!-- not run: … -->``. One that needs a package which is not always
there names it, ``<!-- needs slycot: … -->``; without it, the page's test is skipped in the end, with this reason. What
a page takes as given is prepared here.
What stands in a ``text`` fence after ``<!-- printed -->`` is what the Python before it prints.
"""

import functools
import importlib.util
import re
import shlex
import sys
import types
from pathlib import Path

import numpy as np
import pytest
import typer.main
from checkout import ROOT
from traitlets.config import Config

from rotflex import cli, experiments, greybox, hil
from rotflex.course import spare_design

ELSEWHERE = ROOT / "docs" / "new_course.md"  # what it says is done in test_new_course_page.py
#: Pages that fit many parameters, which takes half a minute.
FITTED = {ROOT / "docs" / "own_bench.md", ROOT / "docs" / "reference" / "identification.md"}
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^(?P<margin> *)```(?P<language>\w+)\n(?P<code>.*?)^(?P=margin)```$", re.MULTILINE | re.DOTALL)
NOT_RUN = re.compile(r"<!-- not run: (.+?) -->\s*$")
NEEDS = re.compile(r"<!-- needs (\w+): .+? -->\s*$")
PRINTED = re.compile(r"\s*<!-- printed -->\s*```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)


LACKING = " is not installed"


def fences(path, *languages):
    """(line, code, why it is not run) of each fence in one of these languages."""
    text = path.read_text(encoding="utf-8")
    for found in FENCE.finditer(text):
        if found["language"] in languages:
            margin = len(found["margin"])
            code = "\n".join(line[margin:] for line in found["code"].split("\n"))
            before = text[: found.start()]
            reason, needed = NOT_RUN.search(before), NEEDS.search(before)
            lacks = f"{needed[1]}{LACKING}" if needed and importlib.util.find_spec(needed[1]) is None else ""
            yield text.count("\n", 0, found.start()) + 2, code, reason[1] if reason else lacks


def printed(path):
    """Last line of a Python fence → what the page says that it prints."""
    text = path.read_text(encoding="utf-8")
    return {
        text.count("\n", 0, found.end()): said[1]
        for found in FENCE.finditer(text)
        if found["language"] == "python" and (said := PRINTED.match(text, found.end()))
    }


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def own_bench(monkeypatch):
    """Four logs of one bench, the first of them of the run that the page replays; of each, three seconds are fitted."""
    monkeypatch.setattr(greybox, "fit", functools.partial(of_three_seconds, greybox.fit))
    gain = spare_design.SPARE_GAIN
    for run, name in enumerate(("first", "second", "third", "fourth"), start=1):
        with hil.open(f"virtual:?seed=7&run={run}") as bench:
            experiments.tracking(bench, gain, frequency=0.25, progress=False).save(f"{name}.mat")
    A, B = any_model()
    return {"K": gain, "A": A, "B": B}


def of_three_seconds(fit, logs, *arguments, **options):
    """A fit of the first seconds of each log: all of them would take minutes."""
    return fit([log.between(0, 3.1) for log in logs], *arguments, **options)


def any_model():
    """Any stable model with the states of the bench and its voltage as input."""
    return np.diag([-1.0, -1.0, -2.0, -2.0]), np.ones((4, 1))


def bench_tutorial(_monkeypatch):
    """The twin as the page has it, and the run of it and of its bench that the page records by commands."""
    page = ROOT / "docs" / "tutorials" / "own_bench.md"
    ((_line, twin, _reason),) = fences(page, "toml")
    Path("twin.toml").write_text(twin, encoding="utf-8")
    gain = [float(value) for value in re.search(r'--gain "(.+?)"', page.read_text(encoding="utf-8"))[1].split(",")]
    for address, name in (("virtual:?seed=7", "fsf"), ("virtual:twin.toml", "twin")):
        with hil.open(address) as bench:
            experiments.tracking(bench, gain, progress=False).save(f"{name}.mat")
    return {}


def hub_settings(_monkeypatch):
    """The object that a hub's file of settings finds under this name."""
    return {"c": Config()}


PREPARED = {
    "docs/jupyterhub.md": hub_settings,
    "docs/own_bench.md": own_bench,
    "docs/tutorials/own_bench.md": bench_tutorial,
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=name_of(path), marks=pytest.mark.scheduled if path in FITTED else ())
        for path in PAGES
        if path != ELSEWHERE and any(not reason for *_code, reason in fences(path, "python"))
    ],
)
def test_python_runs(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TQDM_DISABLE", "1")
    module = types.ModuleType("example")
    monkeypatch.setitem(sys.modules, "example", module)  # where dataclasses look for the module of a class
    names = module.__dict__
    names.update(PREPARED.get(name_of(path), lambda _monkeypatch: {})(monkeypatch))
    said = printed(path)
    for line, code, reason in fences(path, "python"):
        if not reason:
            capsys.readouterr()
            exec(compile("\n" * (line - 1) + code, str(path), "exec"), names)
            out = capsys.readouterr().out
            assert out == said.pop(line + code.count("\n") - 1, out), f"line {line}"
    assert not said
    if lacking := [f"line {line}: {why}" for line, _code, why in fences(path, "python") if why.endswith(LACKING)]:
        pytest.skip("All else ran. " + ", ".join(lacking))


def commands(path):
    """Every command of a page, in lines of shell and in the text."""
    text = path.read_text(encoding="utf-8")
    lines = [line for _line, code, _reason in fences(path, "sh", "console", "bash") for line in code.split("\n")]
    lines += [line for line in text.split("\n") if line.startswith("    ")]  # the other way to write code
    for line in lines:
        if found := re.match(r" *(?:\$ )?((?:rotflex|labcourse) [a-z].*)$", line):
            yield re.split(r" +#", found[1])[0]
    yield from re.findall(r"(?<!`)`((?:rotflex|labcourse) [a-z][^`\n]*)`(?!`)", text)


APP = typer.main.get_command(cli.app)


def unknown(line):
    """Commands and options of a line that there are not."""
    words = shlex.split(line)[1:]
    words = words[: words.index("--")] if "--" in words else words  # what follows is another program's
    command = APP
    while hasattr(command, "commands") and words and not words[0].startswith(("-", "…")):
        if words[0] not in command.commands:
            return words[:1]
        command, words = command.commands[words[0]], words[1:]
    known = {option for one in command.params for option in (*one.opts, *one.secondary_opts)} | {"--help"}
    return [word for word in words if word.startswith("--") and word.partition("=")[0] not in known]


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_links_lead_to_a_file_and_a_heading(path):
    text = FENCE.sub("", path.read_text(encoding="utf-8"))
    for link in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]+`", "", text)):
        if not re.match(r"[a-z]+:", link):
            name, _, heading = link.partition("#")
            target = (path.parent / name).resolve() if name else path
            assert target.exists(), link
            if heading:
                headings = re.findall(r"^#+ (.+)$", target.read_text(encoding="utf-8"), re.MULTILINE)
                anchors = {re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in headings}
                assert heading in anchors, link


def test_each_file_of_the_table_where_a_change_goes_is_there():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = page.partition("## Where a change goes")[2].partition("\n## ")[0]
    named = re.findall(r"`([\w./*]+/[\w./*]*)`", table)
    assert len(named) > 9 and [one for one in named if not any(ROOT.glob(one.rstrip("/")))] == []


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_commands_and_their_options_exist(path):
    found = {line: unknown(line) for line in commands(path)}
    assert [line for line, words in found.items() if words] == []

"""A class that solved this course honestly, each in a way of their own, and some who copied: what they hand in.

Nothing is run. Each answer cell is the solution's or one of the honest ways' (``honest_class.py``, the whole class's
other forms), plots are drawn as people draw them, and then names, comments and lay-out are varied.
"""

from __future__ import annotations

import builtins
import copy
import functools
import io
import json
import keyword
import random
import re
import tempfile
import tokenize
from collections.abc import Iterable
from pathlib import Path

from checkout import ROOT
from honest_class import RIGHT
from honest_hand_in import Notebook, is_answer, solved_notebooks, text_of, written
from simulated_class import BY_OTHER_MEANS
from whole_class_notebooks import BY_OTHER_FORMS

Files = dict[str, bytes]
#: Answer cells with a plot: what it is of, the experiment, and name of the figure.
_PLOTS = {
    "q2-9": ("sweep", "with lab.bench() as {b}:\n    sweep = experiments.sweep({b})", "figure_sweep"),
    "q3-11": (
        "simulated",
        "simulated = simulation.closed_loop(A, B, K, reference, saturation=None)",
        "figure_simulated",
    ),
    "q3-13": ("measured", "with lab.bench() as {b}:\n    measured = experiments.tracking({b}, K)", "figure_measured"),
    "q3-15": (
        "partial",
        "with lab.bench() as {b}:\n    partial = experiments.tracking({b}, K, feedback='partial')",
        "figure_partial",
    ),
}
_LONG = 150  # characters: two or three lines, that two people may well write alike
_NAMES = [
    "w",
    "tmp",
    "res",
    "val",
    "my_x",
    "out",
    "found",
    "part",
    "q1",
    "zz",
    "data_",
    "hilf",
    "wert",
    "erg",
    "calc",
    "foo",
    "item",
    "aux",
    "h1",
    "nn",
]
_COMMENTS = ("# as in the lecture", "# TODO check", "# ok", "# see above", "# plot", "# done", "# by hand")


@functools.cache
def _solved() -> dict[str, Notebook]:
    return solved_notebooks(ROOT)


@functools.cache
def other_ways() -> dict[str, list[str]]:
    """Answer cell's id → what honest students wrote there, each once."""
    found: dict[str, dict[str, None]] = {}
    for way in RIGHT:
        with tempfile.TemporaryDirectory() as folder:
            way.build(Path(folder), _solved())
            for path in Path(folder).rglob("*.ipynb"):
                try:
                    cells = json.loads(path.read_bytes())["cells"]
                except (ValueError, KeyError):
                    continue
                for cell in cells:
                    if cell["cell_type"] == "code" and "metadata" in cell and is_answer(cell):
                        found.setdefault(cell.get("id", ""), {})[text_of(cell)] = None
    for writes in (BY_OTHER_MEANS, BY_OTHER_FORMS):
        for cell, text in writes.items():
            found.setdefault(cell, {})[text] = None
    return {cell: list(texts) for cell, texts in found.items()}


def _plot(cell: str, rng: random.Random) -> str:
    """A plot as somebody draws it."""
    of, experiment, figure = _PLOTS[cell]
    channels = ["alpha"] if cell == "q2-9" else ["theta", "alpha", "vm"]
    size = f"figsize=({rng.choice([6, 7, 8, 9, 10, 12])}, {rng.choice([3, 4, 5, 6, 7, 8])})"
    names = {
        "theta": ["servo angle", r"$\theta$", "theta", "angle of the servo"],
        "alpha": ["deflection", r"$\alpha$", "alpha", "angle of the link"],
        "vm": ["voltage", "V_m", "motor voltage", "$V_m$"],
    }
    units = {"theta": "deg", "alpha": "deg", "vm": "V"}
    values = {name: f'{of}.degrees("{name}")' if name != "vm" else f'{of}["vm"]' for name in channels}
    lines = [experiment.format(b=rng.choice(["b", "bench", "on_the_bench", "rig", "setup_"])), ""]
    brackets = rng.choice(["({})", "[{}]", "in {}"])
    label = {name: f"{rng.choice(names[name])} {brackets.format(units[name])}" for name in channels}
    time = f"{rng.choice(['time', 't', 'Time', 'time t'])} {brackets.format('s')}"
    look = {
        name: rng.choice(
            ["", ', "r"', ', "b-"', ', color="C1"', ", lw=1", ", linewidth=0.7", ', color="black"', ", '.-'"]
        )
        for name in channels
    }
    style = rng.choice(["axes", "axes", "pyplot", "loop"])
    if style == "loop" and len(channels) > 1:
        lines += [
            f"{figure}, axs = plt.subplots({len(channels)}, 1, sharex=True, {size})",
            f"for ax, (y, name) in zip(axs, [{', '.join(f'({values[n]}, {label[n]!r})' for n in channels)}]):",
            f"    ax.plot({of}.time, y)",
            "    ax.set_ylabel(name)",
            *(["    ax.grid()"] if rng.random() < 0.5 else []),
        ]
        lines += [f"axs[-1].set_xlabel({time!r})"]
    elif style == "pyplot":
        lines += [f"{figure} = plt.figure({size})"]
        for number, name in enumerate(channels, start=1):
            lines += [f"plt.subplot({len(channels)}, 1, {number})"] if len(channels) > 1 else []
            body = [f"plt.plot({of}.time, {values[name]}{look[name]})", f"plt.ylabel({label[name]!r})"]
            body += ["plt.grid(True)"] if rng.random() < 0.6 else []
            lines += body
        lines += [f"plt.xlabel({time!r})", *(["plt.tight_layout()"] if rng.random() < 0.5 else [])]
    else:
        axes = (
            ["ax"]
            if len(channels) == 1
            else rng.choice([["ax1", "ax2", "ax3"], ["top", "mid", "low"], ["a", "b_", "c"]])
        )
        left = axes[0] if len(axes) == 1 else f"({', '.join(axes)})"
        lines += [f"{figure}, {left} = plt.subplots({len(channels)}, 1, {size}{rng.choice(['', ', sharex=True'])})"]
        for ax, name in zip(axes, channels, strict=True):
            lines += [f"{ax}.plot({of}.time, {values[name]}{look[name]})", f"{ax}.set_ylabel({label[name]!r})"]
            lines += [f"{ax}.grid({rng.choice(['', 'True', 'alpha=0.3'])})"] if rng.random() < 0.6 else []
            lines += (
                [f"{ax}.set_title({rng.choice(['Response', 'Result', 'Bench', 'Test', 'My run'])!r})"]
                if rng.random() < 0.2
                else []
            )
        lines += [f"{axes[-1]}.set_xlabel({time!r})"]
    return "\n".join(lines)


def honest_class(size: int, seed: int = 0, solution: float = 0.5) -> dict[str, Files]:
    """What an honest class hands in. What is long is in one person's words: only one of the class writes it so.

    Parameters
    ----------
    size : students
    seed : another class
    solution : share of the answers that are written as the solution has it
    """
    taken: set[str] = set()
    return {name: _honest(random.Random(name), taken, solution) for name in (f"s{seed}-{n:02}" for n in range(size))}


def _honest(rng: random.Random, taken: set[str], solution: float) -> Files:
    work = copy.deepcopy(_solved())
    for notebook in work.values():
        for cell in filter(is_answer, notebook["cells"]):
            if cell["cell_type"] != "code":
                continue
            text = text_of(cell)
            if cell["id"] in _PLOTS:
                text = _plot(cell["id"], rng)
            elif rng.random() > solution:
                other = rng.choice([one for one in other_ways()[cell["id"]] if one not in taken] or [text])
                taken |= {other} if len(other) > _LONG else set()
                text = other
            cell["source"] = laid_out(renamed(text, rng), rng)
    return {name: written(notebook) for name, notebook in work.items()}


def renamed(text: str, rng: random.Random, share: float = 0.5) -> str:
    """Local names changed, where the text can be read as Python and nothing else needs them."""
    try:
        tokens = list(tokenize.generate_tokens(io.StringIO(text).readline))
    except (tokenize.TokenError, SyntaxError):
        return text
    bound = re.findall(r"^\s*([a-z]\w*)(?:\s*,\s*[a-z]\w*)* = ", text, re.MULTILINE)
    local = [name for name in dict.fromkeys(bound) if len(name) > 2 and name not in _used_elsewhere()]
    new = {name: f"{rng.choice(_NAMES)}{rng.choice(['', '_', '2', '_a'])}" for name in local if rng.random() < share}
    changed, before = [], ""
    for token in tokens:
        word = token.string
        changed.append((token.type, new.get(word, word) if token.type == tokenize.NAME and before != "." else word))
        before = word
    lines = text.splitlines(keepends=True)
    for token, (_kind, word) in reversed(list(zip(tokens, changed, strict=True))):
        if word != token.string:
            (row, start), (_row, end) = token.start, token.end
            lines[row - 1] = lines[row - 1][:start] + word + lines[row - 1][end:]
    return "".join(lines)


@functools.cache
def _used_elsewhere() -> frozenset[str]:
    """Names in the course's own cells."""
    cells = [cell for notebook in _solved().values() for cell in notebook["cells"]]
    given = [text_of(cell) for cell in cells if cell["cell_type"] == "code" and not is_answer(cell)]
    presets = re.findall(r"^([\w, ]+) = None", "\n".join(text_of(cell) for cell in cells), re.MULTILINE)
    words = re.findall(r"[A-Za-z_]\w*", "\n".join([*given, *presets]))
    return frozenset({*words, *keyword.kwlist, *dir(builtins)})


def laid_out(text: str, rng: random.Random) -> str:
    """Other white space, quotes and comments."""
    lines = text.splitlines()
    for number in sorted(rng.sample(range(len(lines) + 1), min(len(lines) + 1, rng.randrange(3))), reverse=True):
        before = lines[number - 1].rstrip() if number else ""
        if not before.endswith(("\\", ",", "(", "[", ":")) and not any(one in text for one in ('"""', "'''")):
            lines.insert(number, rng.choice(["", rng.choice(_COMMENTS)]))
    joined = "\n".join(lines)
    if rng.random() < 0.3 and "'" not in joined and '"""' not in joined:
        joined = joined.replace('"', "'")
    return joined


def copied(
    student: str, mate: Files, own: Files, notebooks: Iterable[str] = (), cells: Iterable[str] = (), rename: float = 0.0
) -> Files:
    """What somebody hands in who took a class-mate's cells, and laid them out anew.

    Parameters
    ----------
    student : who copies
    mate, own : what the class-mate hands in, and what they would have handed in themselves
    notebooks, cells : which are taken: the beginnings of file names, ids of answer cells; all of a notebook without ids
    rename : share of local names that are changed
    """
    rng = random.Random(f"{student} copies")
    files = dict(own)
    for name in own:
        if not name.startswith(tuple(notebooks) or ("",)):
            continue
        theirs = {cell["id"]: text_of(cell) for cell in json.loads(mate[name])["cells"]}
        notebook = json.loads(own[name])
        for cell in notebook["cells"]:
            if is_answer(cell) and cell["cell_type"] == "code" and (not cells or cell["id"] in cells):
                cell["source"] = laid_out(renamed(theirs[cell["id"]], rng, rename), rng)
        files[name] = written(notebook)
    return files

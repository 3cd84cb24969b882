"""JSON files that were good, with any value in place of one node, or another key."""

import copy
import json

from hypothesis import strategies as st

#: An ``answers.json`` and a ``course.json`` with all that may stand there.
_NUMBER = {"kind": "number", "value": 20.0}
ANSWERS = {"format": 2, "student": "ada", "bench": {"draw": 1}, "software": "rotflex", "probe_seed": 1}
ANSWERS |= {"answers": {"2.11": {"omega_n": _NUMBER}}, "cells": {"2.11": {"omega_n": "q1-answer"}}}
ANSWERS |= {"when": {"2.11": {"omega_n": 1}}}
ANSWERS |= {"predictions": {"2.9": {"said": {"time_of_largest_swing": _NUMBER}, "why": "so"}}}
COURSE = {"student": "ada", "with": ["bob"], "release": "r1", "draw": 2, "title": "Laboratory", "page_limit": 20}
COURSE |= {"reflect": "2026-12-01", "bench": {"which": "own", "seed": 1, "benches": ["a"]}}

_ODD = [None, True, 5, -1, 0.5, 10**30, float("inf"), "", "x", "\ud800", [], {}, ["a", 1], [None], {"a": 1}, "é"]
_KEYS = ["", "source", "cells", "id", "é", "\ud800"]
_DEEP = [b"[" * depth + b"]" * depth for depth in (90, 300, 900, 2_000)]
_VALUES = st.sampled_from(_ODD) | st.recursive(
    st.sampled_from(_ODD) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
_HERE = "what stands here is replaced"


def _places(value, path=()):
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from _places(inner, (*path, key))


@st.composite
def damaged(draw, good):
    """Return a JSON file's bytes: `good` with one node replaced, or one key renamed."""
    whole = [copy.deepcopy(good)]
    *above, key = draw(st.sampled_from([path for path in _places(whole) if path]))
    parent = whole
    for step in above:
        parent = parent[step]
    how = draw(st.integers(0, 9))
    if how == 0 and isinstance(parent, dict):
        parent[draw(st.sampled_from(_KEYS))] = parent.pop(key)
    else:
        parent[key] = _HERE if how == 1 else draw(_VALUES)
    return json.dumps(whole[0]).encode().replace(json.dumps(_HERE).encode(), draw(st.sampled_from(_DEEP)))


def one_damaged(name, notebook):
    """Return one of the files of a hand-in, damaged: its name and its bytes."""
    good = {name: notebook, "answers.json": ANSWERS, "course.json": COURSE}
    return st.one_of([st.tuples(st.just(one), damaged(content)) for one, content in good.items()])

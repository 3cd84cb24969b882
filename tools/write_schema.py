"""Write the JSON Schema of ``answers.json`` and of the reports on cells to ``docs/reference/answers.schema.json``.

    python tools/write_schema.py

``tests/docs/test_schema.py`` compares the file with the models of :mod:`labcourse.answers.schema`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from labcourse.answers import expressions, schema

PATH = Path(__file__).resolve().parents[1] / "docs" / "reference" / "answers.schema.json"
_NUMBER, _INTEGER = {"type": "number"}, {"type": "integer"}
_LEAVES = {
    "symbol": [{"type": "string", "pattern": f"^{expressions.NAME.pattern}$"}],
    "int": [_INTEGER],
    "rational": [_INTEGER, _INTEGER],
    "float": [_NUMBER],
    "pi": [],
}


def _tree() -> dict[str, Any]:
    """Return the schema of a tree: a list of its kind and its arguments."""
    choices = []
    for kind, (fewest, most) in expressions.ARGUMENTS.items():
        items = _LEAVES.get(kind)
        inside: dict[str, Any] = {"items": {"$ref": "#/$defs/Tree"}} if items is None else {"items": False}
        first = [{"const": kind}, *(items or [])]
        choices.append({"type": "array", "prefixItems": first, **inside, "minItems": fewest + 1, "maxItems": most + 1})
    about = (
        f"At most {expressions.MAX_DEPTH} levels and {expressions.MAX_NODES} nodes; the exponent of a power is a "
        f"number of at most {expressions.MAX_EXPONENT}."
    )
    return {"description": about, "oneOf": choices}


def _with_trees(value: Any) -> Any:
    """Return a schema with a reference to that of a tree in place of each list of the format "tree"."""
    if isinstance(value, dict):
        if value.get("format") == "tree":
            return {"$ref": "#/$defs/Tree"}
        return {
            name: _with_trees(inner)
            for name, inner in value.items()
            # Of what means the same, versions of pydantic write more or less.
            if (name != "enum" or "const" not in value) and (name, inner) != ("additionalProperties", True)
        }
    return [_with_trees(inner) for inner in value] if isinstance(value, list) else value


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of the file; a line of the reports on cells is in ``$defs``, as ``Event``."""
    inputs: list[Any] = [("file", "validation", schema.ANSWERS_ADAPTER), ("event", "validation", schema.EVENT)]
    places, content = TypeAdapter.json_schemas(inputs)
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "answers.json",
        **places["file", "validation"],
        "$defs": {**content["$defs"], "Event": places["event", "validation"]},
    }
    whole = _with_trees(whole)
    whole["$defs"]["Tree"] = _tree()
    return whole


def text() -> str:
    """Return the file's content."""
    return json.dumps(json_schema(), indent=2, sort_keys=True, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    PATH.write_text(text(), encoding="utf-8")

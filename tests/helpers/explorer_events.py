"""What a reader does with an explorer, and what they find in its scene, without a page."""

from typing import Any


def readout(explorer: Any, title: str) -> dict[str, Any]:
    """The readout with a title."""
    return next(one for one in explorer.scene["readouts"] if one["title"] == title)


def control(explorer: Any, name: str) -> dict[str, Any]:
    """The control of a name."""
    return next(one for row in explorer.scene["controls"] for one in row if one["name"] == name)


def press(explorer: Any, name: str) -> None:
    """Press a button."""
    explorer.receive({"kind": "press", "name": name, "view": "page", "n": 1})


def change(explorer: Any, name: str, value: Any) -> None:
    """Move a slider, or choose."""
    explorer.receive({"kind": "set", "name": name, "value": value, "view": "page", "n": 2})


def notice(explorer: Any) -> str:
    """What it says at its head."""
    return explorer.scene["notice"]

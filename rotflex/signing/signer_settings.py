"""What the signing program is told: a TOML file that only its own user has to be able to write."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotflex.courseware.messages import _
from rotflex.errors import ConfigurationError

_ENTRIES: dict[str, type] = {"bench": str, "key": str, "journal": str, "real_time": bool}
_EXAMPLE = 'bench = "north", key = "north.key", journal = "north.jsonl"'


@dataclass(frozen=True)
class SignerSettings:
    """What the signing program is told.

    Attributes
    ----------
    bench : name of the bench, as the course's settings have it
    key : file of the private key
    journal : file with a line for each signature
    real_time : refuse more seconds of recordings than have passed; false is for simulated benches
    """

    bench: str
    key: Path
    journal: Path
    real_time: bool = True


def read(file: Path) -> SignerSettings:
    """The settings in a file; paths in it are from its folder.

    Raises
    ------
    ConfigurationError
        If it cannot be read or understood.
    """
    try:
        content: dict[str, Any] = tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise ConfigurationError(_("{file} cannot be read: {error}").format(file=file, error=error)) from None
    for name, value in content.items():
        if not isinstance(value, _ENTRIES.get(name, ())):
            raise ConfigurationError(
                _("{file}: {name} = {value!a:.60} is not understood. There are {known}, as in: {example}").format(
                    file=file, name=name, value=value, known=", ".join(_ENTRIES), example=_EXAMPLE
                )
            )
    missing = [name for name in ("bench", "key", "journal") if not content.get(name)]
    if missing:
        raise ConfigurationError(
            _("{file} does not say {name}, as in: {example}").format(file=file, name=missing[0], example=_EXAMPLE)
        )
    places = {name: file.parent / content[name] for name in ("key", "journal")}
    return SignerSettings(content["bench"], real_time=content.get("real_time", True), **places)

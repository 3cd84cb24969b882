"""What recordings have to be, for a plant to be fitted to them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rotflex import unanswered
from rotflex.errors import ConfigurationError, IdentificationError
from rotflex.recording import Recording


def late(every: list[Recording], paths: list[Path]) -> Iterator[str]:
    """What is to be said of recordings in which samples came late or never.

    Raises
    ------
    IdentificationError
        If too many did, or nothing moves in a recording.
    """
    from rotflex.channels import channel

    for path, recording in zip(paths, every, strict=True):
        try:
            channel(recording, "theta"), channel(recording, "alpha")
        except IdentificationError as error:
            raise IdentificationError(f"{path}: {error} Leave it out.") from None
        if words := unanswered.in_words(recording.metadata, len(recording)):
            if unanswered.too_many(recording.metadata, len(recording)):
                raise IdentificationError(f"{path}: {words} Record it again, or leave it out.")
            yield f"{path}: {words}"


def require_different(paths: list[Path]) -> None:
    """That no recording is given twice: it would count as two, and tell nothing more."""
    seen: dict[bytes, Path] = {}
    for path in paths:
        same = seen.setdefault(path.read_bytes(), path) if path.is_file() else path
        if same is not path:
            raise ConfigurationError(
                f"{path} is {same} once more: name recordings of different runs (of a virtual bench, with &run=2)."
            )


def names(paths: list[Path]) -> list[str]:
    """What recordings are called in a table: by their files, with the folders where two files have the same name."""
    short = [path.name for path in paths]
    return short if len({*short}) == len(short) else [str(path) for path in paths]


def recorded(every: list[Recording], paths: list[Path], name: str, default: Any) -> Any:
    """What all recordings say of their bench, or say nothing of."""
    said = {}
    for path, recording in zip(paths, every, strict=True):
        bench = recording.metadata.get("bench")
        if isinstance(bench, dict) and name in bench:
            said[path.name] = bench[name]
    if len(set(said.values())) > 1:
        listed = ", ".join(f"{path}: {value}" for path, value in said.items())
        raise ConfigurationError(
            f"The recordings are of benches that differ in {name} ({listed}): fit those of one bench."
        )
    return next(iter(said.values()), default)

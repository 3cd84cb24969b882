"""A laboratory with a bench, a key and a signing program, in a folder. Its bench is a virtual one of nobody's."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from rotflex.courseware import signed_files
from rotflex.hil.student_benches import VirtualPlantSpec, student_bench

SEED = 2**40 + 7  #: beyond those of students


@dataclass(frozen=True)
class Laboratory:
    """Attributes: the public key, the signer's settings, the seed of the bench, and what that is made of."""

    name: str
    public: str
    settings: Path
    seed: int
    plant: VirtualPlantSpec

    @property
    def command(self) -> list[str]:
        """That starts the signing program."""
        return [sys.executable, "-m", "rotflex.signing", "sign", str(self.settings)]


def laboratory(folder: Path, name: str = "north", seed: int = SEED, real_time: bool = False) -> Laboratory:
    """A laboratory in a folder."""
    private, public = signed_files.new_key()
    (folder / f"{name}.key").write_bytes(private)
    settings = folder / f"{name}.toml"
    settings.write_text(
        f'bench = "{name}"\nkey = "{name}.key"\njournal = "{name}.jsonl"\nreal_time = {str(real_time).lower()}\n',
        encoding="utf-8",
    )
    return Laboratory(name, public, settings, seed, student_bench(seed))

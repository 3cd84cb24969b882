"""Make docs/overview.png, the picture in the README: the bench from above, and a sweep on it."""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image

from rotflex import experiments, figures, hil

TARGET = Path(__file__).resolve().parents[1] / "docs" / "overview.png"


def main() -> None:
    """Draw both halves and put them side by side."""
    with hil.open("virtual:?seed=7&arm_position=1") as bench:
        sweep = experiments.sweep(bench)
    halves = []
    for picture in (figures.joint_angles(), figures.sweep_response(sweep)):
        stream = io.BytesIO()
        picture.savefig(stream, dpi=110, facecolor="white")
        halves.append(Image.open(stream).convert("RGB"))
    height = max(half.height for half in halves)
    sheet = Image.new("RGB", (sum(half.width for half in halves), height), "white")
    left = 0
    for half in halves:
        sheet.paste(half, (left, (height - half.height) // 2))
        left += half.width
    sheet.quantize(64).save(TARGET, optimize=True)


if __name__ == "__main__":
    main()

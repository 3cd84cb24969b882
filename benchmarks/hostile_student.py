"""What one student costs outside the sandbox, who reaches all limits of docs/handing_in.md at once.

    python benchmarks/hostile_student.py

The hand-in is read, stored, prepared for its run, and its texts are shown, as in grading. Nothing of it is run. Prints
the processor time of each step; at most 20 s are allowed, all together.
"""

from __future__ import annotations

import argparse
import base64
import io
import json
import os
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from classes import WHOLE, small_course
from PIL import Image

from labcourse.answers import notebooks, report_files, words
from labcourse.grading import course as courses
from labcourse.grading import intake
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.intake import archives, finding
from labcourse.grading.reports import markdown
from labcourse.grading.running.bundle import Bundles
from labcourse.grading.running.prepared import prepare, run_content, submission_digest

ALLOWED = 20  # s of processor time
NOISE = np.random.default_rng(1)
_Made = TypeVar("_Made")


class Clock:
    """Adds up the processor time of steps, and prints each."""

    def __init__(self) -> None:
        self.all = 0.0

    def step(self, name: str, act: Callable[[], _Made]) -> _Made:
        """Take a step."""
        begun = sum(os.times()[:4])
        made = act()
        seconds = sum(os.times()[:4]) - begun
        self.all += seconds
        print(f"{name:40} {seconds:6.1f} s", flush=True)
        return made


def zipped(files: dict[str, bytes]) -> bytes:
    """Pack a zip."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return packed.getvalue()


def tarred(kind: str, files: dict[str, bytes]) -> bytes:
    """Pack a tar, compressed in some way."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode=f"w:{kind}") as archive:
        for name, data in files.items():
            about = tarfile.TarInfo(name)
            about.size = len(data)
            archive.addfile(about, io.BytesIO(data))
    return packed.getvalue()


def picture() -> str:
    """A picture of noise, which is tried in all sizes before it is small enough."""
    packed = io.BytesIO()
    side = words.LONGEST_SIDE
    noise = NOISE.integers(0, 255, (side, side, 3), dtype=np.uint8)
    Image.fromarray(noise).save(packed, "JPEG", quality=5)
    return base64.b64encode(packed.getvalue()).decode()


def notebook(master: dict[str, Any], share: int, pictures: int) -> bytes:
    """A notebook of the course, with as much in it as its share of the limits allows."""
    cells = []
    answers = [cell for cell in master["cells"] if words.where_of(cell)]
    text = notebooks.MAX_PICTURES // 2 // max(len(answers), 1)
    for cell in master["cells"]:
        more: dict[str, Any] = {}
        if cell in answers:
            drawn = {f"{place}.png": {"image/jpeg": picture()} for place in range(pictures)}
            shown = "".join(f"![x](attachment:{name})" for name in drawn)
            count = 20_000 // max(len(answers), 1)
            lines = "\n".join(f"{place:0{text // 2 // count}}" for place in range(count))  # none is equal to another
            more = {"source": f"{shown} {'![' * 2000}\n{lines}", "attachments": drawn}
        elif cell["cell_type"] == "code":
            more = {"source": "".join(cell["source"]) + "\n" + "\n".join(f"a{place}=1" for place in range(400))}
        cells.append({**cell, **more})
    cells += [
        {"cell_type": "code", "id": f"x{place}", "source": ""} for place in range(notebooks.MAX_CELLS - len(cells))
    ]
    content = json.dumps({**master, "cells": cells}).encode()
    left = notebooks.MAX_PARTS // share - notebooks.parts_in(content) - 100
    size = min(archives.MAX_SUBMISSION // 2 // share, notebooks.MAX_FILE) - len(content) - left
    outputs = b"[" + b"{}," * (left // 2) + b" " * max(size, 0) + b"1]"
    return content[:-1] + b', "x": ' + outputs + b"}"


def hostile(masters: dict[str, Any], small: bool) -> bytes:
    """Pack a hand-in that reaches all limits of reading at once, or a small one of this kind."""
    pictures = 1 if small else words.MAX_PIXELS_TOGETHER // words.FEWEST_PIXELS // 40 + 1
    share = len(masters) * (20 if small else 1)
    files = {name: notebook(master, share, pictures) for name, master in masters.items()}
    entries, inner = archives.MAX_ENTRIES - 2000, finding.MAX_INNER_ARCHIVES - 4
    files |= {f"d{place}/pyvenv.cfg": b"" for place in range(entries // 2)}
    files |= {f"{'long_' * 90}{place}.csv": b"" for place in range(entries // 2)}
    skipped = zipped({f".git/{place}": b"" for place in range(archives.MAX_LOOKED_THROUGH // inner - 400)})
    files |= {f"{place}.zip": skipped for place in range(inner)}
    size = archives.MAX_INNER_ARCHIVE // (20 if small else 1) - 100_000
    slow = archives.MAX_SUBMISSION // archives.SLOW // (100 if small else 4)
    files["zeros.tar.gz"] = tarred("gz", {"x.csv": bytes(size)})
    files["slow.tar.bz2"] = tarred("bz2", {"x.csv": NOISE.bytes(slow)})
    files["many.tar"] = tarred("", {f"{place}.csv": b"" for place in range(400)})
    return zipped(files)


def main() -> int:
    """Measure; return 1 if it takes longer than allowed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="with a small course and a small hand-in")
    small = parser.parse_args().smoke
    clock = Clock()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        course = courses.load(small_course(folder / "course") if small else WHOLE)
        bundles = Bundles(course)
        masters = bundles.current.pristine
        cells = {name: {cell["id"]: cell for cell in master["cells"]} for name, master in masters.items()}
        (folder / "class").mkdir()
        (folder / "class" / "ada.zip").write_bytes(packed := hostile(masters, small))
        print(f"A zip of {len(packed) / 1e6:.0f} MB, of {len(masters)} notebooks and all else.")
        roster = [StudentRecord("ada", "Ada Lovelace")]
        (submission,) = clock.step("finding it", lambda: intake.find(folder / "class", roster)).submissions
        reports = list(report_files.names(course.catalogue).values())
        clock.step(
            "reading it",
            lambda: intake.read(submission, bundles.names, cells, packages=course.packages, reports=reports),
        )
        with Gradebook(folder / "gradebook.sqlite") as gradebook:
            clock.step("storing it", lambda: gradebook.deliver(submission.student, submission.items))
            clock.step(
                "what counts",
                lambda: intake.choose_newest(submission, submission.items, bundles.names, reports=reports),
            )
        clock.step("preparing it", lambda: prepare(submission, bundles.current, course.catalogue))
        clock.step("digests", lambda: submission_digest(submission, run_content(submission)))
        shown = [answer.as_json() for answer in submission.words.values()]
        clock.step("showing its texts", lambda: [markdown.answer_as_html(answer) for answer in shown])
        clock.step("showing them again", lambda: [markdown.answer_as_html(answer) for answer in shown])
        print(*submission.problems[:6], sep="\n")
        taken = sum(len(answer.pictures) for answer in submission.words.values())
    print("Not read:", *(f"{name}: {why}" for name, why in submission.unread.items()), sep="\n  ")
    print(f"{len(submission.items)} files and {taken} pictures are taken, {len(submission.notes)} messages.")
    print(f"Together {clock.all:.1f} s of processor time; {ALLOWED} s are allowed.")
    return int(clock.all > ALLOWED)


if __name__ == "__main__":
    sys.exit(main())

"""Hand-ins as students make them, packed and named as learning platforms hand them over."""

import io
import json
import os
import tarfile
import zipfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

#: The course's notebooks, and the ids of their cells.
NOTEBOOKS = {
    "01_first_look.ipynb": ["q1-1", "q1-2", "q1-3"],
    "02_finding_it.ipynb": ["q2-1", "q2-2", "q2-3"],
    "03_results.ipynb": ["q3-1", "q3-2", "q3-3"],
}
WANTED = list(NOTEBOOKS)


def notebook(name: str, answer: str = "x = 1", **changes: object) -> bytes:
    """A notebook of the course, its first cell answered."""
    cells = [
        {
            "id": cell_id,
            "cell_type": "code",
            "source": answer if place == 0 else f"pass  # {cell_id}",
            "metadata": {"nbgrader": {"grade_id": cell_id, **({"solution": True} if place == 0 else {})}},
            "outputs": [],
            "execution_count": None,
        }
        for place, cell_id in enumerate(NOTEBOOKS[name])
    ]
    return json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": cells} | changes).encode()


def work(student: str | None = "ada", answer: str = "x = 1", names: list[str] | None = None, **course: object):
    """The files of a student's folder: file name → content."""
    files = {name: notebook(name, answer) for name in (WANTED if names is None else names)}
    if student is not None:
        files["course.json"] = json.dumps({"student": student} | course).encode()
    return files


def zipped(files: dict[str, bytes], when: datetime = datetime(2026, 11, 21, 13, 5, 58), plain: bool = False) -> bytes:
    """A zip; with ``plain``, its names are UTF-8, and it does not say so."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            entry = (_Unflagged if plain else zipfile.ZipInfo)(name, when.timetuple()[:6])
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return packed.getvalue()


def tarred(files: dict[str, bytes], mode: str = "w:gz", **options: Any) -> bytes:
    """A tar of files, compressed as `mode` of tarfile says."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode=mode, **options) as archive:
        for name, content in files.items():
            entry = tarfile.TarInfo(name)
            entry.size, entry.mtime = len(content), datetime(2026, 11, 21, 13, 5, 58, tzinfo=UTC).timestamp()
            archive.addfile(entry, io.BytesIO(content))
    return packed.getvalue()


class _Unflagged(zipfile.ZipInfo):
    def _encodeFilenameFlags(self):
        return self.filename.encode(), self.flag_bits


def lay(folder: Path, files: dict[str, bytes], when: datetime | None = None) -> Path:
    """Put files into a folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        if when is not None:
            os.utime(path, (when.timestamp(), when.timestamp()))
    return folder


def under(folder: str, files: dict[str, bytes]) -> dict[str, bytes]:
    """The same files, in a folder."""
    return {f"{folder}/{name}": content for name, content in files.items()}


def before(prefix: str, files: dict[str, bytes]) -> dict[str, bytes]:
    """The same files, with something put before their names."""
    return {f"{prefix}{name}": content for name, content in files.items()}


def renamed(files: dict[str, bytes], added: str) -> dict[str, bytes]:
    """The same files, with something added to their names, before the ending."""
    return {f"{Path(name).stem}{added}{Path(name).suffix}": content for name, content in files.items()}


def moodle(name: str, number: int, files: dict[str, bytes], ending: str = "_") -> dict[str, bytes]:
    """Moodle's folder of a student."""
    return under(f"{name}_{number}_assignsubmission_file{ending}", files)


def canvas(name: str, number: int, files: dict[str, bytes], late: bool = False, first: int = 678901):
    """Canvas's files of a student: each has a number of its own."""
    who = f"{name}{'_LATE' if late else ''}_{number}"
    return {f"{who}_{first + place}_{file}": content for place, (file, content) in enumerate(files.items())}


def blackboard(name: str, when: str, files: dict[str, bytes], assignment: str = "Laboratory 1"):
    """Blackboard's files of one attempt, and what it writes about them."""
    attempt = f"{assignment}_{name}_attempt_{when}"
    return {f"{attempt}.txt": b"Name: ...\nFiles: ...\n"} | before(f"{attempt}_", files)


def brightspace(name: str, when: str, files: dict[str, bytes], number: str = "12345-678910"):
    """Brightspace's folder of one submission, and its list of all."""
    return {"index.html": b"<html></html>"} | under(f"{number} - {name} - {when}", files)

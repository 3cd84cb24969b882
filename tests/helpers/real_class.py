"""A course whose students work at the laboratory's bench "north": their notebooks, run there, and what they hand in.

The bench is a virtual one of nobody's, behind the address "north:", which says nothing of what it is made of.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from laboratory import Laboratory, laboratory
from made_courses import copied

from rotflex.courseware import signed_files
from rotflex.courseware.run import execute, submit
from rotflex.hil.student_benches import VirtualPlantSpec
from rotflex.instructor import course as courses
from rotflex.instructor.course import Course
from rotflex.instructor.course_check import solved
from rotflex.instructor.release import student_course
from rotflex.recordings_folder import SIGNER

ADDRESS = "north:"
ARM = ("m_1", "L_1", "m_2", "L_2")
_AT_THE_BENCH = """
import os
os.environ.pop("ROTFLEX_RUNNING")  # a student runs them, and no program

from rotflex import hil
from rotflex.hil.student_benches import student_bench

def _at(opened=hil.open, plant=student_bench({seed})):
    def opening(uri, **more):
        if uri != {address!r}:
            return opened(uri, **more)
        bench = opened("virtual", plant=plant.run(more.get("run", 1)))
        bench.identity = {{"uri": uri, "clock": "simulated"}}
        return bench
    return opening

hil.open = _at()
"""


def toml_of(place: Laboratory, spec: VirtualPlantSpec) -> str:
    """A bench's file: the arm as it was measured, and what is identified of a bench."""
    arm, plant = spec.joint, spec.parameters
    omega_n = (plant.K_s / plant.J_l) ** 0.5
    lines = [f'keys = ["{place.public}"]', "[told]", f"arm_position = {arm.arm_position}"]
    lines += [f"{name} = {getattr(arm, name)}" for name in ARM]
    lines += ["[truth]", f"omega_n = {omega_n}", f"omega_n_u = {0.005 * omega_n}"]
    lines += [f"{name} = {getattr(plant, name)}" for name in ("J_eq", "B_eq", "B_l", "torque_per_volt")]
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class RealClass:
    """Attributes: the laboratory, and the course in its folder."""

    place: Laboratory
    source: Path

    @property
    def course(self) -> Course:
        return courses.load(self.source)

    def folder(self, where: Path, student: str, changes: Mapping[str, str] | None = None) -> Path:
        """A student's folder with the notebooks, answered as the solutions do but for some cells.

        Parameters
        ----------
        where : in which it is made
        student : its name
        changes : cell's id → what stands in it
        """
        course = self.course
        folder = where / student
        folder.mkdir(parents=True)
        pristine = {name: json.loads(text) for name, text in student_course.derived(course).items()}
        answered = solved.handed_in(course, pristine)
        for name, notebook in pristine.items():
            sources = {cell.id: cell.source for cell in answered[name]} | dict(changes or {})
            for cell in notebook["cells"]:
                cell["source"] = sources.get(cell["id"], cell["source"])
            (folder / name).write_text(json.dumps(notebook), encoding="utf-8")
        said = {"student": student, "draw": course.draw, "bench": course.settings.bench.plain()}
        (folder / "course.json").write_text(json.dumps(said), encoding="utf-8")
        return folder

    def at_the_bench(self, folder: Path, student: str, only: Iterable[str] = ()) -> None:
        """Run a student's notebooks at the laboratory's bench, in a kernel each: recordings and answers stay there.

        Cells that only show something are left out, for the time.
        """
        notebooks: dict[str, dict[str, Any]] = {}
        for path in sorted(folder.glob("*.ipynb")):
            if not only or path.name in only:
                notebook = json.loads(path.read_text(encoding="utf-8"))
                cells = [cell for cell in notebook["cells"] if "illustration" not in cell["metadata"].get("tags", ())]
                notebooks[path.name] = {**notebook, "cells": cells}
        before = os.environ.get(SIGNER)
        os.environ[SIGNER] = shlex.join(self.place.command)
        try:
            broken = execute.run(
                notebooks,
                folder,
                parameters={"student": student, "bench": ADDRESS},
                first=lambda _name: _AT_THE_BENCH.format(seed=self.place.seed, address=ADDRESS),
            )
        finally:
            os.environ.pop(SIGNER) if before is None else os.environ.update({SIGNER: before})
        assert broken == ()

    def copy(self, folder: Path, where: Path, student: str, in_the_name_of: str = "") -> Path:
        """Another student's folder with the same in it, recordings signed for them: nobody else's are told of them.

        Parameters
        ----------
        folder : of the first
        where : in which it is made
        student : the other
        in_the_name_of : who is said to have made the recordings; the other unless given
        """
        made = where / student
        shutil.copytree(folder, made, ignore=shutil.ignore_patterns("answers.json"))
        course = json.loads((made / "course.json").read_text(encoding="utf-8"))
        (made / "course.json").write_text(json.dumps({**course, "student": student}), encoding="utf-8")
        for path in (made / "recordings").glob("*.mat"):
            self.sign(path, in_the_name_of or student)
        return made

    def sign(self, path: Path, student: str) -> None:
        """Have a recording signed in a student's name, whatever the signing program thinks of it."""
        key = signed_files.private_key(self.place.settings.with_suffix(".key"))
        about = {"student": student, "number": int(path.name.partition("-")[0])}
        path.with_name(path.name + signed_files.ENDING).write_bytes(signed_files.signed(path.read_bytes(), about, key))

    def hand_in(self, folder: Path, out: Path, partners: Iterable[str] = ()) -> Path:
        """Pack a folder as ``rotflex submit`` does, without its check."""
        notebooks = [path.name for path in self.course.notebooks]
        return submit.submit(folder, notebooks, partners=list(partners), out=out).path


def made(folder: Path, notebooks: Iterable[str], more: str = "") -> RealClass:
    """The course with some of its notebooks, and its laboratory, in a folder.

    Parameters
    ----------
    folder : where to
    notebooks : file names
    more : source at the end of the key
    """
    place_folder = folder / "laboratory"
    place_folder.mkdir(parents=True)
    place = laboratory(place_folder)
    source = copied(folder / "course", notebooks, more=more)
    (source / "course.toml").write_text('[bench]\nwhich = "real"\nbenches = ["north"]\n', encoding="utf-8")
    (source / "benches").mkdir()
    (source / "benches" / "north.toml").write_text(toml_of(place, place.plant), encoding="utf-8")
    return RealClass(place, source)

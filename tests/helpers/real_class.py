"""A course whose students work at the laboratory's bench "north": their notebooks, run there, and what they hand in.

The bench is a virtual one of nobody's, behind the address "north:", which says nothing but its name.
"""

import json
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from made_courses import copied
from made_notebooks import code

from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.answers.schema import read_reports
from labcourse.grading import course as courses
from labcourse.grading import course_check
from labcourse.grading.course import Course
from labcourse.grading.release import student_course
from labcourse.run import execute, submit
from rotflex.hil.student_benches import VirtualPlantSpec, student_bench

SEED = 2**40 + 7  #: of the laboratory's bench, beyond those of students
ADDRESS = "north:"
ARM = ("m_1", "L_1", "m_2", "L_2")
_AT_THE_BENCH = """
import os
os.environ.pop("LABCOURSE_RUNNING")  # a student runs them, and no program

from rotflex import hil
from rotflex.hil.student_benches import student_bench

def _at(opened=hil.open, plant=student_bench({seed})):
    def opening(uri, **more):
        if uri != {address!r}:
            return opened(uri, **more)
        bench = opened("virtual", plant=plant.run(more.get("run", 1)))
        bench.identity = {{"uri": uri, "name": "north", "clock": "simulated"}}
        return bench
    return opening

hil.open = _at()
"""


def toml_of(spec: VirtualPlantSpec) -> str:
    """A bench's file: the arm as it was measured, and what is identified of a bench."""
    arm, plant = spec.joint, spec.parameters
    omega_n = (plant.K_s / plant.J_l) ** 0.5
    lines = ["[told]", f"arm_position = {arm.arm_position}"]
    lines += [f"{name} = {getattr(arm, name)}" for name in ARM]
    lines += ["[truth]", f"omega_n = {omega_n}", f"omega_n_u = {0.005 * omega_n}"]
    lines += [f"{name} = {getattr(plant, name)}" for name in ("J_eq", "B_eq", "B_l", "torque_per_volt")]
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class RealClass:
    """A course in its folder, whose students work at the laboratory's bench."""

    source: Path

    @property
    def course(self) -> Course:
        return courses.load(self.source)

    def folder(self, where: Path, student: str) -> Path:
        """A student's folder with the notebooks, answered as the solutions do, made below another folder."""
        course = self.course
        folder = where / student
        folder.mkdir(parents=True)
        pristine = {name: json.loads(text) for name, text in student_course.derive_notebooks(course).items()}
        answered = course_check.solved_cells(course, pristine)
        for name, notebook in pristine.items():
            sources = {cell.id: cell.source for cell in answered[name]}
            for cell in notebook["cells"]:
                cell["source"] = sources.get(cell["id"], cell["source"])
            (folder / name).write_text(json.dumps(notebook), encoding="utf-8")
        said = {"student": student, "draw": course.draw, "bench": course.settings.bench.as_json()}
        (folder / "course.json").write_text(json.dumps(said), encoding="utf-8")
        return folder

    def at_the_bench(self, folder: Path, student: str) -> None:
        """Run a student's notebooks at the laboratory's bench, one after the other: recordings and answers stay there.

        Cells that only show something are left out, for the time.
        """
        notebooks: dict[str, dict[str, Any]] = {}
        for path in sorted(folder.glob("*.ipynb")):
            notebook = json.loads(path.read_text(encoding="utf-8"))
            cells = [cell for cell in notebook["cells"] if "illustration" not in cell["metadata"].get("tags", ())]
            first = code("at-the-bench", _AT_THE_BENCH.format(seed=SEED, address=ADDRESS))
            notebooks[path.name] = {**notebook, "cells": [first, *cells]}
        execute.run(notebooks, folder, parameters={"student": student, "bench": ADDRESS})
        reports = folder / REPORTS_FILE
        assert all(report.finished for report in read_reports(reports.read_bytes()).cells)
        reports.unlink()

    def copy(self, folder: Path, where: Path, student: str) -> Path:
        """Another student's folder with the same in it, made below another folder."""
        made = where / student
        shutil.copytree(folder, made, ignore=shutil.ignore_patterns("answers.json"))
        course = json.loads((made / "course.json").read_text(encoding="utf-8"))
        (made / "course.json").write_text(json.dumps({**course, "student": student}), encoding="utf-8")
        return made

    def hand_in(self, folder: Path, out: Path) -> Path:
        """Pack a folder as ``rotflex submit`` does, without its check."""
        masters = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in self.course.notebooks}
        return submit.submit(folder, masters, self.course.catalogue, out=out).path


def made(folder: Path, notebooks: Iterable[str]) -> RealClass:
    """The course with some of its notebooks, and what is known of its laboratory's bench, in a folder."""
    source = copied(folder / "course", notebooks)
    (source / "course.toml").write_text('[bench]\nwhich = "real"\nbenches = ["north"]\n', encoding="utf-8")
    (source / "benches").mkdir()
    (source / "benches" / "north.toml").write_text(toml_of(student_bench(SEED)), encoding="utf-8")
    return RealClass(source)

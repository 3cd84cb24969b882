"""What the notebook begins with."""

from __future__ import annotations

from pathlib import Path

from labcourse import courses
from labcourse.course_file import bench_policy
from labcourse.session import Session, student_of
from springlab.catalogue import CATALOGUE
from springlab.plant import Spring, seed_of


class Lab(Session):
    """A student's session with their own spring."""

    def __init__(self, student: str, folder: Path) -> None:
        self.seed = bench_policy(folder).seed_for(student, seed_of)
        super().__init__(student, folder, CATALOGUE, bench={"uri": "virtual", "seed": self.seed}, seed=self.seed)

    def bench(self) -> Spring:
        """The student's own spring."""
        return Spring(self.seed)


def start(student: str = "") -> Lab:
    """Begin a session in the folder of the notebook."""
    courses.use("springlab")
    return Lab(student_of(student, Path.cwd()), Path.cwd())

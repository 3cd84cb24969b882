"""What a notebook begins with."""

from labcourse.session import Session
from NAME.catalogue import CATALOGUE
from NAME.plant import Oven

__all__ = ["CATALOGUE", "Lab", "start"]


class Lab(Session):
    """A student's session with their own oven."""

    def bench(self) -> Oven:
        """Return the student's oven."""
        return Oven(self.seed)


def start(student: str = "") -> Lab:
    """Begin a session in the folder of the notebook."""
    return Lab.begin("NAME", CATALOGUE, student)

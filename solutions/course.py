"""This course as one object: what the general machinery of grading gets to know of it."""

from collections.abc import Mapping
from typing import Any

from labcourse.grading.course import Course
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import DRAW, PRESETS, student_seed

from . import real_benches
from .given import GIVEN
from .key import KEY
from .real_bench import RealBench
from .stated import STATED
from .true_bench import TrueBench


def on_virtual_bench(parameters: Mapping[str, Any]) -> bool:
    """Whether notebooks are run on a virtual bench: of a real one, nothing is known."""
    return str(parameters.get("bench", "virtual")).partition(":")[0] == "virtual"


COURSE = Course(
    name="rotflex-course",
    catalogue=CATALOGUE,
    key=KEY,
    bench=TrueBench,
    package="rotflex.course",
    packages=("rotflex",),
    command="rotflex",
    presets=tuple(PRESETS),
    draw=DRAW,
    own_seed=student_seed,
    given=GIVEN,
    benches=real_benches.faults(),
    evidence="rotflex.course.recordings_folder:evidence",
    bench_of_evidence=RealBench,
    knows_bench=on_virtual_bench,
    withheld=(
        "rotflex.design",
        "rotflex.model",
        "rotflex.observers",
        "rotflex.sampled",
        "rotflex.signals.flat",
        "rotflex.symbolic",
    ),
    parameters={"bench": "virtual"},
    imports=(
        "rotflex.experiments",
        "rotflex.figures",
        "rotflex.greybox",
        "rotflex.course.lab",
        "rotflex.simulation",
        "rotflex.course.reports",
        "rotflex.course.spare_design",
        "control",
        "scipy.linalg",
        "scipy.optimize",
        "scipy.signal",
        "scipy.stats",
        "sympy",
    ),
    stated=STATED,
)

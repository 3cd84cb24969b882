"""The course as one object."""

from NAME.catalogue import CATALOGUE
from NAME.plant import Oven

from labcourse.grading.course import Course

from .key import KEY

COURSE = Course(
    name="NAME-course",
    catalogue=CATALOGUE,
    key=KEY,
    bench=lambda student, policy: Oven(policy.seed_for(student)),
    package="NAME",
    packages=("NAME",),
    imports=("NAME.lab",),
    requires=("labcourse[report]",),
)

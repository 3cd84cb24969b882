"""The course as one object."""

from __future__ import annotations

from springlab.catalogue import CATALOGUE
from springlab.plant import Spring, seed_of

from labcourse.grading.course import Course

from .key import KEY

COURSE = Course(
    name="spring-course",
    title="A mass on a spring",
    catalogue=CATALOGUE,
    key=KEY,
    bench=lambda student, policy: Spring(policy.seed_for(student, seed_of)),
    package="springlab",
    packages=("springlab",),
    imports=("springlab.lab",),
)

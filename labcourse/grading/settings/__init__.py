"""A course's settings: ``course.toml`` in its folder, what an instructor decides for a term without any Python.

==================  ==================================================================================================
``decided``         what is decided: plain dataclasses, each with what counts where nothing is said
``entries``         what may stand in the file: sections, entries, what each has to be, and an example
``contradictions``  what does not go with each other, or with the course
``reading``         the file → :class:`CourseSettings`, or all that is not understood of it
``toml_file``       any file of a course's folder that is TOML: read, or refused
==================  ==================================================================================================
"""

from __future__ import annotations

from labcourse.grading.settings.decided import (
    SHARE_DIGITS,
    CourseSettings,
    Deadline,
    Extension,
    FeedbackSettings,
    LateSettings,
    LevelSettings,
    MarkSettings,
    OutcomeSettings,
    ReflectSettings,
)
from labcourse.grading.settings.reading import SETTINGS_FILE, read

__all__ = [
    "SETTINGS_FILE",
    "SHARE_DIGITS",
    "CourseSettings",
    "Deadline",
    "Extension",
    "FeedbackSettings",
    "LateSettings",
    "LevelSettings",
    "MarkSettings",
    "OutcomeSettings",
    "ReflectSettings",
    "read",
]

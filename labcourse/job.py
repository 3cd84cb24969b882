"""The student, bench and course of a run, as a check or grading sets them: read once, before any cell is run.

A cell that assigns ``student``, calls ``start`` again, or changes the environment, the current folder or
``course.json`` changes nothing of it. Where nobody sets them, as in JupyterLab, nbval, papermill or nbclient,
:data:`STUDENT` is empty, and a notebook's parameters count.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

VARIABLE = "LABCOURSE_JOB"  #: environment variable: the entries below, JSON
PICTURES = "LABCOURSE_PICTURES"  #: environment variable; "off" draws no image, if nobody looks at the notebook
_given = json.loads(os.environ.get(VARIABLE, "{}"))
STUDENT: str = _given.get("student", "")  #: ID of the student on whose bench it is run; "" if nobody sets one
BENCH: str = _given.get("bench", "virtual")  #: address of the bench
COURSE = _given.get("course")  #: content of ``course.json``; None for that of the installed release
FOLDER = Path.cwd()  #: where answers are recorded

"""The program that runs a submission's notebooks, beside the students' package and in whatever sandbox it is run.

It stands alone: what it is started next to is the course as students have it, which has no room for grading. One warm
process imports what notebooks use, and forks for each notebook; the child runs the cells in its own process, through
papermill, with IPython's shell behind it. No kernel is started, and nothing goes over a socket.

    python -P main.py < SPECIFICATION

``main`` reads the specification and goes through the notebooks, ``watch`` forks and holds to the time, ``engine`` runs
a notebook, ``kernel`` a cell, ``muted`` discards what cells output, ``warm`` imports, ``private_interfaces`` sees that
the libraries are as they were tested.
"""

from __future__ import annotations

#: Exit codes, from good to bad; the worst that befell any of the notebooks. They are worth a note, never a mark.
FINE, TIMED_OUT, DIED = 0, 10, 11
#: Exit code if nothing was run, because what notebooks need cannot be imported, or is not as it was tested.
BROKEN = 12
#: What the course's own reader made of the student's files, in the working folder: JSON. Cells can have changed it.
EVIDENCE_FILE = ".labcourse-evidence.json"

"""The warm process: a program that runs notebooks for papermill, in a sandbox for grading, and at home for anyone.

One warm process imports what notebooks use, and forks for each notebook. The child runs the cells in its own process,
with ipykernel's kernel behind it. No kernel is started, and nothing goes over a socket.

    python -P -m labcourse.run.inside.main < SPECIFICATION

For grading, a bundle has the instructor's version of it as the package ``labcourse_inside``, beside the packages of
the release under which a submission is run.

``main`` reads the specification and goes through the notebooks, ``papermill_client`` is what papermill calls for each,
``watch`` forks and limits the time, ``kernel`` runs the cells, ``outputs`` is the file of what they show, and
``private_interfaces`` replaces what the libraries have not promised to keep.
"""

from __future__ import annotations

#: Exit codes, from good to bad; that of the worst notebook counts. They are worth a note, never a mark.
FINE, TIMED_OUT, DIED = 0, 10, 11
#: Exit code if nothing was run, because imports of notebooks fail, or a library has a version that was not tested.
BROKEN = 12
#: What the course's own reader found in the student's files: JSON in the working folder. Cells can have changed it.
EVIDENCE_FILE = ".labcourse-evidence.json"
#: Before the name of a notebook: the file in which it is left with its outputs, if they are to be shown.
EXECUTED = ".labcourse-executed-"

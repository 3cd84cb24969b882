"""Grading: release a course, take in submissions, run them, mark them, give feedback. Instructor only.

=================  ===================================================================================================
``notebooks``      instructor's notebook → student's notebook
``release``        the student's folder and zip
``intake``         a submission's folder or zip → the source of its answer cells
``runner``         pristine notebooks with that source, run in a child process → the bytes of ``answers.json``
``decoding``       bytes → claims, strictly read
``truth``          the student's own bench, as it really is
``checks``         how an answer of each sort is compared: what ``solutions/key.py`` is made of
``marking``        claims and key → marks
``feedback``       marks → a page for the student
``grades``         all of it, for a class
``commands``       the instructor's commands
=================  ===================================================================================================

Whatever comes from a submission is data: it is never imported, evaluated or unpickled in this process, and nothing that
a kernel prints or sends is read. A submission's ``answers.json`` is a claim by a stranger; points need positive
evidence.
"""

"""Grading, for instructors. Students never get this package.

=======================================  ========================================================================
``course``, ``settings``, ``verdicts``   a course as one object; its settings; how its key judges
``release``                              the student notebooks, and the folder and zip that are handed out
``intake``                               submissions, read from what students handed in
``running``, ``isolation``               submissions run in a sandbox: content of ``answers.json``
``marking``, ``marks``                   content of ``answers.json`` marked by the course's key; what a mark is
``submission``                           all that is known of a submission: read it first
``batch``, ``graded_run``                a class, from submissions to the gradebook; marking it again
``gradebook``, ``erasure``               what is stored, and how a person is erased from it
``executed``                             notebooks run again, to look at what they showed
``scoring``                              answers in words, scored by a person
``reports``, ``accounts``                feedback and tables of marks; points so far
``outcomes``, ``sheets``                 levels of outcomes; scoring sheets
``overview``, ``todo``                   a class at a glance; what a person must do today
``platforms``                            marks in the files of learning platforms
``course_check``, ``new``                whether a course is complete and consistent; a new course
``commands``                             the commands of the command line
=======================================  ========================================================================

All content of a submission is data: it is never imported, evaluated or unpickled in this process. Of what a kernel
prints or sends, nothing is read but the plain text and the pictures that ``executed`` shows. A submission's
``answers.json`` is an untrusted claim: points need positive evidence.
"""

import sys

# jsonschema, which nbformat uses, imports a grammar of web addresses if it is installed. That takes seconds, and the
# schema of a notebook does not need it.
sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]  # None: the import fails at once

"""The instructor's: what students never get.

==================================================  ================================================================
``model``, ``symbolic``, ``design``                 what this course's questions ask students to build
``course``, ``verdicts``                            a course as one object; what an answer is judged against
``release``                                         the student's notebooks, folder and zip
``running``                                         submissions taken in and run in isolation → ``answers.json``
``marking``                                         bytes of ``answers.json`` → marks, by the course's key
``reports``                                         marks for people
``batch``, ``regrade``, ``commands``                a class, from submissions to the gradebook; the commands
``isolation``, ``gradebook``                        know of no course at all
==================================================  ================================================================

Whatever comes from a submission is data: it is never imported, evaluated or unpickled in this process, and nothing that
a kernel prints or sends is read. A submission's ``answers.json`` is an untrusted claim; points need positive
evidence.
"""

import sys

# jsonschema, behind nbformat, imports a grammar of web addresses where there is one. That takes seconds, and no schema
# of a notebook needs it.
sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]

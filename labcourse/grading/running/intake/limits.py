"""How much is taken in. All that comes from a student, or from a platform, is bounded here; docs/handing_in.md says so.

How many own files come along is said where they are chosen (:mod:`labcourse.answers.own_files`).
"""

from __future__ import annotations

# --- what is looked into ---
MAX_CLASS_ENTRIES = 100_000  #: files and folders of a zip of the whole class; 1000 students with 100 each
MAX_ENTRIES = 5_000  #: files and folders of one hand-in
MAX_SUBMISSION = 1_000_000_000  #: bytes that are read of one student's files, unpacked
MAX_SECONDS = 60  #: of reading one student's files; after them, no other file is opened
MAX_DEPTH = 8  #: folders within folders
MAX_CLASS_DEPTH = 3  #: folders and zips around those of the students; a platform's zip, its folder, and a section's
MAX_CLASS_ARCHIVE = 4_000_000_000  #: bytes of a zip of the whole class; 1000 students of 4 MB each
MAX_ARCHIVE = 200_000_000  #: bytes of one student's zip
MAX_INNER_ARCHIVE = 100_000_000  #: bytes of a zip within a zip
MAX_NESTING = 3  #: zips within zips
MAX_INNER_ARCHIVES = 20  #: zips within one hand-in
MAX_DIRECTORY = 2_000_000  #: bytes of a zip's table of contents; 5000 files, with paths of 350 characters
MAX_CLASS_DIRECTORY = 10_000_000  #: the same, of a zip of the whole class

# --- notebooks (see also labcourse.answers.notebooks) and what belongs to the course ---
MAX_STRANGERS = 30  #: notebooks of unknown names that are recognised by their cells
MAX_COURSE_FILE = 10_000  #: bytes of course.json; a name, a release, and partners

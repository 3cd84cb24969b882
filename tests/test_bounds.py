"""Each bound, deadline and limit of the machinery stands where it has to: about here, for a reason that is said here.

The numbers beside the reasons are not read off the code. What is moved by a third falls out of its range; whoever moves
one on purpose changes its reason here, too. How a bound acts, at either side of its value, is tested where it acts.
"""

from __future__ import annotations

import ast
import importlib
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import pytest
from checkout import ROOT

from rotflex.hil import bench, guard
from rotflex.instructor.batch import Settings
from rotflex.instructor.isolation import outcome
from rotflex.instructor.running import runner

KB, MB, GB = 10**3, 10**6, 10**9
MINUTE = 60.0
SLACK = 0.25  # of a number; a third more or less is too much
COUNTED = 20  # below, a whole number is what it is

#: Module and name → about what it has to be, and why.
BOUNDS: dict[str, tuple[float, str]] = {
    "courseware.predictions:LONGEST": (1000, "characters: a sentence, and a few more"),
    # --- reports ---
    "courseware.report.checklist:_LONGEST_HEADING": (60, "characters; three quarters of a line"),
    "courseware.report.checklist:_HEADING_BEGINS": (6, "letters: 'Conclu' is Conclusion and Conclusions"),
    "courseware.report.checklist:_VALUE": (2, "description and symbol stand before it"),
    "courseware.report.pandoc:_PATIENCE": (60.0, "s; a report takes a tenth of one, on a slow machine some"),
    "courseware.report.writing:_SMALLEST": (0.6, "of 11 pt: 6.6 pt, and indices of 5; less is not read on paper"),
    "courseware.report.writing:_LONGEST_WORD": (60, "characters of a word in a message; a line has about 80"),
    "courseware.report.front:_LONGEST": (2000, "characters of a caption; a third of a page"),
    "courseware.report.front:_MOST": (100, "captions and sources; twenty are many"),
    "courseware.report.fine_curves:_POINTS": (2000, "of a curve, on a page 160 mm wide: a dozen to each millimetre"),
    "courseware.report.fine_curves:_MAX_BYTES": (20 * MB, "8 diagrams of 24 curves, two numbers of 13 characters each"),
    "courseware.report.attaching:MOST_PAGES": (150, "ten times a long report"),
    "courseware.report_files:MAX_BYTES": (20 * MB, "a report with ten photographs as telephones make them"),
    "courseware.report_files:_WITHIN": (1024, "bytes; readers of PDFs look no further for the beginning"),
    "courseware.report_files:_SHOWN": (12, "digits; of a class no two begin alike"),
    "courseware.run.reports_along:_ROUGHLY": (2, "s; FAT counts in two"),
    "courseware.run.reports_along:_NAMED": (6, "parts in a line"),
    # --- what students' work may be like ---
    "courseware.answers:MAX_BYTES": (1 * MB, "as the guide says; what it holds is bounded in tests/test_lab.py"),
    "courseware.forms:MAX_BYTES": (120 * KB, "a recording's summary of 400 points in each of a dozen channels"),
    "courseware.attached_pictures:MOST": (6, "pictures of one answer; two pages of each of three drafts"),
    "courseware.attached_pictures:MAX_BYTES": (20 * MB, "a telephone's largest photograph"),
    "courseware.attached_pictures:MAX_PIXELS": (60e6, "telephones have 50 million"),
    "courseware.attached_pictures:MAX_PIXELS_TOGETHER": (150e6, "three of the largest, at 4 bytes of memory each"),
    "courseware.attached_pictures:MAX_SIDE": (20_000, "a scan of a long sheet at 600 dots per inch"),
    "courseware.attached_pictures:LONGEST_SIDE": (1400, "handwriting on a page can be read"),
    "courseware.attached_pictures:KEPT_BYTES": (700 * KB, "six of them are within 5 MB for each answer"),
    "courseware.expressions:MAX_NODES": (1000, "a page of formula"),
    "courseware.expressions:MAX_DEPTH": (40, "deeper than anybody can read"),
    "courseware.expressions:MAX_INTEGER": (1e20, "what is typed with 15 digits, in millionths"),
    "courseware.expressions:MAX_EXPONENT": (64, "far beyond any power of a formula"),
    "courseware.kinds.figures:MOST_AXES": (8, "four rows of two"),
    "courseware.kinds.figures:MOST_LINES": (
        24,
        "curves and marks of a diagram; curves alone are told apart up to a dozen",
    ),
    "courseware.kinds.figures:MOST_POINTS": (200, "of a curve as it is kept"),
    "courseware.kinds.figures:_MOST_IN_ALL": (4400, "points of all curves, two numbers of 13 characters each: 115 kB"),
    "courseware.kinds.figures:_FEWEST_POINTS": (60, "a curve is still seen for what it is"),
    "courseware.kinds.axis_labels:_MOST_PLACES": (16, "units in a label; three are many"),
    "courseware.kinds.axis_labels:_NESTED": (3, "brackets in each other, in a label"),
    "courseware.kinds.figures:MOST_SAMPLES": (1e9, "two weeks at 1 kHz"),
    "courseware.kinds.functions:_LONGEST_MESSAGE": (200, "two lines"),
    "courseware.kinds.figures:_LONGEST_LABEL": (200, "two lines"),
    "courseware.kinds.recordings:MOST_POINTS": (400, "as many as a plot is wide, halved"),
    "courseware.kinds.recordings:MOST_SAMPLES": (1e7, "an hour at 2 kHz"),
    "courseware.kinds.recordings:_LONGEST_METADATA": (4 * KB, "what a bench says of itself, ten times"),
    "courseware.kinds.values:LONGEST_PROSE": (5000, "two pages"),
    "courseware.kinds.values:_FEWEST_WORDS": (3, "words; one or two are no sentence"),
    "courseware.kinds.values:_SHORT": (30, "characters of two long words"),
    "courseware.kinds.values:_LEAST_PERCENTAGE": (
        0.06,
        "an overshoot of a few per cent as a fraction is below it, one count of an encoder is not",
    ),
    "courseware.saved_words:MAX_BYTES": (100 * MB, "a notebook full of pictures"),
    "courseware.run.from_notebook:_LONGEST_ID": (64, "what Jupyter allows for a cell's id"),
    "courseware.student_id:LONGEST": (80, "a name with all its names"),
    "courseware.student_id:LONGEST_IN_BYTES": (240, "a file system's 255, less an ending"),
    "courseware.benches:MOST_SEED": (2**32 - 1, "what a seed is drawn from"),
    "courseware.run.cell_reports:MAX_BYTES": (1 * MB, "a thousand cells with a message each"),
    "courseware.run.cell_reports:_MOST_LINES": (6000, "eleven notebooks of at most some hundred cells"),
    "courseware.run.cell_reports:_MOST_LACKED": (50, "answers that one cell asks for"),
    "courseware.run.handed_in:MAX_CELLS": (1000, "ten times what a long notebook has"),
    "courseware.run.handed_in:MAX_SOURCE": (200 * KB, "a cell of thousands of lines"),
    "courseware.run.handed_in:MAX_TEXT": (10 * MB, "a text cell with pictures in it"),
    "courseware.run.own_files:MAX_FILES": (200, "as the guide says"),
    "courseware.run.own_files:MAX_FILE": (10 * MB, "as the guide says"),
    "courseware.run.own_files:MAX_TOTAL": (30 * MB, "as the guide says"),
    "courseware.run.own_files:MAX_DEPTH": (8, "folders within folders, as in what is handed in"),
    "courseware.run.own_files:LONGEST_PATH": (240, "Windows' 260, less a folder"),
    "courseware.run.skippable_cells:LONGEST": (20 * KB, "600 lines; Python looks at them within a second"),
    "courseware.run.skippable_cells:LONGEST_TOGETHER": (100 * KB, "five of the longest"),
    "courseware.run.student_folder:_MOST_BYTES": (200 * MB, "a notebook that can be opened at all"),
    "courseware.run.submit:MAX_OUTPUT": (200 * KB, "a table or a picture"),
    # --- how much of something is shown ---
    "courseware.attached_pictures:_SHOWN": (60, "characters, within a line"),
    "courseware.run.check_words:_NAMED": (6, "cells, within a line"),
    "courseware.run.reasons:_NAMED": (2, "questions before 'and 12 more'"),
    "courseware.run.reasons:_MOST_HARMLESS": (20, "lines"),
    "courseware.run.submit:_SHOWN": (16, "hexadecimal digits: 64 bits, which nobody hits by chance"),
    "instructor.accounts.exact:_DIGITS": (100, "points, weight and per cent, multiplied, a dozen decimals each"),
    "instructor.accounts.exact:_SHOWN": (6, "decimals; marks have as many"),
    "instructor.commands.marks:_SHOWN": (60, "characters, within a line"),
    "instructor.marking.decoding:_MOST_NOTES": (20, "lines"),
    "instructor.marking.checks:_LONGEST_SHOWN": (40, "characters, within a line"),
    "instructor.marking.decoding:_SHOWN": (40, "characters, within a line"),
    "instructor.marking.marking:_LONGEST_SHOWN": (300, "characters: three lines"),
    "instructor.marking.marking_processes:_LONGEST_BENCH": (200, "characters: two lines"),
    "instructor.scoring.rubric:LONGEST": (500, "characters: five lines, read before each of eighty answers"),
    "instructor.reports.formulas:LONGEST": (1000, "characters of a formula that fits on a page"),
    "instructor.reports.formulas:MOST_NODES": (3000, "of its tree"),
    "instructor.reports.formulas:_DEEPEST": (25, "groups in each other"),
    "instructor.reports.live_report:_MOST_ROWS": (60, "a screen"),
    "instructor.reports.rendered_words:LONGEST": (20 * KB, "four times what an answer has"),
    "instructor.reports.rendered_words:MOST_BYTES": (300 * KB, "of HTML, fifteen times what is rendered"),
    "instructor.reports.rendered_words:_DEEPEST": (12, "quotes and lists in each other"),
    "instructor.reports.rendered_words:_WIDEST": (40, "columns"),
    "instructor.running.bundles:_SHOWN": (60, "characters, within a line"),
    "instructor.running.intake.names:LONGEST_SHOWN": (120, "characters: a line"),
    "instructor.running.intake.names:_MOST_SHOWN": (5, "names, within a line"),
    "instructor.running.intake.reading:_MOST_SHOWN": (5, "files, within a line"),
    "instructor.running.inside.watch:_LONGEST_COMPLAINT": (2000, "characters: a traceback"),
    # --- deadlines, s ---
    "courseware.run.check:_ROUGHLY": (2.0, "the coarsest clock of a file system"),
    "courseware.run.execute:CELL_TIMEOUT": (MINUTE, "the longest cell takes seconds"),
    "courseware.run.execute:GRACE": (5.0, "to tidy up after an interrupt"),
    "courseware.run.execute:_BEGIN": (2 * MINUTE, "a cold start on a slow disk"),
    "courseware.run.execute:_LOOK": (0.2, "nobody waits noticeably"),
    "courseware.files:_PATIENCE": (2.0, "a virus scanner has a new file for a second; nobody waits longer for a cell"),
    "courseware.files:_PAUSE": (0.05, "a program that reads a small file has it for less"),
    "courseware.jupyterlab:_ASKING": (5.0, "the server answers at once, and before the patience for its end is over"),
    "courseware.jupyterlab:_LOOK": (0.2, "nobody waits noticeably"),
    "courseware.jupyterlab:_PATIENCE": (15.0, "JupyterLab ends its kernels within 5 s each, together"),
    "courseware.run.from_notebook:_PATIENCE": (15.0, "three times the grace of what is ended"),
    "courseware.run.from_notebook:_ITSELF": (5.0, "the grace of what is ended"),
    "instructor.release.dates:_PATIENCE": (20.0, "git takes a fraction of a second"),
    "instructor.gradebook.database:PATIENCE": (30.0, "a transaction takes a second at most"),
    "instructor.isolation.cgroups:_PATIENCE": (2.0, "the kernel takes milliseconds"),
    "instructor.isolation.pipes:_LOOK": (0.1, "nobody waits noticeably"),
    "instructor.isolation.sandbox:_START_TIMEOUT": (MINUTE, "it takes a fraction of a second"),
    "instructor.isolation.sandbox:_END_TIMEOUT": (MINUTE, "it takes a fraction of a second"),
    "instructor.marking.decoding:_PATIENCE": (5.0, "an answer is decoded in milliseconds"),
    "instructor.marking.marking:_PATIENCE": (MINUTE, "the slowest honest answer takes a few seconds"),
    "instructor.marking.marking_processes:_PATIENCE": (10 * MINUTE, "as a submission's run has"),
    "instructor.running.executors:_CONNECT": (15.0, "a scheduler answers within a second"),
    "instructor.running.inside.main:_TRIAL_TIMEOUT": (MINUTE, "as a cell has"),
    "instructor.running.inside.watch:GRACE": (5.0, "to tidy up after an interrupt"),
    "instructor.running.inside.watch:_LONGEST_PAUSE": (0.05, "nobody waits noticeably"),
    "hil.halt:WATCHDOG_TIMEOUT": (0.2, "an arm at 30 rad/s turns a whole turn meanwhile, and no more"),
    "hil.halt:_AGAIN": (3, "times 0 V is written before a watchdog is stopped that lets nothing be written"),
    "hil.answered:MOST": (
        0.05,
        "of a run; a busy computer made 0.006 of one late, and two long pauses make 0.04",
    ),
    "hil.answered:_ROUNDING": (2, "samples: one at either end of a pause"),
    "hil.pace:DRIFT": (5e-4, "a cheap crystal is off by 1e-4, and one that is hot by as much again"),
    "hil.pace:TOO_SLOW": (5, "answers; a pause makes one of them long"),
    "hil.pace:_FRESH": (2, "periods; a board may take its first sample one after the start"),
    "hil.pace:_SWITCH": (5e-4, "s; a quarter of a sample"),
    "hil.guard:_LIGHTEST_LINK": (1e-3, "kg·m²; a third of the lightest arm there is"),
    "hil.guard:_A_FEW_COUNTS": (0.0087, "rad; half a degree, 6 counts"),
    "hil.bench_file:_FEW_DEG": (5, "deg; half a turn in radians is 3.1"),
    "hil.commissioned:_STIFFEST": (10, "N·m/rad; seven times as stiff as the workbook's"),
    "hil.real:WORKBOOKS_STIFFNESS": (1.4, "N·m/rad; the workbook's"),
    "hil.serial.line:ALIVE_AFTER": (0.02, "s; less than half of the board's 50 ms of silence"),
    "hil.serial.line:_ATTEMPTS": (3, "times a request is sent; each can be obeyed twice"),
    "hil.serial.line:_PATIENCE": (0.25, "s; an answer comes within some milliseconds, a busy computer hears it later"),
    "hil.serial.line:_STARTING": (5, "s; a boot loader takes two"),
    "hil.serial.motor:LONGEST_TIMEOUT": (65, "s; sixteen bits of milliseconds"),
    "hil.serial.motor:_ATTEMPTS": (3, "times the last voltage is sent, until it is known to be obeyed"),
    "hil.serial.port:_PATIENCE": (1, "s; a frame takes less than a millisecond"),
    "hil.serial.stream:SLOWEST": (10_000, "ms; ten seconds between samples are no experiment"),
    "hil.serial.stream:_LATE": (0.1, "s; twice the board's 50 ms of silence"),
    "hil.supervision:_RATE_OVER": (0.01, "s; a count is worth 0.15 rad/s then"),
    # --- what is taken in ---
    "instructor.running.intake.limits:MAX_CLASS_ENTRIES": (100_000, "1000 students with 100 files each"),
    "instructor.running.intake.limits:MAX_ENTRIES": (5000, "as the guide says"),
    "instructor.running.intake.limits:MAX_DEPTH": (8, "as the guide says"),
    "instructor.running.intake.limits:MAX_CLASS_DEPTH": (3, "a platform's zip, its folder, and a section's"),
    "instructor.running.intake.limits:MAX_CLASS_ARCHIVE": (4 * GB, "1000 students of 4 MB each"),
    "instructor.running.intake.limits:MAX_ARCHIVE": (200 * MB, "as the guide says"),
    "instructor.running.intake.limits:MAX_INNER_ARCHIVE": (100 * MB, "as the guide says"),
    "instructor.running.intake.limits:MAX_NESTING": (3, "as the guide says"),
    "instructor.running.intake.limits:MAX_INNER_ARCHIVES": (20, "as the guide says"),
    "instructor.running.intake.limits:MAX_DIRECTORY": (2 * MB, "5000 files, with paths of 350 characters"),
    "instructor.running.intake.limits:MAX_CLASS_DIRECTORY": (10 * MB, "100 000 files, with paths of 50 characters"),
    "instructor.running.intake.limits:MAX_NOTEBOOK_FILE": (200 * MB, "as the guide says"),
    "instructor.running.intake.limits:MAX_NOTEBOOK": (5 * MB, "as the guide says"),
    "instructor.running.intake.limits:MAX_PICTURES": (15 * MB, "as the guide says"),
    "instructor.running.intake.limits:MAX_BRACKETS": (5e6, "a second of looking for their ends"),
    "instructor.running.intake.limits:MAX_STRANGERS": (10, "as many notebooks as a course has"),
    "instructor.running.intake.limits:MAX_COURSE_FILE": (10 * KB, "a name, a release, and partners"),
    "instructor.running.intake.labels:_LONGEST": (300, "a file system's longest name, and some"),
    "instructor.running.intake.notebook_names:_FEWEST_CELLS": (3, "two may be the same by chance"),
    "instructor.platforms.earned:_NAMED": (6, "parts that wait, in a line"),
    "instructor.platforms.recognised:_SHOWN": (12, "headings in a message: three lines"),
    "instructor.running.intake.people:MOST_TOGETHER": (4, "as many as stand around a bench"),
    "instructor.running.intake.stores:_PIECE": (1 * MB, "read at a time"),
    "instructor.running.intake.times:_MAX_BYTES": (10 * MB, "100 000 lines"),
    "instructor.running.counted_pages:MOST_PAGES": (2000, "ten times what anybody hands in; a larger number is a lie"),
    "instructor.running.counted_pages:_LARGEST": (1000, "bytes; two numbers take forty"),
    "instructor.running.prepared:_LONGEST_CELL": (64, "what Jupyter allows for a cell's id"),
    # --- what a run and its marking may take ---
    "hil.bench_file:LONGEST_NAME": (60, "a name that is read in a line"),
    "instructor.running.runner:MAX_EVIDENCE": (40 * MB, "20 recordings of 60 s, 13 characters for each number"),
    "instructor.running.runner:MAX_ANSWERS": (2 * MB, "twice what is asked of answers.json, for others' formats"),
    "instructor.isolation.bubblewrap:_SHARED_MEMORY": (16 * 2**20, "semaphores, and no data"),
    "instructor.isolation.pipes:_CHUNK": (2**16, "what a pipe holds"),
    "instructor.isolation.sandbox:_MAX_STARTUP_OUTPUT": (2**16, "what bubblewrap complains of"),
    "instructor.isolation.unisolated:_ROUNDS": (100, "of killing what forks"),
    "instructor.marking.decoding:MAX_DEPTH": (60, "an expression's 40, and the lists around it"),
    "instructor.marking.decoding:MAX_INTEGER": (1e20, "as in expressions"),
    "instructor.marking.marking_processes:_MEMORY": (4 * 2**30, "twice what a run has"),
    "instructor.running.executors:_TRIES": (3, "workers that may be lost"),
    "instructor.gradebook.storable:MOST_CHARACTERS": (64 * 2**20, "a text that SQLite takes, by far"),
    "instructor.gradebook.storable:MOST_BYTES": (256 * 2**20, "more than any zip of a student's that is taken in"),
    "instructor.gradebook.roster:_MOST_TOLD": (12, "columns that are named in a line"),
    "instructor.gradebook.naming:FEWEST_CHARACTERS": (3, "of two, words that name nobody are full"),
    "instructor.gradebook.naming:FEWEST_DIGITS": (5, "points, years and frequencies have up to four"),
    "instructor.erasure.remains:MOST_BYTES": (50 * MB, "a spreadsheet of a class's answers, as scoring takes them"),
    "instructor.commands.person:_MOST_TOLD": (30, "places that fill a screen"),
    "instructor.gradebook.storable:_DEEPEST": (30, "levels"),
    "instructor.gradebook.schema:_SECRET_BYTES": (32, "256 bits"),
    "instructor.batch:PROBE_SEED_BITS": (48, "not to be guessed, and exact as a float"),
    "courseware.run.restore:_MOST_ROUNDS": (50, "two are usual"),
    "instructor.release.identity:_LONGEST": (40, "characters of a term, within a file's name"),
    "instructor.release.identity:_DIGITS": (8, "hexadecimal digits: 32 bits tell a course's releases apart"),
    "instructor.settings.entries:_LONGEST": (120, "characters of a title: a line"),
    # --- marking ---
    "courseware.run.alike:CLOSE": (1e-4, "two digits more lenient than the six that are kept"),
    "instructor.marking.checks:MOST_RUNS": (1000, "recordings of one bench, far more than anybody makes"),
    "instructor.marking.checks:_FIRST_RUN": (1, "counted as people count"),
    "instructor.marking.expression_checks:_POINTS": (6, "random points; two would do"),
    "instructor.marking.expression_checks:_RTOL": (1e-7, "half the digits of a float"),
    "instructor.marking.expression_checks:_FLOAT_RTOL": (2e-3, "0.333 for a third is 1e-3 away"),
    "instructor.marking.expression_checks:_WORTH_A_SHARE": (0.7, "more than half, less than three of four"),
    "instructor.design:PAIR_TOLERANCE": (1e-6, "typed with seven digits"),
    "instructor.design:SMALL_POLE": (1e-2, "of the largest pole"),
    "instructor.model:POLE_TOLERANCE": (1e-6, "typed with seven digits"),
    "instructor.model:RANK_TOLERANCE": (1e-10, "far above 1e-16, far below any singular value of ours"),
    # --- scoring by persons ---
    "instructor.scoring.alike:SIMILAR": (88, "%: a few words of forty are others"),
    "instructor.scoring.alike:_CONTEXT": (8, "words on either side: half a line"),
    "instructor.scoring.cards:_LONGEST": (300, "characters beside a text: a matrix of four by four"),
    "instructor.scoring.desk:HELD": (120, "s: three renewals, and not long after a page was closed by force"),
    "instructor.scoring.desk:MOST_TOGETHER": (8, "with what differs in each, within two screens"),
    "instructor.scoring.guards:MOST_BYTES": (64 * KB, "a remark and fifty answers' keys, ten times"),
    "instructor.scoring.pace:AT_ONCE": (1, "s; nobody reads an answer in less"),
    "instructor.scoring.pace:FEWEST": (5, "a median of fewer says nothing"),
    "instructor.scoring.pace:PAUSE": (600, "s; the longest report is read in less"),
    "instructor.scoring.sent:LONGEST_REMARK": (2000, "characters: a page"),
    "instructor.scoring.sent:MOST_ANSWERS": (50, "several times what is shown together"),
    "instructor.scoring.server:_MOST_POINTS": (1e6, "more than any answer has"),
    "instructor.scoring.table_files:MOST_BYTES": (50 * MB, "fifty answers of 5000 characters of each of 200 students"),
    "instructor.scoring.tables:_LONGEST_CELL": (32_000, "a spreadsheet's 32767, less a word that says so"),
}

#: Modules and names that are no bounds: codes, numbers of a kernel, shares of points, measures of a drawing.
NO_BOUNDS = {
    "courseware.answers:FORMAT": "a version; tests/courseware/test_answers.py",
    "courseware.benches:FIRST_DRAW": "a version",
    "hil.recorded_runs": "how alike runs are; tests/hil/test_recorded_runs.py",
    "courseware.pictures": "inches and dots; tests/figures/test_figures.py",
    "courseware.run.commands": "exit codes; tests/courseware/run/test_commands.py",
    "instructor.commands.options": "exit codes; tests/test_cli.py",
    "instructor.course_check.solved:_SEED": "any will do",
    "instructor.gradebook.score_rows:ROUND": "the number of a round",
    "instructor.gradebook.database:_WRITERS": "a lock's number; any will do",
    "instructor.isolation.outcome:MIB": "a unit",
    "instructor.scoring.desk:_KEY": "digits of a digest",
    "instructor.scoring.tables:_DIGITS": "digits of a digest",
    "instructor.isolation.seccomp": "the kernel's numbers; tests/instructor/isolation/test_isolation_parts.py",
    "courseware.kinds.figures:_ROUNDING": "of an axis; tests/courseware/test_figures_kept.py",
    "courseware.kinds.figures:_SAME_PLACE": "of a figure; tests/courseware/test_figures_kept.py",
    "instructor.marking.figure_checks": "of the figures' checks; tests/instructor/marking",
    "instructor.marking.curve_following": "of the figures' checks; tests/instructor/marking",
    "instructor.marking.seen_curves": "of the figures' checks; tests/instructor/marking",
    "instructor.marking.wrong_answers": "how answers are made wrong; any will do",
    "instructor.model:_EPS": "a float's",
    "instructor.release.dates:_FIRST": "what a zip can hold; tests/instructor/release/test_dates.py",
    "instructor.release.dates:_LAST": "as above",
    "instructor.release.student_notebooks:_WIDTH": "characters of a comment",
    "instructor.settings.decided:SHARE_DIGITS": "of a share; tests/instructor/outcomes/test_levels.py",
    "instructor.outcomes.plots": "measures of a drawing; tests/instructor/outcomes/test_pages.py",
    "courseware.report.drawing": "measures of a drawing; tests/courseware/report/test_drawing.py",
    "courseware.report.entries": "digits and letters of a table; tests/courseware/report/test_composing.py",
    "courseware.report.tree:_HEADING": "the level of a heading; tests/courseware/report/test_set_texts.py",
    "courseware.report.tree:_SHOWN": "characters of a message",
    "courseware.report.writing:_LONGEST": "as above",
    "courseware.report.writing:_MOST_CHARACTERS": "as above",
    "instructor.reports.drawn_figure": "measures of a drawing; tests/instructor/reports/test_drawn_figure.py",
    "instructor.overview.shown": "columns of a terminal; tests/instructor/overview/test_glance.py",
    "instructor.overview.slips": "of what is worth saying of a class; as above",
    "instructor.overview.students": "as above",
    "instructor.overview.waiting": "characters that are shown; tests/instructor/overview/test_glance.py",
    "instructor.reports.hints": "of hints, which the test of a class sees; tests/instructor/reports/test_hints.py",
    "instructor.running.inside": "exit codes; tests/instructor/running/test_inside.py",
    "instructor.running.inside.watch:_FINISHED": "an exit code",
    "instructor.running.intake.stores:_UTF8_NAME": "a flag of the zip format",
    "instructor.running.runner:_GIB": "a unit",
    "hil.bench_file:_NONE": "stands for no channel",
    "hil.commissioned:VERSION": "of the record",
    "hil.serial.board": "channels, as they are wired; tests/hil/serial/test_serial_board.py",
    "hil.serial.port:BAUD_RATE": "the firmware's; tests/hil/serial/test_protocol.py",
    "hil.serial.protocol": "the firmware's; tests/hil/serial/test_protocol.py holds them against its header",
    "hil.serial.stream:_NUMBERS": "sixteen bits",
    "hil.serial.tasks:_VOLTS_PER_STEP": "of the controller's converter; tests/hil/serial/test_serial_board.py",
    "hil.bench:_FOREVER": "the maker's word for no end; tests/hil/test_bench_values.py",
    "hil.replay": "how alike runs are; tests/hil/test_replay.py",
    "instructor.course_check.times": "how long a notebook takes; tests/instructor/test_reading_time.py",
    "hil.controllers:DERIVATIVE_CUTOFF": "tests/hil/test_controllers.py",
    "hil.terminals": "how finely time is cut; tests/hil/test_terminals.py",
    "hil.sensors": "channels, as they are wired; tests/hil/test_virtual.py",
    "hil.virtual": "channels, as they are wired; tests/hil/test_virtual.py",
    "hil.student_benches": "the draw; tests/hil/test_student_benches.py",
}
LOOKED_AT = ("courseware", "instructor", "hil")
NOT_LOOKED_AT = ("courseware/scene/", "gradebook/migrations/", "isolation/attacks.py")

#: Class → field → about what it is unless another is given, and why.
DEFAULTS: dict[type, dict[str, tuple[float, str]]] = {
    runner.Limits: {
        "cell": (MINUTE, "the longest cell takes seconds"),
        "submission": (10 * MINUTE, "a whole course takes a minute at most"),
        "memory": (2 * 2**30, "twice what a notebook with all libraries needs"),
        "processes": (100, "threads of the libraries, on many processors"),
        "folder": (256 * 2**20, "recordings and pictures"),
    },
    outcome.Limits: {
        "seconds": (10 * MINUTE, "as a submission has"),
        "memory": (2 * 2**30, "as a submission has"),
        "processes": (100, "as a submission has"),
        "file_size": (64 * 2**20, "twice all own files"),
        "folder": (256 * 2**20, "as a submission has"),
        "output": (2**20, "nobody reads more"),
        "open_files": (256, "a quarter of what is usual"),
    },
    bench.Limits: {
        "voltage": (10.0, "V; what the board gives"),
        "theta": (3.14159, "rad; half a turn"),
        "alpha": (0.5236, "rad; 30 deg"),
        "rate": (float("inf"), "none on a virtual bench; a real one has hil.real.LIMITS"),
        "duration": (float("inf"), "none on a virtual bench"),
    },
    guard.Allowance: {
        "share": (0.6, "a wrong sign or a still counter comes to 1"),
        "motion": (0.0349, "rad; 2 deg: with the stiffness known within 15 %, sweeps of 24 benches needed 1.5"),
        "friction": (0.03, "N·m; the stickiest of real logs has 0.024"),
        "memory": (0.1, "s; three time constants of the servo"),
        "smoothing": (0.006, "s; three samples"),
        "jump": (2, "times the quickest motion"),
        "stiffness": (1.4, "N·m/rad; the workbook's"),
    },
    Settings: {"jobs": (1, "one after the other")},
}


def value_of(name: str) -> float:
    module, _colon, constant = name.partition(":")
    return getattr(importlib.import_module(f"rotflex.{module}"), constant)


def _slack(about: float) -> float:
    return 1e-4 if about < COUNTED and about == round(about) else SLACK


@pytest.mark.parametrize("name", BOUNDS)
def test_each_bound_stands_about_where_it_has_to(name):
    about, why = BOUNDS[name]
    assert value_of(name) == pytest.approx(about, rel=_slack(about)), why


@pytest.mark.parametrize("of", DEFAULTS, ids=lambda of: f"{of.__module__}.{of.__name__}")
def test_each_usual_limit_stands_about_where_it_has_to(of):
    numbers = {one.name: one.default for one in fields(of) if type(one.default) in (int, float)}
    assert set(numbers) == set(DEFAULTS[of])
    for name, value in numbers.items():
        about, why = DEFAULTS[of][name]
        assert value == pytest.approx(about, rel=_slack(about)), (name, why)


def test_a_submissions_limits_are_the_sandboxs_one_by_one():
    limits = runner.Limits(cell=1, submission=2.5, memory=3, processes=4, folder=5)
    inside = limits.of_sandbox()
    assert (inside.seconds, inside.memory, inside.processes, inside.folder) == (2.5, 3, 4, 5)
    usual = outcome.Limits()
    assert (inside.file_size, inside.output, inside.open_files) == (usual.file_size, usual.output, usual.open_files)


def constants() -> Iterator[str]:
    """Module and name of each number that a module states for itself, in capitals."""
    package = ROOT / "rotflex"
    for path in sorted(one for folder in LOOKED_AT for one in (package / folder).rglob("*.py")):
        if any(part in path.as_posix() for part in NOT_LOOKED_AT):
            continue
        module = ".".join(path.relative_to(package).with_suffix("").parts).removesuffix(".__init__")
        for name in capitals(path):
            value = value_of(f"{module}:{name}")
            if isinstance(value, int | float) and not isinstance(value, bool):
                yield f"{module}:{name}"


def capitals(path: Path) -> Iterator[str]:
    """Names in capitals that a module binds."""
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            names = [one for target in targets for one in ast.walk(target) if isinstance(one, ast.Name)]
            yield from (one.id for one in names if one.id.strip("_").isupper())


def test_no_bound_is_without_a_reason():
    there = set(constants())
    explained = set(BOUNDS) | set(NO_BOUNDS)
    assert [name for name in sorted(there) if not {name, name.partition(":")[0]} & explained] == []
    assert sorted(set(BOUNDS) - there) == []

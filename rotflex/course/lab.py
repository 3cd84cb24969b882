"""The laboratory as a notebook sees it: a student, their bench, and their answers.

::

    import rotflex.course.lab

    lab = rotflex.course.lab.start(student="ada", bench="virtual")
    with lab.bench() as on_the_bench:
        recording = experiments.sweep(on_the_bench)
    lab.answer("2.11", omega_n=omega_n)
    K_s = lab.value("2.12", "K_s")
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from labcourse import course_file, courses, job, program
from labcourse.answers import cell_reports
from labcourse.answers.reflection import Comparison
from labcourse.benches import OWN, PRESET, REAL, SAME
from labcourse.course_file import bench_policy
from labcourse.run import RUNNING
from labcourse.session import Session, student_of
from rotflex import hil
from rotflex.course.practice import Practice
from rotflex.course.questions import CATALOGUE
from rotflex.course.recordings_folder import ADDRESS, RecordingsFolder
from rotflex.hil.student_benches import DRAW, FIRST_RUN, student_bench, student_seed

VIRTUAL = "virtual"  #: the bench that the course gives the student
_of_job: list[Lab] = []  # the session of this process, if it runs a notebook of a job


def start(
    student: str = "", bench: str = "virtual", folder: str | os.PathLike[str] | None = None, quiet: bool = False
) -> Lab:
    """Begin a session in the laboratory.

    In a run by a check or by grading, each call returns the same session, for the student and the bench that are set
    from outside (:mod:`labcourse.job`), whatever it is given.

    Parameters
    ----------
    student : ID of the student, if neither ``course.json`` nor a JupyterHub names one; "demo" if nobody does
    bench : address of the bench, see :func:`rotflex.hil.open`; "virtual" is the one that the course gives the student
    folder : where answers are kept; the notebook's own by default
    quiet : leave out the welcome

    Raises
    ------
    ConfigurationError
        If the student's ID cannot be one, see :mod:`labcourse.student_id`, or ``course.json`` cannot be read.
    BenchError
        If the bench's address is not understood.
    """
    courses.use("rotflex.course")
    program.use_by_default("rotflex")
    place = Path(folder) if folder is not None else Path.cwd()
    name = student_of(student, place)
    if not job.STUDENT:
        return Lab(name, bench, place, quiet)
    if not _of_job:
        _of_job.append(Lab(name, job.BENCH, job.FOLDER))
    if _of_job[0].policy.which != REAL:  # there, the notebooks ask for the address of the bench
        cell_reports.unused("bench", bench, job.BENCH)
    return _of_job[0]


class Lab(Session):
    """A student's session. Made by :func:`start`.

    Attributes
    ----------
    student : the student's id
    servo, joint : the parts on the bench as the data sheets state them (:mod:`rotflex.config`)
    questions : everything that can be answered, by number
    book : the answers so far
    address : of the bench, see :func:`rotflex.hil.open`
    seed : of the student's virtual bench
    policy : which bench the course gives each student
    recordings : those that were made at a real bench
    """

    def __init__(self, student: str, uri: str, folder: Path, quiet: bool = False) -> None:
        self.address = uri
        self.recordings = RecordingsFolder(folder)
        self.policy = bench_policy(folder)
        self.seed = self.policy.seed_for(student, student_seed)
        bench = self.bench()
        self.servo, self.joint = bench.servo, bench.joint
        super().__init__(student, folder, CATALOGUE, bench.identity, self.seed)
        if not quiet:
            parts = f"arm in position {self.joint.arm_position}, encoders of type {self.servo.encoder}"
            self.welcome(f"{self.address}: {parts}", *self._notes())
        self.print_notices()

    def __repr__(self) -> str:
        return f"<Lab: student {self.student}, bench {self.address}>"

    def _notes(self) -> Iterable[str]:
        if message := course_file.other_hub_user(self.student):
            yield message
        if self.policy.which in (SAME, PRESET):
            yield "Everybody in your course has this same bench."
        if self.policy.which == REAL:
            yield (
                "Marks are given for recordings made on the laboratory's own benches. There, write the "
                'bench\'s address, as bench = "…". Anywhere else, your recordings of there are used: the '
                f"folder recordings has {len(self.recordings.paths)}."
            )

    def bench(self, address: str | None = None, run: int = FIRST_RUN) -> hil.Bench:
        """This student's bench, to be opened in a ``with`` statement; or the one at another address.

        No two runs of a real bench are the same. A virtual bench does the same every time, unless it is told that this
        is another ``run``: the same number gives the same recording, always.

        What is recorded at a real bench is kept in the folder ``recordings``. The address "recorded" is that bench once
        more, wherever the folder is: each experiment gives its recording, or says that there is none. Where the course
        has benches of the laboratory's, "virtual" means the same; and so does a real bench's address in a check of the
        whole work, which runs what will be marked, and moves nothing.
        """
        chosen = address or self.address
        counts = self._counts(chosen)
        if counts and RUNNING in os.environ:  # as it is marked; and nobody stands at that bench
            chosen, counts = VIRTUAL, False
        if chosen == ADDRESS or (chosen == VIRTUAL and self.policy.which == REAL):
            return self.recordings.bench(run)
        preset = self.policy.preset if self.policy.which == PRESET else None
        bench = hil.open(chosen, seed=self.seed, preset=preset, draw=self.policy.draw or DRAW, run=run)
        if self.policy.which == REAL and not counts:
            print("Note      No bench of the laboratory's: what is recorded here is not kept, and does not count.")
        elif counts and self.policy.benches and (name := bench.identity.get("name", "")) not in self.policy.benches:
            print(
                f"Note      This bench's name is {name!r}, and your course's benches are "
                f"{', '.join(self.policy.benches)}: a person has to look at what is recorded here before it counts. "
                "Whoever looks after the bench can correct the name in its file."
            )
        return self.recordings.keeping(bench, run) if counts else bench

    def _counts(self, address: str) -> bool:
        """Whether what is recorded there is kept: at a real bench, and at a twin where a course rehearses with one."""
        scheme, _colon, rest = address.partition(":")
        if scheme == VIRTUAL:
            return self.policy.which == REAL and rest.partition("?")[0].endswith(".toml")
        return scheme not in ("replay", ADDRESS)

    def practice(self, number: int | None = None) -> Practice:
        """A bench to practise on, drawn anew at each call and never the student's own; nothing is kept or marked.

        ``lab.practice(123)`` is the practice bench of that number again.

        Raises
        ------
        ConfigurationError
            If there is no practice bench of that number.
        """
        practice = Practice(number)
        print(repr(practice))
        return practice

    def given_value(self, question: str, part: str) -> Any:
        """Return a value that is given to the class. The stiffness of a student's own bench is known only here."""
        if self.policy.which != OWN or question != "2.12":
            return super().given_value(question, part)
        drawn = student_bench(self.seed, draw=self.policy.draw or DRAW)
        return {"J_l": self.joint.J_l, "K_s": drawn.parameters.K_s}[part]

    def checks(self) -> Iterable[Comparison]:
        """What :meth:`reflect` holds against each other, see :mod:`rotflex.course.reflection`."""
        from rotflex.course import reflection

        return reflection.checks(self.servo, self.joint, self.book.bench, self.book.probe_seed)

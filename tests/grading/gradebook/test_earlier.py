"""A gradebook of the version before: every command refuses it, and ``grade NEW OLD.sqlite`` takes it over."""

import json
import sqlite3
from contextlib import closing

import pytest
from command_line import rotflex, said
from earlier_gradebook import turned_back
from fake_class import FakeClass, left, perfect
from gradebook_dump import dump
from set_clock import END_OF_TERM, set_clock
from typer.main import get_command

from labcourse.errors import IsolationError
from labcourse.grading.gradebook import Gradebook, earlier
from labcourse.grading.overview import class_overview
from labcourse.grading.running import isolation_report
from labcourse.grading.todo import todo
from labcourse.grading.verdicts import Status
from labcourse.problems import Code
from rotflex.cli import app

ROSTER = "id,name,group\nada,Ada Lovelace,\nbob,Bob Bell,\ncleo,,\ndan,,\neve,,\nfay,Fay Foot,\n"
ROSTER += "gus,,north\nhal,,north\nivy,,\n"
#: ada and bob name each other. gus and hal are in one group; gus hands in for both, and the run is on hal's bench.
SAYS = {"ada": ("ada", "bob"), "bob": ("ada", "bob"), "gus": ("hal", "gus")}
HANDED_IN = ("ada", "bob", "cleo", "dan", "eve", "fay", "gus")
BY = ("--by", "tia")
READ = ("2.11", "explanation")
#: Students with a bench that is used in a run: a pair is run once.
BENCHES = ("ada", "cleo", "dan", "eve", "hal")
_MARK = ("ada", *READ, "1", "--reason", "So.", *BY)
#: Command → the words after MARKS.
COMMANDS = {
    "roster": lambda folder: [folder / "roster.csv"],
    "grade": lambda folder: [folder / "in"],
    "status": lambda folder: [],
    "score": lambda folder: BY,
    "regrade": lambda folder: [],
    "report": lambda folder: [],
    "publish": lambda folder: BY,
    "export": lambda folder: ["--into", folder / "roster.csv"],
    "mark": lambda folder: _MARK,
    "take": lambda folder: ["eve", "02"],
    "rerun": lambda folder: ["eve"],
    "excuse": lambda folder: ["eve", "02", "--reason", "Ill.", *BY],
    "comment": lambda folder: ["ada", "So.", *BY],
    "history": lambda folder: ["ada"],
    "outcomes report": lambda folder: [],
    "outcomes sheets": lambda folder: [],
    "person copy": lambda folder: ["ada", folder / "ada.json"],
    "person erase": lambda folder: ["ada", "--yes", *BY],
}


class Class(FakeClass):
    """A class that was graded, and a copy of its gradebook as the version before left it."""

    def __init__(self, folder, patch):
        super().__init__(folder, patch)
        patch.setattr(isolation_report, "check", lambda: None)
        (folder / "roster.csv").write_text(ROSTER)
        for student in HANDED_IN:
            self.hand_in(student, source=f"omega_n = 1  # {student}")
        for student, (owner, partner) in SAYS.items():
            (folder / "in" / student / "course.json").write_text(json.dumps({"student": owner, "with": [partner]}))
        self.book_file, self.old = folder / "first" / "gradebook.sqlite", folder / "old.sqlite"

    def say(self, *words, code=0):
        """Type a command, which has to end with this exit code."""
        of_course = words[0] not in ("roster", "mark", "comment", "history", "person")
        done = rotflex(*words, *(["--solutions", self.course.folder] if of_course else []))
        assert done.exit_code == code, (words, done.output, done.exception)
        return done

    def live(self):
        """Grade what was handed in, and do what persons do."""
        first = self.folder / "first"
        self.say("roster", first, self.folder / "roster.csv")
        self.say("grade", first, self.folder / "in", "--supply", "cleo:2.11.omega_n=19.5")
        self.say("mark", first, "dan", *READ, "0.5", "--reason", "Say why.", *BY)
        with Gradebook(self.book_file) as book:
            book.scores.give("ada", READ, 1.0, "tia", level=4, remark="2")
            book.scores.undo(book.scores.give("bob", READ, 0.0, "tia").number, "tia")
        self.say("comment", first, "dan", "Please look again.", "--question", READ[0], "--part", READ[1], "--ask", *BY)
        self.say("comment", first, "ada", "Well done.", *BY)
        notebook = self.course.notebook_of("2.11")
        self.say("excuse", first, "eve", notebook, "--reason", "Ill.", *BY)
        self.say("publish", first, "--yes", *BY)
        self.say("person", "erase", first, "fay", "--yes", *BY)
        self.runs.clear()
        return turned_back(self.book_file, self.old, without_files="hal")

    def take_over(self, new="new", **how):
        return self.say("grade", self.folder / new, self.old, **how)


@pytest.fixture(scope="module")
def lived(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        set_clock(patch, END_OF_TERM)
        there = Class(tmp_path_factory.mktemp("earlier"), patch)
        there.live()
        yield there


@pytest.fixture
def old(lived):
    lived.runs.clear()
    lived.leaves.clear()
    return lived


def contents(file):
    """All of a gradebook that is to be the same; the audit trail has texts as reasons, and is compared by itself."""
    with Gradebook(file) as book:
        found = dump(book)
        ids = [student["student"] for student in found["students"]]
        found["secret"], found["erased"] = book.secret(), [*book.persons.erased(["fay"])]
        # Nobody had stored yet in which folder it was, for which assignment, by which attempt, and when it came in.
        found["stored"] = {one: [row[:5] for row in book.stored(one)] for one in ids}
        found["excuses"] = {one: {name: act.reason for name, act in book.excuses(one).items()} for one in ids}
        found["when"] = [(one.actor, one.when) for one in (*book.publications(), *book.comments())]
    for student in found["students"]:
        del student["audit"]
        for delivery in student["deliveries"]:
            del delivery["folder_of"]
        for run in student["runs"]:
            # Who of a pair handed in was not stored by itself.
            del run["prepared_from"], run["versions"], run["submission"]
            for notes in (run["notes"], *(facts["notes"] for facts in run["cells"])):
                notes[:] = [note for note in notes if note["code"] != Code.HANDED_IN_BY_PARTNER]
    return found


def trail(file):
    """The rows of the audit trail, as they are stored."""
    with closing(sqlite3.connect(file)) as connection:
        return connection.execute("SELECT * FROM audit").fetchall()


def to_do(old, file):
    """What a person must do: code, for whom, and the points at stake."""
    with Gradebook(file) as book:
        tasks = todo(class_overview(book, old.course, file.parent).of)
    return [(task.what.code, task.who, task.worth) for task in tasks]


def of_gradebooks(group, name=""):
    """The commands that are given a gradebook."""
    for word, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from of_gradebooks(command, f"{word} ")
        elif any(parameter.name == "marks" for parameter in command.params):
            yield name + word


def test_all_commands_are_tried():
    assert {*of_gradebooks(get_command(app))} == {*COMMANDS}


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_command_refuses_it_and_names_the_command_that_takes_it_over(old, command):
    before = old.old.read_bytes()
    done = old.say(*command.split(), old.old, *COMMANDS[command](old.folder), code=2)
    assert f"rotflex grade NEW {old.old}" in said(done)
    assert old.old.read_bytes() == before


def test_the_new_gradebook_is_that_of_a_class_that_was_not_disturbed(old):
    before = old.old.read_bytes()
    old.take_over()
    new = old.folder / "new" / "gradebook.sqlite"
    assert sorted(old.runs) == sorted(BENCHES)
    assert contents(new) == contents(old.book_file)
    assert trail(new) == trail(old.old)  # for marks that are the same there are no new rows
    # Feedback was given back before: no mark may be listed as moved since.
    assert to_do(old, new) == to_do(old, old.book_file)
    assert old.old.read_bytes() == before


def test_a_mark_that_is_another_now_is_in_the_trail_with_the_one_before(old):
    old.leaves["hal"] = left(perfect("hal", 7, omega_n=1.0))
    old.take_over("changed")
    with Gradebook(old.folder / "changed" / "gradebook.sqlite") as book, Gradebook(old.book_file) as first:
        added, before = book.audit()[len(first.audit()) :], first.current("hal").marks
    assert [(one.student, one.where) for one in added] == [(who, ("2.11", "omega_n")) for who in ("gus", "hal")]
    (reason,) = (mark.reason for mark in before if mark.where == ("2.11", "omega_n"))
    for one in added:
        assert (one.before.status, one.before.points, one.before.reason) == (Status.RIGHT, 2.0, reason)
        assert (one.after.status, one.after.points) == (Status.WRONG, 0.0)


def test_after_an_interrupt_it_goes_on(old):
    old.leaves["hal"] = IsolationError("The sandbox is lost.", "sandbox", "Start it again.")
    old.take_over("stopped", code=3)
    done = len(old.runs) - 1
    assert 0 < done < len(BENCHES)
    old.leaves.clear()
    old.take_over("stopped")
    new = old.folder / "stopped" / "gradebook.sqlite"
    assert len(old.runs) == len(BENCHES) + 1
    assert (contents(new), trail(new)) == (contents(old.book_file), trail(old.old))
    old.take_over("stopped")
    assert len(old.runs) == len(BENCHES) + 1  # nothing is run again


def test_an_interrupt_while_it_is_copied_leaves_nothing_of_it(old, monkeypatch):
    copy = earlier._copy

    def interrupted(connection):
        copy(connection)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(earlier, "_copy", interrupted)
        old.take_over("copied", code=130)
    new = old.folder / "copied" / "gradebook.sqlite"
    with Gradebook(new) as book:
        assert book.students() == [] and book.audit() == []
    old.take_over("copied")
    assert contents(new) == contents(old.book_file)


def test_a_gradebook_that_has_other_students_is_refused_and_nothing_changes(old):
    old.say("roster", old.folder / "other", old.folder / "roster.csv")
    new = old.folder / "other" / "gradebook.sqlite"
    before, first = new.read_bytes(), old.old.read_bytes()
    old.take_over("other", code=2)
    assert (new.read_bytes(), old.old.read_bytes(), old.runs) == (before, first, [])


def test_a_damaged_gradebook_is_refused_in_a_line(old):
    (damaged := old.folder / "damaged.sqlite").write_bytes(b"SQLite format 3\0and no more")
    assert "Traceback" not in str(old.say("grade", old.folder / "of-damaged", damaged, code=2))


@pytest.mark.parametrize("version", [11, 14])
def test_another_version_is_not_taken_over(old, version):
    other = turned_back(old.book_file, old.folder / f"version-{version}.sqlite", version)
    old.say("grade", old.folder / f"from-{version}", other, code=2)
    with Gradebook(old.folder / f"from-{version}" / "gradebook.sqlite") as book:
        assert book.students() == [] and old.runs == []

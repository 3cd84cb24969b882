"""How the class in ``scored_class.py`` is scored: on the page, through the gradebook, and by a table; and then anew.

Whoever scores knows an answer by the number in its text alone, as a reader knows it by its words.
"""

import csv
import re
from collections import Counter
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from made_courses import OURS
from scored_by_hand import SHARES
from scored_class import ANN, PARTS, TEACHER, Drawn, Person, Where
from scoring_class import Client, clients, shown
from typer.testing import CliRunner

from labcourse.grading import course as courses
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.scoring import rubric
from labcourse.grading.scoring.desk import Desk
from rotflex import cli

#: Parts that are scored on the page, and those by a table; all others are given to the gradebook as the page does it.
ON_THE_PAGE: list[Where] = [("3.17", "explanation"), ("Modeling report, as a whole", "appearance")]
BY_TABLE = {"2.17", "Modeling report"}
#: On the page, each so many answers get a wrong level first, which is taken back.
SLIPS = 9


def run(*words: Any, code: int = 0) -> str:
    """A command, as it is typed; what it says."""
    done = CliRunner().invoke(cli.app, [str(word) for word in words])
    assert done.exit_code == code, done.output
    return done.output


class Scoring:
    """All that is done with the class's answers in words.

    Parameters
    ----------
    drawn : the class, which is in the gradebook
    folder : of results, with the gradebook
    source : the course's folder

    Attributes
    ----------
    said : what the commands said, by option
    page : the page's overview in the end
    """

    def __init__(self, drawn: Drawn, folder: Path, source: Path) -> None:
        self.drawn, self.folder, self.source = drawn, folder, source
        self.said: dict[str, str] = {}
        found = courses.load(source)
        with Gradebook(folder / "gradebook.sqlite") as book:
            items = rubric.read(found.folder, found.catalogue)
            desk = Desk(book, found.catalogue, items, found.settings.levels)
            ann, teacher = clients(desk, ANN, TEACHER)
            for where in ON_THE_PAGE:
                self._on_the_page(ann, where)
            self._directly(book)
            self._by_table(folder / "scores.csv")
            self._of_the_teacher(teacher)
            self.page = ann.get("/").text

    def person(self, number: str) -> Person:
        """What is true of the answer with this number."""
        student, where = self.drawn.by_number[number]
        return self.drawn.students[student].persons[where]

    def _shown(self, reply: Any, where: Where) -> tuple[Person | None, list[dict[str, str]]]:
        """The answer on a card that is to be scored: what is true of it, and its key. There may be others beside it."""
        picks = shown(reply)
        if not picks:
            return None, []
        numbers = dict.fromkeys(re.findall(r"in (\d{5}) samples", reply.json()["html"], re.IGNORECASE))
        known = [one for one in numbers if self.drawn.by_number[one][1] == where]
        assert known and len(picks) == 1
        return self.person(known[0]), picks

    def _on_the_page(self, ann: Client, where: Where) -> None:
        """Card by card, with slips taken back; what nobody reads is skipped."""
        sent = {"question": where[0], "part": where[1]}
        reply, skipped, count = ann.act("next", sent), set(), 0
        while True:
            person, picks = self._shown(reply, where)
            if person is None or picks[0]["key"] in skipped:
                return
            answers = {**sent, "answers": picks}
            count += 1
            if person.asked:
                reply = ann.act("ask", {**answers, "remark": "Is that right?"})
            elif person.first is not None:
                if count % SLIPS == 0:
                    ann.act("give", {**answers, "level": 4 - person.first, "remark": "A slip."})
                    answers["answers"] = shown(ann.act("undo", sent))
                reply = ann.act("give", {**answers, "level": person.first, "remark": "As it is."})
            elif person.points is not None:
                reply = ann.act("give", {**answers, "points": person.points})
            else:
                skipped.add(picks[0]["key"])
                reply = ann.act("next", {**sent, "skip": picks[0]["key"]})
            assert reply.status_code == 200 and not reply.json()["trouble"], reply.text

    def _directly(self, book: Gradebook) -> None:
        """As the page writes it; what is to be asked of those in the table, too, for a table cannot ask."""
        for answer in book.scores.answers([where for where in PARTS if where not in ON_THE_PAGE]):
            person = self.drawn.students[answer.student].persons[answer.where]
            if person.asked:
                book.scores.ask(answer.student, answer.where, ANN, remark="How?", expected=answer.mark)
            elif answer.question not in BY_TABLE and (person.first is not None or person.points is not None):
                level, points = person.first, person.points
                worth = points if level is None else float(SHARES[level]) * answer.mark.out_of
                book.scores.give(
                    answer.student, answer.where, worth, ANN, level=level, remark="So.", expected=answer.mark
                )

    def _by_table(self, table: Path) -> None:
        """Written, filled in, and read."""
        self.said["write"] = run("score", self.folder, "--solutions", self.source, "--write", table)
        with table.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file))
        self.filled = Counter[str]()
        for row in rows:
            if row["question"] not in BY_TABLE:
                self.filled["same"] += 1
                continue
            person = self.person(_number(row["answer"]))
            level, points = person.first, person.points
            row["level"] = "" if level is None else str(level)
            row["points"] = "" if points is None else str(points)
            row["remark"] = "By table." if row["level"] or row["points"] else ""
            self.filled["changed" if row["remark"] else "same"] += 1
        with table.open("w", encoding="utf-8-sig", newline="") as file:
            written = csv.DictWriter(file, rows[0])
            written.writeheader()
            written.writerows(reversed(rows))
        self.said["read"] = run("score", self.folder, "--solutions", self.source, "--read", table, "--by", ANN)

    def _of_the_teacher(self, teacher: Client) -> None:
        """What was asked is decided, by the links on the page's overview."""
        self.asked = re.findall(r'href="/score\?question=([^"]+?)&amp;part=(\w+)&amp;key=(\w+)"', teacher.get("/").text)
        for question, part, key in self.asked:
            where = (unquote(question), part)
            sent = {"question": where[0], "part": where[1]}
            person, picks = self._shown(teacher.act("next", {**sent, "key": key}), where)
            assert person is not None and person.asked
            if person.decided is not None:
                done = teacher.act("give", {**sent, "answers": picks, "level": person.decided, "remark": "Decided."})
                assert not done.json()["trouble"], done.text


def _number(text: str) -> str:
    return re.search(r" in (\d{5}) samples", text, re.IGNORECASE)[1]


assert {where[0] for where in ON_THE_PAGE} | BY_TABLE <= set(OURS.catalogue.marked)

"""How the class in ``scored_class.py`` is scored: by a scorer, who asks the teacher of some, and by the teacher."""

from pathlib import Path
from typing import Any

from scored_by_hand import SHARES
from scored_class import ANN, READ, TEACHER, Drawn
from typer.testing import CliRunner

from labcourse.grading.gradebook import Gradebook
from rotflex import cli


def run(*words: Any, code: int = 0) -> str:
    """A command, as it is typed; what it says."""
    done = CliRunner().invoke(cli.app, [str(word) for word in words])
    assert done.exit_code == code, done.output
    return done.output


def score(drawn: Drawn, folder: Path) -> None:
    """Score the class's answers in words in the gradebook of a folder."""
    with Gradebook(folder / "gradebook.sqlite") as book:
        for answer in book.scores.answers(READ):
            person = drawn.students[answer.student].persons[answer.where]
            about = {"remark": "So.", "expected": answer.mark}
            if person.asked:
                book.scores.ask(answer.student, answer.where, ANN, **about)
                if person.decided is not None:
                    worth = float(SHARES[person.decided]) * answer.mark.out_of
                    book.scores.give(answer.student, answer.where, worth, TEACHER, level=person.decided)
            elif person.first is not None:
                worth = float(SHARES[person.first]) * answer.mark.out_of
                book.scores.give(answer.student, answer.where, worth, ANN, level=person.first, **about)
            elif person.points is not None:
                book.scores.give(answer.student, answer.where, person.points, ANN, **about)

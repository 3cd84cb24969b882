"""Scores out and in as a table: only what was changed is taken, and what is not is told with its row."""

import csv
import io
import random
import re
import zipfile
from contextlib import nullcontext

import pytest
from gradebooks import graded, mark, prose, record, report_text
from openpyxl import Workbook, load_workbook
from scoring_class import COMPARED, LEVELS, WORDS, desk, fill, texts

from labcourse.errors import GradingError
from labcourse.grading.scoring import table_files, tables
from labcourse.grading.scoring.desk import Pick, key_of, seen
from labcourse.grading.settings import LevelSettings

FORMULAS = [
    '=HYPERLINK("http://example.com";"x")',
    "+1+1",
    "-2 rad/s is the value that I see",
    "@SUM(A1)",
    "\t=1+1",
    "'=1",
]


class Table:
    """A table as a person has it open: rows that can be changed, and saved as their program saves."""

    def __init__(self, made, path):
        self.made, self.path = made, path
        tables.write(made, path)
        if path.suffix == ".csv":
            self.rows = list(csv.DictReader(io.StringIO(path.read_text("utf-8-sig"), newline="")))
        else:
            heading, *lines = load_workbook(path).active.iter_rows(values_only=True)
            self.rows = [dict(zip(heading, line, strict=True)) for line in lines]

    def row(self, student, where=WORDS):
        return next(row for row in self.rows if row["key"] == key_of(student, where))

    def save(self, separator=","):
        names = list(self.rows[0])
        lines = [names, *([row[name] for name in names] for row in self.rows)]
        if self.path.suffix == ".csv":
            text = io.StringIO(newline="")
            csv.writer(text, delimiter=separator).writerows(lines)
            self.path.write_text(text.getvalue(), encoding="utf-8")
        else:
            book = Workbook()
            for line in lines:
                book.active.append(line)
            book.save(self.path)

    def read(self, by="Ann", **how):
        self.save(**how)
        return tables.read(self.made, self.path, by)


@pytest.fixture(params=[".xlsx", ".csv"])
def table(request, book, tmp_path):
    fill(book, texts(4))
    return Table(desk(book), tmp_path / f"scores{request.param}")


def given(book):
    return [(act.student, act.where, act.level, act.points, act.remark, act.actor) for act in book.scores.acts()]


def test_there_is_a_row_for_each_answer_without_a_name(table, book):
    assert len(table.rows) == 8
    assert [row["question"] for row in table.rows] == ["2.11"] * 4 + ["2.16"] * 4
    assert {row["answer"] for row in table.rows} == {one.mark.given for one in book.scores.answers()}
    assert not any("student-" in str(row[name]) for row in table.rows for name in row if name != "answer")
    assert not any(row["level"] or row["points"] for row in table.rows)


def test_what_was_filled_in_is_taken_and_the_rest_left(table, book):
    table.row("student-000").update(level=3, remark="Show it.")
    table.row("student-001").update(points="0,3")
    table.row("student-002", COMPARED).update(level="4")
    random.Random(1).shuffle(table.rows)
    done = table.read(separator=";") if table.path.suffix == ".csv" else table.read()
    assert str(done) == "3 scored, 5 as they were, 0 not taken."
    assert sorted(given(book)) == [
        ("student-000", WORDS, 3, 0.75, "Show it.", "Ann"),
        ("student-001", WORDS, None, 0.3, "", "Ann"),
        ("student-002", COMPARED, 4, 2.0, "", "Ann"),
    ]


def test_read_again_it_changes_nothing_and_says_so(table, book):
    table.row("student-000").update(level=3, remark="Show  it.")
    table.row("student-001").update(points=1 / 3)
    table.row("student-002").update(level=2, points=0.5)
    table.read()
    assert str(tables.read(table.made, table.path, "Ann")) == "0 scored, 8 as they were, 0 not taken."
    fresh = Table(table.made, table.path)
    assert fresh.row("student-000")["level"] in (3, "3")
    fresh.row("student-000").update(level=2)  # its points are those of level 3
    assert fresh.read().changed == 1
    assert str(fresh.read()) == "0 scored, 8 as they were, 0 not taken."
    assert len(given(book)) == 4


def test_what_one_corrects_in_a_table_that_was_read_is_taken(table, book):
    table.row("student-000").update(level=3)
    table.row("student-001").update(level=3)
    table.read()
    table.row("student-000").update(level=1)
    done = table.read()
    assert (done.changed, done.same, done.problems) == (1, 7, [])
    assert "Ann gave it level 3, 0.75 of 1 point at" in done.replaced[0]
    assert [act[2] for act in given(book)] == [3, 3, 1]
    other = table.read(by="Bea")  # it is no reading of hers
    assert (other.changed, len(other.problems)) == (0, 2)
    assert "Ann gave it level 1" in " ".join(other.problems)


@pytest.mark.parametrize("meanwhile", ["another", "elsewhere", "itself", "mark", "text"])
def test_what_was_decided_since_a_table_was_read_stays(table, book, meanwhile):
    table.row("student-000").update(level=3)
    table.read()
    if meanwhile == "mark":
        book.set_mark("student-000", *WORDS, 0.1, "Prof", "Looked at again.")
    elif meanwhile == "text":
        record(book, graded("student-000", mark(), prose(given="Another."), report_text(), submission="2"))
    (now,) = [one for one in book.scores.answers([WORDS]) if one.student == "student-000"]
    if meanwhile != "mark":
        who = "Bea" if meanwhile == "another" else "Ann"
        table.made.give(who, WORDS, [Pick(key_of("student-000", WORDS), seen(now))], level=2)
    if meanwhile != "elsewhere":
        table.row("student-000").update(level=4)
    done = table.read()
    if meanwhile == "itself":  # their own, and the row was changed: that counts, and is told
        assert done.changed == 1 and "Ann gave it level 2" in done.replaced[0]
        return
    assert (done.changed, len(done.problems)) == (0, 1)
    assert book.scores.answers([WORDS])[0].mark.points == (0.1 if meanwhile == "mark" else 0.5)


def test_marks_of_others_that_are_replaced_are_named(table, book):
    (now,) = [one for one in book.scores.answers([WORDS]) if one.student == "student-000"]
    table.made.give("Bea", WORDS, [Pick(key_of("student-000", WORDS), seen(now))], level=3)
    later = Table(table.made, table.path)
    assert "Bea gave it level 3" in later.row("student-000")["state"]
    later.row("student-000").update(level=4)
    later.row("student-001").update(level=4)
    done = later.read()
    row = later.rows.index(later.row("student-000")) + 2
    assert done.changed == 2
    (told,) = done.replaced
    label = table.made.label("student-000", WORDS)
    assert told.startswith(f"Row {row}: {label} was scored before. Bea gave it level 3, 0.75 of 1 point at")
    assert told.endswith("Now: 1 point.")
    again = Table(table.made, table.path)
    again.row("student-001").update(level=3)
    assert again.read().replaced == []  # their own, which stood in the table


def test_questions_to_the_instructor_are_told_and_it_is_counted_which_are_decided(table, book):
    for student in ("student-000", "student-001"):
        book.scores.ask(student, WORDS, "Bea", remark="=Is it?")
    assert tables.write(table.made, table.path) == (8, 2)
    later = Table(table.made, table.path)
    told = [row["state"] for row in later.rows if row["state"]]
    assert len(told) == 2 and all("Bea asked the instructor" in one and "=Is it?" in one for one in told)
    later.row("student-000").update(level=4)
    done = later.read("Prof")
    assert str(done) == "1 scored, 7 as they were, 0 not taken. Of 2 questions to the instructor it decided 1."
    assert [one.student for one in book.scores.answers([WORDS]) if one.asked] == ["student-001"]


def test_a_score_can_be_changed_and_a_remark_too(table, book):
    table.row("student-000").update(level=3, remark="Show it.")
    table.row("student-001").update(points=1 / 3)
    table.read()
    later = Table(table.made, table.path)
    later.row("student-000").update(level=2)  # its points are those of before
    later.row("student-001").update(remark="Which cause?")
    assert later.read().changed == 2
    assert given(book)[2:] == [
        ("student-000", WORDS, 2, 0.5, "Show it.", "Ann"),
        ("student-001", WORDS, None, 1 / 3, "Which cause?", "Ann"),
    ]


def test_what_another_decided_in_between_is_a_conflict_and_is_not_replaced(table, book):
    (now,) = [one for one in book.scores.answers([WORDS]) if one.student == "student-000"]
    table.made.give("Bea", WORDS, [Pick(key_of("student-000", WORDS), seen(now))], level=1)
    table.row("student-000").update(level=4)
    record(
        book, graded("student-001", mark(), prose(given="Another."), report_text(given="Another, too."), submission="2")
    )
    table.row("student-001").update(level=4)
    row = table.rows.index(table.row("student-000")) + 2
    done = table.read()
    assert (done.changed, len(done.problems)) == (0, 2)
    (told,) = [problem for problem in done.problems if "Bea" in problem]
    assert told.startswith(f"Row {row}: ")
    assert "Bea gave it level 1, 0.25 of 1 point at" in told
    assert [act[2] for act in given(book)] == [1]


def test_points_are_taken_with_all_that_was_typed(table, book):
    table.row("student-000").update(points="0,125")
    table.row("student-001").update(points=0.3333)
    table.row("student-002").update(level=3, points=0.751)
    done = table.read(separator=";") if table.path.suffix == ".csv" else table.read()
    assert sorted(act[3] for act in given(book)) == [0.125, 0.3333]
    assert "level 3 is 0.75 points, and not 0.751" in done.problems[0]
    later = Table(table.made, table.path)
    later.row("student-001").update(points=0.334)  # as near to what was written as what was given
    assert (later.read().changed, given(book)[-1][3]) == (1, 0.334)


def test_a_levels_worth_may_be_typed_beside_it_in_full_or_as_it_is_shown(book, tmp_path):
    fill(book, texts(2))
    made = desk(book)
    made.levels = LevelSettings({**LEVELS.shares, 3: 0.667})
    table = Table(made, tmp_path / "scores.csv")
    table.row("student-000", COMPARED).update(level=3, points="1.334")
    table.row("student-001", COMPARED).update(level=3, points="1.33")
    assert table.read().problems == []
    assert [act[2:4] for act in given(book)] == [(3, 1.334)] * 2
    later = Table(made, table.path)
    later.row("student-000", COMPARED).update(remark="Well.")
    assert later.read().changed == 1 and given(book)[-1][2:5] == (3, 1.334, "Well.")
    assert str(later.read()) == "0 scored, 4 as they were, 0 not taken."


def test_a_mark_by_hand_stands_in_the_table_as_it_is_and_not_as_the_level_before_it(table, book):
    table.row("student-000").update(level=3)
    table.read()
    book.set_mark("student-000", *WORDS, 0.2, "copied", "Prof")
    later = Table(table.made, table.path)
    row = later.row("student-000")
    assert (row["level"] or "", float(row["points"]), row["remark"]) == ("", 0.2, "copied")
    assert re.fullmatch(r"Prof gave it 0.2 of 1 point at \d\d:\d\d UTC: “copied”", row["state"])
    row["remark"] = "copied, so it seems"
    done = later.read()
    assert done.changed == 1 and given(book)[-1] == ("student-000", WORDS, None, 0.2, "copied, so it seems", "Ann")
    (told,) = done.replaced
    assert "Prof gave it 0.2 of 1 point" in told and told.endswith("Now: 0.2 points.")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"level": 5}, "no level '5'"),
        ({"level": "good"}, "no level 'good'"),
        ({"level": 2.5}, "no level '2.5'"),
        ({"points": 1.5}, "give 0 to 1 point, not '1.5'"),
        ({"points": -1}, "give 0 to 1 point"),
        ({"points": "nan"}, "give 0 to 1 point"),
        ({"points": "many"}, "give 0 to 1 point, not 'many'"),
        ({"level": 3, "points": 1}, "level 3 is 0.75 points, and not 1"),
        ({"level": 4, "points": 0.5}, "level 4 is 1 point, and not 0.5"),
        ({"level": 3, "points": "many"}, "level 3 is 0.75 points, and not many"),
        ({"remark": "Only words."}, "neither level nor points"),
        ({"level": 3, "key": "feedfeedfeedfeed"}, "no such answer any more"),
        ({"level": 3, "check": ""}, "“check” was changed"),
        ({"level": 3, "check": "1/2/x/4/5/6"}, "“check” was changed"),
    ],
)
def test_what_cannot_be_taken_is_told_with_its_row_and_the_rest_is_taken(table, book, change, said):
    table.rows[2].update(change)
    table.rows[5].update(level=4)
    done = table.read()
    assert done.changed == 1
    assert len(done.problems) == 1
    assert done.problems[0].startswith("Row 4: ")
    assert said in done.problems[0]


def test_a_row_that_stands_twice_counts_once_and_a_score_that_was_emptied_is_told(table, book):
    table.row("student-000").update(level=3)
    table.rows.append({**table.row("student-000"), "level": 1})
    done = table.read()
    assert (done.changed, len(done.problems)) == (1, 1)
    assert "that one counts" in done.problems[0]
    later = Table(table.made, table.path)
    later.row("student-000").update(level="", points="")
    assert "neither level nor points" in later.read().problems[0]


def test_no_students_text_is_a_formula(book, tmp_path):
    for n, text in enumerate(FORMULAS):
        record(book, graded(f"s{n}", mark(), prose(given=text), report_text(given="\x1b[31m\u202e\x00 plain")))
    made = desk(book)
    tables.write(made, tmp_path / "a.xlsx")
    table = load_workbook(tmp_path / "a.xlsx").active
    cells = [cell for line in table.iter_rows(min_row=2) for cell in line]
    assert {cell.value for cell in cells} >= set(FORMULAS)
    assert "f" not in {cell.data_type for cell in cells}
    inside = zipfile.ZipFile(tmp_path / "a.xlsx")
    assert not any(b"<f>" in inside.read(name) for name in inside.namelist() if "worksheets" in name)
    tables.write(made, tmp_path / "a.csv")
    rows = list(csv.reader(io.StringIO((tmp_path / "a.csv").read_text("utf-8-sig"), newline="")))
    assert not any(cell.lstrip().startswith(("=", "+", "-", "@")) for row in rows for cell in row)
    assert "\x1b" not in (tmp_path / "a.csv").read_text("utf-8")


@pytest.mark.parametrize(("column", "content"), [("remark", "=1+1"), ("level", "=3"), ("remark", "#NAME?")])
def test_a_formula_without_a_result_is_told_and_its_row_not_taken(book, tmp_path, column, content):
    fill(book, texts(2))
    made = desk(book)
    path = tmp_path / "scores.xlsx"
    tables.write(made, path)
    file = load_workbook(path)
    heading = [cell.value for cell in file.active[1]]
    for row in (2, 3):
        file.active.cell(row, heading.index("level") + 1).value = 3
    file.active.cell(3, heading.index(column) + 1).value = content
    file.active.cell(2, heading.index("answer") + 1).value = "=1+1"  # nothing that matters
    file.save(path)
    done = tables.read(made, path, "Ann")
    assert (done.changed, len(done.problems)) == (1, 1)
    assert done.problems[0].startswith(f"Row 3: its {column} is a formula without a result")
    assert len(given(book)) == 1


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.txt", b"", r"\.xlsx or \.csv"),
        ("a.csv", b"", "no column key"),
        ("a.csv", b"key,level\n1,2\n", "points, remark, check"),
        ("a.csv", b"key,\xff", "not UTF-8"),
        ("a.xlsx", b"PK nothing", "cannot be read"),
        ("missing.csv", None, "cannot be read"),
    ],
)
def test_what_is_no_such_table_is_told(book, tmp_path, name, content, said):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(GradingError, match=said):
        tables.read(desk(book), tmp_path / name, "Ann")


@pytest.mark.parametrize("fits", [True, False])
def test_characters_of_a_cell(book, tmp_path, fits):
    answer = "x" * (32_000 + (not fits))
    fill(book, [answer])
    cells = [row["answer"] for row in Table(desk(book), tmp_path / "a.xlsx").rows]
    assert (answer in cells) == fits and max(map(len, cells)) <= 32_767


@pytest.mark.parametrize("fits", [True, False])
def test_bytes_of_a_table(table, monkeypatch, fits):
    table.save()
    monkeypatch.setattr(table_files, "MOST_BYTES", table.path.stat().st_size - (not fits))
    with nullcontext() if fits else pytest.raises(GradingError, match="larger"):
        tables.read(table.made, table.path, "Ann")


def test_where_it_cannot_be_written_is_told(book, tmp_path):
    fill(book, texts(1))
    with pytest.raises(GradingError, match="cannot be written"):
        tables.write(desk(book), tmp_path / "no" / "a.csv")

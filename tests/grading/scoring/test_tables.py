"""Scores out and in as a table: only what was changed is taken, and there is a message on each row that is not."""

import csv
import io
import random
import zipfile
from contextlib import nullcontext

import pytest
from gradebooks import graded, mark, prose, record, report_text
from openpyxl import Workbook, load_workbook
from scoring_class import COMPARED, WORDS, desk, fill, texts

from labcourse.errors import GradingError
from labcourse.grading.scoring import tables
from labcourse.grading.scoring.desk import Pick, key_of, seen

FORMULAS = ['=HYPERLINK("http://example.com";"x")', "+1+1", "-2 rad/s is what I see", "@SUM(A1)", "\t=1+1", "'=1"]


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
        lines = [list(self.rows[0]), *(list(row.values()) for row in self.rows)]
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


def give(table, who, level, student="student-000"):
    (now,) = [one for one in table.made.book.scores.answers([WORDS]) if one.student == student]
    table.made.give(who, WORDS, [Pick(key_of(student, WORDS), seen(now))], level=level)


def test_there_is_a_row_for_each_answer_without_a_name(table, book):
    assert [row["question"] for row in table.rows] == ["2.11"] * 4 + ["2.16"] * 4
    assert {row["answer"] for row in table.rows} == {one.mark.given for one in book.scores.answers()}
    assert not any("student-" in str(row[name]) for row in table.rows for name in row if name != "answer")
    assert not any(row["level"] or row["points"] for row in table.rows)


def test_what_was_filled_in_is_taken_in_any_order_and_the_rest_left(table, book):
    table.row("student-000").update(level=3, remark="Show  it.")
    table.row("student-001").update(points="0,3")
    table.row("student-002", COMPARED).update(level="4")
    table.row("student-003").update(points=1 / 3)
    random.Random(1).shuffle(table.rows)
    done = table.read(separator=";") if table.path.suffix == ".csv" else table.read()
    assert str(done) == "4 scored, 4 as they were, 0 not taken."
    expected = [
        ("student-000", WORDS, 3, 0.75, "Show it.", "Ann"),
        ("student-001", WORDS, None, 0.3, "", "Ann"),
        ("student-002", COMPARED, 4, 2.0, "", "Ann"),
        ("student-003", WORDS, None, 1 / 3, "", "Ann"),
    ]
    assert sorted(given(book)) == expected
    assert str(tables.read(table.made, table.path, "Ann")) == "0 scored, 8 as they were, 0 not taken."
    assert sorted(given(book)) == expected


def test_a_score_is_changed_in_a_table_that_was_written_anew(table, book):
    table.row("student-000").update(level=3, remark="Show it.")
    table.row("student-001").update(points=1 / 3)
    table.read()
    later = Table(table.made, table.path)
    assert str(later.row("student-000")["level"]) == "3" and not later.row("student-000")["points"]
    later.row("student-000").update(level=2)
    later.row("student-001").update(remark="Which cause?")  # 0.33 stays 1/3
    assert later.read().changed == 2
    assert given(book)[2:] == [
        ("student-000", WORDS, 2, 0.5, "Show it.", "Ann"),
        ("student-001", WORDS, None, 1 / 3, "Which cause?", "Ann"),
    ]


@pytest.mark.parametrize("meanwhile", ["another", "by hand", "text"])
@pytest.mark.parametrize("was_read", [True, False])
@pytest.mark.parametrize("changed", [True, False])
def test_what_another_decided_since_a_table_was_written_stays(table, book, meanwhile, was_read, changed):
    if was_read:
        table.row("student-000").update(level=3)
        table.read()
    if meanwhile == "by hand":
        book.set_mark("student-000", *WORDS, 0.1, "Looked at again.", "Prof")
    elif meanwhile == "text":
        record(book, graded("student-000", mark(), prose(given="Another."), report_text(), submission="2"))
    else:
        give(table, "Bea", level=2)
    before = given(book)
    if changed:
        table.row("student-000").update(level=4)
    done = table.read()
    assert (done.changed, len(done.problems)) == (0, int(changed or was_read)) and given(book) == before
    if done.problems:
        row = table.rows.index(table.row("student-000")) + 2
        assert done.problems[0].startswith(f"Row {row}: Answer ") and "Nothing of yours" in done.problems[0]


def test_a_scorer_corrects_an_own_score_in_a_table_that_was_read(table, book):
    table.row("student-000").update(level=3)
    table.row("student-001").update(points=0.3)
    table.read()
    table.row("student-000").update(level=1)
    table.row("student-001").update(points=0.4)
    done = table.read()
    assert (done.changed, done.same, done.problems) == (2, 6, [])
    assert "Ann gave it level 3, 0.75 of 1 point at" in done.replaced[0]
    assert [act[2:4] for act in given(book)] == [(3, 0.75), (None, 0.3), (1, 0.25), (None, 0.4)]
    other = table.read(by="Bea")  # she did not score these
    assert (other.changed, len(other.problems)) == (0, 2)
    table.row("student-000").update(level=3)  # as it was before: nobody knows which is meant
    assert "You decided otherwise" in table.read().problems[0]


@pytest.mark.parametrize("changed", [True, False])
def test_what_a_scorer_decided_in_the_browser_since_is_replaced_by_a_changed_row_only(table, book, changed):
    table.row("student-000").update(level=3)
    table.read()
    give(table, "Ann", level=2)
    if changed:
        table.row("student-000").update(level=4)
    done = table.read()
    assert (done.changed, len(done.replaced), len(done.problems)) == ((1, 1, 0) if changed else (0, 0, 1))
    assert given(book)[-1][2] == (4 if changed else 2)


def test_a_score_that_is_set_back_to_what_a_table_had_is_no_unchanged_row(table, book):
    give(table, "Ann", level=3)
    later = Table(table.made, table.path)
    later.row("student-000").update(level=2)
    later.read()
    later.row("student-000").update(level=3)
    assert "You decided otherwise" in later.read().problems[0]


def test_marks_of_others_that_are_replaced_are_named(table, book):
    give(table, "Bea", level=3)
    later = Table(table.made, table.path)
    assert "Bea gave it level 3" in later.row("student-000")["state"]
    later.row("student-000").update(level=4)
    later.row("student-001").update(level=4)
    done = later.read()
    row, label = later.rows.index(later.row("student-000")) + 2, table.made.label("student-000", WORDS)
    assert done.changed == 2
    (message,) = done.replaced
    assert message.startswith(f"Row {row}: {label} was scored before. Bea gave it level 3, 0.75 of 1 point at")


def test_questions_to_the_instructor_are_in_it_and_can_be_decided(table, book):
    for student in ("student-000", "student-001"):
        book.scores.ask(student, WORDS, "Bea", remark="=Is it?")
    assert tables.write(table.made, table.path) == (8, 2)
    later = Table(table.made, table.path)
    states = [row["state"] for row in later.rows if row["state"]]
    assert len(states) == 2 and all("Bea asked the instructor" in one and "=Is it?" in one for one in states)
    later.row("student-000").update(level=4)
    assert later.read("Prof").changed == 1
    assert [one.student for one in book.scores.answers([WORDS]) if one.asked] == ["student-001"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"level": 5}, "no level '5'"),
        ({"level": "good"}, "no level 'good'"),
        ({"level": 2.5}, "no level '2.5'"),
        ({"points": 1.5}, "give 0 to 1 point, not '1.5'"),
        ({"points": -1}, "give 0 to 1 point"),
        ({"points": "nan"}, "give 0 to 1 point"),
        ({"points": "many"}, "give 0 to 1 point, not 'many'"),
        ({"level": 3, "points": 1}, "either a level or points"),
        ({"remark": "Only words."}, "either a level or points"),
        ({"level": 3, "key": "feedfeedfeedfeed"}, "no such answer any more"),
        ({"level": 3, "check": ""}, "“check” was changed"),
        ({"level": 3, "check": "1/x/3"}, "“check” was changed"),
    ],
)
def test_a_row_that_cannot_be_taken_is_named_and_the_rest_is_taken(table, change, message):
    table.rows[2].update(change)
    table.rows[5].update(level=4)
    done = table.read()
    assert (done.changed, len(done.problems)) == (1, 1)
    assert done.problems[0].startswith("Row 4: ") and message in done.problems[0]


def test_a_row_that_is_there_twice_counts_once_and_a_score_cannot_be_emptied(table):
    table.row("student-000").update(level=3)
    table.rows.append({**table.row("student-000"), "level": 1})
    done = table.read()
    assert (done.changed, len(done.problems)) == (1, 1) and "that one counts" in done.problems[0]
    later = Table(table.made, table.path)
    later.row("student-000").update(level="")
    assert "either a level or points" in later.read().problems[0]


def test_no_students_text_is_a_formula(book, tmp_path):
    for n, text in enumerate(FORMULAS):
        record(book, graded(f"s{n}", mark(), prose(given=text), report_text(given="\x1b[31m\u202e\x00 plain")))
    made = desk(book)
    tables.write(made, tmp_path / "a.xlsx")
    cells = [cell for line in load_workbook(tmp_path / "a.xlsx").active.iter_rows(min_row=2) for cell in line]
    assert {cell.value for cell in cells} >= set(FORMULAS)
    assert "f" not in {cell.data_type for cell in cells}
    inside = zipfile.ZipFile(tmp_path / "a.xlsx")
    assert not any(b"<f>" in inside.read(name) for name in inside.namelist() if "worksheets" in name)
    tables.write(made, tmp_path / "a.csv")
    text = (tmp_path / "a.csv").read_text("utf-8-sig")
    rows = list(csv.reader(io.StringIO(text, newline="")))
    assert not any(cell.lstrip().startswith(("=", "+", "-", "@")) for row in rows for cell in row)
    assert "\x1b" not in text


@pytest.mark.parametrize(("column", "content"), [("remark", "=1+1"), ("level", "=3"), ("remark", "#NAME?")])
def test_a_formula_or_an_error_is_not_taken(book, tmp_path, column, content):
    fill(book, texts(2))
    made, path = desk(book), tmp_path / "scores.xlsx"
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
    assert done.problems[0].startswith(f"Row 3: its {column} is a formula")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.txt", b"", r"\.xlsx or \.csv"),
        ("a.csv", b"", "no column key"),
        ("a.csv", b"key,level\n1,2\n", "points, remark, check"),
        ("a.csv", b"key,\xff", "not UTF-8"),
        ("a.xlsx", b"PK nothing", "cannot be read"),
        ("missing.csv", None, "cannot be read"),
    ],
)
def test_a_file_that_is_no_such_table_is_refused(book, tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(GradingError, match=message):
        tables.read(desk(book), tmp_path / name, "Ann")
    with pytest.raises(GradingError, match="cannot be written"):
        tables.write(desk(book), tmp_path / "no" / "a.csv")


@pytest.mark.parametrize("fits", [True, False])
def test_long_cells_are_cut_and_large_files_are_refused(book, tmp_path, monkeypatch, fits):
    answer = "x" * (32_000 + (not fits))
    fill(book, [answer])
    table = Table(desk(book), tmp_path / "a.xlsx")
    cells = [row["answer"] for row in table.rows]
    assert (answer in cells) == fits and max(map(len, cells)) <= 32_767
    table.save()
    monkeypatch.setattr(tables, "MOST_BYTES", table.path.stat().st_size - (not fits))
    with nullcontext() if fits else pytest.raises(GradingError, match="larger"):
        tables.read(table.made, table.path, "Ann")

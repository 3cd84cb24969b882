"""Each bound on what a student's work may be like, at either side of its value: what just fits is taken."""

import base64
import io
import json
from functools import reduce
from pathlib import PurePosixPath

import numpy as np
import pytest
from PIL import Image

from labcourse import files
from labcourse.answers import answers, cell_reports, expressions, forms, json_values, own_files, schema, words
from labcourse.answers.parts import Question, number, prose, recording
from labcourse.answers.words import Budget, PictureError, as_png, pictures_of
from labcourse.errors import AnswerError
from labcourse.problems import Code, Problem
from labcourse.run import student_folder, submit
from rotflex.recording import Channel, Recording

FITS = pytest.mark.parametrize("fits", [True, False], ids=["fits", "one more"])
WORDS = prose("why", "", "")


def taken(fits, act, error, words="."):
    """What is made where it fits; else the error, whose words are looked for."""
    if fits:
        return act()
    with pytest.raises(error, match=words):
        act()
    return None


@FITS
def test_bytes_of_a_file_of_answers(monkeypatch, fits):
    data = b'{"answers": {}, "student": "ada", "format": 2, "bench": {}, "probe_seed": 1, "software": ""}'
    monkeypatch.setattr(answers, "MAX_BYTES", len(data) - (not fits))
    taken(fits, lambda: answers.parse(data), AnswerError, f"{len(data)} bytes")


@FITS
def test_bytes_of_one_answer(monkeypatch, fits):
    size = len(json.dumps({"kind": "prose", "value": "So it is."}))
    monkeypatch.setattr(forms, "MAX_BYTES", size - (not fits))
    taken(fits, lambda: forms.encode(WORDS, "So it is.", 1), AnswerError, f"at most {size - 1}")


@FITS
def test_the_file_grows_to_its_limit(tmp_path, monkeypatch, fits):
    question = Question("1", "1", "a", "", (), (WORDS, number("x", "", None, "", "")))

    def reply_in(name):
        book = answers.AnswerBook(tmp_path / name, "ada", {"uri": "virtual"}, 1)
        replies = book.answer(question, {"x": 1.0, "why": "y" * 500})
        assert replies[0].recorded and book.get("1", "x") is not None  # whatever becomes of the other part
        return replies[1]

    assert reply_in("free.json").recorded
    size = (tmp_path / "free.json").stat().st_size
    monkeypatch.setattr(answers, "MAX_BYTES", size - (not fits))
    reply = reply_in("held.json")
    assert reply.recorded == fits
    assert fits or f"would be larger than {size - 1} bytes" in reply.refused


def run_of(samples, metadata=None):
    return Recording(0.01 * np.arange(samples), {"theta": Channel(np.zeros(samples), "rad")}, metadata or {})


PART = recording("r", {}, ("theta",), "", "", units={"theta": "rad"})


@FITS
def test_samples_of_a_recording(monkeypatch, fits):
    monkeypatch.setattr(json_values, "MOST_SAMPLES", 1000)
    taken(fits, lambda: forms.encode(PART, run_of(1000 + (not fits)), 1), AnswerError, "too long")


@FITS
def test_characters_of_a_recordings_metadata(monkeypatch, fits):
    metadata = {"note": "x" * 300}
    size = len(json.dumps(metadata))
    monkeypatch.setattr(json_values, "LONGEST_METADATA", size - (not fits))
    taken(fits, lambda: forms.encode(PART, run_of(100, metadata), 1), AnswerError, "metadata")


X = ["symbol", "x"]


@FITS
@pytest.mark.parametrize(
    ("words", "tree"),
    [
        ("integers", lambda more: ["int", 10**20 + more]),
        ("integers", lambda more: ["int", -(10**20) - more]),
        ("too large", lambda more: ["add", *([["int", 1]] * (expressions.MAX_NODES - 1 + more))]),
        ("too large", lambda more: reduce(lambda tree, _: ["sin", tree], range(expressions.MAX_DEPTH - 1 + more), X)),
        ("exponent", lambda more: ["pow", X, ["int", 64 + more]]),
        ("exponent", lambda more: ["pow", ["pow", X, ["int", 8 + more]], ["int", 8]]),
    ],
)
def test_integers_nodes_levels_and_exponents_of_an_expression(fits, words, tree):
    taken(fits, lambda: expressions.check(tree(not fits)), AnswerError, words)


def png(width, height):
    packed = io.BytesIO()
    Image.new("RGB", (width, height), "white").save(packed, format="PNG")
    return packed.getvalue()


@FITS
@pytest.mark.parametrize("size", [(20, 10), (10, 20)])
@pytest.mark.parametrize(
    ("name", "limit", "code"),
    [
        ("MAX_PICTURE", None, Code.PICTURE_TOO_LARGE),
        ("MAX_PIXELS", 200, Code.PICTURE_OF_MANY_PIXELS),
        ("MAX_SIDE", 20, Code.PICTURE_TOO_WIDE),
    ],
)
def test_bytes_pixels_and_sides_of_a_picture(monkeypatch, fits, size, name, limit, code):
    data = png(*size)
    monkeypatch.setattr(words, name, (limit or len(data)) - (not fits))
    taken(fits, lambda: as_png(data, Budget()), PictureError, code)


@FITS
def test_pixels_of_all_pictures_together(monkeypatch, fits):
    monkeypatch.setattr(words, "FEWEST_PIXELS", 200)
    budget = Budget(400 - (not fits))
    as_png(png(20, 10), budget)
    assert budget.left == 200 - (not fits)
    taken(fits, lambda: as_png(png(20, 10), budget), PictureError, Code.PICTURES_OF_MANY_PIXELS)


@FITS
def test_scans_of_a_jpeg(fits):
    """Each goes over the whole picture: a small file with thousands of them takes minutes."""
    packed = io.BytesIO()
    Image.new("L", (64, 64), "white").save(packed, "JPEG", progressive=True)
    start, mark, last = packed.getvalue().rpartition(words._SCAN)
    more = words.MOST_SCANS - start.count(words._SCAN) + (not fits)
    data = start + (mark + last[:-2]) * more + last[-2:]
    taken(fits, lambda: as_png(data, Budget()), PictureError, Code.PICTURE_UNUSUAL)


@pytest.mark.parametrize("number", [6, 7])
def test_pictures_of_one_answer(number):
    text = " ".join(f"![a](attachment:{place}.png)" for place in range(number))
    data = base64.b64encode(png(20, 10)).decode()
    found = pictures_of(text, {f"{place}.png": {"image/png": data} for place in range(number)}, {}, Budget())
    assert len(found.saved) == 6
    assert found.problems == ([] if number == 6 else [Problem.of(Code.TOO_MANY_PICTURES, most=6)])


@pytest.mark.parametrize("side", [1399, 1400, 1401, 3000])
def test_a_picture_is_kept_with_a_side_of_1400_pixels_at_most(side):
    kept = Image.open(io.BytesIO(as_png(png(side, 10), Budget())))
    assert kept.width == min(side, 1400)


@FITS
def test_bytes_of_a_picture_as_it_is_kept(monkeypatch, fits):
    noise = np.random.default_rng(1).integers(0, 255, (400, 400, 3), dtype=np.uint8)
    packed = io.BytesIO()
    Image.fromarray(noise).save(packed, format="PNG")
    whole = as_png(packed.getvalue(), Budget())
    monkeypatch.setattr(words, "MAX_STORED", len(whole) - (not fits))
    kept = as_png(packed.getvalue(), Budget())
    assert (kept == whole) == fits and len(kept) <= len(whole)


def notebook(cells):
    return json.dumps({"cells": cells}).encode()


@FITS
def test_bytes_of_a_notebook_in_a_students_folder(tmp_path, monkeypatch, fits):
    path = tmp_path / "a.ipynb"
    path.write_bytes(notebook([]))
    monkeypatch.setattr(files, "MAX_BYTES", path.stat().st_size - (not fits))
    found = student_folder.read(tmp_path, ["a.ipynb"], ["rotflex"])
    assert ("a.ipynb" in found.hand_in.notebooks, bool(found.problems)) == (fits, not fits)


@FITS
def test_characters_that_a_cell_shows(monkeypatch, fits):
    outputs = [{"output_type": "stream", "text": "x" * 100}]
    monkeypatch.setattr(submit, "MAX_OUTPUT", len(json.dumps(outputs)) - (not fits))
    assert submit.slim(notebook([{"cell_type": "code", "source": "", "outputs": outputs}]))[1] == (not fits)


@FITS
@pytest.mark.parametrize(
    ("name", "files"), [("MAX_FILE", [("a.csv", 1000)]), ("MAX_TOTAL", [("a.csv", 400), ("b.csv", 600)])]
)
def test_bytes_of_own_files(monkeypatch, fits, name, files):
    monkeypatch.setattr(own_files, name, 1000 - (not fits))
    paths, notes = own_files.choose([(PurePosixPath(path), size) for path, size in files], ["a.ipynb"])
    assert (len(paths) == len(files), len(notes)) == (fits, not fits)


@FITS
def test_number_depth_and_length_of_own_files(monkeypatch, fits):
    def taken_of(*paths):
        chosen, notes = own_files.choose([(PurePosixPath(path), 1) for path in paths], ["a.ipynb"])
        return len(chosen) == len(paths) and notes == []

    assert taken_of(*(f"f{place:03}.csv" for place in range(200 + (not fits)))) == fits
    assert taken_of("/".join("d" * (8 + (not fits))) + "/x.csv") == fits
    assert taken_of("x" * (236 + (not fits)) + ".csv") == fits


@FITS
def test_folders_of_own_files_on_disk(tmp_path, fits):
    deep = tmp_path / "/".join("d" * (own_files.MAX_DEPTH + (not fits)))
    deep.mkdir(parents=True)
    (deep / "x.csv").write_text("1")
    contents, notes = own_files.read(tmp_path, [])
    assert (len(contents), len(notes)) == (int(fits), int(not fits))
    assert fits or notes[0].parameters["why"] == Problem.of(Code.OWN_FILE_TOO_DEEP, most=8)


def lines(events):
    return b"".join(json.dumps(event).encode() + b"\n" for event in events)


@FITS
def test_bytes_of_a_report(monkeypatch, fits):
    data = lines([{"event": "started", "notebook": "a", "cell": str(place)} for place in range(3)])
    monkeypatch.setattr(schema.cell_reports, "MAX_BYTES", len(data) - 1 - (not fits))  # a line's end may be missing
    assert len(schema.read_reports(data).cells) == (3 if fits else 2)


@FITS
def test_answers_that_a_cell_lacked(fits):
    number_of = 50 + (not fits)
    events = [{"event": "started", "notebook": "a", "cell": "c"}]
    events += [{"event": "lacked", "notebook": "a", "question": str(place), "part": "x"} for place in range(number_of)]
    (cell,) = schema.read_reports(lines(events)).cells
    assert len(cell.lacked) == 50


@pytest.mark.parametrize("line", [0, 1, 10**6 - 1, 10**6, True, "3", None])
def test_the_line_of_an_error(line):
    possible = line is None or (type(line) is int and 1 <= line <= 10**6 - 1)
    error = cell_reports.of_exception(SyntaxError("no", ("a", line, 1, "")))
    assert error.line == (line if possible else None)
    events = [{"event": "ended", "notebook": "a", "cell": "c", "error": {"type": "E", "message": "", "line": line}}]
    cells = schema.read_reports(lines(events)).cells
    assert [cell.error.line for cell in cells] == ([line] if possible else [])


@FITS
def test_characters_of_a_name_and_of_a_message_in_a_report(fits):
    text = "x" * (cell_reports.LONGEST + (not fits))
    assert len(cell_reports.of_exception(ValueError(text)).message) == cell_reports.LONGEST
    for name, value in (("notebook", text), ("cell", text), ("error", {"type": "E", "message": text, "line": None})):
        event = {"event": "ended", "notebook": "a", "cell": "c", "error": None, name: value}
        assert bool(schema.read_reports(lines([event])).cells) == fits


@FITS
def test_levels_and_integers_of_a_recordings_metadata_are_those_that_a_file_of_answers_may_have(tmp_path, fits):
    inner = 10**20 + (not fits)
    deep = reduce(lambda value, _: [value], range(schema.MAX_DEPTH - 5 + (not fits)), 1)
    for metadata in ({"seed": inner}, {"deep": deep}):
        book = answers.AnswerBook(tmp_path / "answers.json", "ada", {}, 1)
        (reply,) = book.answer(Question("1", "1", "a", "", (), (PART,)), {"r": run_of(10, metadata)})
        assert reply.recorded == fits and ("not plain data" in reply.refused) != fits
    assert not fits or answers.parse((tmp_path / "answers.json").read_bytes())["answers"]["1"]["r"]["n"] == 10

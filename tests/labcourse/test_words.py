"""Answers in words: found in a student's text cells, whatever an editor or the student did to them."""

import base64
import io
import re
import subprocess
import sys
import zlib

import pytest
from PIL import Image

from labcourse.answers import words
from labcourse.answers.json_values import LONGEST_PROSE
from labcourse.answers.notebooks import Cell
from labcourse.answers.words import STUB, TextAnswer
from labcourse.problems import Code, Problem

HEADING = words.heading("Your answer: 1.1, why")
OTHER = words.heading("Your answer: 1.2, how")


def master(cell_id, source, kind="markdown", where=None):
    metadata = {"nbgrader": {"grade_id": f"grade-{cell_id}"}}
    if where:
        metadata[words.KEY] = {"question": where[0], "part": where[1]}
    return {"id": cell_id, "cell_type": kind, "metadata": metadata, "source": source}


MASTER = [
    master("text", "## Question 1.1"),
    master("why", f"{HEADING}\n\n{STUB}", where=("1.1", "why")),
    master("code", "k = None", "code"),
    master("record", "lab.answer('1.1', k=k)", "code"),
    master("how", f"{OTHER}\n\n{STUB}", where=("1.2", "how")),
    master("end", "## The end"),
]
WHY = ("1.1", "why")
NO_FORMAT = Problem.of(Code.PICTURE_OF_OTHER_FORMAT, formats=words._FORMATS)


def cell(source, cell_id="", kind="markdown", grade_id="", attachments=None):
    return Cell(cell_id, grade_id, kind, source, attachments or {})


def pristine(**changes):
    """A student's cells as released, by id; a change of None leaves a cell out, a list puts cells in its place."""
    found = []
    for one in MASTER:
        usual = cell(one["source"], one["id"], one["cell_type"], f"grade-{one['id']}")
        changed = changes.get(one["id"], usual)
        found += changed if isinstance(changed, list) else [] if changed is None else [changed]
    return found


def texts(cells, **options):
    return {where: found.text for where, found in words.written(MASTER, cells, **options).words.items()}


def of_why(code, **parameters):
    return Problem.of(code, question=WHY[0], part=WHY[1], **parameters)


def left_out(problems):
    """The pictures that are left out of the answer, and why."""
    about = [(one.code, one.parameters["question"], one.parameters["part"]) for one in problems]
    assert about == [(Code.PICTURE_LEFT_OUT, *WHY)] * len(problems)
    return {one.parameters["picture"]: one.parameters["why"] for one in problems}


def why(source, **more):
    return cell(source, **{"cell_id": "why", "grade_id": "grade-why", **more})


def png(size=(4, 3), colour="red", kind="PNG", **more):
    packed = io.BytesIO()
    Image.new("RGB", size, colour).save(packed, kind, **more)
    return packed.getvalue()


def with_pictures(source, attachments):
    found = words.written(MASTER, pristine(why=why(source, attachments=attachments)))
    return found.words[WHY].pictures, found.problems


def attached(data, name="image.png", media="image/png"):
    return {name: {media: base64.b64encode(data).decode()}}


def test_pictures_of_one_name_in_two_cells_of_an_answer_are_two():
    red, blue = png(), png(colour="blue")
    split = [
        why(f"{name}: ![x](attachment:image.png)", attachments=attached(data))
        for name, data in (("a", red), ("b", blue))
    ]
    found = words.written(MASTER, pristine(why=split)).words[WHY]
    shown = [found.pictures[target] for target in re.findall(r"\((.+?)\)", found.text)]
    colours = [[Image.open(io.BytesIO(data)).getpixel((0, 0)) for data in some] for some in (shown, [red, blue])]
    assert colours[0] == colours[1] and shown[0] != shown[1]


@pytest.mark.parametrize("source", ["", " \n ", "...", HEADING, STUB, f"{HEADING}\n\n{STUB}", f"{HEADING}\n\n{STUB}\n"])
def test_nothing_written_is_no_answer(source):
    found = words.written(MASTER, pristine(why=why(source)))
    assert (found.words, found.notes, found.problems) == ({}, [], [])


LANGUAGES = "Größe: $\\omega_n=\\sqrt{K_s}$\n\n* ¿por qué? — «c'est ça»\n\n| a | b |\n|---|---|"


@pytest.mark.parametrize(
    ("source", "text"),
    [
        (f"{HEADING}\n\nIt bends.", "It bends."),
        ("It bends.", "It bends."),
        (f"{HEADING} It bends.", "It bends."),
        (f"{HEADING}\n\n{STUB}\n\nIt bends.", "It bends."),
        (f"{HEADING}\n\n{STUB} It bends.", "It bends."),
        (f"{HEADING}\r\n\r\nIt bends.\r\n", "It bends."),
        (f"{HEADING}\n\n{words.BEGIN}\nIt bends.\n{words.END}", "It bends."),
        (f"{HEADING}\n\n{LANGUAGES}", LANGUAGES),
        ("a\x1b[31mb\x00", "a\ufffd[31mb\ufffd"),
    ],
)
def test_heading_and_stub_are_no_part_of_the_answer_and_all_else_is(source, text):
    found = words.written(MASTER, pristine(why=why(source)))
    assert (found.words, found.notes) == ({WHY: TextAnswer(text)}, [])


@pytest.mark.parametrize(
    "changed",
    [why("It bends.", cell_id="new"), why("It bends.", grade_id=""), cell(f"{HEADING}\n\nIt bends.")],
    ids=["renewed id", "no metadata", "neither: an old format"],
)
def test_an_answer_cell_is_known_by_id_or_grading_metadata_or_heading(changed):
    found = words.written(MASTER, pristine(why=changed))
    assert found.words[WHY].text == "It bends." and found.notes == []


def test_without_ids_metadata_and_heading_the_place_tells():
    cells = [cell(one.source, kind=one.kind) for one in pristine(why=why("It bends."))]
    found = words.written(MASTER, cells)
    assert found.words == {WHY: TextAnswer("It bends.")}
    assert found.notes == [of_why(Code.TEXT_IN_PLACE)]


def test_pieces_of_a_split_cell_are_joined_in_order():
    pieces = [why(f"{HEADING}\n\nFirst."), why("Second.", cell_id="b"), why("Third.", cell_id="c")]
    found = words.written(MASTER, pristine(why=pieces))
    assert (found.words[WHY].text, found.notes) == ("First.\n\nSecond.\n\nThird.", [])


def test_a_copy_that_was_left_as_it_was_does_not_count_and_one_that_differs_is_told():
    same = pristine(why=why("It bends."), end=[why("It bends.", cell_id="copy")])
    assert texts(same) == {WHY: "It bends."}
    empty = pristine(why=why(f"{HEADING}\n\n{STUB}"), end=[why("It bends.", cell_id="copy")])
    assert texts(empty) == {WHY: "It bends."}
    found = words.written(MASTER, pristine(why=why("It bends."), end=[why("It breaks.", cell_id="copy")]))
    assert found.words[WHY].text == "It bends.\n\nIt breaks."
    assert found.notes == [of_why(Code.TEXT_COPIES_DIFFER, count=2)]


@pytest.mark.parametrize("kind", ["code", "raw"])
def test_an_answer_cell_that_became_another_kind_is_read(kind):
    found = words.written(MASTER, pristine(why=why("It bends.", kind=kind)))
    assert found.words[WHY].text == "It bends."
    assert found.notes == [of_why(Code.TEXT_IN_OTHER_KIND)]


def test_a_text_beside_an_empty_answer_cell_is_the_answer_and_one_below_goes_on_with_it():
    stub, beside = why(f"{HEADING}\n\n{STUB}"), cell("It bends.")
    for cells, text, code in (
        ([stub, beside], "It bends.", Code.TEXT_BELOW),
        ([beside, stub], "It bends.", Code.TEXT_ABOVE),
        ([why("It bends."), cell("And how.")], "It bends.\n\nAnd how.", Code.TEXT_ALSO_BELOW),
        ([stub, cell("It bends.", kind="raw")], "It bends.", Code.TEXT_BELOW),
    ):
        found = words.written(MASTER, pristine(why=cells))
        assert found.words == {WHY: TextAnswer(text)}
        assert found.notes == [of_why(code)]


def test_helper_cells_and_notes_elsewhere_are_no_answers():
    cells = pristine(
        text=[cell("## Question 1.1", "text"), cell("to do: read this again")],
        why=[why("It bends."), cell("def helper(): return 1", kind="code")],
        end=[cell("## The end", "end"), cell("My notes.")],
    )
    found = words.written(MASTER, cells)
    assert (found.words, found.notes) == ({WHY: TextAnswer("It bends.")}, [])


def test_words_in_a_code_cell_beside_an_empty_answer_cell_are_told_and_code_is_not():
    told = [of_why(Code.TEXT_BESIDE_NOT_READ)]
    for source, notes in (("The link falls behind, as nothing pushes it.", told), ("for k in n:\n    print(k)", [])):
        cells = [why(f"{HEADING}\n\n{STUB}"), cell(source, kind="code")]
        found = words.written(MASTER, pristine(why=cells))
        assert (found.words, found.notes) == ({}, notes)


def test_of_two_answers_that_lack_none_gets_a_text_that_may_be_the_others():
    found = words.written([MASTER[1], MASTER[4]], [cell("Because.")])
    assert (found.words, {note.code for note in found.notes}) == ({}, {Code.TEXT_BESIDE_NOT_READ})
    assert {note.parameters["question"] for note in found.notes} == {"1.1", "1.2"}


def test_a_text_that_is_too_long_is_kept_as_far_as_it_goes_and_told():
    found = words.written(MASTER, pristine(why=why("x" * (LONGEST_PROSE + 7))))
    assert len(found.words[WHY].text) == LONGEST_PROSE
    assert found.problems == [of_why(Code.TEXT_TOO_LONG, count=LONGEST_PROSE + 7, most=LONGEST_PROSE)]
    assert words.written(MASTER, pristine(why=why("x" * LONGEST_PROSE))).problems == []


def test_a_pasted_picture_comes_along_as_png():
    jpeg = attached(png((80, 60), kind="JPEG"), "foto mit ü.jpg", "image/jpeg")
    pictures, problems = with_pictures("See:\n\n![x](attachment:foto%20mit%20%C3%BC.jpg)", jpeg)
    ((name, data),) = pictures.items()
    assert (name, problems) == ("attachment:foto%20mit%20%C3%BC.jpg", [])
    with Image.open(io.BytesIO(data)) as image:
        assert (image.format, image.size) == ("PNG", (80, 60))


def test_a_name_that_an_editor_stores_encoded_is_recognised():
    name = "Bild%20%281%29.png"  # as Jupyter Notebook 6 stores "Bild (1).png"
    pictures, problems = with_pictures(f"![x](attachment:{name})", attached(png(), name))
    assert (list(pictures), problems) == ([f"attachment:{name}"], [])


def test_pictures_written_into_the_text_count_as_pictures_and_not_as_characters():
    data = base64.b64encode(png((300, 300)) * 1).decode()
    found = words.written(MASTER, pristine(why=why(f"a ![p](data:image/png;base64,{data}) b")))
    assert found.words[WHY].text == "a ![p](attachment:in-text-1) b"
    assert list(found.words[WHY].pictures) == ["attachment:in-text-1"]
    found = words.written(MASTER, pristine(why=why(f"a ![p](data:image/png;base64,{'A' * 8000}) b")))
    assert left_out(found.problems) == {"attachment:in-text-1": NO_FORMAT}
    assert found.words[WHY].pictures == {}


def test_a_picture_beside_the_notebook_is_taken_from_there():
    files = {"plots/my plot.png": png(), "a%20b.png": png()}
    cells = pristine(why=why("![](plots/my%20plot.png) ![](<./plots/my plot.png>) ![](a%20b.png) ![](other.png)"))
    found = words.written(MASTER, cells, files)
    assert set(found.words[WHY].pictures) == {"plots/my%20plot.png", "./plots/my plot.png", "a%20b.png"}
    assert left_out(found.problems) == {"other.png": Problem.of(Code.PICTURE_NOT_IN_NOTEBOOK)}


def bomb(side):
    """A PNG of a few bytes that says that it has so many pixels in each direction."""
    data = bytearray(png())
    data[16:24] = side.to_bytes(4) * 2
    data[29:33] = zlib.crc32(bytes(data[12:29])).to_bytes(4)
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (bomb(60_000), Problem.of(Code.PICTURE_OF_MANY_PIXELS, most=60)),
        (bomb(8_000), Problem.of(Code.PICTURE_OF_MANY_PIXELS, most=60)),
        (png((1, 20_001)), Problem.of(Code.PICTURE_TOO_WIDE, most=20_000)),
        (png((400, 400))[:60], Problem.of(Code.PICTURE_DAMAGED)),
        (b"<svg onload='alert(1)'/>", NO_FORMAT),
        (b"", NO_FORMAT),
    ],
    ids=["bomb", "too large", "strip", "cut off", "svg", "empty"],
)
def test_a_picture_that_is_not_read_is_left_out_and_told(data, why):
    pictures, problems = with_pictures("![](attachment:image.png)", attached(data))
    assert pictures == {}
    assert left_out(problems) == {"attachment:image.png": why}


@pytest.mark.slow
def test_the_largest_picture_takes_bounded_memory_and_time():
    """In a process of its own, as its memory would not be told from that of others."""
    program = (
        "import io, resource, sys\nfrom PIL import Image\nfrom labcourse.answers import words\n"
        "packed = io.BytesIO()\nImage.new('RGBA', (7700, 7700)).save(packed, 'PNG')\n"
        "resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))\n"
        "print(len(words.as_png(packed.getvalue(), words.Budget())) > 1000)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert done.stdout == "True\n", done.stderr


def test_animated_pictures_are_their_first_frame():
    frames = [Image.new("P", (300, 300), color) for color in range(50)]
    packed = io.BytesIO()
    frames[0].save(packed, "GIF", save_all=True, append_images=frames[1:])
    pictures, _problems = with_pictures("![](attachment:image.png)", attached(packed.getvalue()))
    (data,) = pictures.values()
    with Image.open(io.BytesIO(data)) as image:
        assert (image.format, getattr(image, "n_frames", 1)) == ("PNG", 1)


def test_a_photograph_stands_upright_and_a_transparent_picture_is_on_white():
    turned = Image.new("RGB", (60, 40))
    exif = turned.getexif()
    exif[0x0112] = 6
    packed, clear = io.BytesIO(), io.BytesIO()
    turned.save(packed, "JPEG", exif=exif)
    Image.new("RGBA", (2, 2), (0, 0, 0, 0)).save(clear, "PNG")
    pictures = {**attached(packed.getvalue(), "a.jpg", "image/jpeg"), **attached(clear.getvalue(), "b.png")}
    found, _problems = with_pictures("![](attachment:a.jpg) ![](attachment:b.png)", pictures)
    upright, white = (Image.open(io.BytesIO(data)) for data in found.values())
    assert upright.size == (40, 60)
    assert white.convert("RGB").getpixel((0, 0)) == (255, 255, 255)


def test_what_is_added_to_the_text_of_the_question_is_the_answer_if_its_cell_is_empty_and_else_is_not():
    stub, typed = why(f"{HEADING}\n\n{STUB}"), cell("## Question 1.1\n\nIt bends.", "text", grade_id="grade-text")
    found = words.written(MASTER, pristine(text=typed, why=stub))
    assert (found.words, found.notes) == ({WHY: TextAnswer("It bends.")}, [of_why(Code.TEXT_IN_QUESTION)])
    assert texts(pristine(text=typed, why=why("It breaks."))) == {WHY: "It breaks."}
    other = cell("## Question 1\n\nIt bends.", "text", grade_id="grade-text")  # of another release, perhaps
    assert texts(pristine(text=other, why=stub)) == {}

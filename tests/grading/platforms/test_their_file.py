"""Cells of any file, and that nothing but what is changed changes. Python's csv is the other opinion."""

import codecs
import csv
import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labcourse.errors import GradingError
from labcourse.grading.platforms.their_file import SEPARATORS, read, table

SAID = st.text(st.sampled_from('ab "",;\t\r\n\'=#é学\x0b\u2028'), max_size=8)
ENDS = st.sampled_from(["\r\n", "\n", "\r"])
CODECS = st.sampled_from(
    [(b"", "utf-8"), (codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be")]
)


@st.composite
def files(draw):
    """Bytes of a file that some program wrote, its separator and its text."""
    separator = draw(st.sampled_from(SEPARATORS))
    text = ""
    for _ in range(draw(st.integers(0, 5))):
        cells = draw(st.lists(st.tuples(SAID, st.booleans()), max_size=4))
        text += separator.join(written(said, quoted, separator) for said, quoted in cells) + draw(ENDS)
    if draw(st.booleans()):
        text += written(draw(SAID), True, separator)  # no line end behind the last line
    mark, codec = draw(CODECS)
    return mark + text.encode(codec), separator, text


def written(said, quoted, separator):
    must = any(one in said for one in (separator, '"', "\r", "\n"))
    return '"' + said.replace('"', '""') + '"' if quoted or must else said


def by_csv(text, separator):
    return list(csv.reader(io.StringIO(text, newline=""), delimiter=separator))


def cells(found):
    return [[cell.text for cell in row] for row in found.rows]


@given(files())
def test_cells_are_those_that_pythons_csv_reads_and_without_a_change_no_byte_is_another(file):
    data, separator, text = file
    assert table(read(data), separator).changed({}) == data
    assert cells(table(read(data), separator)) == by_csv(text, separator)


@given(files(), SAID.filter(bool), st.data())
def test_one_change_changes_that_cell_and_no_other(file, said, draw):
    data, separator, text = file
    there = table(read(data), separator)
    places = [(row, place) for row, found in enumerate(there.rows) for place in range(len(found))]
    if not places:
        return
    row, place = draw.draw(st.sampled_from(places))
    new = there.changed({(row, place): said})
    expected = by_csv(text, separator)
    expected[row][place] = said
    source = read(data)
    decoded = new[len(source.mark) :].decode(source.codec)
    assert new.startswith(source.mark) and by_csv(decoded, separator) == expected
    cell = there.rows[row][place]  # and around it, not a byte is another
    before, after = text[: cell.start], text[cell.end :]
    assert decoded.startswith(before) and decoded.endswith(after)


def test_a_cell_in_quotes_stays_in_quotes_and_one_without_gets_them_only_if_it_has_to():
    there = table(read(b'"a",b,c\n'), ",")
    assert there.changed({(0, 0): "1"}) == b'"1",b,c\n'
    assert there.changed({(0, 1): "1.5", (0, 2): "1,5"}) == b'"a",1.5,"1,5"\n'


@pytest.mark.parametrize("codec", ["utf-16-le", "utf-16-be"])
def test_utf_16_is_known_without_a_byte_order_mark(codec):
    data = "Last Name\tÜ\r\n".encode(codec)
    assert read(data).text == "Last Name\tÜ\r\n" and table(read(data), "\t").changed({}) == data


def test_what_is_no_utf_8_stays_what_it_is():
    data = "Jürgen,1\r\n".encode("cp1252")
    assert table(read(data), ",").changed({(0, 1): "2"}) == "Jürgen,2\r\n".encode("cp1252")


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"PK\x03\x04rest", "Excel"),
        (codecs.BOM_UTF16_LE + b"a\0b", "UTF-16-LE.* byte 4"),
        (codecs.BOM_UTF8 + b"a\xff", "UTF-8.* byte 4"),
    ],
)
def test_what_cannot_be_read_is_said_in_words(data, why):
    with pytest.raises(GradingError, match=why):
        read(data)


def test_a_quote_that_is_never_closed_is_said_with_its_line():
    with pytest.raises(GradingError, match="line 3"):
        table(read(b'a,"x\ny"\nb,"c\n'), ",")


def test_a_row_knows_its_line_also_below_cells_of_several_lines():
    there = table(read(b'a,"x\r\ny"\r\rb\n'), ",")
    assert [there.line(row) for row in (0, 2)] == [1, 4]

"""One rule for students' IDs: what it takes, what it refuses and why, and that all modules follow it."""

import ntpath
import unicodedata
from pathlib import PureWindowsPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labcourse.errors import ConfigurationError, CourseError, GradebookError, StudentIDError
from labcourse.grading.gradebook import storable
from labcourse.grading.intake.owners import Roster
from labcourse.session import student_of
from labcourse.student_id import caseless, normalised
from rotflex.hil.student_benches import student_seed

COMPOSED, APART = "j\u00fcrgen", "ju\u0308rgen"

GOOD = {" Ada L \n": "Ada L", APART: COMPOSED, "Angstrom \u212b": "Angstrom \u00c5"}
GOOD["u\u0308" * 80] = "ü" * 80  # 160 characters as they come, 80 as they are kept
AS_IT_IS = ["ada", "Ada  L", "0042", "김민준", "[red]ada", "{{7+7}}", "'; DROP TABLE--", "=1+1", "a.b@example.org"]
AS_IT_IS += ["console", "com10", "null.ada", "grades.csv.ada", "x" * 80, "民" * 80]
GOOD |= {name: name for name in AS_IT_IS}
#: What cannot be an ID → what the refusal names.
BAD = dict.fromkeys(["", " \t\n"], "is empty")
BAD |= dict.fromkeys(["a\nb", "a\x1b[31m", "a\u202eb", "a\u00a0b", "a\udcff"], "can be seen")
BAD |= {"x" * 81: "81 characters", "\N{GRINNING FACE}" * 61: "244 bytes", ".ada": "begins with a dot"}
BAD |= {"..": "begins with a dot", "ada.": "ends with a dot", "NUL": "NUL for a device", "COM1": "COM1 for a device"}
BAD |= {"Aux .ada": "Aux for a device", "con.ada.lovelace": "con for a device", "lpt\u00b2": "lpt² for a device"}
BOOKS = [f"gradebook.sqlite-{kind}" for kind in ("journal", "wal", "shm")]
BAD |= dict.fromkeys(["grades.csv", "Gradebook.SQLite", *BOOKS], "a file of that name")
BAD |= {f"a{character}b": f"{character} is not allowed in a folder's name" for character in '/\\:*?"<>|'}


def test_an_id_is_kept_composed_and_without_white_space_around():
    class Odd(str):
        __slots__ = ()

    assert {text: normalised(text) for text in GOOD} == GOOD
    assert type(normalised(Odd("ada"))) is str


def test_what_cannot_be_an_id_is_refused_in_words():
    for text, fragment in BAD.items():
        with pytest.raises(StudentIDError) as refused:
            normalised(text)
        assert fragment in str(refused.value)
        assert str(refused.value).isprintable()  # whatever was given, a terminal can show it


def test_what_is_no_text_is_refused_and_shown_in_short():
    for value in (None, 3, b"ada", ["ada"], {"a": "x" * 1000}):
        with pytest.raises(StudentIDError) as refused:
            normalised(value)
        assert len(str(refused.value)) < 150


anything = st.text(st.characters(exclude_categories=()), max_size=90)
visible = st.text(st.characters(categories=("L", "M", "N", "P", "S")), min_size=1, max_size=90)
near_the_rules = st.text(st.sampled_from("aAüÜ\u0308ßẞİıΣςſ. -/:1¹nulconNULCON"), max_size=6)
any_id = anything | visible | near_the_rules


def kept(given):
    try:
        return normalised(given)
    except StudentIDError:
        return None


@given(any_id)
def test_what_is_kept_stays_as_it_is_and_is_composed(given):
    student = kept(given)
    if student is not None:
        assert normalised(student) == student == unicodedata.normalize("NFC", student)


@given(any_id)
def test_however_accents_are_put_together_it_is_the_same_student_with_the_same_bench(given):
    composed, apart = (unicodedata.normalize(form, given) for form in ("NFC", "NFD"))
    assert kept(composed) == kept(apart) == kept(given)
    assert caseless(composed) == caseless(apart) == caseless(f" {given}\n")
    if kept(given):
        assert student_seed(composed) == student_seed(apart) == student_seed(given)


@given(near_the_rules)
def test_capitals_tell_nobody_apart(given):
    assert caseless(given) == caseless(caseless(given))
    assert caseless(given.swapcase()) == caseless(given.swapcase().casefold())


def is_reserved_on_windows(name):
    reserved = getattr(ntpath, "isreserved", None)  # Python 3.13
    return reserved(name) if reserved else PureWindowsPath(name).is_reserved()


@given(typed=any_id)
def test_an_id_can_name_a_folder_and_a_zip_on_every_system(typed, tmp_path_factory):
    student = kept(typed)
    if student is None:
        return
    assert not is_reserved_on_windows(student) and PureWindowsPath(student).name == student
    place = tmp_path_factory.mktemp("ids")
    (place / student).mkdir()
    (place / f"{student}.zip").write_bytes(b"")
    assert sorted(path.name for path in place.iterdir()) == sorted([student, f"{student}.zip"])


def by_intake(given, folder):
    """As a folder's name, also one that no file system would take; a zip's and a folder's are read alike."""
    match = Roster().by_name(given)
    if not match.students:
        raise StudentIDError(*match.problems)
    return match.students[0]


@given(typed=any_id.filter(bool))
def test_what_one_module_takes_all_take_as_the_same(typed, tmp_path_factory):
    folder = tmp_path_factory.getbasetemp()
    expected = kept(typed)
    for take in (student_of, lambda given, _folder: storable.student(given), by_intake):
        try:
            student = take(typed, folder)
        except (ConfigurationError, GradebookError):
            student = None
        assert student == expected, take


def test_names_of_gradings_own_files_are_reserved_and_errors_are_those_that_callers_expect():
    assert issubclass(StudentIDError, ConfigurationError) and issubclass(StudentIDError, CourseError)
    with pytest.raises(GradebookError, match="dot"):
        storable.student(".ada")
    assert kept("hints.md") is None and kept("hints.json") is None

"""Code and words that two have in common: found through new names and lay-out, and no more than chance in a class."""

from __future__ import annotations

import alike_class
import pytest
from made_courses import OURS

from rotflex.courseware.words import Words
from rotflex.instructor.release import student_course
from rotflex.instructor.reports import same_code
from rotflex.instructor.reports.overlaps import MOST_ALIKE, Token, prints

SIZE = 60
#: How somebody copies: which notebooks, which answer cells of them, and how many of the names they change.
COPIES = (
    *({}, {"rename": 1.0}, {"rename": 0.5}),
    *({"notebooks": ["02"], "cells": ["q2-9", "q2-10", "q2-11", "q2-12"]}, {"notebooks": ["07", "08"], "rename": 1.0}),
    *({"notebooks": ["08", "09"]}, {"notebooks": ["01", "02", "03", "07"], "rename": 0.7}),
    *({"notebooks": ["08"], "cells": ["q3-13"]}, {"notebooks": ["07"], "cells": ["q3-11"], "rename": 1.0}),
    {"notebooks": ["02", "06", "07"]},
)


@pytest.fixture(scope="module")
def given():
    solutions = [path.read_bytes() for path in OURS.notebooks]
    return same_code.HandedOut([text.encode() for text in student_course.derived(OURS).values()], solutions)


def found(everybody, given):
    coders = [same_code.coder(name, name, files, given) for name, files in everybody.items()]
    return same_code.in_code(coders, given)


@pytest.mark.parametrize(("seed", "solution"), [(0, 0.9), (1, 0.5), (2, 0.2), (10, 0.9), (11, 0.5), (12, 0.2)])
def test_of_sixty_who_did_it_themselves_one_pair_at_most_is_told_and_of_ten_who_copied_nine(given, seed, solution):
    """Some write mostly as the solution does, and some hardly ever: of each class, in ways of their own."""
    everybody = alike_class.honest_class(SIZE, seed, solution)
    assert len(found(everybody, given)) <= 1
    names = list(everybody)
    pairs = {(names[2 * number], names[2 * number + 1]): how for number, how in enumerate(COPIES)}
    for (mate, copier), how in pairs.items():
        everybody[copier] = alike_class.copied(copier, everybody[mate], everybody[copier], **how)
    told = {one.students for one in found(everybody, given)}
    assert len(told & pairs.keys()) >= 9
    assert len(told - pairs.keys()) <= 1


# --- what is compared -------------------------------------------------------------------------------------------------


def same(one, other, known=()):
    tokens = [same_code.code(text, known) for text in (one, other)]
    first, second = (list(prints(found, len(tokens[0]))) for found in tokens)
    return first == second


@pytest.mark.parametrize(
    "other",
    [
        "spitze=f[np.argmax( a [inside]) ]  # the peak",
        "peak = f[np.argmax(a[drinnen])]",
        "peak = \\\n    f[np.argmax(a[inside])]\n# end",
    ],
)
def test_lay_out_comments_and_chosen_names_do_not_matter(other):
    assert same("peak = f[np.argmax(a[inside])]", other, known={"f", "a", "np"})


@pytest.mark.parametrize(
    "other",
    [
        "peak = f[np.argmin(a[inside])]",  # an attribute's name is a library's
        "peak = f[np.argmax(inside[inside])]",  # one name in two places is not two names
        "peak = f[sp.argmax(a[inside])]",
        "peak = f[np.argmax(a[inside])**2]",
    ],
)
def test_other_code_is_other_code(other):
    assert not same("peak = f[np.argmax(a[inside])]", other, known={"f", "a", "np", "sp"})


def test_numbers_and_quotes_are_compared_by_what_they_mean_and_arguments_by_name():
    assert same("plot(x, color='red', lw=1.50)", 'plot(x, color="red", lw=1.5)')
    assert same("1e3 + 2_000", "1000. + 2000")
    assert not same("plot(x, color='red')", "plot(x, colour='red')")
    assert not same("plot(x, color='red')", "plot(x, color='blue')")


def test_what_is_no_python_is_compared_too():
    broken = "def f)(:\n    %time x = 'open\n  return (((\n!pip install numpy"
    assert [one.text for one in same_code.code(broken)][:4] == ["def", "f", ")", "("]
    assert same(broken, broken.replace("x", "y"))


# --- who is told ------------------------------------------------------------------------------------------------------

MINE = "\n".join(f"value_{n} = np.sum([{n}, {n * n}, {7 * n}]) + np.pi ** {n}" for n in range(10))
OTHER = "\n".join(f"thing_{n} = lab.some({n}) * {n}.5 / other[{n}, 'a'] - {n} % 3" for n in range(10))


def having(**texts):
    given = same_code.HandedOut([])
    return [same_code.coder(name, group, {"own.py": text.encode()}, given) for name, (group, text) in texts.items()]


def told(everybody):
    return [one.students for one in same_code.in_code(everybody, same_code.HandedOut([]))]


def test_two_are_told_with_where_and_an_excerpt_and_who_works_together_is_not():
    assert told(having(ada=("ada", MINE), bob=("bob", MINE), eve=("eve", OTHER))) == [("ada", "bob")]
    assert told(having(ada=("ada", MINE), bob=("ada", MINE), eve=("eve", OTHER))) == []
    (one,) = same_code.in_code(having(ada=("ada", MINE), bob=("bob", MINE)), same_code.HandedOut([]))
    line = same_code.told(one, of_code=True)
    assert line.startswith(f"ada, bob have {one.tokens} words and signs of code in common")
    assert '(own.py): "value_0 = np.sum([0, 0, 0])' in line and one.tokens == len(same_code.code(MINE))


def test_what_more_than_a_few_have_says_nothing():
    many = {f"s{n}": (f"s{n}", MINE) for n in range(MOST_ALIKE)}
    assert len(told(having(**many))) == MOST_ALIKE * (MOST_ALIKE - 1) / 2
    assert told(having(**many, one=("one", MINE))) == []


def test_what_was_handed_out_says_nothing():
    given = same_code.HandedOut([b'{"cells": [{"cell_type": "markdown", "source": %s}]}' % repr_json(MINE)])
    coders = [same_code.coder(name, name, {"own.py": MINE.encode()}, given) for name in ("ada", "bob")]
    assert same_code.in_code(coders, given) == []


def repr_json(text):
    import json

    return json.dumps(text).encode()


def test_files_that_are_no_text_notebooks_that_cannot_be_read_and_what_programs_write_are_passed_over():
    files = {"a.mat": b"\xff\x00", "b.ipynb": b"no JSON", "answers.json": MINE.encode(), "course.json": MINE.encode()}
    assert same_code.coder("ada", "ada", files, same_code.HandedOut([])).pieces == ()


def test_a_table_of_samples_that_was_saved_anew_is_found():
    samples = [round(0.001 * n * n % 1.7, 4) for n in range(100)]
    mine = "t,alpha\n" + "".join(f"{n / 500},{value}\n" for n, value in enumerate(samples))
    theirs = "time;alpha\n" + "".join(f"{n / 500:.6f},{value:.6e}\n" for n, value in enumerate(samples))
    assert told(having(ada=("ada", mine), bob=("bob", theirs))) == [("ada", "bob")]


def test_long_words_of_two_are_told_and_short_ones_or_others_are_not():
    long = (
        "The peak lies a little low since the damping of the joint pulls it down, and the sweep passes it quickly, so "
    )
    long += "that the arm has no time to come to rest before the frequency has moved on by another tenth of a hertz."
    other = "I think that friction in the gear takes energy out of it, so the measured curve is flatter than the model."
    short = "It is stable because all poles lie in the left half plane."
    given = same_code.HandedOut([])

    def pairs(**texts):
        writers = [same_code.writer(name, name, {("1", "why"): Words(text)}) for name, text in texts.items()]
        return [(one.students, one.tokens) for one in same_code.in_words(writers, given)]

    assert pairs(ada=long, bob=long.upper().replace(",", " –"), eve=other) == [(("ada", "bob"), len(long.split()))]
    assert pairs(ada=short, bob=short, eve=long) == []


def test_an_odd_text_is_bounded():
    huge = "x = 1\n" * 100_000
    assert len(same_code.code(huge)) == 20_000
    assert all(isinstance(one, Token) for one in same_code.words("\x00\ud7ff" + "ä" * 10))

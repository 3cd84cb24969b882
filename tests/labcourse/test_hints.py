"""What draws a hint when it is handed in, and is recorded all the same (units of numbers: test_forms.py)."""

import re

import numpy as np
import pytest

from labcourse.answers.forms import decode, encode
from rotflex import experiments, hil
from rotflex.course.questions import CATALOGUE

SEED = 7


def part(question, name):
    return CATALOGUE.find(question).part(name)


K = [18.24, -17.15, 1.59, 0.633]  # the workbook's


@pytest.mark.parametrize("asked", [("3.8", "K"), ("3.10", "K"), ("Table 3", "K_fsf")])
@pytest.mark.parametrize(
    ("entries", "hint"),
    [
        (K, None),
        ([round(entry * np.pi / 180, 5) for entry in K], "per degree; give V/rad"),
        ([18, -17, 1.6, 0.63], "2 digits or fewer"),
        ([18, -17, 1.59, 0.63], None),  # one may end in a zero by chance
        ([20.0, -17.15, 1.59, 0.633], None),
        ([1.824, -1.715, 0.159, 0.0633], "unusually small"),
        ([1824.0, -1715.0, 159.1, 63.31], "unusually large"),
        ([0, 0, 0, 0], None),  # marking has something to say
    ],
)
def test_a_gain_per_degree_or_of_few_digits_is_kept_and_hinted_at_without_the_value(asked, entries, hint):
    wanted = part(*asked)
    encoded = encode(wanted, entries, SEED)
    assert decode(wanted, encoded.content).tolist() == [entries]
    if hint is None:
        assert encoded.hints == ()
    else:
        (said,) = encoded.hints
        assert re.search(hint, said)
        assert {float(number) for number in re.findall(r"[\d.]*\d", said)} <= {2}


def test_honest_answers_that_look_odd_draw_no_hint():
    assert encode(part("Table 3", "K_psf"), [18.24, 0, 1.59, 0], SEED).hints == ()
    assert encode(part("2.14", "C"), [[1, 0, 0, 0], [0, 1, 0, 0]], SEED).hints == ()
    one_count = 100 * (np.ceil(20 / (360 / 4096)) * 360 / 4096 - 20) / 40  # % of a step from -20 to 20 deg
    assert encode(part("3.16", "PO"), one_count, SEED).hints == ()


def test_an_explanation_of_a_word_or_two_is_kept_and_asked_about():
    long = "\u4f3a\u670d\u7535\u673a" * 8  # a sentence, where words are not set apart
    short = ["Friction.", "dry friction"]
    for text in (*short, "The servo gives way.", r"$\alpha=0$", "![](attachment:drawing.png)", long):
        encoded = encode(part("2.11", "explanation"), text, SEED)
        assert encoded.content["value"] == text
        assert len(encoded.hints) == (text in short)


def test_a_voltage_sweep_in_place_of_the_position_sweep_is_kept_and_hinted_at():
    with hil.open("virtual:?seed=7") as bench:
        asked_for = experiments.sweep(bench, progress=False)
        recording = experiments.sweep(bench, drive="voltage", progress=False)
    assert encode(part("2.9", "sweep"), asked_for, SEED).hints == ()
    (hint,) = encode(part("2.9", "sweep"), recording, SEED).hints
    assert "'voltage'" in hint and "'position'" in hint

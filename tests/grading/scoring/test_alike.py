"""Answers that are nearly the same come together, and none whose numbers, signs or telling words differ."""

import re
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rapidfuzz import fuzz

from labcourse.grading.scoring import alike


def together(*texts):
    return len(alike.groups(texts)) == 1


TRAPS = [
    ("With this gain the loop is {} for all inputs.", "stable", "not stable"),
    ("The pole is at {} in the left half of the plane.", "-3.2", "3.2"),
    ("The pole is at {} in the left half of the plane.", "−3.2", "+3.2"),
    ("The current rises to 2 {} in the first moment here.", "mA", "A"),
    ("We found that it {} depend on the voltage at all.", "doesn't", "does"),
    ("The response is {} as the gain is so large.", "overdamped", "underdamped"),
    ("The assumption is {} for motions of this size.", "reasonable", "unreasonable"),
    ("It is {} where it is large.", "linear there, and nonlinear", "nonlinear there, and linear"),
    ("The gain ${}$ has to be chosen for a real pole here.", "k_1", "k_2"),
    ("The angle ${}$ follows the voltage with some delay.", r"\phi", r"\psi"),
    ("There are {} peaks in the spectrum that we recorded.", "two", "three"),
    ("So y = a {} b for all of the samples that were taken.", "+", "-"),
    *(
        ("The natural frequency is then {}, as I measured it.", one, other)
        for one, other in (
            ("K × J", "K ÷ J"),
            ("√J/K", "J/K"),
            ("(K + m)/J", "K + m/J"),
            ("[K + m]/J", "K + m/J"),
            ("m ≪ M", "m ≫ M"),
            ("ω²", "ω₂"),
            ("10⁻³", "10 - 3"),
            ("\u03b8\u0307 / K", "\u03b8\u0308 / K"),
            ("\u03b8\u0307 / K", "\u03b8 / K"),
            ("y' / K", "y'' / K"),
            ("y\u2032 / K", "y / K"),
        )
    ),
    ("When the mass is moved out, the peak goes {} in what I saw.", "↑", "↓"),
    ("The peak moves {} when the mass is moved outwards there.", "→", "←"),
    ("It can be neglected {} a visible loss of accuracy.", "without", "with"),
]


@pytest.mark.parametrize(("text", "one", "other"), TRAPS)
def test_what_says_something_else_is_not_put_together_however_similar(text, one, other):
    one, other = text.format(one), text.format(other)
    assert fuzz.ratio(alike.normal(one), alike.normal(other)) >= alike.SIMILAR  # by similarity alone they would be
    assert not together(one, other)
    assert not together(other, one)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Friction is not in the model, so it is lower.", "friction  is not\nin the model so it is lower"),
        ("The arm bends, so energy is stored in it.", "The arms bend, so energy is stored in it."),
        ("The pole is at -3.2.", "The pole is at −3.2."),
        ("The frequency is ω₁² in the model, so 3 m/s².", "The frequency is ω_1^2 in the model, so 3 m/s^2."),
        ("FRICTION IS NOT IN THE MODEL", "Friction is not in the model"),
        ("It bends, so “energy” is stored; see below…", "It bends so energy is stored, see below."),
        ("The students' model: it has no friction, I think.", "The students model it has no friction I think"),
        ("It doesn't reach 5 V at the end of the run.", "It doesn’t reach 5V at the end of the run"),
    ],
)
def test_what_differs_in_spelling_is_together(one, other):
    assert together(one, other)


words = st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]), max_size=100)


@given(words)
def test_equal_texts_are_always_together(text):
    assert together(text, text)
    assert together(text, f"  {text}\n")


@given(st.lists(words, max_size=6))
def test_each_text_is_in_one_group_and_each_member_is_like_its_first(texts):
    found = alike.groups(texts)
    assert sorted(place for group in found for place in group) == list(range(len(texts)))
    for group in found:
        first = alike.normal(texts[group[0]])
        for place in group[1:]:
            other = alike.normal(texts[place])
            assert fuzz.ratio(first, other) >= alike.SIMILAR or first == other
            assert alike.telling(first) == alike.telling(other)


#: Words between which one that tells is put; none of them tells, nor makes another say the contrary.
FILLERS = st.lists(
    st.sampled_from(["measured", "curve", "thus", "model", "gives", "value", "shows", "beam"]), min_size=12, max_size=40
)
OPPOSITES = """
    higher/lower more/less larger/smaller bigger/smaller faster/slower greater/smaller increase/decrease
    increases/decreases increasing/decreasing before/after left/right above/below stable/unstable first/second
    minimum/maximum min/max thinner/thicker heavier/lighter nearer/farther earlier/later stronger/weaker
    wider/narrower steeper/flatter positive/negative over/under better/worse sufficient/insufficient
    bounded/unbounded periodic/nonperiodic useful/useless
"""
CHANGES = st.one_of(
    st.tuples(st.integers(0, 10**6), st.integers(0, 10**6)).map(lambda pair: (str(pair[0]), str(pair[1]))),
    st.floats(0.01, 99.0).map(lambda x: (f"{x:.2f}", f"{x + 0.01:.2f}")),
    st.integers(1, 99).map(lambda n: (f"{n}", f"-{n}")),
    st.sampled_from([("is", "isn't"), ("", "not"), ("", "never"), ("with", "without"), ("", "no"), ("", "hardly")]),
    st.sampled_from([*"×÷√∫∝≪≫∂∇→←↑↓°()[⟨‖⇒∈"]).map(lambda sign: ("", sign)),
    st.sampled_from(OPPOSITES.split()).map(lambda pair: tuple(pair.split("/"))),
)


@given(FILLERS, CHANGES, st.data())
def test_one_other_number_negation_or_opposite_always_splits(fillers, change, data):
    one, other = change
    place = data.draw(st.integers(0, len(fillers)))
    texts = [" ".join(filter(None, [*fillers[:place], word, *fillers[place:]])) for word in (one, other)]
    assert together(*texts) == (one == other)


def test_small_steps_do_not_lead_from_one_answer_to_another():
    words = [f"w{chr(97 + n)}{chr(97 + n)}" for n in range(26)]
    other = [f"v{chr(97 + n)}{chr(98 + n)}" for n in range(26)]
    steps = [" ".join([*other[:n], *words[n:]]) for n in range(27)]
    plain = [alike.normal(step) for step in steps]
    assert all(fuzz.ratio(*pair) >= alike.SIMILAR for pair in pairwise(plain))
    for group in alike.groups(steps):
        assert all(fuzz.ratio(plain[group[0]], plain[place]) >= alike.SIMILAR for place in group)


def test_what_else_has_to_be_equal_splits():
    assert alike.groups(["It bends."] * 3, ["one picture", "another", "one picture"]) == [(0, 2), (1,)]


@given(words, words)
def test_a_difference_tells_all_that_is_new_and_gone(first, other):
    pieces = alike.difference(first, other)
    one, two = (" ".join(text.split()) for text in (first, other))
    if not pieces:
        assert one == two
        return
    cut = [re.escape(piece.text).replace(re.escape(" … "), ".*") for piece in pieces if piece.kind != "gone"]
    assert re.fullmatch("".join(cut), two, re.DOTALL)
    cut = [re.escape(piece.text).replace(re.escape(" … "), ".*") for piece in pieces if piece.kind != "new"]
    assert re.fullmatch("".join(cut), one, re.DOTALL)


def test_a_difference_shows_the_words_around_it_and_cuts_what_is_long():
    long = " ".join(f"w{n}" for n in range(60))
    pieces = alike.difference(f"{long} bends {long}", f"{long} turns {long}")
    assert [(piece.kind, piece.text) for piece in pieces[1:3]] == [("gone", "bends"), ("new", "turns")]
    assert pieces[0].text == " … " + " ".join(f"w{n}" for n in range(52, 60)) + " "
    assert pieces[3].text == " " + " ".join(f"w{n}" for n in range(8)) + "  … "

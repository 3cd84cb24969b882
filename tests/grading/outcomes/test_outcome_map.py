"""The map from codes to outcomes: what is wrong in it is told, each fault."""

import pytest
from made_courses import OURS
from refused import refused

from labcourse.errors import GradingError
from labcourse.grading.outcomes import outcome_map

GOOD = """
scheme = "Ours"
[outcomes]
design = "designs things"
talk = "speaks well"
[codes]
A-1 = ["design"]
GS-1 = ["talk", "design", "talk"]
"""


def read(folder, text):
    (folder / "outcomes.toml").write_text(text, encoding="utf-8")
    return outcome_map.find(folder, OURS.catalogue)


def test_another_scheme_can_be_put_in_its_place(tmp_path):
    found = read(tmp_path, GOOD)
    assert (found.scheme, found.outcomes) == ("Ours", {"design": "designs things", "talk": "speaks well"})
    assert found.criteria() == {"design": {"A-1", "GS-1"}, "talk": {"GS-1"}}


FAULTS = [
    ("GS-1 =", "GS1 ="),
    ('"talk", "design", "talk"', '"speech"'),
    ('scheme = "Ours"', ""),
    ('scheme = "Ours"', 'scheme = "Ours"\nyear = 3'),
    ('talk = "speaks well"', "talk = 3"),
    ('["design"]', '"design"'),
    ('["design"]', "[1]"),
]


def test_a_fault_is_told_with_what_to_do(tmp_path, snapshot):
    def spoilt(old, new):
        assert old in GOOD
        read(tmp_path, GOOD.replace(old, new))

    assert refused(GradingError, spoilt, FAULTS, tmp_path) == snapshot


def test_all_faults_are_told_at_once(tmp_path):
    with pytest.raises(GradingError) as caught:
        read(tmp_path, GOOD.replace("A-1", "X-1").replace("GS-1", "X-2"))
    assert "X-1" in str(caught.value) and "X-2" in str(caught.value)


def test_codes_without_an_outcome_and_outcomes_without_a_code_are_told(tmp_path):
    notes = " ".join(read(tmp_path, GOOD.replace('["design"]', "[]").replace('"design", ', "")).notes(OURS.catalogue))
    assert "A-1, A-2" in notes and "K-3, GS-2: no outcome in outcomes.toml" in notes
    assert "no evidence: design (designs things)." in notes and "GS-1" not in notes


def test_a_course_without_a_map_has_none(tmp_path):
    assert outcome_map.find(tmp_path, OURS.catalogue) is None
    assert "no outcomes.toml" in outcome_map.no_map(tmp_path)

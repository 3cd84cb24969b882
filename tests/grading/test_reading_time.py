"""How long a notebook takes: texts state what words, figures and questions come to."""

import reading_time
from made_courses import OURS


def test_this_course_states_what_the_formula_gives():
    assert list(reading_time.other_times(OURS)) == []

"""How each answer is marked: expected values and tolerances. For instructors.

A question leads to its parts, a part to its check. ``bench`` is the student's own bench as it really is
(``true_bench``), ``own`` the student's own answers.

The policy
* A value is right if it is right for the student's own bench, however it was found.
* Else it is right *given the student's own earlier answers* if it follows from them: full points. One wrong answer
  costs its own points only.
* Nothing follows from an answer that holds nothing: energies without motion, zeros, a transformation that cannot be
  inverted, a polynomial that leaves the feedback nothing to do (``own_answers``).
* A recording has to be of the student's own bench. A figure may show the student's own recording whatever that is of;
  that costs its points once.
* A figure whose curve is there but whose axes lack their units, and a spectrum whose peaks are in the right places but
  of the wrong height, earn half.
* Answers in words, and each report as a whole, are for a person, and earn nothing until one has read them: what to
  look for is in ``rubric.toml``.

* What builds on the measured stiffness is compared with the true bench, with the student's own stiffness when all
  else is done right, and with their own answers just before, their own function of 2.13 among them
  (``design_checks``, ``own_model``).
* A gain is right if it places the poles, however it was found. If the poles that it places are the student's own of
  3.4, it follows. The poles of the closed loop are those that the student's own gain gives: the desired ones are right
  only with a gain that gives them (``loop_checks``).
* What is measured on a response is compared with the same experiment run again with the student's own answers. Where
  these are such that nothing can be recorded (the loop runs away, the bench stops, the servo does not follow), the
  right design stands in, and so does the gain with which the notebooks went on (``repeated``). Numbers that are read
  correctly off a recording with the other feedback follow from it. A servo that never settles has no settling time, and
  none need be given. Whether the specifications are met follows from the student's numbers.

The tolerances stand in ``tolerances.py``, with the reasons.
"""

from labcourse.grading.marking.checks import ForAPerson
from rotflex.course.questions import CATALOGUE

from .key_beyond import BEYOND
from .key_control import CONTROL
from .key_modeling import MODELING, WARM_UP

#: The texts of each report, and then it as a whole.
REPORTS = {
    asked.number: {part.name: ForAPerson() for part in asked.parts}
    for asked in sorted((CATALOGUE.reports | CATALOGUE.judged).values(), key=lambda asked: asked.section)
}

KEY = {**WARM_UP, **MODELING, **CONTROL, **BEYOND, **REPORTS}

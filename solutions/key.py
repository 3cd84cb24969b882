"""How each answer is marked: expected values, tolerances, and what to look for in answers in words. For instructors.

A question leads to its parts, a part to its check. ``bench`` is the student's own bench as it really is
(``rotflex.grading.truth``), ``own`` the student's own answers.

The policy
* A value is right if it is right for the student's own bench, however it was found.
* Else it is right *given the student's own earlier answers* if it follows from them: full points. One wrong number
  costs its own points only.
* A recording has to be of the student's own bench. A figure may show the student's own recording whatever that is of;
  that costs its points once.
* A figure whose curve is there but whose axes lack their units, and a spectrum whose peaks are in the right places but
  of the wrong height, earn half.
* Answers in words are for a person, and earn nothing until one has read them.

* What builds on the measured stiffness is compared with the true bench, with the student's own stiffness when all
  else is done right, and with their own answer just before (``rotflex.grading.chain``).
* A gain is right if it places the poles, however it was found.
* What is measured on a response is compared with the same experiment run again with the student's own answers. Whether
  the specifications are met follows from the student's numbers.

The tolerances
* omega_n, 5 %: one bin of the padded FFT is 2 %, and the servo loop gives way by about as much again.
* K_s, 10 %: it goes with the square of omega_n.
* K_s from the student's own J_l and omega_n, 2 %: arithmetic, with room for rounding on the way.
* J_l, 1 %: the data sheet's inches and metres differ by a third of a per cent.
* The recording, 1 % RMS: the virtual bench repeats itself exactly; what ran before in the same session moves the point
  of rest, and with it the recording by up to 0.6 %. Other students' benches differ by 1.6 % at the least.
"""

from key_control import CONTROL
from key_modeling import MODELING, WARM_UP

from rotflex.grading.checks import ForAPerson
from rotflex.workbook.questions import REPORTS

REPORT_TEXTS = {
    report.number: {part.name: ForAPerson(part.prompt) for part in report.parts} for report in REPORTS.values()
}

KEY = {**WARM_UP, **MODELING, **CONTROL, **REPORT_TEXTS}

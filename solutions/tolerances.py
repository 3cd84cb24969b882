"""The tolerances by which answers are marked, and why each is what it is. Relative, unless the name says otherwise.

Those of the natural frequency and the stiffness were tried on 500 benches of draw 4: of all the honest ways to read
them, to three digits and more, one reading in 2000 is refused, and a friend's numbers seldom pass
(``tests/solutions/test_copied_numbers.py`` holds both on fewer).
"""

from rotflex.units import DEG, REV

RESOLUTION = 0.01  #: of the encoder: it is exact, and rounded by the student

# The natural frequency: how it was read is not known, so each honest way has its own place (``readings``).
BY_EYE = 0.03  #: off the plotted spectrum of a sweep: 0.1 Hz, which is a mark or half of one on its axis
#: Three digits, from 18 on: what a program reads off the same recording in the same way is the same to the last bit.
BY_PROGRAM = 0.003
BY_SWINGS = 0.004  #: three digits of a free swing, read off a spectrum with other zeros appended
NEAR_TRUE = 0.0125  #: of the true one: what ``resonance`` makes (up to 1.1 % above)
#: For the stiffness by itself, in omega_n, true or of the sweep's peak: half a bin of the sweep (0.031 Hz, of 2.9 to
#: 4.4), and three digits.
BIN = 0.012
K_S_FROM_OWN = 0.02  #: from the student's own J_l and omega_n: arithmetic, with room for rounding on the way
FEWEST_DIGITS = 2  #: an answer may be rounded to so many: "two digits are honest", as 02 says
#: kg·m²: what an arm of this laboratory can have. A wrong inertia among these is another arm's: no stiffness follows.
ARMS = (2.7e-3, 4.6e-3)
J_L = 0.01  #: of the arm's masses, in whole grams, and lengths
J_L_SLIP = 0.003  #: of an inertia that is put down to a slip: three digits
CARRIED = 0.02  #: of an own answer that a table repeats: rounding

#: How near what a student measured is to a bench that it is of, for hints: most sweeps have their peak so near to the
#: true omega_n; J_l to three digits; K_s with the square.
ALIKE = {"omega_n": 0.035, "J_l": 0.002, "K_s": 0.07}

#: The virtual bench repeats itself exactly, whatever ran before. Of two students' benches, no pair in 250 000 differs
#: by less than this, and the nearest by 1.05 %.
RECORDING = 0.01
SPECTRUM = 0.05  #: heights of peaks; their places are held to a bin

DESIRED = 0.005  #: poles and polynomial that are the same for everybody
PLACED = 0.02  #: coefficients of the closed loop's polynomial; the gain may be given to three digits
CONTROLLABILITY = 0.03  #: products of several rounded matrices

_COUNT = 100 * (REV / 4096) / (40 * DEG)  # per cent of the step that a count of the encoder is worth: 0.22
#: What is measured on a response: relative and absolute, of which the larger counts. The settling time is read from
#: samples, or off the plot to 0.02 s; the overshoot is a small difference of large angles: a count at the peak, one at
#: rest, one from a step to the next, or half a degree off the plot either way; deflection and voltage to half a mark.
MEASURED = {
    "t_s": {"rtol": 0.05, "atol": 0.02},
    "PO": {"rtol": 0.05, "atol": 3 * _COUNT},
    "alpha_max_deg": {"rtol": 0.03, "atol": 0.1},
    "V_max": {"rtol": 0.05, "atol": 0.1},
}

#: What is built on a stiffness is right, and not only follows, if it is so near; and one in the student's own A serves
#: where they gave none by itself (``design_checks``). By eye omega_n is 3 % off, and a sweep's peak mostly 2 %.
K_S = 0.10

# Notebook 11; measured on 20 benches of draw 4.
#: A sum of 50 samples is 6 % below the integral of the Gramian, and one that begins with the second sample is 7 %
#: above; two digits of 1.0 are worth 5 %.
DEVIATION = 0.12
STATES = 0.02  #: of the largest entry in the same unit: three digits, and Euler for the process noise
#: An observer with the delay as a state sets voltages at 2 ms that differ by 6 %. Another process noise at 30 ms, or
#: three digits, are worth 3 %. With the 33 Hz derivatives it is 11 % or more. With both encoders the servo may come to
#: rest elsewhere, and the deflection differs by up to 14 %: these are run as well.
OBSERVED = 0.07
#: At rest, the voltage changes by counts. Three digits of K change the RMS by 5 %, the half turn at the
#: start by 4 %. With both encoders it is 25 to 55 % higher.
NOISE = 0.10
SWING = {"rtol": 0.05, "atol": 0.1}  #: deg: a count of the encoder is 0.088
LIMIT = 0.06  #: of a sample time: off a plot to 0.5 ms, or the last whole ms; without the delay it is 20 % longer
PEAK = 0.06  #: a coarse grid of frequencies; three digits of K, which move a loop that is near -1
PLAN = {"deflection": 0.03, "volts": 0.05}  #: with 0.07 V against friction, the voltage is 3.5 % larger
#: Of a turn: rad by which it may miss its end (0.9 deg, with help against friction or without); s from the first to
#: the last of these angles; share of the planned deflection (1.3 with a polynomial of degree 11, 3 with a step); what
#: the link's equation leaves (up to 0.26 on the own bench, and more than this on half of them with 5 % less stiffness).
TURN = {"angle": 2 * DEG, "time": 0.8, "deflection": 1.6, "link": 0.35}

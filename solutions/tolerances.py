"""The tolerances by which answers are marked, and why each is what it is. Relative, unless the name says otherwise."""

RESOLUTION = 0.01  #: of the encoder: it is exact, and rounded by the student

# The natural frequency: how it was read is not known, so each honest way has its own place (``readings``).
BY_EYE = 0.03  #: off the plotted spectrum of a sweep: half a millimetre of a figure's width
#: Three digits, from 18 on: what a program reads off the same recording by the same way is the same to the last bit.
BY_PROGRAM = 0.003
#: Below and above the true one: where the ratio |alpha/theta| of a sweep has its peak, padded or not; and what
#: ``resonance`` and ``logarithmic_decrement`` give, with room for rounding.
NEAR_TRUE = (0.015, 0.02)
#: The stiffness by itself, as a share of omega_n: half a bin of the sweep's own padding, and three digits.
BIN = 0.012
K_S_FROM_OWN = 0.02  #: from the student's own J_l and omega_n: arithmetic, with room for rounding on the way
FEWEST_DIGITS = 2  #: an answer may be rounded to so many: "two digits are honest", as 02 says
#: kg·m²: what an arm of this laboratory can have. A wrong inertia among these is another arm's: no stiffness follows.
ARMS = (2.7e-3, 4.5e-3)
J_L = 0.01  #: of the arm's masses, in whole grams, and lengths
J_L_SLIP = 0.003  #: of an inertia that is put down to a slip: three digits
CARRIED = 0.02  #: of an own answer that a table repeats: rounding

#: How near what a student measured is to a bench that it is of, for hints: most sweeps have their peak so near to the
#: true omega_n; J_l to three digits; K_s with the square.
ALIKE = {"omega_n": 0.035, "J_l": 0.002, "K_s": 0.07}

#: The virtual bench repeats itself exactly; what ran before in the same session moves the point of rest, and with it
#: the recording by up to 0.6 %. Other students' benches differ by 1.6 % at the least.
RECORDING = 0.01
SPECTRUM = 0.05  #: heights of peaks; their places are held to a bin

DESIRED = 0.005  #: poles and polynomial that are the same for everybody
PLACED = 0.02  #: coefficients of the closed loop's polynomial; the gain may be given to three digits
CONTROLLABILITY = 0.03  #: products of several rounded matrices

#: What is measured on a response: relative and absolute, of which the larger counts. The settling time is read from
#: samples; the overshoot is a small difference of large angles, in encoder counts.
MEASURED = {
    "t_s": {"rtol": 0.05, "atol": 0.02},
    "PO": {"rtol": 0.05, "atol": 0.6},
    "alpha_max_deg": {"rtol": 0.03, "atol": 0.1},
    "V_max": {"rtol": 0.05, "atol": 0.1},
}

#: A stiffness in the student's own A, where they gave none by itself (``design_checks``).
K_S = 0.06

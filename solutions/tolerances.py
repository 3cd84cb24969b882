"""The tolerances by which answers are marked, and why each is what it is. Relative, unless the name says otherwise."""

RESOLUTION = 0.01  #: of the encoder: it is exact, and rounded by the student
OMEGA_N = 0.05  #: one bin of the padded FFT is 2 %, and the servo loop gives way by about as much again
K_S = 0.10  #: it goes with the square of omega_n
K_S_FROM_OWN = 0.02  #: from the student's own J_l and omega_n: arithmetic, with room for rounding on the way
J_L = 0.01  #: the data sheet's inches and metres differ by a third of a per cent
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

"""The numbers of this course that texts repeat, so that ``rotflex check-course`` can hold them against each other.

A text that says such a number in other words than these is not found: give it a pattern here when you write it.
"""

from labcourse.grading.course import StatedNumber
from rotflex.course.questions import CATALOGUE
from rotflex.specifications import AMPLITUDE, FREQUENCY, LIMITS, OMEGA_N, P_3, P_4, SAMPLE_TIME, SETTLING_BAND, ZETA
from rotflex.units import DEG

from . import tolerances

_NUMBER = r"([-−]?\d+(?:\.\d+)?)"


def _stated(what: str, value: float, *patterns: str) -> list[StatedNumber]:
    """A number, and the words around it; ``#`` stands for the number."""
    return [StatedNumber(what, pattern.replace("#", _NUMBER), round(value, 12)) for pattern in patterns]


def _last(section: str) -> float:
    """The number of a section's last question."""
    return float([number for number in CATALOGUE.questions if number.partition(".")[0] == section][-1])


_SPECIFICATIONS = (
    *_stated(
        "the limit of the settling time, in s",
        LIMITS["settling_time"],
        r"\$t_s\\le\$ # s",
        r"\$t_s\$ \| ≤ # s",
        r"later than # s after its start",
        r'"settling time", #, "s"',
        r'"t_s": \(#, "s"\)',
    ),
    *_stated(
        "the limit of the overshoot, in %",
        LIMITS["overshoot"],
        r"\$PO\\le\$ # %",
        r"\$PO\$ \| ≤ # %",
        r"meet a limit of # %",
        r'"overshoot", #, "%"',
        r'"PO": \(#, "%"\)',
    ),
    *_stated(
        "the limit of the deflection, in deg",
        LIMITS["max_alpha"] / DEG,
        r"\\alpha\\rvert\\le\$ # deg",
        r"\\alpha\\rvert_\{\\max\}\$ \| ≤ # deg",
        r"deflection exceeds # deg on the bench",
        r'"deflection", #, "deg"',
    ),
    *_stated(
        "the limit of the voltage, in V",
        LIMITS["max_vm"],
        r"V_m\\rvert\\le\$ # V",
        r"V_m\\rvert_\{\\max\}\$ \| ≤ # V",
        r"cuts the voltage to ±# V",
        r"is cut\*\* to ±# V",
        r"has been cut to ±# V",
        r'"voltage", #, "V"',
        r"gives at most ±# V",
        r"reaches the limit of # V",
        r"Is it within # V",
        r'"V_max": \(#, "V"\)',
    ),
    *_stated(
        "the settling band, in % of the final angle",
        100 * SETTLING_BAND,
        r"within ±# % of its final value",
        r"to within # % of the final angle",
        r"band of the specification is ±# % of",
        r"The band is ±# %",
        r"±0\.8 deg \(# %\)",
    ),
    *_stated(
        "the amplitude of the command, in deg",
        AMPLITUDE / DEG,
        r"between [-−]20 and \+# degrees",
        r"square wave of ±# deg",
    ),
    *_stated(
        "the height of the step, in deg",
        2 * AMPLITUDE / DEG,
        r"turn by # degrees within half a second",
        r"\\Delta\\theta\$ = # deg",
        r"per cent of the # deg step",
    ),
    *_stated("the frequency of the command, in Hz", FREQUENCY, r"square wave of # Hz"),
    *_stated(
        "the sample time, in ms", 1e3 * SAMPLE_TIME, r"\$h\$ = # ms", r"Every # ms the program", r"samples of # ms"
    ),
)

_POLES = (
    *_stated("the desired damping ratio", ZETA, r"\| \$\\zeta=#\$", r"pair \(\$\\zeta=#\$\)", r"\$\\zeta\$ = #\."),
    *_stated(
        "the desired natural frequency, in rad/s",
        OMEGA_N,
        r"\| \$\\zeta=[\d.]+\$, \$\\omega_n=#\$ rad/s",
        r"not the # rad/s of the design",
    ),
    *_stated("the desired pole p_3, in 1/s", P_3, r"\$p_3=#\$", r"real poles at #", r"16j, #, [-−]\d"),
    *_stated(
        "the desired pole p_4, in 1/s",
        P_4,
        r"\$p_4=#\$",
        r"real poles at [-−]\d+ and # add",
        r"16j, [-−]\d+, #",
        r"fourth pole from # to",
    ),
)

_TOLERANCES = (
    *_stated("how near omega_n is read by eye, in %", 100 * tolerances.BY_EYE, r"within # % of the highest point"),
    *_stated("how near a program reads omega_n, in %", 100 * tolerances.BY_PROGRAM, r"within # % of what a program"),
    *_stated("how near the true omega_n is right, in %", 100 * tolerances.NEAR_TRUE, r"within # % of the true value"),
    *_stated("the tolerance of J_l, in %", 100 * tolerances.J_L, r"\$J_l\$ is right within # %"),
    *_stated("half a bin of the sweep, in %", 100 * tolerances.BIN, r"the peak of the sweep, to # %"),
    *_stated("how near K_s follows, in %", 100 * tolerances.K_S_FROM_OWN, r"\$\\omega_n\$ within # %"),
)

_RANGES = (
    *_stated("the last question of Section 2", _last("2"), r"\[2\.9\]\([^)]*\) to \[#\]"),
    *_stated("the last question of Section 3", _last("3"), r"\[3\.4\]\([^)]*\) to \[#\]"),
)

_OF_A_WHOLE = {part.points for question in CATALOGUE.judged.values() for part in question.parts}

_REPORTS = tuple(
    stated
    for points in _OF_A_WHOLE
    for stated in _stated("what a side of a report is worth", points, r"and its appearance, # points? each")
)

STATED = (*_SPECIFICATIONS, *_POLES, *_TOLERANCES, *_RANGES, *_REPORTS)

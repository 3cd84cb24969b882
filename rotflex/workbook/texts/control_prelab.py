"""What the code cells of ``05_control_prelab`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "alt": N_(
            "Eight small plots of motion against time. Poles -1 and -0.4 plus or minus 3j: it dies away. Poles 0 and "
            "plus or minus 3j: it stays as large as it is. Poles 0.4 and 0.2 plus or minus 3j: it grows. The poles 0 "
            "and plus or minus 3j, each twice: it grows, too."
        ),
        "caption": N_(
            "**Figure 1.** Poles (in 1/s) and the motions that belong to them. The last two have the same poles as "
            "the two above them, but twice."
        ),
    },
    2: {
        "caption": N_(
            "**Figure 2.** Your open-loop poles. Faint arcs: equal natural frequency. Faint rays: equal damping "
            "ratio $\\zeta$."
        ),
    },
    3: {
        "caption": N_(
            "**Figure 3.** Four desired poles. Their distance from the origin says how fast, their direction how "
            "well damped."
        ),
    },
    4: {
        "alt": N_(
            "Two plots of step responses against omega_n t. Left: pairs with damping ratio 0.3, 0.6 and 0.9 "
            "overshoot by 37, 9.5 and 0.2 per cent. Right: the pair with 0.6 alone overshoots by 9.5 per cent, with "
            "two further poles by 5.7 and later, with two zeros in addition by 3.4 and sooner again."
        ),
        "caption": N_(
            "**Figure 4.** Left: pairs of poles alone. Right: the pair with $\\zeta=0.6$; then with two more poles "
            "at $-1.5\\,\\omega_n$ and $-2\\,\\omega_n$; then with two zeros at $\\pm j\\omega_n$ as well. Grey: the "
            "band of 2 %."
        ),
    },
    5: {
        "caption": N_(
            "**Figure 5.** State feedback. All four states are compared with what they should be; $K$ turns the "
            "difference into a voltage."
        ),
    },
    6: {
        "caption": N_("**Figure 6.** What the feedback has to do: from the crosses to the squares."),
    },
}
LINES = {
    "0, twice": N_("0, twice"),
    "± 3j, twice": N_("± 3j, twice"),
    "time": N_("time (s)"),
    "motion": N_("motion (any unit)"),
    "not without them": N_(
        "Of the questions below, only 3.4 can be answered without them. You can read on, and run this notebook again "
        "later."
    ),
    "open loop": N_("open loop"),
    "response": N_("response / final value"),
    "pair alone": N_("pair alone"),
    "and two poles": N_("and two poles"),
    "and two zeros": N_("and two zeros"),
    "poles to move": N_("With questions 2.18 and 3.4 answered, this cell shows how far the poles have to be moved."),
    "desired": N_("desired"),
}

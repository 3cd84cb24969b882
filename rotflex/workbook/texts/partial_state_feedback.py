"""What the code cells of ``09_partial_state_feedback`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "caption": N_(
            "**Figure 1.** The loop on the bench, as in `08_full_state_feedback`. This time the switch is on *partial*."
        ),
    },
    2: {
        "caption": N_(
            "**Figure 2.** One turn down and one turn up: full state feedback (solid) and partial (dashed), on the "
            "same bench with the same gain."
        ),
    },
    3: {
        "caption": N_(
            "**Figure 3.** The poles as $k_2$ and $k_4$ fade from their values (crosses) to zero (squares). A pole "
            "that leaves the picture to the left is not shown."
        ),
    },
    4: {
        "caption": N_(
            "**Figure 4.** Full state feedback (solid), and partial state feedback with a gain of its own (dashed)."
        ),
    },
}
LINES = {
    "answer first": N_(
        "Answer one of these questions first. You can read on meanwhile; then run this notebook again from its top."
    ),
    "servo's damping ratio": N_("damping ratio of the servo by itself: {zeta:.2f}"),
    "a pole at": N_("a pole at {pole} 1/s"),
    "servo follows": N_("With this gain the servo follows both ways, and no limit of the bench is reached."),
    "stopped": N_("Full state feedback was stopped: {error} Look at question 3.13 again."),
    "head of the comparison, 2": N_("                 simulated    measured    measured   limit"),
    "swing": N_("{name:8}  after 0.5 s up to {late:4.1f} deg      below 1 deg from {quiet:.1f} s on"),
    "dotted paths": N_(
        " Dotted paths lead from the poles with full to those with partial feedback. Poles further from the origin "
        "than 60 per second are not shown."
    ),
    "sigma by (3)": N_("sigma by (3):                 {decay:.1f} 1/s"),
    "sigma by the poles": N_("sigma by the poles:           {decay:.1f} 1/s"),
    "pair's damping ratio": N_("damping ratio of the pair:    {zeta:.2f}"),
    "best gain": N_("best gain for partial feedback: k_1 = {k_1:.1f} V/rad, k_3 = {k_3:.2f} V/(rad/s)"),
    "slowest pole": N_("real part of its slowest pole:  {slowest:.1f} 1/s    (with yours: {yours:.1f} 1/s)"),
    "it was stopped": N_("It was stopped: {error}"),
    "partial same gain": N_("partial, same gain"),
    "partial own gain": N_("partial, own gain"),
    "head of the gains": N_("                        t_s       PO   |alpha|max   |V_m|max   error at rest"),
}

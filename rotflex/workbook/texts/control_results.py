"""What the code cells of ``10_control_results`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "caption": N_(
            "**Figure 1.** Where the design stands. Squares: simulation; circles: bench with full state feedback; "
            "diamonds: bench with partial state feedback."
        ),
    },
}
LINES = {
    "K W and K_c": N_("K W and the companion gain differ by       {percent:.1f} %"),
    "poles": N_("desired and closed-loop poles differ by    {percent:.1f} %"),
    "gain on theta": N_("the gain on theta, full and partial:       {full:.4g} and {partial:.4g} V/rad"),
    "settling time": N_("settling time"),
    "overshoot": N_("overshoot"),
    "deflection": N_("deflection"),
    "voltage": N_("voltage"),
    "simulation": N_("simulation"),
    "bench full": N_("bench, full"),
    "bench partial": N_("bench, partial"),
    "answer first": N_("Answer questions 3.12, 3.14 and 3.16 first; then run this cell again."),
    "share": N_("share of what the specification allows (%)"),
    "results": N_("Results in per cent of their limits. "),
}

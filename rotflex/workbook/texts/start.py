"""What the code cells of ``00_start`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "caption": N_(
            "**Figure 1.** The flexible joint from above. The servo turns the base by $\\theta$; the link (the arm) "
            "turns further by $\\alpha$, against the springs of the joint."
        ),
    },
    2: {
        "caption": N_(
            "**Figure 2.** The servo jumps and is held; the link swings against the springs until friction has used "
            "up its energy."
        ),
    },
    3: {
        "alt": N_("The deflection over 0.1 seconds, enlarged: it moves in steps of less than a tenth of a degree."),
        "caption": N_("**Figure 3.** Each step is one count of the encoder."),
    },
}
LINES = {
    "arm position": N_("arm position      {arm_position}"),
    "bottom arm": N_("bottom arm        {m_1:.1f} g, {L_1:.1f} mm long"),
    "top arm": N_("top arm           {m_2:.1f} g, {L_2:.1f} mm long, its middle {d_12:.1f} mm from the pivot"),
    "gear ratio": N_("gear ratio        {K_g:.0f}"),
    "largest voltage": N_("largest voltage   ±{V_max:.0f} V"),
}

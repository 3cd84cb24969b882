"""What the code cells of ``02_finding_stiffness`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "alt": N_(
            "The gain from servo angle to deflection against frequency for three damping ratios. All peak at or just "
            "above 3 Hz; the less damping, the higher and narrower."
        ),
        "caption": N_(
            "**Figure 1.** Equation (4) for an arm with its natural frequency at 3 Hz. The less damping, the taller "
            "the peak; where it is hardly changes."
        ),
    },
    2: {
        "caption": N_("**Figure 2.** The sweep experiment. A loop around the servo makes it follow the sweep."),
    },
    3: {
        "caption": N_("**Figure 3.** A signal made of three sines, and its amplitude spectrum."),
    },
    4: {
        "alt": N_(
            "The servo angle in the sweep, commanded and measured. The measured swing is somewhat smaller than the "
            "commanded one, and where the link resonates much smaller, for some seconds."
        ),
        "caption": N_("**Figure 4.** The servo follows the sweep, except for a few seconds."),
    },
    5: {
        "caption": N_(
            "**Figure 5.** A simulated bench, whose parameters are known. Top: the sweep is the motor's voltage. "
            "Middle: the servo follows the sweep. Bottom: the ratio of deflection to servo angle, from the *voltage* "
            "sweep. The dotted line is the true natural frequency."
        ),
    },
    6: {
        "caption": N_(
            "**Figure 6.** Your link, swinging freely. Measure the time of five swings, divide five by it, and "
            "compare with your $f_n=\\omega_n/2\\pi$."
        ),
    },
}
LINES = {
    "frequency": N_("frequency of the shaking (Hz)"),
    "commanded": N_("commanded"),
    "measured": N_("measured"),
    "time": N_("time (s)"),
    "arm position": N_("d_12 = {d_12:.4f} m    (arm position {arm_position})"),
    "half a newton": N_("half a newton at 30 cm:      {degrees:.1f} deg"),
    "half a bin": N_("half a bin more in f:        K_s changes by {percent:.1f} %"),
    "decrement": N_("from {first:.1f} deg to {last:.1f} deg in {periods} periods:  zeta = {zeta:.3f}"),
    "joint alone": N_("of the joint alone:                  zeta = {zeta:.3f} ± {uncertainty:.3f}"),
    "no decrement": N_("The damping cannot be read off this swing: {error}"),
}

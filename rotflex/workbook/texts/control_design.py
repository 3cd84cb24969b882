"""What the code cells of ``06_control_design`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "caption": N_(
            "**Figure 1.** The poles without and with your feedback. The two that dominate should lie where the "
            "dotted ray ($\\zeta=0.6$) meets the dashed arc ($\\omega_n=20$ rad/s)."
        ),
    },
    2: {
        "alt": N_(
            "Servo angle, deflection and voltage against time for one step from 20 to minus 20 degrees: solid with "
            "the gain by pole placement, dashed with that of the LQR, dotted the command. The two sets of curves "
            "have the same shape and differ in size."
        ),
        "caption": N_("**Figure 2.** One step of the wave on your model, with both gains."),
    },
    3: {
        "alt": N_(
            "Two plots of the error of the estimated alpha rate against time. With the right model the derivative is "
            "off by tens of degrees per second while the link swings, and jagged; the observer's error is nearly "
            "zero. With a wrong stiffness the observer errs, too, by less, and in a smooth curve."
        ),
        "caption": N_(
            "**Figure 3.** Errors of the two estimates of $\\dot\\alpha$ during a step of 20 degrees, on a bench "
            "like the model and on a softer one."
        ),
    },
}
LINES = {
    "needs them": N_(
        "The rest of this notebook needs them. You can read on meanwhile; then run it again from its top."
    ),
    "lengths of the columns": N_("lengths of the columns of T:      "),
    "rank of T": N_("rank of T, as it is:              "),
    "of 5": N_("of 5"),
    "rank with equal columns": N_("rank with columns of equal length:"),
    "last row, from A": N_("last row of the companion matrix, from A:     "),
    "last row, your 3.3": N_("last row of the companion matrix, your 3.3:   "),
    "first rows of W": N_("W, its first two rows (for the angles):"),
    "your companion gain": N_("your companion gain:"),
    "open loop": N_("open loop"),
    "closed loop": N_("closed loop"),
    "your gain": N_("your gain"),
    "rounded to two digits": N_("rounded to two digits"),
    "one zero lost": N_("one zero lost in the first"),
    "first entry of K": N_("\nfirst entry of K, V/rad:    "),
    "yours, and lost": N_("{k_1:.3g} yours,  {lost:.3g} with the zero lost"),
    "no inverse": N_("Your W has no inverse, so something is wrong in question 3.7."),
    "head of the gains": N_("        by W       by library  unit         acts on"),
    "a jump": N_("A command that jumps by 40 deg asks for {volts:.3g} V at once."),
    "they agree": N_("\nThe two agree."),
    "they differ": N_("\nThe two differ: one of them is not what it should be. Which poles does each give?"),
    "pole placement": N_("pole placement"),
    "poles": N_("    poles"),
    "needs a stable loop": N_("The comparison needs a controllable model and a stable loop. {problem}"),
    "does not follow": N_("    does not follow the wave"),
    "step": N_(
        "    settling time {settling_time:.2f} s,  overshoot {overshoot:.1f} %,  deflection {max_alpha:.1f} deg,  "
        "voltage {max_vm:.1f} V"
    ),
    "time": N_("time (s)"),
    "command": N_("command"),
    "unstable": N_("Your closed loop is unstable, so there is nothing to compare. Look at question 3.8."),
    "derivative": N_("derivative"),
    "observer": N_("observer"),
    "rms": N_(
        "{name:18} {how:10}  RMS error: {theta_dot:4.1f} deg/s in theta_dot, {alpha_dot:4.1f} deg/s in alpha_dot"
    ),
    "model right": N_("model right"),
    "joint softer": N_("joint 10 % softer"),
    "needs an observable model": N_("The comparison needs a controllable and observable model. {problem}"),
    "error in alpha_dot": N_("error in $\\dot\\alpha$ (deg/s)"),
    "holds": N_("holds"),
    "does not hold": N_("does not hold, by {percent:.2g} % of the largest entry"),
}

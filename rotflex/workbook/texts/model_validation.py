"""What the code cells of ``03_model_validation`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "caption": N_(
            "**Figure 1.** What is in the model: two inertias, a spring between them, and friction. $J_{eq}$ and "
            "$B_{eq}$ stand for everything that turns with the base, seen at the load gear."
        ),
    },
    2: {
        "alt": N_(
            "Torque against speed. Two parallel lines fall from the torque at standstill, one for 1.5 V and one for "
            "0.8 V. A nearly flat line rises from zero: friction. Where it crosses the motor's lines, near 2.6 and "
            "1.4 rad/s, are dots."
        ),
        "caption": N_(
            "**Figure 2.** The torque at the load gear falls as the servo turns faster. With a constant voltage the "
            "servo settles where the motor's torque equals that of friction (dots)."
        ),
    },
    3: {
        "caption": N_(
            "**Figure 3.** The validation. Bench and model get the same voltage; neither knows of the other."
        ),
    },
    4: {
        "caption": N_("**Figure 4.** A step of 0.8 V at 0.5 s, on your bench and on your model."),
    },
    5: {
        "caption": N_("**Figure 5.** One second of your recording. The voltage jumps from 1.5 V to −1.5 V at 0.05 s."),
    },
    6: {
        "alt": N_(
            "Three plots against time: the residual of the servo angle, that of the deflection, and the voltage, a "
            "square wave."
        ),
        "caption": N_("**Figure 6.** The residuals: measured minus modelled angle. Mind the two scales."),
    },
    7: {
        "alt": N_(
            "Seven rows of two plots, the residuals of theta and of alpha over four seconds: your bench on top, and "
            "below it each suspect alone. Both kinds of servo friction, and the motor, give a large residual in "
            "theta; the friction of the link, and the stiffness, show in alpha nearly alone."
        ),
        "caption": N_("**Figure 7.** Residuals of your bench (top), and those that each suspect alone would give."),
    },
    8: {
        "alt": N_(
            "Steady speed against voltage. The model is a straight line through zero. The three measured points lie "
            "a little off it; the line through the two on the right meets zero speed at a small positive voltage."
        ),
        "caption": N_(
            "**Figure 8.** The steady speed at three voltages. Compare slope and zero crossing of the dotted line "
            "with the model's."
        ),
    },
    9: {
        "alt": N_(
            "Poles in the s-plane as the braking of the motor grows. Without braking a pair lies next to the "
            "imaginary axis. With growing braking it moves to the left in an arc, and back to the imaginary axis at "
            "a lower frequency. The real motor's pair lies near the leftmost point of the arc. A real pole runs off "
            "to the left."
        ),
        "caption": N_(
            "**Figure 9.** The poles of your model for all strengths of the motor's brake (grey). The pair that is "
            "the link's swing leaves the imaginary axis at the frequency of a free servo, and returns to it at that "
            "of a clamped one."
        ),
    },
    10: {
        "alt": N_(
            "The upper half of the s-plane with clouds of poles around those of the model. The stiffness gives a "
            "short streak along the imaginary direction. Motor and gears give a wider cloud, and the real pole "
            "spreads from about -10 to beyond -30 per second."
        ),
        "caption": N_(
            "**Figure 10.** Poles of 500 models with the natural frequency drawn within 3 %, and of 500 with motor "
            "and gears drawn within the data sheet's tolerances. The lower half of the plane mirrors the upper."
        ),
    },
    11: {
        "caption": N_(
            "**Figure 11.** The step of 0.8 V again, with the fitted model, which has seen the square wave only. "
            "Compare with Figure 4."
        ),
    },
}
LINES = {
    "your matrix": N_("your {name} in question 2.7:"),
    "J_eq": N_("J_eq = {J_eq:.3g} kg·m²          (data sheet)"),
    "B_eq": N_("B_eq = {B_eq:.3g} N·m/(rad/s)      (typical)"),
    "K_s": N_("K_s  = {K_s:.3g} N·m/rad          (question 2.12)"),
    "J_l": N_("J_l  = {J_l:.3g} kg·m²          (question 2.12)"),
    "b": N_("b = {b:.4f} N·m/(rad/s), {times:.0f} times the friction B_eq"),
    "friction": N_("friction $B_{eq}\\dot\\theta$"),
    "speed": N_("speed of the servo $\\dot\\theta$ (rad/s)"),
    "torque": N_("torque $\\tau$ (N·m)"),
    "motor": N_("motor at {volts} V"),
    "entry of A": N_("the entry of A in row 3, column 3:    {entry:7.3g} per second   (torque as input)"),
    "entry of A_v": N_("the entry of A_v in row 3, column 3:  {entry:7.3g} per second   (voltage as input)"),
    "RMS": N_("{angle:6} RMS of the residual {rms:5.2g} deg, fit {fit:3.0f} %"),
    "time": N_("time (s)"),
    "servo, viscous": N_("servo friction viscous,\n0.010 in place of 0.004"),
    "servo, Coulomb": N_("servo friction Coulomb,\n0.010 and 0.006 N·m"),
    "link, viscous": N_("link damping viscous,\n0.002 N·m/(rad/s)"),
    "link, Coulomb": N_("link friction Coulomb,\n0.003 N·m"),
    "stiffness": N_("stiffness larger\nby 15 %"),
    "motor's constants": N_("motor's $k_t$ and $k_m$\nlarger by 8 %"),
    "your bench": N_("your bench"),
    "forward": N_("forward: slope {slope:.0f} deg/s per V (model {modelled:.0f}), zero speed at {dead_zone:.2f} V"),
    "lost speed": N_(
        "{v:5.1f} V   model {model_speed:6.1f} deg/s   bench {bench_speed:6.1f} deg/s   lost {lost:4.1f} deg/s, that "
        "is {percent:4.1f} %"
    ),
    "model": N_("model"),
    "through your points": N_("through your two points forward"),
    "voltage": N_("voltage $V_m$ (V)"),
    "steady speed": N_("steady speed $\\dot\\theta$ (deg/s)"),
    "wires cut": N_("wires cut, $b$ = 0"),
    "your voltage model": N_("your voltage model"),
    "ten times the brake": N_("brake ten times as hard"),
    "real part": N_("real part (1/s)"),
    "imaginary part": N_("imaginary part (rad/s)"),
    "motor and gears": N_("motor and gears within tolerance"),
    "natural frequency": N_("natural frequency within 3 %"),
    "one standard deviation": N_("one standard deviation of the link's pair"),
    "spread": N_("    {label:36}{frequency:.1f} rad/s in frequency, {decay:.1f} 1/s in decay"),
    "your model": N_("your model"),
    "head of the fit": N_("                        your model    fitted   with its 95 % interval"),
    "fits": N_("{angle:6} fit of the step: your linear model {before:3.0f} %, the fitted model {after:3.0f} %"),
}

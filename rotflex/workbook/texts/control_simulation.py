"""What the code cells of ``07_control_simulation`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "caption": N_("**Figure 1.** State feedback that tracks a command."),
    },
    2: {
        "caption": N_(
            "**Figure 2.** What is simulated. The switch is for notebook `09`; here it stays at *full*. The signals "
            "on a yellow ground are recorded."
        ),
    },
    3: {
        "alt": N_(
            "Left: the command over ten seconds, a square wave between -20 and 20 degrees that starts from 0. Right, "
            "enlarged around 1.52 seconds: the square wave jumps at once, the limited command goes down in ten equal "
            "stairs."
        ),
        "caption": N_(
            "**Figure 3.** The command, and one of its turns enlarged. It starts from 0, so the *first* step is only "
            "half as high as the others."
        ),
    },
    4: {
        "alt": N_(
            "The voltage around the step at 1.52 seconds. For the square wave it jumps at once to its largest value "
            "and falls; with the limiter it rises within 20 milliseconds to a clearly smaller one. Afterwards the "
            "two are nearly the same."
        ),
        "caption": N_(
            "**Figure 4.** The voltage that the controller asks for, at the step from 20 to −20 deg. The limiter "
            "lowers its peak."
        ),
    },
    5: {
        "alt": N_(
            "A made-up step response from -20 to 20 degrees. It overshoots, comes back, and stays within the band of "
            "20 plus or minus 0.8 degrees; the settling time runs from the first movement of the command to the "
            "point at which the curve enters the band for the last time. The overshoot is the height of the peak "
            "above 20 degrees; the step is 40 degrees high."
        ),
        "caption": N_("**Figure 5.** How a response is read. (This one is made up; yours looks better.)"),
    },
    6: {
        "alt": N_(
            "Servo angle, enlarged near -20 degrees, and deflection after the step at 1.52 seconds, simulated "
            "exactly and with the workbook's arithmetic. The workbook's curves run slightly ahead, and their "
            "deflection is a little larger at its peak."
        ),
        "caption": N_("**Figure 6.** One turn, in both fidelities; on the left with the settling band."),
    },
}
LINES = {
    "waits": N_("This cell waits for a model (question 2.14) and a gain (question 3.8) that make a stable loop."),
    "answer first": N_(
        "Answer these questions first. You can read on meanwhile; then run this notebook again from its top."
    ),
    "gain K": N_("gain K:            "),
    "closed-loop poles": N_("closed-loop poles: "),
    "commanded angle": N_("commanded angle $\\theta_d$ (deg)"),
    "square wave": N_("square wave"),
    "with the limiter": N_("with the limiter"),
    "time": N_("time (s)"),
    "by hand": N_("by hand           k_1 times 40 deg:            {volts:5.1f} V"),
    "largest voltage": N_("{name:17} largest voltage asked for: {volts:5.1f} V"),
    "limits": N_("limits, ±10 V"),
    "V_m asked for": N_("$V_m$ asked for (V)"),
    "they agree": N_("The two agree to a millionth of a degree."),
    "they differ": N_("The two differ by {apart:.2g} deg."),
    "settling time": N_("settling time $t_s$"),
    "overshoot": N_("overshoot (deg)"),
    "step of 40 deg": N_("step, 40 deg"),
    "band": N_("band, 20 ± 0.8 deg"),
    "command": N_("command $\\theta_d$"),
    "servo angle": N_("servo angle $\\theta$"),
    "in the band": N_("in the band for good"),
    "time since": N_("time since the command began to move (s)"),
    "angle": N_("angle (deg)"),
    "samples": N_("{count} samples, from {first:.3f} s to {last:.3f} s"),
    "by hand, by tool": N_("{name:14} by hand {own}   by response {tool} {unit}"),
    "predicted": N_("largest deflection, predicted from omega_n by (6): {degrees:.1f} deg"),
    "simulated": N_("                    simulated:                     {degrees:.1f} deg"),
    "head of the steps": N_("                 step      t_s     PO   |alpha|max"),
    "does not follow": N_("{fidelity:12} {milliseconds:5.1f} ms   the servo does not follow"),
    "runs away": N_("{fidelity:12} {milliseconds:5.1f} ms   runs away"),
}

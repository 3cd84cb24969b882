"""What the code cells of ``08_full_state_feedback`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "caption": N_("**Figure 1.** The loop on the bench. The signals on a yellow ground are recorded."),
    },
    2: {
        "alt": N_(
            "Estimates of the velocity of a swinging servo. The difference of two samples jumps between 0, 0.77 and "
            "1.5 rad/s all the time. The band-limited derivative is a slightly ragged curve close to the true one, a "
            "little late."
        ),
        "caption": N_("**Figure 2.** The same encoder counts, differentiated in two ways."),
    },
    3: {
        "alt": N_(
            "Left: gain against frequency. All three agree at low frequencies; above 33 hertz the ideal derivative "
            "and the difference go on rising, while the band-limited derivative levels off near 250 rad/s per rad. "
            "Right: the phase of the band-limited derivative falls behind the ideal one, by some 4 degrees at 3.2 "
            "hertz and more above; the difference falls behind less."
        ),
        "caption": N_(
            "**Figure 3.** Gain and phase of three derivatives, as the program computes them. The vertical line "
            "marks 20 rad/s, the natural frequency that was asked of the closed loop."
        ),
    },
    4: {
        "alt": N_(
            "One turn down and one turn up, measured and simulated. Upper row: the servo angle near its goal, with "
            "the settling band; the bench moves in steps. Middle: the deflections lie close together. Lower row: the "
            "measured voltage is ragged."
        ),
        "caption": N_(
            "**Figure 4.** One turn down and one turn up: your bench (solid) and your simulation (dashed). The "
            "shaded band is that of specification 1."
        ),
    },
    5: {
        "alt": N_(
            "Settling time, overshoot and largest deflection on twenty benches, by arm position, with the limits. "
            "Overshoots spread widely; settling times fall into groups; deflections lie closer together."
        ),
        "caption": N_("**Figure 5.** Your gain on twenty benches that it was not designed for."),
    },
    6: {
        "caption": N_("**Figure 6.** A real bench."),
    },
}
LINES = {
    "answer first": N_(
        "Answer one of these questions first. You can read on meanwhile; then run this notebook again from its top."
    ),
    "gain K": N_("gain K: "),
    "difference of two samples": N_("difference of two samples"),
    "band-limited derivative": N_("band-limited derivative"),
    "true velocity": N_("true velocity"),
    "time": N_("time (s)"),
    "error": N_("{name:26} error (rms) {rms:.2f} rad/s"),
    "one count more": N_("one count more, times your k_3:  {difference:.2f} V   {filtered:.2f} V"),
    "ideal derivative": N_("ideal derivative"),
    "frequency": N_("frequency (Hz)"),
    "gain, rad/s per rad": N_("gain (rad/s per rad)"),
    "phase": N_("phase against the ideal (deg)"),
    "no crossing": N_(
        "The gain of this loop does not come down to 1 between 5 and 500 rad/s. Look at question 3.8 again."
    ),
    "crossing": N_("crossing       {crossing:.0f} rad/s, that is {hertz:.0f} Hz"),
    "phase margin": N_("phase margin   {margin:.0f} deg; a millisecond of delay takes {degrees:.1f} deg of it"),
    "delay margin": N_("delay margin   {milliseconds:.0f} ms"),
    "servo follows": N_("With this gain the servo follows, and no limit of the bench is reached."),
    "theta minus the goal": N_("$\\theta$ minus the goal (deg)"),
    "runs away": N_("On your model, this gain makes a loop that runs away; there is nothing to compare."),
    "band": N_("band"),
    "bench": N_("bench"),
    "simulation": N_("simulation"),
    "turn to": N_("turn to {goal} deg"),
    "head of the turns": N_("start    from → to (deg)     t_s      PO     |alpha|   |V_m|   error at rest"),
    "head of the comparison": N_("                  simulated   measured   limit"),
    "head of the rest": N_("before the turn at   error      alpha      voltage (mean)"),
    "head of the runs": N_("           t_s       PO    |alpha|     |V_m|   error at rest"),
    "does not follow": N_("run {number}: the servo does not follow"),
    "run": N_(
        "run {number} {settling_time:7.3f} s {overshoot:6.1f} % {max_alpha:6.1f} deg {max_vm:7.1f} V {at_rest:11.2f} "
        "deg"
    ),
    "stopped": N_("run {number}: stopped. {error}"),
    "from, to": N_("{name:18} from {least:5.2f} to {most:5.2f}"),
    "other benches": N_("other benches"),
    "limit": N_("limit"),
    "arm position": N_("arm position"),
    "yours": N_("yours"),
    "bench stopped": N_("bench {n}: stopped, a limit was exceeded"),
    "Euler step": N_("Euler step"),
    "zero-order hold": N_("zero-order hold"),
    "says": N_("{name:16} says {velocity:.2f} rad/s"),
    "no log": N_("There is no real_bench.mat beside this notebook; nothing to show."),
}

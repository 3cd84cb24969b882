"""What the code cells of ``01_modeling_prelab`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES = {
    1: {
        "caption": N_("**Figure 1.** The flexible joint from above: angles, lengths and masses."),
    },
    2: {
        "caption": N_(
            "**Figure 2.** The same, as two inertias on one shaft. The two springs act as one torsion spring; the "
            "friction of the joint sits beside it."
        ),
    },
    3: {
        "caption": N_(
            "**Figure 3.** The example. The displacement $s$ is counted from where the spring is relaxed, the angle "
            "$\\phi$ from the vertical."
        ),
    },
    4: {
        "caption": N_("**Figure 4.** The motor's armature circuit, and the gears behind it."),
    },
    5: {
        "caption": N_("**Figure 5.** A body seen along the two axes."),
    },
}
LINES = {
    "is an energy": N_("is an energy"),
    "is NOT an energy": N_("is NOT an energy in each of its terms: look again"),
    "equation of": N_("equation of {name}:"),
    "torques only": N_("torques only"),
    "NOT a torque in": N_("NOT a torque in every term"),
    "energy balance": N_("energy balance:"),
    "no springs": N_("no springs:    theta_ddot + alpha_ddot ="),
    "huge link": N_("huge link:     theta_ddot + alpha_ddot ="),
    "holds": N_("holds"),
    "does NOT hold": N_("does NOT hold; left over is {left_over}"),
    "rigid joint": N_("rigid joint:   theta_ddot ="),
    "is an acceleration": N_("is an acceleration"),
    "is NOT an acceleration": N_("is NOT an acceleration in each term"),
    "row": N_("row {number}:"),
    "agrees with the accelerations": N_("agrees with the accelerations"),
    "does NOT agree": N_("does NOT agree: look again"),
    "torque per volt": N_("torque per volt, at standstill        {torque_per_volt:.3f} N·m/V"),
    "back-EMF": N_("braking by the back-EMF               {back_emf_damping:.4f} N·m/(rad/s)"),
    "viscous friction": N_("viscous friction of the servo, B_eq   {B_eq:.4f} N·m/(rad/s)"),
    "point": N_("top arm as a point:              "),
    "twice as long": N_("all lengths twice as long:        inertia times"),
    "your link": N_("your link:                        {inertia:.3g} g·m²"),
    "at most": N_("more than this it cannot be:      {inertia:.3g} g·m²"),
    "theirs minus ours": N_("equation of {q}: theirs minus ours = {difference}"),
}

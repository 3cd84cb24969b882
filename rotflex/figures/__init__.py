"""The workbook's figures: diagrams of the mechanism and of the loops, and plots of what is measured.

Every function returns a matplotlib figure that carries its own description for those who cannot see it;
:func:`show` puts it into a notebook.

================  ===========================================================
figure            drawn by
================  ===========================================================
2.1, 2.2          ``joint_angles``, ``lumped_model``
2.3               ``compound_sine_spectrum``
2.4, 2.6          ``sweep_experiment``, ``validation_experiment``
2.7, 2.8          ``validation``
3.1               ``desired_poles`` in symbols, ``pole_map`` in numbers
3.2, 3.3, 3.5     ``state_feedback``, ``simulation_loop``, ``implementation_loop``
3.4, 3.6, 3.7     ``tracking``
beyond the book   ``naive_against_true``, ``free_decay``, ``compare_tracking``, ``motions_of_poles``,
                  ``reading_a_response``
================  ===========================================================
"""

from rotflex.figures.drawings import (
    desired_poles,
    implementation_loop,
    joint_angles,
    lumped_model,
    simulation_loop,
    state_feedback,
    sweep_experiment,
    validation_experiment,
)
from rotflex.figures.pictures import ROLES, Picture, new_picture, show, style
from rotflex.figures.plots import (
    compare_tracking,
    compound_sine_spectrum,
    free_decay,
    motions_of_poles,
    naive_against_true,
    pole_map,
    reading_a_response,
    tracking,
    validation,
)

__all__ = [
    "ROLES",
    "Picture",
    "compare_tracking",
    "compound_sine_spectrum",
    "desired_poles",
    "free_decay",
    "implementation_loop",
    "joint_angles",
    "lumped_model",
    "motions_of_poles",
    "naive_against_true",
    "new_picture",
    "pole_map",
    "reading_a_response",
    "show",
    "simulation_loop",
    "state_feedback",
    "style",
    "sweep_experiment",
    "tracking",
    "validation",
    "validation_experiment",
]


def __dir__() -> list[str]:
    return __all__

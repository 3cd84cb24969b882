"""The workbook's figures: drawings of the mechanism and of the loops, and plots of what is measured.

A drawing is an SVG file in ``rotflex/figures/drawings``, with its description for those who cannot see it;
:func:`show_drawing` puts it into a notebook, as in ``figures.show_drawing("joint_angles")``. A plot is drawn by a
function that returns a matplotlib figure, which carries its own description; :func:`show` puts it into a notebook.

================  ===========================================================
figure            drawing, or function of a plot
================  ===========================================================
2.1, 2.2          ``"joint_angles"``, ``"lumped_model"``
2.3               ``compound_sine_spectrum``
2.4, 2.6          ``"sweep_experiment"``, ``"validation_experiment"``
2.7, 2.8          ``validation``
3.1               ``"desired_poles"`` in symbols, ``pole_map`` in numbers
3.2, 3.3, 3.5     ``"state_feedback"``, ``"simulation_loop"``, ``"implementation_loop"``
3.4, 3.6, 3.7     ``tracking``
beyond the book   ``naive_against_true``, ``free_decay``, ``compare_tracking``, ``motions_of_poles``,
                  ``reading_a_response``, ``"trolley_with_pendulum"``
================  ===========================================================
"""

from rotflex.figures.pictures import ROLES, Picture, new_picture, show, show_drawing, style
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
    "free_decay",
    "motions_of_poles",
    "naive_against_true",
    "new_picture",
    "pole_map",
    "reading_a_response",
    "show",
    "show_drawing",
    "style",
    "tracking",
    "validation",
]


def __dir__() -> list[str]:
    return __all__

"""Explorers: what a notebook shows to be played with. Each has a plain function that gives the same without a page.

=======================  ==============================================  ==============================================
explorer                 made by                                         the same in plain Python
=======================  ==============================================  ==============================================
poles                    ``explore_poles(A, B, K, lab)``                 ``design(A, B, poles)``, ``margins(A, B, K)``
sine sweep               ``explore_sweep(lab)``                          ``spectra(recording)``
validation               ``explore_validation(recording, ...)``          ``overlay(recording, parameters)``
bench                    ``open_console(lab)``                           :mod:`rotflex.experiments`
controller to be felt    ``feel_controller(lab)``                        ``experiments.tracking(bench, K)``
results                  ``results_table(lab, "Table 2")``               ``lab.table("Table 2")``
=======================  ==============================================  ==============================================
"""

from labcourse.scene.results import results_table
from rotflex.widgets.console import feel_controller, open_console
from rotflex.widgets.placement import Dominant, design, margins, with_gain
from rotflex.widgets.poles import explore_poles
from rotflex.widgets.sweeps import explore_sweep, spectra, stiffness_at
from rotflex.widgets.validations import explore_validation, fit_percent, overlay

__all__ = [
    "Dominant",
    "design",
    "explore_poles",
    "explore_sweep",
    "explore_validation",
    "feel_controller",
    "fit_percent",
    "margins",
    "open_console",
    "overlay",
    "results_table",
    "spectra",
    "stiffness_at",
    "with_gain",
]

"""Explorers: what a notebook shows to be played with. Each has a plain function that gives the same without a page.

=======================  ==============================================  ==============================================
explorer                 made by                                         the same in plain Python
=======================  ==============================================  ==============================================
energies                 ``watch_energy()``                              none: questions 2.1 and 2.2 ask for it
sine sweep               ``explore_sweep(lab)``                          ``spectra(recording)``
validation               ``explore_validation(lab)``                     ``overlay(recording, parameters)``
bench and model          ``watch_model(lab)``                            :func:`rotflex.experiments.validation`
poles                    ``explore_poles(lab=lab)``                      ``design(A, B, poles)``
closed loop              ``explore_loop(lab)``                           :func:`rotflex.simulation.closed_loop`
before and after         ``show_arm(lab)``                               ``figures_of(recording)``
two designs              ``compare_designs(lab, designs)``               :func:`rotflex.hil.loop.run`
bench                    ``open_console(lab)``                           :mod:`rotflex.experiments`
controller to be felt    ``feel_controller(lab)``                        ``experiments.tracking(bench, K)``
results                  ``results_table(lab, "Table 2")``               ``lab.table("Table 2")``
=======================  ==============================================  ==============================================

Explorers of a student's own work show another arm until the questions are answered that they would give away.
Any other plant: ``explore_poles(A, B, K)``, ``explore_sweep(recording=..., J_l=...)`` and
``ValidationExplorer(recording, servo, joint)``.
"""

from labcourse.scene.results import results_table
from rotflex.widgets.arms import figures_of, show_arm, watch_energy, watch_model
from rotflex.widgets.console import feel_controller, open_console
from rotflex.widgets.loops import explore_loop
from rotflex.widgets.placement import Dominant, design, with_gain
from rotflex.widgets.poles import explore_poles
from rotflex.widgets.sweeps import explore_sweep, spectra, stiffness_at
from rotflex.widgets.two_designs import Trial, compare_designs
from rotflex.widgets.validations import ValidationExplorer, explore_validation, fit_percent, overlay

__all__ = [
    "Dominant",
    "Trial",
    "ValidationExplorer",
    "compare_designs",
    "design",
    "explore_loop",
    "explore_poles",
    "explore_sweep",
    "explore_validation",
    "feel_controller",
    "figures_of",
    "fit_percent",
    "open_console",
    "overlay",
    "results_table",
    "show_arm",
    "spectra",
    "stiffness_at",
    "watch_energy",
    "watch_model",
    "with_gain",
]

"""What the code cells of ``04_modeling_results`` say."""

from __future__ import annotations

from rotflex.courseware.messages import N_

FIGURES: dict[int, dict[str, str]] = {}
LINES = {
    "uncertainty of omega_n": N_("uncertainty of omega_n   {percent:.1f} %"),
    "uncertainty of J_l": N_("uncertainty of J_l       {percent:.1f} %"),
    "uncertainty of K_s": N_("uncertainty of K_s       {percent:.1f} %"),
}

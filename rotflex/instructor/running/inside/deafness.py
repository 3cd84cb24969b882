"""Nobody listens: then nothing needs to be drawn or formatted for show."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg


def set_up(shell: Any) -> None:
    """Of what cells display, only the plain text is made, for a ``__repr__`` may be part of what a student tries.

    Figures are drawn when the code asks for it, and not because a cell has ended; they are closed as ever. Of errors,
    the last line is made. What was printed is not kept for the history.
    """
    shell._tee = lambda channel: nullcontext()
    shell.display_formatter.active_types = ["text/plain"]
    shell.InteractiveTB.set_mode("Minimal")
    shell._format_exception_for_storage = lambda *args, **kwargs: {}
    FigureCanvasAgg.draw_idle = lambda *args, **kwargs: None  # type: ignore[method-assign]

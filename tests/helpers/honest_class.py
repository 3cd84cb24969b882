"""The honest class: ways of handing in a solved course, thought up by someone who had not read the code.

The first lot is to have full marks, however it was written and packed. In the second something is wrong, honestly, and
the student has to be told what. `honest_hand_in` says what a way is; `solved_notebooks` makes what they all begin with.
"""

import honest_cells
import honest_code
import honest_files
import honest_packings
import honest_slips
import honest_stops
from honest_hand_in import Way, solved_notebooks

__all__ = ["RIGHT", "WAYS", "WRONG", "Way", "solved_notebooks"]

RIGHT: list[Way] = [
    *honest_cells.WAYS,
    *honest_code.WAYS,
    *honest_files.WAYS,
    *honest_packings.WAYS,
]
WRONG: list[Way] = [*honest_stops.WAYS, *honest_slips.WAYS]
WAYS: list[Way] = [*RIGHT, *WRONG]

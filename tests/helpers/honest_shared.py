"""The honest class in few submissions: ways that touch different cells share one."""

from functools import cached_property

import honest_packings
from checkout import ROOT
from honest_class import RIGHT, WRONG, solved_notebooks
from honest_hand_in import together, touched
from honest_marks import grade
from packs import packed

CELL_TIMEOUT = 45  # s: one of them never ends; a busy machine needs half of it for the grey-box fit of 03
SOLVED = solved_notebooks(ROOT)
_ONLY_OF_THE_FILE = {"everything-lost-as-by-kaggle", "written-otherwise"}
READ = [*honest_packings.WAYS, *(way for way in RIGHT if way.name in _ONLY_OF_THE_FILE)]
_READ = {way.name for way in READ}
RUN = [way for way in (*RIGHT, *WRONG) if way.name not in _READ]
#: Those that would need a submission of their own, or wait; what is particular to each is tried by itself elsewhere.
LATER = {"by-colab", "endless-loop", "module-forgotten", "cell-deleted-after-running", "too-much-memory"}
LATER |= {"another-name-assigned", "another-ones-course-folder"}
BUILDS_ON_ALL = {"Table 3"}  # many ways lose points of it, each of them other ones


def graded_here(ways, place, *options):
    """Grade a class of these ways."""
    return grade(ways, SOLVED, place, "--jobs", "2", "--cell-timeout", str(CELL_TIMEOUT), *options)


class Shared:
    """The ways in few submissions. Right ways share one if they touch different cells; wrong ways, if they also lose
    points of different questions."""

    def __init__(self, ways, place, *options):
        right = packed([way for way in ways if way.change and not way.lost], lambda way: touched(way, SOLVED))
        wrong = packed(
            [way for way in ways if way.change and way.lost],
            lambda way: touched(way, SOLVED) | (way.lost - BUILDS_ON_ALL),
        )
        self.place, self.options = place, options
        self.packs = [*right, *wrong, *([way] for way in ways if not way.change)]
        self.hand_ins = [together(pack) if pack[0].change else pack[0] for pack in self.packs]

    @cached_property
    def graded(self):
        """The class, graded by the command."""
        return graded_here(self.hand_ins, self.place, *self.options)

    def hand_in(self, way):
        """Return the submission that a way is part of."""
        return next(one for pack, one in zip(self.packs, self.hand_ins, strict=True) if way in pack)

"""The numbers of this course that texts repeat, so that ``rotflex check-course`` can hold them against each other."""

STATED = ()

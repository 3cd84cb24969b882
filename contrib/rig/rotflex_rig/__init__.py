"""One bench for a whole class: students send runs as plain data, and the laboratory's computer makes them in turn.

``request``   a run as plain data, and what is refused
``address``   the student's half: the bench at ``rig:https://…``
``queue``     who may ask, who is next, and what became of each run, in SQLite
``server``    the queue by HTTPS, and a page for the laboratory
``worker``    the laboratory's computer: it tries each run on the bench's twin, then runs it on the bench
``commands``  the command ``rotflex-rig``
"""

from rotflex_rig.address import login

__all__ = ["login"]

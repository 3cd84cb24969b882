"""This course: its questions, tables and reports, a student's session, and the probes of its functions."""


def draw() -> int:
    """Return the version of how students' benches are drawn now."""
    from rotflex.hil.student_benches import DRAW

    return DRAW

"""Running a course's notebooks with a student's work in them: what is run, in what frame, and what became of it."""

#: Environment variable, set while notebooks are run by a program: "grade" or "check".
RUNNING = "ROTFLEX_RUNNING"

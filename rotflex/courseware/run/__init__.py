"""Running a course's notebooks with a student's answers in them: which cells are run, and in what frame."""

"""Print how long each notebook takes, and what it is made of: the formula is in ``course_check/reading_time.py``.

python tools/reading_time.py
"""

from __future__ import annotations

from labcourse.grading import course
from labcourse.grading.course_check import reading_time
from labcourse.grading.release import student_notebooks

HEADINGS = ("words", "figures", "answers", "in words", "functions", "min")


def main() -> None:
    """A line for each notebook, and their sum."""
    ours = course.find()
    total = 0
    print(f"{'notebook':28}" + "".join(f"{heading:>11}" for heading in HEADINGS))
    for path in ours.notebooks:
        time = reading_time.reading_time(student_notebooks.read(path), path.stem, ours.catalogue)
        total += time.stated
        made_of = (time.words, time.figures, time.answers, time.in_words, time.functions)
        counts = "".join(f"{count:11}" for count in made_of)
        print(f"{path.stem:28}{counts}{time.minutes:11.1f}, stated as {time.stated}")
    print(f"in all, as stated: {total} min, {total / 60:.1f} h")


if __name__ == "__main__":
    main()

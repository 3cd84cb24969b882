"""Attacks by cells of a student's own, which are run where they stand: before the course's, between them, after them;
on what the notebook is run by, on the reports of what became of each cell, and by errors that are more than errors.
"""

from typing import Any

from hostile import STIFFNESS, Attack
from hostile_answers import ESCAPES, MARKUP
from hostile_code import TOO_LONG

# All that a notebook begins with is somebody else's, and says that every answer is right.
BEFORE_ALL = """
import types
class Generous(types.ModuleType):
    def __getattr__(self, name): return lambda *_, **__: self
    def answer(self, question, /, **parts):
        with open("answers.json", "w") as file:
            file.write(_dumps({"format": 2, "points": 13, "answers": {question: dict.fromkeys(parts, {"points": 9})}}))
        return "recorded"
import rotflex
for name in ("rotflex.course.lab", "labcourse.answers.answers", "labcourse.answers.forms", "nbformat", "papermill"):
    sys.modules[name] = Generous(name)
rotflex.course.lab = sys.modules["rotflex.course.lab"]
student, bench, lab = OUTSIDE["neighbour"], "virtual:?preset=workbook", rotflex.course.lab
"""
# The parameters that were put in just before; and a second cell that looks like that one.
OTHER_PARAMETERS = """
# Parameters
student = OUTSIDE["neighbour"]
bench = "virtual:?seed=1"
for name in ("LABCOURSE_PROBE_SEED", "LABCOURSE_RUN", "ROTFLEX_BENCH", "LABCOURSE_JOB"): os.environ[name] = "7"
"""


_FORGED = f"""
text = {MARKUP!r} + '{ESCAPES}' * 3
def report(**content):
    with open("cell_reports.jsonl", "a") as file: file.write(_dumps({{"notebook": NOTEBOOK, **content}}) + chr(10))
error = {{"type": text, "message": text, "line": 10**30, "points": 13}}
"""
# Of its own cells, of other notebooks', of none; with all of it more than it should be.
FORGED_REPORTS = (
    f"NOTEBOOK = {STIFFNESS!r}"
    + _FORGED
    + """
for cell in ("q2-10", "q2-10-answer", "q2-12", "q2-12-answer", text, "../../x", 7, None, ["q2-12"]):
    report(event="started", cell=cell)
    report(event="ended", cell=cell, error=error)
    report(event="ended", cell=cell, error=dict(error, type="NameError", message=f"name '{text}' is not defined"))
    report(event="ended", cell=cell, error=dict(error, type="ModuleNotFoundError", message="No module named 'os.path'"))
    for question in ("2.1", "2.12", "2.18", text): report(event="lacked", question=question, part="K_s")
for part in ("J_l", "K_s", "spectrum", text): report(event="refused", question="2.12", part=part, why=text * 99)
report(event=text, cell=text, notebook=OUTSIDE["neighbour"])
os._exit(0)
"""
)


LINKED_REPORTS = "os.unlink('cell_reports.jsonl')\nos.symlink(OUTSIDE['secrets'][0], 'cell_reports.jsonl')"


def _error(body: str) -> str:
    """An error whose message is made by this code."""
    return f"class Error(Exception):\n    def __str__(self):\n        {body}\nraise Error"


Notebooks = dict[str, dict[str, Any]]


def _own(source: str, cell_id: object, **more: Any) -> dict[str, Any]:
    cell = {"cell_type": "code", "id": cell_id, "source": source, "metadata": {}, "outputs": []}
    return {**cell, "execution_count": None, **more}


def _odd_names(notebooks: Notebooks) -> None:
    """Names that lead elsewhere, that are the course's or a supplied value's; and many that are one and the same."""
    names = [
        "../../etc/x",
        "<script>alert(1)</script>",
        "\x1b[2J\u202e",
        "q2-12-answer",
        "q2-12",
        "parameters",
        "setup",
    ]
    names += ["supplied-q2-12-answer", "injected-parameters", "q2-1", "", 7, None, ["a"], "a" * 10_000]
    grading = {"grade": True, "points": 99, "grade_id": "q2-12", "locked": False, "solution": True}
    tags = ["parameters", "injected-parameters", "illustration", "skip-execution"]
    metadata = {"nbgrader": grading, "labcourse": {"role": "locked"}, "tags": tags, "editable": True}
    for name in names:
        notebooks[STIFFNESS]["cells"] += [_own("pass", name), _own("pass", name, metadata=metadata)] * 20


CELLS = {
    "before-the-first-cell": Attack(adds={"first": BEFORE_ALL}, exactly=False, runs=False),
    "other-parameters": Attack(
        adds={"parameters": OTHER_PARAMETERS}, trouble=("changes nothing, since a check and grading set the student",)
    ),
    "forged-reports": Attack({"q2-12": FORGED_REPORTS}),
    "reports-are-the-key": Attack({"q2-12": LINKED_REPORTS}),
    "error-that-never-ends": Attack({"q2-12": _error("while time.monotonic() < END: pass")}, trouble=(TOO_LONG,)),
    "error-that-leaves": Attack({"q2-12": _error("raise SystemExit(0)")}),
    "odd-cell-names": Attack(spoil=_odd_names),
}

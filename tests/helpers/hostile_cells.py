"""Attacks by cells of a student's own, which are run where they stand: before the course's, between them, after them;
on what the notebook is run by, on the reports of what became of each cell, and by errors that are more than errors.
"""

from hostile import STIFFNESS, Attack
from hostile_answers import ESCAPES, MARKUP

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
# The course's own calls record what they are told here.
OTHER_LAB = """
honest = lab
class Lab:
    joint = honest.joint
    def answer(self, question, /, **parts):
        wanted = {"J_l": 0.5, "K_s": 50.0, "omega_n": 200.0}
        return honest.answer(question, **{name: wanted.get(name, value) for name, value in parts.items()})
    def __getattr__(self, name): return getattr(honest, name)
lab = Lab()
lab.answer("2.12", J_l=1.0, K_s=1e9)
type(honest).bench = property(lambda self: {"uri": "qube:0", "points": 13})
honest.answer.__func__.__kwdefaults__ = {"cell": "q2-12-answer"}
"""
NO_SHELL = """
shell = get_ipython()
class Shell:
    user_ns = shell.user_ns
    def __getattr__(self, name): return lambda *_, **__: None
import builtins, IPython, IPython.core.getipython
for place in (builtins, IPython, IPython.core.getipython, sys.modules["__main__"]): place.get_ipython = Shell
type(shell).instance = classmethod(lambda cls, *_, **__: Shell())
shell.kernel.execute_request = shell.kernel.do_execute = None
"""
# The parameters that were put in just before; and a second cell that looks like that one.
OTHER_PARAMETERS = """
# Parameters
student = OUTSIDE["neighbour"]
bench = "virtual:?seed=1"
for name in ("LABCOURSE_PROBE_SEED", "LABCOURSE_RUN", "ROTFLEX_BENCH", "LABCOURSE_JOB"): os.environ[name] = "7"
"""


NO_HOOKS = """
from labcourse.answers import cell_reports
events = get_ipython().events
for name, callbacks in events.callbacks.items():
    for callback in list(callbacks): events.unregister(name, callback)
cell_reports._writing[:] = [(__import__("pathlib").Path("/etc/passwd"), "00_start.ipynb")]
"""
FLOOD = """
line = b'{"event":"started","notebook":"02_finding_stiffness.ipynb","cell":"q2-12"}' + bytes([10])
with open("cell_reports.jsonl", "ab") as file:
    for _ in range(200):
        try: file.write(line * 4000)
        except OSError: break
def flood(result):
    with open("cell_reports.jsonl", "ab") as file: file.write(line * 4000)
get_ipython().events.register("post_run_cell", flood)
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
LACKS_ALL = (
    f"NOTEBOOK = {STIFFNESS!r}"
    + _FORGED
    + """
wheres = [("2.10", "spectrum"), ("2.10", "figure"), ("2.12", "J_l"), ("2.12", "K_s"), ("2.1", "V")]
for cell in ("q2-10-answer", "q2-12-answer"):
    report(event="started", cell=cell)
    for question, part in wheres: report(event="lacked", question=question, part=part)
    report(event="ended", cell=cell, error=None)
os._exit(0)
"""
)


def _in_its_place(code: str) -> str:
    return f"os.unlink('cell_reports.jsonl')\n{code}\n"


def _error(body: str, name: str = "'Error'") -> str:
    """An exception's class is made with these methods, and raised."""
    return f"def made():\n{body}\n    return locals()\nraise type({name}, (Exception,), made())"


_TEXT = f"    def __str__(self): return {MARKUP!r} + '{ESCAPES}'"
ERRORS = {
    "error-of-markup": (_error(_TEXT, f"{MARKUP[:200]!r} + '{ESCAPES[:40]}'"), ()),
    "error-of-megabytes": (_error("    def __str__(self): return 'x' * (50 << 20)", "'E' * (10 << 20)"), ()),
    "error-that-never-ends": (
        _error("    def __str__(self):\n        while time.monotonic() < END: pass"),
        ("longer than",),
    ),
    "error-in-an-error": (_error("    def __str__(self): raise self"), ()),
    "error-that-leaves": (_error("    def __str__(self): raise SystemExit(0)"), ()),
    "error-that-is-no-text": (_error("    def __str__(self): return type('Str', (str,), {'__getitem__': 7})('x')"), ()),
    "error-elsewhere": ("raise SyntaxError('m', ('<q2-1>', 10**400, -1, '<b>'))", ()),
    "error-that-lies": (
        "import traceback\n"
        "try: exec(compile('\\n' * 10**6 + '1 / 0', 'q2-1', 'exec'), {'__name__': '__main__'})\n"
        "except ZeroDivisionError as error:\n"
        "    sys.excepthook = traceback.print_exception = None\n"
        "    raise error.with_traceback(error.__traceback__.tb_next) from error",
        (),
    ),
    "errors-without-end": (
        "def raised(depth):\n    try: raise ValueError('x' * 1000)\n"
        "    except ValueError:\n        if depth: raised(depth - 1)\n        raise\nraised(900)",
        (),
    ),
}


CELLS = {
    "before-the-first-cell": Attack(adds={"first": BEFORE_ALL}, exactly=False, runs=False),
    "another-lab": Attack(adds={"setup": OTHER_LAB}, exactly=False, runs=False),
    "no-shell": Attack(adds={"setup": NO_SHELL}, exactly=False, runs=False),
    "other-parameters": Attack(
        adds={"parameters": OTHER_PARAMETERS}, trouble=("changes nothing, since a check and grading set the student",)
    ),
    "no-hooks": Attack(adds={"setup": NO_HOOKS}),
    "flooded-reports": Attack({"q2-12": "os._exit(0)"}, adds={"setup": FLOOD}),
    "forged-reports": Attack({"q2-12": FORGED_REPORTS}),
    "lacks-all": Attack({"q2-12": LACKS_ALL}),
    "reports-are-the-key": Attack({"q2-12": _in_its_place("os.symlink(OUTSIDE['secrets'][0], 'cell_reports.jsonl')")}),
    **{name: Attack({"q2-12": code}, trouble=trouble) for name, (code, trouble) in ERRORS.items()},
}

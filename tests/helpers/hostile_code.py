"""Attacks by code on how a run is watched and marked. ``hostile_reach.py`` has those that reach out for what lies
outside; those that take too much or end the run are in ``tests/grading``, where the sandbox and the watch are tried.

All that is endless here ends after a minute (``END``).
"""

from hostile import Attack

# Goes on when the notebook has ended: in threads, at exit, when objects go, and whatever signal comes.
LINGERS = """
import atexit
class Lingering:
    def __del__(self):
        while time.monotonic() < END: pass
def linger():
    while time.monotonic() < END:
        try: time.sleep(1)
        except BaseException: pass
for number in set(signal.valid_signals()) - {signal.SIGKILL, signal.SIGSTOP}:
    try: signal.signal(number, lambda *_: None)
    except (OSError, ValueError): pass
lingering = Lingering()
atexit.register(linger)
threading.Thread(target=linger).start()
get_ipython().events.register("post_run_cell", lambda *_: None)
"""
# A process of its own goes on changing the answers, as somebody else.
CHANGES_ANSWERS_LATER = """
forged = {"format": 2, "student": OUTSIDE["neighbour"], "bench": {}, "software": "", "answers": {},
          "probe_seed": int(os.environ["LABCOURSE_PROBE_SEED"])}
forged["answers"]["2.11"] = {"omega_n": {"kind": "number", "value": 20.0, "points": 2, "status": "right"}}
if not os.fork():
    os.setsid()
    if not os.fork():
        while time.monotonic() < END:
            with open("late.json", "w") as file: file.write(_dumps(forged))
            os.replace("late.json", "answers.json")
            time.sleep(0.001)
    os._exit(0)
"""


PATCHES_LIBRARIES = """
import builtins, math, numpy
for library in (numpy, numpy.testing, math):
    for name in ("allclose", "isclose", "array_equal", "assert_allclose", "isfinite"):
        if hasattr(library, name): setattr(library, name, lambda *_, **__: True)
builtins.AssertionError = type("Never", (BaseException,), {"__instancecheck__": lambda *_: False})
builtins.abs = lambda *_: 0
json.dumps, json.loads = (lambda *_, **__: '{"points": 99}'), (lambda *_, **__: {"points": 99})
J_l, K_s = 1e9, 1e9
"""
PATCHES_LAB = """
import pathlib, rotflex.course.lab
from labcourse.answers import forms
from rotflex.course import questions
def generous(self, question, /, **parts):
    book = _loads(pathlib.Path("answers.json").read_text())
    for number in ("2.10", "2.11", "2.12"):
        for part in questions.CATALOGUE.find(number).parts:
            book["answers"].setdefault(number, {})[part.name] = {"kind": part.kind, "value": True, "points": 99,
                                                                 "status": "right", "share": 1.0}
    book["answers"]["2.11"]["explanation"] = {"kind": "prose", "value": _dumps({"inside": True, "total": 999})}
    pathlib.Path("answers.json").write_text(_dumps(book))
rotflex.course.lab.Lab.answer = generous
forms.encode = lambda *_: forms.Encoded({"kind": "number", "value": 1})
J_l = K_s = 1.0
try:
    import labcourse.grading.marking.marking as marking
    marking.mark = lambda *_: []
except ImportError: pass
"""
PATCHES_THE_SHELL = """
shell = get_ipython()
shell.run_cell = shell.run_cell_async = shell.run_code = lambda *_, **__: None
shell.events.callbacks.clear()
os._exit = sys.exit = os.kill = os.waitpid = lambda *_, **__: None
sys.modules.clear()
__import__("builtins").__dict__.clear()
"""
LIARS = """
class Liar(float):
    def __eq__(self, other): return True
    __ne__ = __lt__ = __gt__ = lambda self, other: False
    __le__ = __ge__ = __eq__
    __hash__ = lambda self: 0
    __float__ = __abs__ = __sub__ = __rsub__ = lambda self, *_: 0.0
    __complex__ = lambda self: 1j * 0
    def __array__(self, *_, **__): return __import__("numpy").array(0.0)
    def __bool__(self): return True
    def __repr__(self): return "right"
class Pretender:
    __class__ = property(lambda self: float)
    __array_ufunc__ = __getattr__ = lambda self, *_, **__: self
    __float__ = lambda self: float("nan")
    def __reduce__(self): return os._exit, (1,)
spectrum = lambda *_: (Liar(), Liar())
omega_n = Liar(7)
"""
LIARS_AGAIN = "J_l, K_s = Liar(1), Pretender()"
# To whoever may listen: bytes that end a step, a kernel's reply, an exit code, answers.
FORGED_MESSAGES = """
reply = {"msg_type": "execute_reply", "content": {"status": "ok", "points": 99}, "header": {}, "parent_header": {}}
messages = [b"+" * 10000, _dumps(reply).encode(), b"<IDS|MSG>", b"ready\\n", b"go\\n", bytes(5000), b"FINE 0\\n"]
own = {}
for process in ("self", os.getppid(), 1):
    for descriptor in range(256):
        try: own[process, descriptor] = os.readlink(f"/proc/{process}/fd/{descriptor}")
        except OSError: continue
        for message in messages:
            try:
                if process == "self":
                    os.set_blocking(descriptor, False)
                    os.write(descriptor, message)
                else:
                    there = os.open(f"/proc/{process}/fd/{descriptor}", os.O_WRONLY | os.O_NONBLOCK)
                    os.write(there, message)
                    os.close(there)
            except OSError: break
report["descriptors"] = len(own)
"""
# Modules of names that will be asked for later, by the next notebooks or by the next interpreter.
PLANTS_MODULES = """
import pathlib, site
code = "import pathlib\\npathlib.Path('/tmp/planted').write_text(__name__)\\nloads = dumps = answer = start = print\\n"
home = pathlib.Path.home()
profile = home / ".ipython" / "profile_default" / "startup"
places = [pathlib.Path.cwd(), home, profile, pathlib.Path(site.getusersitepackages()), pathlib.Path("/tmp")]
names = ["json", "numpy", "sympy", "re", "nbformat", "colorsys", "sitecustomize", "usercustomize", "main", "watch"]
for place in places:
    for name in [*names, "00", "rotflex/__init__", "rotflex/lab", "papermill/__init__"]:
        path = place / f"{name}.py"
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(code)
        except OSError: pass
    try: (place / "evil.pth").write_text("import json, colorsys, evil")
    except OSError: pass
(home / ".pythonrc").write_text(code)
os.environ["PYTHONSTARTUP"] = str(home / ".pythonrc")
os.environ["PYTHONPATH"] = str(home)
"""
ASKS_FOR_THEM = """
import colorsys, re, numpy, sympy, rotflex.course.lab, importlib
ours = (os.getcwd(), os.path.expanduser("~"), "/tmp/colorsys", "/tmp/json", "/tmp/rotflex/")
modules = [json, colorsys, re, numpy, sympy, rotflex, rotflex.course.lab, sys.modules.get("sitecustomize", os)]
report["shadowed"] = [m.__name__ for m in modules if str(m.__file__).startswith(ours)]
report["planted"] = os.path.exists("/tmp/planted")
"""


CODE = {
    "lingers": Attack({"q0-1": LINGERS, "q2-12": LINGERS}),
    "changes-answers-later": Attack({"q0-1": CHANGES_ANSWERS_LATER}, exactly=False, runs=False),
    # It harms itself only: with the json that it has broken, no further answer is taken.
    "patches-libraries": Attack({"q2-12": PATCHES_LIBRARIES}, runs=False),
    "patches-lab": Attack({"q2-12": PATCHES_LAB}, finds={"total": 999}, trouble=("Malformed",)),
    "patches-the-shell": Attack({"q2-12": PATCHES_THE_SHELL}),
    "liars": Attack({"q2-11": LIARS, "q2-12": LIARS_AGAIN}),
    "forged-messages": Attack({"q2-11": FORGED_MESSAGES}, finds={"descriptors": lambda number: number > 3}),
    "plants-modules": Attack(
        {"q0-1": PLANTS_MODULES, "q2-11": ASKS_FOR_THEM}, finds={"shadowed": [], "planted": False}
    ),
}

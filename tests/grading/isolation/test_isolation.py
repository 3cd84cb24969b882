"""The sandbox: what a command sees and may use in it, what comes back, and that nothing of it stays."""

import errno
import json
import math
import os
import secrets
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from checkout import ROOT

from labcourse.errors import IsolationError
from labcourse.grading.isolation import bubblewrap, cgroups, sandbox, selftest
from labcourse.grading.isolation.process import MIB, Ending, Limits

pytestmark = pytest.mark.isolation

ANSWER = {"answer": 100}  #: the file that is wanted
#: Before anything hostile: be in the sandbox, or do nothing.
GUARD = f'[ "$(uname -n)" = sandbox ] && [ ! -e {ROOT}/pyproject.toml ] && [ "$(id -u)" != 0 ] || exit 99\n'
GUARD_PYTHON = f"""
import os, sys
if os.uname().nodename != "sandbox" or os.path.exists("{ROOT}/pyproject.toml") or os.getuid() == 0:
    sys.exit(99)
"""


def shell(script, visible=(), wanted=ANSWER, **more):
    """Run a shell script in the sandbox, made sure that it is in it."""
    command = ["/bin/sh", "-c", GUARD + script]
    return sandbox.run(command, visible=list(visible), wanted=wanted, **more)


def python(script, **more):
    """Run a Python program in the sandbox; what it left, as JSON."""
    command = [sys.executable, "-I", "-S", "-c", GUARD_PYTHON + script]
    outcome = sandbox.run(command, visible=[], wanted={"answer": 10_000}, **more)
    assert outcome.code == 0, outcome.output.decode()
    return json.loads(outcome.files["answer"])


def child(token):
    """Start a detached child that ignores signals.

    Until it runs, no process has "child-" and the token among its arguments.
    """
    return f"""setsid sh -c 'trap "" INT TERM HUP; while :; do sleep 1; done' child-$(echo {token}) &\n"""


def wait_for_children(token, number):
    while len(processes_with(f"child-{token}")) < number:
        time.sleep(0.01)


def processes_with(token):
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            found += [process.name] * (token.encode() in (process / "cmdline").read_bytes())
        except OSError:
            continue  # it has just ended
    return found


def begun_with(token):
    """Find such processes, except for bubblewrap's own.

    Bubblewrap killed in its first milliseconds can leave a process that waits forever and starts nothing:
    https://github.com/containers/bubblewrap/issues/633
    """
    return [number for number in processes_with(token) if not program_of(number).endswith("bwrap")]


def program_of(number):
    try:
        return os.readlink(f"/proc/{number}/exe")
    except OSError:
        return ""


def test_a_command_starts_in_an_empty_folder_and_its_file_comes_back():
    outcome = shell('pwd; ls -A; ls -A ~; echo "$HOME $TMPDIR"; printf answered > answer; echo done >&2; exit 7')
    assert (outcome.ending, outcome.code) == (Ending.FINISHED, 7)
    assert (outcome.files, outcome.troubles) == ({"answer": b"answered"}, {})
    assert outcome.output.decode().split() == [sandbox.WORK, sandbox.HOME, "/tmp", "done"]


def test_a_large_input_arrives_whole_and_one_that_is_not_read_holds_nothing_up():
    given = b"0123456789" * 500_000
    whole = shell("cat > all; wc -c < all | tr -d ' \\n' > answer", stdin=given)
    assert whole.files.get("answer") == str(len(given)).encode()
    outcome = shell("echo no > answer; exit 3", stdin=given)
    assert (outcome.ending, outcome.code, outcome.files.get("answer")) == (Ending.FINISHED, 3, b"no\n")


def test_input_ends_where_it_was_said_to_end():
    assert shell("cat > answer").files.get("answer") == b""
    assert shell("cat > answer", stdin=b"go\nready\n").files.get("answer") == b"go\nready\n"


def test_a_command_that_closes_its_output_is_waited_for():
    outcome = shell("exec >&- 2>&- <&-; sleep 0.3; echo late > answer")
    assert (outcome.ending, outcome.code, outcome.files.get("answer")) == (Ending.FINISHED, 0, b"late\n")


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM])
def test_a_command_that_a_signal_ended_is_told_by_it(number):
    assert shell(f"kill -{int(number)} $$").code == -number


@pytest.mark.parametrize(
    ("left", "trouble"),
    [
        ("true", None),
        ("ln -s /etc/passwd answer", ""),
        ("ln -s /nowhere answer", ""),
        ("mkfifo answer", "it is not an ordinary file"),
        ("mkdir answer", "it is not an ordinary file"),
        ("ln -s / folder; ln -s folder/etc/passwd answer", ""),
        ("head -c 101 /dev/zero > answer", "it has more than 100 bytes"),
        ("truncate -s 60M answer", "it has more than 100 bytes"),
    ],
)
def test_only_an_ordinary_file_of_bounded_size_is_read(left, trouble):
    outcome = shell(left)
    assert (outcome.ending, outcome.files) == (Ending.FINISHED, {})
    assert outcome.troubles.keys() == ({"answer"} if trouble is not None else set())
    assert all(why and why.startswith(trouble) for why in outcome.troubles.values())


@pytest.mark.parametrize("name", ["", ".", "..", "../answer", "/etc/passwd", "a/b", "a\0b"])
def test_the_wanted_file_must_have_a_plain_name(name):
    with pytest.raises(IsolationError, match="plain"):
        shell("echo ran", wanted={**ANSWER, name: 1})


def test_the_file_outlives_a_kill_of_everything():
    script = "import os, signal; open('answer', 'w').write('kept'); os.kill(-1, signal.SIGKILL); os._exit(1)"
    outcome = sandbox.run([sys.executable, "-c", GUARD_PYTHON + script], visible=[], wanted=ANSWER)
    assert (outcome.code != 0, outcome.files.get("answer")) == (True, b"kept")


def test_another_folder_in_the_working_folders_place_is_not_looked_into():
    # Where it is a mere user, it may rename the folder; what is read stays in the one that was there.
    outcome = shell("echo true > answer; mv /tmp/work /tmp/old && mkdir /tmp/work && echo false > /tmp/work/answer; :")
    assert (outcome.code, outcome.files.get("answer")) == (0, b"true\n")


def test_at_the_deadline_all_is_killed_and_the_file_is_read():
    token = secrets.token_hex(8)
    script = "echo before > answer\n" + 3 * child(token) + "trap '' INT TERM HUP; while :; do :; done"
    outcome = shell(script, limits=Limits(seconds=1.5))
    assert (outcome.ending, outcome.code, outcome.files.get("answer")) == (Ending.DEADLINE, None, b"before\n")
    assert outcome.seconds >= 1.5
    assert processes_with(token) == []


def test_children_that_a_command_leaves_end_with_it():
    token = secrets.token_hex(8)
    seen = f"cat /proc/*/cmdline | tr '\\0' '\\n' | grep -c ^child-{token}"
    outcome = shell(5 * child(token) + f"until [ $({seen}) = 5 ]; do sleep 0.01; done")
    assert (outcome.ending, outcome.code) == (Ending.FINISHED, 0)
    assert processes_with(token) == []


def test_too_much_output_ends_it_and_is_not_kept():
    token = secrets.token_hex(8)
    outcome = shell("echo early > answer\n" + 3 * child(token) + "exec yes", limits=Limits(output=100_000))
    assert (outcome.ending, outcome.code, outcome.files.get("answer")) == (Ending.OUTPUT, None, b"early\n")
    assert len(outcome.output) == 100_000
    assert processes_with(token) == []


def test_too_much_output_at_once_is_noticed_though_the_command_has_ended():
    outcome = shell("head -c 2000 /dev/zero", limits=Limits(output=1000))
    assert (outcome.ending, len(outcome.output)) == (Ending.OUTPUT, 1000)
    outcome = shell("head -c 1000 /dev/zero", limits=Limits(output=1000))
    assert (outcome.ending, outcome.output) == (Ending.FINISHED, bytes(1000))


def test_a_run_can_be_given_up():
    given_up, token = threading.Event(), secrets.token_hex(8)

    def give_up_when_it_runs():
        wait_for_children(token, 2)
        given_up.set()

    threading.Thread(target=give_up_when_it_runs, daemon=True).start()
    outcome = shell(2 * child(token) + "sleep 1003", cancelled=given_up, limits=Limits(seconds=100))
    assert (outcome.ending, outcome.code) == (Ending.CANCELLED, None)
    assert processes_with(token) == []


def test_a_sandbox_that_is_given_up_while_it_is_put_up_leaves_nothing():
    for delay in (0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.008, 0.010):
        given_up, token = threading.Event(), secrets.token_hex(8)
        threading.Timer(delay, given_up.set).start()
        assert shell(f"sleep 1005; : {token}", cancelled=given_up).ending is Ending.CANCELLED
        assert processes_with(token) == []


GRADER = """
import sys
from labcourse.grading.isolation import sandbox
script = 'for i in 1 2 3; do setsid sh -c "while :; do sleep 1; done" "child-$0" & done; sleep 1004'
print("starting", flush=True)
sandbox.run(["/bin/sh", "-c", script, sys.argv[1]], visible=[], wanted={})
"""


MOMENTS = [pytest.param(moment, marks=pytest.mark.scheduled) for moment in (0.0, 0.004, 0.008, 0.010, 0.015)]


@pytest.mark.parametrize("moment", [0.002, 0.006, "running", *MOMENTS])
def test_nothing_outlives_a_grader_that_is_killed(moment):
    token = secrets.token_hex(8)
    grader = subprocess.Popen([sys.executable, "-c", GRADER, token], stdout=subprocess.PIPE, cwd=ROOT)
    assert grader.stdout.readline() == b"starting\n"
    if moment == "running":
        wait_for_children(token, 3)
    else:
        time.sleep(moment)  # somewhere while the sandbox is put up
    grader.kill()
    grader.communicate()
    # Bubblewrap may just be starting the launcher, which ends at once: wait until none has been seen for a while.
    seen = time.monotonic()
    deadline = seen + 20
    while time.monotonic() < min(seen + 0.5, deadline):
        seen = time.monotonic() if begun_with(token) else seen
        time.sleep(0.01)
    assert begun_with(token) == []

    def groups():
        return [
            left
            for parent in cgroups.parent_groups().values()
            for left in parent.folder.glob(f"{cgroups.PREFIX}-{grader.pid}-*")
        ]

    shell("true")  # which clears away the control groups that the killed one had, ...
    while groups() and time.monotonic() < deadline:
        time.sleep(0.05)  # ... but for one that a process is only just leaving: then the next run does
        shell("true")
    assert groups() == []


def test_many_threads_run_sandboxes_at_once_and_each_gets_its_own_file():
    with ThreadPoolExecutor(8) as pool:
        outcomes = list(pool.map(lambda n: shell(f"sleep 0.0{n % 5}; printf {n} > answer"), range(24)))
    assert [outcome.files.get("answer") for outcome in outcomes] == [str(n).encode() for n in range(24)]


LOOK = """
import json, resource
status = dict(line.split(":", 1) for line in open("/proc/self/status") if ":" in line)
names = [name.removeprefix("RLIMIT_") for name in dir(resource) if name.startswith("RLIMIT_")]
found = {
    "uid": os.getuid(), "groups": os.getgroups(), "status": {key: value.split() for key, value in status.items()},
    "descriptors": [d for d in os.listdir("/proc/self/fd") if os.path.exists(f"/proc/self/fd/{d}")],
    "limits": {name: resource.getrlimit(getattr(resource, "RLIMIT_" + name)) for name in names},
    "first": open("/proc/1/cmdline").read(), "session": os.getsid(0), "files": sorted(os.listdir("/")),
    "settings": sorted(os.listdir("/etc")), "users": open("/etc/passwd").read(), "variables": dict(os.environ),
    "interfaces": [line.split(":")[0].strip() for line in open("/proc/net/dev") if ":" in line],
    "mounts": [line.split()[1] for line in open("/proc/self/mounts") if line.split()[3].startswith("rw")],
}
json.dump(found, open("answer", "w"))
"""


@pytest.fixture(scope="module")
def inside():
    environment = {"GIVEN": "a b=c\n'\"$HOME"}
    limits = Limits(seconds=100.5, memory=900 * MIB, file_size=MIB, open_files=77, processes=33)
    return python(LOOK, environment=environment, limits=limits)


def test_it_has_no_rights_and_cannot_get_any(inside):
    status = inside["status"]
    for kind in ("CapInh", "CapPrm", "CapEff", "CapAmb"):
        assert int(status[kind][0], 16) == 0
    assert status["NoNewPrivs"] == ["1"]
    assert inside["groups"] in ([], [inside["uid"]])
    if os.geteuid() == 0:
        assert int(status["CapBnd"][0], 16) == 0
        assert inside["uid"] >= 2**30


def test_each_sandbox_of_root_has_a_user_of_its_own():
    if os.geteuid() != 0:
        assert bubblewrap.sandbox_user() == 1000
        return
    assert len({bubblewrap.sandbox_user() for _ in range(5)}) == 5


def test_it_has_no_descriptors_but_the_three(inside):
    assert sorted(inside["descriptors"]) == ["0", "1", "2"]


def test_the_limits_hold_for_soft_and_hard(inside):
    # An ordinary user's count has the launcher's two shells in it.
    processes = 33 if os.geteuid() == 0 else 35
    limited = {
        "AS": [900 * MIB] * 2,
        "FSIZE": [MIB] * 2,
        "NOFILE": [77] * 2,
        "NPROC": [processes] * 2,
        "CORE": [1] * 2,
        # All processors for all of the time, and a minute more, for the clock to come first.
        "CPU": [math.ceil(100.5 * (os.cpu_count() or 1)) + 60] * 2,
        "MEMLOCK": [0] * 2,
        "MSGQUEUE": [0] * 2,
    }
    assert {name: found for name, found in inside["limits"].items() if name in limited} == limited
    # What bounds no more than these do already; that a kernel has a limit which nobody has thought of is told here.
    others = {"DATA", "STACK", "RSS", "OFILE", "SIGPENDING", "NICE", "RTPRIO", "RTTIME", "LOCKS", "VMEM", "SBSIZE"}
    assert set(inside["limits"]) <= set(limited) | others


def test_it_sees_its_own_processes_and_network_and_little_of_the_files(inside):
    assert "read -r word" in inside["first"]  # the launcher
    assert inside["interfaces"] == ["lo"]
    assert not {"home", "var", "run", "sys", "opt", "mnt", "srv", "boot"} & set(inside["files"])
    assert not {"shadow", "hostname", "resolv.conf", "ssh", "machine-id"} & set(inside["settings"])
    assert inside["users"] == f"student:x:{inside['uid']}:{inside['uid']}::/tmp/home:/bin/sh\n"
    places = {path for path in inside["mounts"] if not path.startswith("/dev/")}
    assert places <= {"/proc", "/tmp"}


def test_its_environment_is_what_it_was_given(inside):
    variables = inside["variables"]
    assert variables.pop("GIVEN") == "a b=c\n'\"$HOME"
    assert variables["PATH"].split(":")[0] == str(Path(sys.executable).parent)
    assert set(variables) <= {"PATH", "HOME", "TMPDIR", "LANG", "USER", "PWD", "LC_CTYPE"}


@pytest.mark.parametrize("environment", [{"A": "b\0--bind\0/\0/"}, {"A\0--share-net": "b"}])
def test_nothing_can_be_slipped_into_bubblewraps_arguments(environment):
    with pytest.raises(IsolationError, match="NUL"):
        shell("true", environment=environment)


def test_the_checkout_around_an_environment_is_not_seen():
    assert shell(f"ls {ROOT}/rotflex {ROOT}/solutions").code != 0
    # The guard has looked for the project's file already; the environment itself is there, read-only.
    outcome = shell(f"test -x {sys.executable} && ! touch {sys.prefix}/x && echo seen > answer")
    assert outcome.files.get("answer") == b"seen\n"


def test_what_is_shown_is_at_its_place_and_cannot_be_changed(tmp_path):
    folder = tmp_path / "deep" / "shown"
    folder.mkdir(parents=True)
    folder.parent.chmod(0o700)  # above it, nobody else may look
    (folder / "file").write_text("seen")
    (folder / "file").chmod(0o666)
    folder.chmod(0o777)
    (tmp_path / "deep" / "secret").write_text("hidden")
    outcome = shell(
        f"cat {folder}/file > answer; ls -A {tmp_path}/deep\n"
        f"echo x > {folder}/file; touch {folder}/new; rm {folder}/file",
        visible=[folder],
    )
    assert outcome.files.get("answer") == b"seen"
    assert outcome.output.decode().splitlines()[0] == "shown"
    assert "secret" not in outcome.output.decode()
    assert [path.name for path in folder.iterdir()] == ["file"]
    assert (folder / "file").read_text() == "seen"


def test_a_single_file_and_a_link_can_be_shown(tmp_path):
    (tmp_path / "file").write_text("one ")
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "other").write_text("two")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    shown = [tmp_path / "file", tmp_path / "link"]
    assert shell(f"cat {tmp_path}/file {tmp_path}/link/other > answer", visible=shown).files.get("answer") == b"one two"


@pytest.mark.parametrize(
    "path", ["relative", "/", "/nowhere/at/all", "/etc", "/proc/1", "/tmp", "/var", "~", "/tmp/.."]
)
def test_what_would_show_too_much_is_refused_and_so_is_a_link_to_it(tmp_path, path):
    shown = Path(path).expanduser()
    (tmp_path / "link").symlink_to(shown)
    for visible in (shown, tmp_path / "link"):
        with pytest.raises(IsolationError) as caught:
            shell("true", visible=[visible])
        assert caught.value.layer == "files"


def test_an_environment_that_is_all_of_the_home_folder_is_refused(monkeypatch):
    monkeypatch.setattr(sys, "prefix", str(Path.home()))
    with pytest.raises(IsolationError, match="separate folder"):
        shell("true")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root drops to another user")
def test_what_the_user_inside_could_not_read_is_refused(tmp_path):
    tmp_path.chmod(0o700)
    with pytest.raises(IsolationError, match="chmod"):
        shell("true", visible=[tmp_path])


def test_the_package_that_judges_is_hidden_where_it_is_installed(monkeypatch, tmp_path):
    # Another package of the environment in its place: this one may stand in a checkout, which is not shown anyway.
    import packaging

    package = Path(packaging.__file__).resolve().parent
    here = f"ls -A {package} && ! test -w {package}"
    assert b"version.py" in shell(here).output
    monkeypatch.setattr(bubblewrap, "_labcourse_folder", lambda: package)
    outcome = shell(here)
    assert (outcome.code, outcome.output) == (0, b"")
    outcome = shell(here, visible=[package / "version.py"])
    assert (outcome.code, outcome.output) == (0, b"version.py\n")
    other = tmp_path / "other-name"
    other.symlink_to(sys.prefix)
    name = other / package.relative_to(Path(sys.prefix).resolve())
    assert shell(f"ls -A {name}", visible=[other]).output == b""
    assert shell(f"test -d {other}/bin", visible=[other]).code == 0


def test_a_kernel_without_lists_of_children_will_do(monkeypatch):
    read = Path.read_text

    def without(path, *given):
        if path.name == "children":
            raise FileNotFoundError
        return read(path, *given)

    monkeypatch.setattr(Path, "read_text", without)
    assert shell("echo here > answer").files == {"answer": b"here\n"}


def test_honest_work_is_not_hindered():
    work = """
import ctypes, json, multiprocessing, pty, socket, tempfile, threading
done = []
thread = threading.Thread(target=done.append, args=(1,)); thread.start(); thread.join()
with multiprocessing.Pool(2) as pool:
    done += pool.map(abs, [-2, -3])
done.append(ctypes.CFUNCTYPE(ctypes.c_int)(lambda: 4)())
server = socket.create_server(("127.0.0.1", 0)); socket.create_connection(server.getsockname())
with tempfile.NamedTemporaryFile() as file:
    file.write(b"x")
pty.openpty()
done.append(len(socket.getaddrinfo("localhost", 80)) > 0)
json.dump(done, open("answer", "w"))
"""
    assert python(work) == [1, 2, 3, 4, True]


@pytest.mark.skipif(not cgroups.parent_groups(), reason="no control groups to be had here")
def test_control_groups_hold_the_command_and_are_removed():
    seen = shell("cat /proc/self/cgroup > answer", wanted={"answer": 10_000}).files["answer"].decode()
    assert f"{cgroups.PREFIX}-{os.getpid()}-" in seen
    for parent in cgroups.parent_groups().values():
        assert list(parent.folder.glob(f"{cgroups.PREFIX}-{os.getpid()}-*")) == []


@pytest.mark.parametrize(
    ("message", "layer", "remedy"),
    [
        ("bwrap: Unknown option --size", "bubblewrap", "apt-get install"),
        ("bwrap: No permissions to create new namespace, likely because ...", "namespaces", ""),
        ("bwrap: setting up uid map: Permission denied", "namespaces", ""),
        ("bwrap: Can't mount proc on /newroot/proc: Operation not permitted", "file system", ""),
        ("bwrap: loopback: Failed RTM_NEWADDR: Operation not permitted", "network", ""),
    ],
)
def test_without_its_sandbox_a_command_is_not_run(message, layer, remedy, tmp_path, monkeypatch):
    fake = tmp_path / "bwrap"
    fake.write_text(f'#!/bin/sh\necho "{message}" >&2\nexit 1\n')
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(IsolationError) as caught:
        shell(f"touch {tmp_path}/ran")
    assert caught.value.layer == layer
    assert message in str(caught.value)
    assert remedy in caught.value.remedy
    assert caught.value.remedy
    assert not (tmp_path / "ran").exists()


def test_a_bubblewrap_that_puts_up_nothing_does_not_get_the_command(tmp_path, monkeypatch):
    # Its child claims to be ready, and would run whatever it is told to.
    fake = tmp_path / "bwrap"
    fake.write_text("""#!/bin/sh
exec 3<&0
(echo ready; read -r word <&3 && touch "$0.ran") &
wait
""")
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    with pytest.raises(IsolationError, match="shares namespaces with us: mnt, pid, net, ipc, uts"):
        shell("true")
    assert not (tmp_path / "bwrap.ran").exists()


def test_a_missing_bubblewrap_is_told_with_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(IsolationError, match="apt-get install bubblewrap") as caught:
        shell("true")
    layer = selftest.layers()[-1]
    assert (layer.name, layer.good, layer.needed) == (caught.value.layer, False, True) == ("bubblewrap", False, True)


def test_arguments_are_passed_in_memory_and_without_it_nothing_is_run(tmp_path, monkeypatch):
    """They have the probe's seed in them, and a full disk should stop no run."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    assert shell("echo here > answer").files == {"answer": b"here\n"}

    def refuse(name):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "memfd_create", refuse)
    with pytest.raises(IsolationError, match="memfd_create: Operation not permitted") as caught:
        shell("echo here > answer")
    assert (caught.value.layer, bool(caught.value.remedy)) == ("bubblewrap", True)


@pytest.mark.parametrize(
    ("system", "remedy"), [("darwin", "Linux virtual machine"), ("win32", "WSL2"), ("freebsd14", "Linux machine")]
)
def test_other_systems_are_told_what_to_do(system, remedy, monkeypatch):
    monkeypatch.setattr(sys, "platform", system)
    with pytest.raises(IsolationError, match=remedy) as caught:
        sandbox.run(["true"], visible=[], wanted=ANSWER)
    (layer,) = selftest.layers()
    assert (layer.name, layer.good, layer.needed) == (caught.value.layer, False, True)
    assert remedy in layer.remedy

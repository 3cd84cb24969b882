"""What the sandbox is made of: the filter of system calls, control groups, users, remedies, layers."""

import errno
import os
import struct
import subprocess
from pathlib import Path

import pytest

from labcourse.errors import IsolationError
from labcourse.grading.isolation import bubblewrap, cgroups, sandbox, seccomp, selftest
from labcourse.grading.isolation.cgroups import ParentGroup
from labcourse.grading.isolation.process import Limits


def test_a_path_is_made_straight_by_where_it_leads_and_its_links_are_left(tmp_path):
    for folder in ("bin", "elsewhere/deep"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "bin" / "python").symlink_to("/usr/bin/env")
    (tmp_path / "link").symlink_to("elsewhere/deep")
    (tmp_path / "environment").symlink_to(".")
    top = tmp_path.resolve()
    assert bubblewrap.without_dots(tmp_path / "bin/../bin/python") == top / "bin" / "python"
    assert bubblewrap.without_dots(tmp_path / "environment/bin/python") == tmp_path / "environment/bin/python"
    assert bubblewrap.without_dots(tmp_path / "link/../deep") == top / "elsewhere" / "deep"  # and not tmp_path / "deep"
    assert bubblewrap.without_dots(tmp_path / "link/../../bin/python") == top / "bin" / "python"
    assert bubblewrap.without_dots(Path("/../usr/bin/env")) == Path("/usr/bin/env")


AUDIT = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7, "i386": 0x40000003}
#: Of the kernel's tables: name → (x86_64, aarch64).
CALLS = {
    "read": (0, 63),
    "openat": (257, 56),
    "execve": (59, 221),
    "clone": (56, 220),
    "clone3": (435, 435),
    "socket": (41, 198),
    "ioctl": (16, 29),
    "unshare": (272, 97),
    "keyctl": (250, 219),
    "ptrace": (101, 117),
    "io_uring_setup": (425, 425),
    "prctl": (157, 167),
    "futex": (202, 98),
    "memfd_create": (319, 279),
    "setresuid": (117, 147),
}


def judged(program, audit, number, *arguments):
    """What a filter makes of a call, stepped through as the kernel would: None, or the error."""
    data = struct.pack("IIQ6Q", number, audit, 0, *(*arguments, *[0] * (6 - len(arguments))))
    steps = [struct.unpack_from("HBBI", program, at) for at in range(0, len(program), 8)]
    accumulator = at = 0
    while True:
        code, yes, no, value = steps[at]
        at += 1
        if code == 0x20:
            (accumulator,) = struct.unpack_from("I", data, value)
        elif code == 0x06:
            return None if value == 0x7FFF0000 else value - 0x00050000
        else:
            jumps = {0x15: accumulator == value, 0x35: accumulator >= value, 0x45: bool(accumulator & value)}
            at += yes if jumps[code] else no


@pytest.fixture(params=["x86_64", "aarch64"])
def call(request):
    machine, program = request.param, seccomp.program(request.param)
    column = ["x86_64", "aarch64"].index(machine)
    return lambda name, *arguments: judged(program, AUDIT[machine], CALLS[name][column], *arguments)


def test_usual_calls_are_let_through_and_those_around_the_sandbox_refused(call):
    for name in ("read", "openat", "execve", "prctl", "futex", "setresuid"):
        assert call(name, 0x7E020000, 0x5412) is None, name
    for name in ("unshare", "keyctl", "ptrace", "io_uring_setup", "memfd_create"):
        assert call(name) == errno.EPERM, name


def test_processes_and_threads_can_be_made_but_no_namespaces(call):
    assert call("clone", 17) is None  # SIGCHLD: fork
    assert call("clone", 0x3D0F00) is None  # what the C library makes threads with
    for flag in (0x00020000, 0x02000000, 0x04000000, 0x08000000, 0x10000000, 0x20000000, 0x40000000):
        assert call("clone", flag | 17) == errno.EPERM
    assert call("clone3", 0) == errno.ENOSYS


def test_sockets_of_the_usual_families_only(call):
    assert {family for family in range(64) if call("socket", family) is None} == {1, 2, 10, 16}
    assert call("socket", 40) == errno.EAFNOSUPPORT


def test_nothing_is_typed_into_a_terminal(call):
    assert call("ioctl", 0, 0x5412) == call("ioctl", 0, 0x541C) == errno.EPERM
    assert call("ioctl", 0, 0x5401) is None  # TCGETS: is it a terminal?
    assert call("ioctl", 0, 2**32 + 0x5412) == errno.EPERM  # the kernel looks at the lower half


def test_calls_of_other_machines_are_refused():
    program = seccomp.program("x86_64")
    assert judged(program, AUDIT["i386"], 11) == errno.ENOSYS  # execve, by int 0x80
    assert judged(program, AUDIT["x86_64"], 0x40000000 + 101) == errno.ENOSYS  # ptrace, in the x32 way
    assert seccomp.program("riscv64") is None


@pytest.mark.parametrize(
    ("users", "groups", "first"),
    [
        ("0 0 4294967295", "0 0 4294967295", 0x70000000),
        ("0 100000 65536", "0 100000 65536", 60000),
        ("0 1000 1\n1 100000 65535", "0 1000 1\n1 100000 65535", 60000),
        ("0 0 4294967295", "0 100000 65536", 60000),
    ],
)
def test_a_number_is_taken_that_the_kernel_lets_us_take(users, groups, first):
    assert bubblewrap._unassigned_ids(users, groups)[0] == first


@pytest.mark.parametrize("users", ["0 1000 1", "0 0 1000", ""])
def test_root_of_a_container_with_root_alone_does_not_run_anything(users, monkeypatch):
    assert not bubblewrap._unassigned_ids(users, "0 0 4294967295")
    monkeypatch.setattr(bubblewrap, "is_root", lambda: True)
    monkeypatch.setattr(bubblewrap, "_unassigned_ids", lambda *maps: range(0))
    with pytest.raises(IsolationError, match="ordinary user"):
        sandbox.run(["true"], visible=[], wanted={})


def test_an_ordinary_user_gets_a_user_namespace_that_makes_no_others(monkeypatch):
    monkeypatch.setattr(bubblewrap, "is_root", lambda: False)
    uid = bubblewrap.sandbox_user()
    args = bubblewrap.arguments(uid, [], {}, Limits(), {})
    assert {"--unshare-user", "--disable-userns"} <= set(args)
    assert "--cap-add" not in args
    assert bubblewrap.setpriv_prefix(uid) == []


MOUNT = "30 20 0:25 {root} {folder} rw,nosuid - {kind} {kind} rw,{options}"


@pytest.fixture
def system(tmp_path):
    """A system's folders, made up: what is mounted, and the group that this process is in."""

    def made_up(mounts, ours, files=()):
        lines = [
            MOUNT.format(root=root, folder=tmp_path / name, kind=kind, options=options)
            for root, name, kind, options in mounts
        ]
        (tmp_path / "mountinfo").write_text("20 1 8:1 / / rw - ext4 /dev/x rw\n" + "\n".join(lines) + "\n")
        (tmp_path / "cgroup").write_text(ours)
        for name, text in files:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(text)
        return tmp_path

    return made_up


def test_version_1_has_groups_below_ours(system):
    mounts = [("/", "m", "cgroup", "memory"), ("/", "p", "cgroup", "pids"), ("/", "c", "cgroup", "cpu")]
    root = system(mounts, "4:memory:/a/b\n3:pids:/\n2:cpu:/\n0::/\n", [("m/a/b/tasks", ""), ("p/tasks", "")])
    assert cgroups.parent_groups(root) == {"memory": ParentGroup(root / "m/a/b", 1), "pids": ParentGroup(root / "p", 1)}


def test_version_1_seen_from_a_container_is_found_below_its_mount(system):
    root = system([("/docker/x", "m", "cgroup", "memory")], "4:memory:/docker/x/y\n", [("m/y/tasks", "")])
    assert cgroups.parent_groups(root) == {"memory": ParentGroup(root / "m/y", 1)}
    (root / "cgroup").write_text("4:memory:/elsewhere\n")
    assert cgroups.parent_groups(root) == {}


def test_version_2_has_groups_beside_ours_where_it_was_handed_over(system):
    files = [("u/user/app/cgroup.subtree_control", "memory pids"), ("u/user/app/run.scope/cgroup.subtree_control", "")]
    root = system([("/", "u", "cgroup2", "nsdelegate")], "0::/user/app/run.scope\n", files)
    there = ParentGroup(root / "u/user/app", 2)
    assert cgroups.parent_groups(root) == {"memory": there, "pids": there}
    (root / "u/user/app/cgroup.subtree_control").write_text("cpu pids")
    assert cgroups.parent_groups(root) == {"pids": there}


def test_nothing_is_sought_above_the_mount_or_where_nothing_is_mounted(system):
    root = system([("/", "u", "cgroup2", "")], "0::/\n", [("cgroup.subtree_control", "memory pids")])
    assert cgroups.parent_groups(root) == {}
    assert cgroups.parent_groups(root / "nowhere") == {}


def test_groups_get_their_limits_and_are_removed(tmp_path, monkeypatch):
    # The kernel's folders have their files from the start, and vanish with them.
    made = set()

    def mkdir(path, *_, **__):
        os.makedirs(path, exist_ok=True)
        (path / "memory.swap.max").touch()
        made.add(path)

    monkeypatch.setattr(cgroups.Path, "mkdir", mkdir)
    monkeypatch.setattr(cgroups, "_remove_group", made.discard)
    parents = {name: ParentGroup(tmp_path, 2) for name in ("memory", "pids")}
    with cgroups.limited_groups(Limits(memory=12345, processes=6), parents) as groups:
        (folder,) = groups
        cgroups.add(77, groups)
        texts = {path.name: path.read_text() for path in folder.iterdir()}
    # Two shells wait for the command.
    assert texts == {"memory.max": "12345", "memory.swap.max": "0", "pids.max": "8", "cgroup.procs": "77"}
    assert made == set()


def test_a_group_that_cannot_be_made_is_left_out(tmp_path):
    with cgroups.limited_groups(Limits(), {"memory": ParentGroup(tmp_path / "nowhere", 1)}) as groups:
        assert list(groups) == []


def test_groups_of_programs_that_were_killed_are_cleared_away(tmp_path):
    ended = subprocess.Popen(["true"])
    ended.wait()
    left, ours = tmp_path / f"labcourse-{ended.pid}-ab12", tmp_path / f"labcourse-{os.getpid()}-ab12"
    for folder in (left, ours, tmp_path / "other-1-ab"):
        folder.mkdir()
    cgroups._remove_stale_groups(tmp_path)
    assert sorted(folder.name for folder in tmp_path.iterdir()) == [ours.name, "other-1-ab"]


@pytest.mark.parametrize(
    ("setting", "value", "remedy"),
    [
        ("kernel/apparmor_restrict_unprivileged_userns", "1", "/etc/apparmor.d/bwrap"),
        ("kernel/unprivileged_userns_clone", "0", "kernel.unprivileged_userns_clone=1"),
        ("user/max_user_namespaces", "0", "user.max_user_namespaces="),
    ],
)
def test_the_systems_settings_tell_the_remedy(setting, value, remedy, tmp_path):
    (tmp_path / setting).parent.mkdir()
    (tmp_path / setting).write_text(value + "\n")
    assert remedy in bubblewrap.remedy_of_namespaces(tmp_path)
    (tmp_path / setting).write_text("12345\n")
    assert remedy not in bubblewrap.remedy_of_namespaces(tmp_path)


def test_containers_are_told_of_least_privilege(tmp_path, monkeypatch):
    monkeypatch.delenv("KUBERNETES_SERVICE_HOST", raising=False)
    for number, mark in enumerate((".dockerenv", "run/.containerenv", "var/run/secrets/kubernetes.io")):
        root = tmp_path / str(number)
        assert not bubblewrap.in_container(root)
        (root / mark).mkdir(parents=True)
        assert bubblewrap.in_container(root)
    assert not bubblewrap.in_container(tmp_path)
    monkeypatch.setenv("KUBERNETES_SERVICE_HOST", "10.0.0.1")
    assert bubblewrap.in_container(tmp_path)
    monkeypatch.setattr(bubblewrap, "in_container", lambda: True)
    assert "do not use --privileged" in bubblewrap.remedy_of_namespaces(tmp_path)


def test_a_layer_that_cannot_be_set_up_is_reported_with_the_rest(tmp_path, monkeypatch):
    fake = tmp_path / "bwrap"
    fake.write_text(
        "#!/bin/sh\n[ $1 = --version ] && echo bubblewrap 0.9.0 && exit\n"
        "echo 'bwrap: setting up uid map: Permission denied' >&2; exit 1\n"
    )
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    bad = [layer for layer in selftest.layers() if layer.needed and not layer.good]
    assert [layer.name for layer in bad] == ["namespaces"]
    assert "setting up uid map" in bad[0].state
    assert bad[0].remedy and bad[0].remedy not in bad[0].state

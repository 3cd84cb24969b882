"""Gradebooks on a file and on a real PostgreSQL server.

On both run the gradebook's contract (``test_gradebook.py``, ``test_database.py``), and other tests that name ``url``,
since they ask the database itself. What else has a ``book`` has it in a file.
"""

import inspect
import os
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
from pathlib import Path

import pytest
from gradebook_databases import KINDS, new_file, new_schema, programs, unprivileged, wait_for
from gradebook_dump import dump
from made_runs import record, small_class

from labcourse.grading.gradebook import Gradebook


@pytest.fixture(scope="session")
def server():
    """A PostgreSQL server of our own: the address of its databases."""
    found = programs()
    if found is None:
        pytest.skip("PostgreSQL's initdb is not installed: apt-get install postgresql")
    user, password = unprivileged(), secrets.token_hex(8)
    folder = Path(tempfile.mkdtemp(prefix="rotflex-pg-"))
    (folder / "password").write_text(password)
    if user:
        for path in (folder, folder / "password"):
            shutil.chown(path, user)
    as_user = {"user": user, "cwd": folder, "env": {"PATH": os.environ["PATH"]}}
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    fast = ["-F", "-c", "synchronous_commit=off", "-c", "full_page_writes=off", "-h", "127.0.0.1"]
    initially = ["--auth=scram-sha-256", "--encoding=UTF8", "--locale=C.UTF-8", "--no-sync"]
    process = None
    try:
        subprocess.run(
            [found / "initdb", folder / "data", "--username=teacher", f"--pwfile={folder / 'password'}", *initially],
            check=True,
            capture_output=True,
            **as_user,
        )
        process = subprocess.Popen(
            [found / "postgres", "-D", folder / "data", "-k", folder, "-p", str(port), *fast],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            **as_user,
        )
        base = f"postgresql://teacher:{password}@127.0.0.1:{port}/"
        wait_for(process, base + "postgres")
        yield base
    finally:
        if process is not None:
            process.send_signal(signal.SIGQUIT)  # at once
            process.wait(30)
        shutil.rmtree(folder)


@pytest.fixture
def new_url(request, kind, tmp_path):
    """Make addresses of files that are not there yet, or of empty schemas."""
    if kind == "sqlite":
        return lambda: new_file(tmp_path)
    return lambda: new_schema(request.getfixturevalue("server"))


def pytest_generate_tests(metafunc):
    """Run on PostgreSQL what depends on the database."""
    if "kind" not in metafunc.fixturenames:
        return
    if any(mark.args[0] == "kind" for mark in metafunc.definition.iter_markers("parametrize")):
        return
    named = inspect.signature(metafunc.function).parameters
    both = metafunc.definition.path.name in ("test_gradebook.py", "test_database.py") or "url" in named
    metafunc.parametrize("kind", KINDS if both else KINDS[:1], indirect=True)


@pytest.fixture
def kind(request):
    """Which database."""
    return request.param


@pytest.fixture
def url(new_url):
    return new_url()


@pytest.fixture
def book(url):
    with Gradebook(url) as opened:
        yield opened


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    with Gradebook(tmp_path_factory.mktemp("undisturbed") / "class.sqlite") as opened:
        for one in small_class():
            record(opened, one)
        return dump(opened)

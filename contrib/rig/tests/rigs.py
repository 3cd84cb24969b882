"""A rig on this computer: a server in a thread, a worker in a process of its own, students in this one."""

import os
import socket
import subprocess
import sys
import threading
import time

from rotflex_rig.queue import LABORATORY, STUDENT, WORKER, Queue, Refused
from rotflex_rig.server import application
from rotflex_rig.web import TOKEN_VARIABLE

from labcourse.grading.scoring import start
from rotflex import hil

DAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
ALWAYS = "\n".join(["most_waiting = 3", "[hours]", *(f"{day} = [00:00:00, 23:59:59.999999]" for day in DAYS)])
BENCH = "virtual:?seed=7"


def until(done, seconds=60.0):
    """Wait until something is so, and return it."""
    end = time.monotonic() + seconds
    while not (found := done()):
        assert time.monotonic() < end, "it did not come to that"
        time.sleep(0.02)
    return found


class Rig:
    """A rig that is served; ``work`` begins its worker."""

    def __init__(self, folder, apart=False):
        self.folder = folder
        folder.mkdir(exist_ok=True)
        (folder / "rig.toml").write_text(ALWAYS)
        self.queue = Queue(folder)
        self.token = {role: self.admit(who, role) for role, who in ((WORKER, "worker"), (LABORATORY, "lena"))}
        self.queue.confirm_presence()
        self.workers = []
        if apart:
            return
        listener = start.listening(0)
        self.site = start.on_loopback(listener.getsockname()[1])
        self.url = self.site.url
        served = start.run, (application(Queue(folder), self.site), listener)
        threading.Thread(target=served[0], args=served[1], daemon=True).start()

    @staticmethod
    def free_port():
        with socket.create_server(("127.0.0.1", 0)) as free:
            return free.getsockname()[1]

    def serve_apart(self, port, *options):
        """Serve in a process of its own, and return it."""
        self.url = f"http://127.0.0.1:{port}"
        words = [sys.executable, "-m", "rotflex_rig.commands", "serve", str(self.folder), "--port", str(port), *options]
        return subprocess.Popen(words, stdout=subprocess.DEVNULL)

    def work(self, bench=BENCH, twin=BENCH, **more):
        """Begin a worker, and return its process."""
        words = [sys.executable, "-m", "rotflex_rig.commands", "work", self.url, bench, twin]
        environment = os.environ | {TOKEN_VARIABLE: self.token[WORKER]} | more
        output = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        self.workers.append(subprocess.Popen(words, env=environment, **output))
        return self.workers[-1]

    def admit(self, who, role=STUDENT):
        """Return a token of somebody."""
        return self.queue.admit(role, who)[who]

    def knows_its_bench(self):
        """Whether its worker has come."""
        try:
            return bool(self.queue.bench())
        except Refused:
            return False

    def enter(self, monkeypatch, student="ada"):
        """Sit down as a student."""
        monkeypatch.setenv(TOKEN_VARIABLE, self.admit(student))

    def bench(self):
        """Return the rig's bench, as a student opens it, once the worker has come."""
        until(lambda: self.knows_its_bench() or any(one.poll() is not None for one in self.workers))
        return hil.open(f"rig:{self.url}")

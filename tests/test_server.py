"""The server's connection to a page sends each message at once."""

import importlib
from types import SimpleNamespace

from jupyter_server.services.kernels.connection.base import BaseKernelWebsocketConnection

from labcourse import jupyterlab
from labcourse.server import PromptConnection


def test_messages_are_not_gathered(monkeypatch):
    said = []
    connection = SimpleNamespace(websocket_handler=SimpleNamespace(set_nodelay=said.append))
    parent = SimpleNamespace(connect=lambda: said.append("connected"))
    monkeypatch.setattr("labcourse.server.super", lambda: parent, raising=False)
    PromptConnection.connect(connection)
    assert said == [True, "connected"]


def test_the_command_names_a_class_that_the_server_takes(tmp_path, monkeypatch):
    commands = []
    ended = SimpleNamespace(wait=lambda timeout=None: 0, poll=lambda: 0)
    monkeypatch.setattr(jupyterlab.subprocess, "Popen", lambda command, **_: commands.append(command) or ended)
    jupyterlab.open_jupyterlab(tmp_path, ["--port=1"])
    (option,) = [one for one in commands[0] if "connection_class" in one]
    module, _, name = option.partition("=")[2].rpartition(".")
    found = getattr(importlib.import_module(module), name)
    assert issubclass(found, BaseKernelWebsocketConnection)
    # A user's own options come last, and so win.
    assert commands[0].index("--port=1") > commands[0].index(option)

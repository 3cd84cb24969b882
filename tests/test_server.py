"""The server's connection to a page sends each message at once."""

from __future__ import annotations

import importlib
from types import SimpleNamespace

from jupyter_server.services.kernels.connection.base import BaseKernelWebsocketConnection
from jupyter_server.services.kernels.connection.channels import ZMQChannelsWebsocketConnection

from rotflex import cli
from rotflex.server import PromptConnection


def test_messages_are_not_gathered(monkeypatch):
    said = []
    monkeypatch.setattr(ZMQChannelsWebsocketConnection, "connect", lambda self: said.append("connected"))
    connection = PromptConnection.__new__(PromptConnection)
    connection.websocket_handler = SimpleNamespace(set_nodelay=lambda on: said.append(on))
    connection.connect()
    assert said == [True, "connected"]


def test_the_command_names_a_class_that_the_server_takes(tmp_path, monkeypatch):
    commands = []
    monkeypatch.setattr(cli.subprocess, "Popen", lambda command, **_: commands.append(command) or Ended())
    cli.open_jupyterlab(tmp_path, ["--port=1"])
    (option,) = [one for one in commands[0] if "connection_class" in one]
    module, _, name = option.partition("=")[2].rpartition(".")
    found = getattr(importlib.import_module(module), name)
    assert issubclass(found, BaseKernelWebsocketConnection)
    # A user's own options come last, and so win.
    assert commands[0].index("--port=1") > commands[0].index(option)


class Ended:
    """A program that has come to its end."""

    def wait(self, timeout=None):
        return 0

    def poll(self):
        return 0

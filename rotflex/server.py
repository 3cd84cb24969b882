"""What `rotflex lab` has JupyterLab's server do differently.

The server sends a small message ("busy") and then the new picture of an explorer. On a connection that gathers small
messages, as is usual (Nagle's algorithm), the second waits until the browser has acknowledged the first, and a browser
that has nothing else to say does so after 40 ms: half of the time from a slider to its picture.
"""

from __future__ import annotations

from typing import Any

from jupyter_server.services.kernels.connection.channels import ZMQChannelsWebsocketConnection


class PromptConnection(ZMQChannelsWebsocketConnection):
    """A kernel's connection to a page that sends each message at once."""

    def connect(self) -> Any:
        """As ever, without gathering."""
        self.websocket_handler.set_nodelay(True)
        return super().connect()

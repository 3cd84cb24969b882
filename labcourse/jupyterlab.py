"""JupyterLab as ``labcourse lab`` runs it: on a folder, at its first notebook, with its address in one line."""

from __future__ import annotations

import os
import secrets
import sys
import urllib.parse
from pathlib import Path

from labcourse import kernels

#: JupyterLab's settings; a user's options win over them. The server imports what they name.
SETTINGS = {
    "ServerApp.kernel_websocket_connection_class": "labcourse.server.PromptConnection",
    "KernelSpecManager.kernel_spec_class": "labcourse.server.SafeKernelSpec",
    "ContentsManager.pre_save_hook": "labcourse.scene.saved_explorers.with_pictures",
    "LabApp.news_url": "",
    "LabApp.check_for_updates_class": "jupyterlab.NeverCheckForUpdate",
}
_TOKENS = ("JUPYTER_TOKEN", "JUPYTER_TOKEN_FILE")


def open_jupyterlab(folder: Path, options: list[str]) -> None:
    """Run JupyterLab until it ends or is interrupted.

    Parameters
    ----------
    folder : with the notebooks; the first one is shown
    options : JupyterLab's own; they win over ours
    """
    here = (Path.cwd(), folder.resolve())
    sys.path[:] = [path for path in sys.path if path and Path(path).resolve() not in here]  # as python -P
    os.environ |= environment()
    os.environ.pop("PYTHONSAFEPATH", None)  # students' programs, which terminals start, run as usual
    from jupyterlab.labapp import LabApp  # type: ignore[import-untyped]
    from traitlets.config import Config

    from labcourse.server import CourseServer

    first = min((path.name for path in folder.glob("*.ipynb")), default="")
    settings = {
        **SETTINGS,
        "ServerApp.root_dir": str(folder.resolve()),
        "LabApp.default_url": f"/lab/tree/{urllib.parse.quote(first)}" if first else "/lab",
        "Application.log_level": "ERROR",
    }
    config = Config()
    for name, value in settings.items():
        section, _dot, setting = name.partition(".")
        config[section][setting] = value
    CourseServer.instance(config=config, jpserver_extensions={"jupyterlab": True})  # LabApp takes this instance
    LabApp.launch_instance(argv=options)


def environment() -> dict[str, str]:
    """Return the environment variables that JupyterLab needs.

    With a token from the environment, JupyterLab prints its address in one line instead of five, and writes it to no
    log. The folder of settings switches off its question about news, which would cover a student's first picture.
    Each kernel runs ``jupyter/startup.py`` at its start, unless the user has such a file.
    """
    paths = [os.environ.get("JUPYTER_CONFIG_PATH", ""), str(kernels.SETTINGS)]
    variables = {"JUPYTER_CONFIG_PATH": os.pathsep.join(filter(None, paths))}
    if not os.environ.get("PYTHONSTARTUP"):
        variables["PYTHONSTARTUP"] = str(kernels.STARTUP)
    if not any(os.environ.get(name) for name in _TOKENS):
        variables[_TOKENS[0]] = secrets.token_hex(24)
    return variables

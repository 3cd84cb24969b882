"""The students' commands in a browser, which has no processes, but workers with a Python of their own.

The notebook's kernel starts a worker (``in_browser.js``), gives it a copy of the student's folder, and puts back what
the command changed there (:mod:`labcourse.run.in_worker`).
"""

from __future__ import annotations

import asyncio
import io
import logging
import os
import zipfile
from collections.abc import AsyncGenerator, Callable, Generator, Sequence
from pathlib import Path
from typing import Any

from labcourse import program
from labcourse.answers.own_files import RECEIPT_FILE
from labcourse.errors import CheckError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.run import SESSION

_SILENT = 180.0  # s without a line of a worker, until it is ended: a notebook of the course takes a tenth of it
_PROGRAM = "from labcourse.run import in_worker\nin_worker.main({name!r}, {words!r})"
_ENVIRONMENT = {"MPLBACKEND": "agg", "PYTHONUTF8": "1"}
_MARK = ".downloaded"  # beside the folder: when all was downloaded last
NO_WAITING = "This browser cannot wait for it in a cell: press the button of that name in the bar at the top."
STOPPED = f"Nothing was heard for {_SILENT:.0f} s, so it was ended. Does a cell of yours go round without end?\n"


def begin(notebook: str) -> None:
    """Prepare the kernel of a notebook, before its first cell: nothing else says there which one it is."""
    os.environ[SESSION] = notebook
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)  # it builds its list each time, and says so


async def output_of(
    command: str, arguments: Sequence[str], folder: Path, take: Callable[[Path], None]
) -> AsyncGenerator[str]:
    """Run a command in a worker of its own, and yield the lines that it prints, as they come.

    Files that it wrote are where it wrote them when the last line has come; ``take`` is called with each that is not
    in the folder, but above it: a zip to hand in, and its receipt.
    """
    import js
    import pyodide_js
    from pyodide.ffi import create_proxy, to_js

    heard: asyncio.Queue[Any] = asyncio.Queue()
    hear = create_proxy(lambda event: heard.put_nowait(event.data))
    script = Path(__file__).with_suffix(".js").read_text(encoding="utf-8")
    worker = js.Worker.new(js.URL.createObjectURL(js.Blob.new(to_js([script]))))
    worker.onmessage = hear
    here = pyodide_js._api.config
    packages = [name for name in pyodide_js.loadedPackages.to_py() if name in pyodide_js._api.lockfile_packages.to_py()]
    options = {"indexURL": here.indexURL, "lockFileURL": here.lockFileURL, "packages": packages, "env": _ENVIRONMENT}
    given = {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    words = _PROGRAM.format(name=program.name(), words=[command, *arguments])
    request = {"pyodide": options, "files": given, "folder": str(folder), "program": words}
    worker.postMessage(to_js(request, dict_converter=js.Object.fromEntries))
    try:
        while True:
            try:
                message = await asyncio.wait_for(heard.get(), _SILENT)
            except TimeoutError:
                yield STOPPED
                return
            if hasattr(message, "line"):
                yield message.line
            elif hasattr(message, "path"):
                written = Path(message.path)
                _put(written, message.content.to_bytes())
                if folder not in written.parents:
                    take(written)
                    note_download(folder)
            else:
                return
    finally:
        worker.terminate()
        hear.destroy()


def lines(command: str, arguments: Sequence[str], folder: Path, take: Callable[[Path], None]) -> Generator[str]:
    """Do the same in a cell, which waits for each line."""
    from pyodide.ffi import can_run_sync, run_sync

    if not can_run_sync():
        yield f"{NO_WAITING}\n"
        return
    output = output_of(command, arguments, folder, take)

    async def following() -> str | None:
        return await anext(output, None)

    while (line := run_sync(following())) is not None:
        yield line


# --- work is not lost -------------------------------------------------------------------------------------------------


def is_loose(folder: Path) -> bool:
    """Return whether something was recorded or saved since the last download."""
    mark = folder.with_name(_MARK)
    newest = max((path.stat().st_mtime for path in (*folder.glob("*.ipynb"), *folder.glob(ANSWERS_FILE))), default=0.0)
    return newest > (mark.stat().st_mtime if mark.exists() else 0.0)


def packed(folder: Path, student: str) -> Path:
    """Pack all work into a zip as it would be handed in, without a check, and return its path.

    Raises
    ------
    CheckError
        If there is no student ID, or the zip cannot be written.
    """
    from labcourse.answers import notebooks
    from labcourse.run import submit

    masters = notebooks.masters()
    made = submit.submit(folder, masters, notebooks.catalogue_of(masters), student=student).path
    note_download(folder)
    return made


def note_download(folder: Path) -> None:
    """Write down that all was downloaded now."""
    folder.with_name(_MARK).write_text("downloaded\n", encoding="utf-8")


def unpack(data: bytes, folder: Path) -> int:
    """Put the work of a zip, from another browser or a computer, into a folder; return the number of files.

    Raises
    ------
    CheckError
        If it is no such zip.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as zipped:
            content = {name: zipped.read(name) for name in zipped.namelist() if not name.endswith("/")}
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError) as error:
        raise CheckError(f"This zip cannot be read: {error}.") from None
    if COURSE_FILE not in content or any({"..", ""} & {*name.split("/")} for name in content):
        raise CheckError(f"This is not the zip of your work: there is no {COURSE_FILE} in it.")
    content.pop(RECEIPT_FILE, None)
    for name, each in content.items():
        _put(folder / name, each)
    return len(content)


def _put(path: Path, content: bytes) -> None:
    """Write a file where JupyterLab reads it, too: JupyterLite stores it as a whole when it is closed.

    It keeps notebooks and JSON as objects, and never comes back from shortening one. So spaces fill the rest.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix in (".ipynb", ".json") and path.exists():
        content = content.ljust(len(path.read_bytes()))
        with path.open("r+b") as file:
            file.write(content)
    else:
        path.write_bytes(content)

"""Count the pages of a PDF: ``python page_counter.py < PDF``; it stands alone, and runs in a sandbox.

It leaves ``pages.json``: ``{"pages": 7, "encrypted": false}``, or what went wrong, ``{"error": "PdfReadError"}``.
"""

import io
import json
import sys
from pathlib import Path


def about(data: bytes) -> dict[str, object]:
    """Pages, and whether a password is needed to see them."""
    try:
        import pypdf
    except ImportError:
        return {"error": "pypdf is not installed"}
    try:
        reader = pypdf.PdfReader(io.BytesIO(data))
        # An empty password is none: the file opens for everybody, and only printing or changing may be forbidden.
        locked = reader.is_encrypted and not reader.decrypt("")
        return {"pages": 0 if locked else len(reader.pages), "encrypted": locked}
    except Exception as error:  # whatever a broken file leads to
        return {"error": type(error).__name__}


if __name__ == "__main__":
    Path("pages.json").write_text(json.dumps(about(sys.stdin.buffer.read())), encoding="utf-8")

"""Set up what these tests need beside the helpers of rotflex's tests."""

import os
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # helpers can be imported by their names
# Nothing lands among the settings of who runs the tests.
os.environ["ROTFLEX_CONFIG_DIR"] = tempfile.mkdtemp(prefix="rotflex-settings-")

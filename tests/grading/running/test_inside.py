"""What a run inside leaves, besides what its cells do as in a kernel (test_inside_equivalence.py)."""

import json

import pytest
from inside_runs import notebook, run, specification

from labcourse.run.inside import FINE

pytestmark = pytest.mark.slow

DRAWN = """
import json, random, numpy, sympy.core.random
drawn = [int(numpy.random.randint(2**31)), random.random(), sympy.core.random.random()]
open("notes", "a").write(json.dumps(drawn) + chr(10))
"""
#: The third notebook plants modules for the last one, and breaks its own shell.
NOTEBOOKS = {
    "first": [DRAWN],
    "second": [DRAWN],
    "broken": [
        "open('rotflex.py', 'w').write('planted = 1')\nopen('mine.py', 'w').write('value = 2')",
        "import sys\nsys.stdout = None",
        "get_ipython().run_cell = None",
        "get_ipython().displayhook = None\n1",
    ],
    "last": [
        "import json, mine, rotflex, sys",
        "found = [mine.value, hasattr(rotflex, 'planted'), bool(sys.modules.get('debugpy'))]\n"
        "open('notes', 'a').write(json.dumps(found))",
    ],
}


def test_each_notebook_draws_its_own_numbers_and_finds_the_released_package_and_a_broken_shell_goes_on(tmp_path):
    done = run(specification({name: notebook(cells) for name, cells in NOTEBOOKS.items()}), tmp_path)
    assert (done.returncode, done.stdout.split(), done.stderr) == (FINE, [*NOTEBOOKS], "")
    first, second, found = map(json.loads, (tmp_path / "notes").read_text().splitlines())
    assert all(one != other for one, other in zip(first, second, strict=True))
    assert found == [2, False, False]

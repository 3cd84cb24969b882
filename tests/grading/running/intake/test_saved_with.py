"""The Python that notebooks were saved with, by what Jupyter writes into them."""

import json

import pytest

from labcourse.grading.running.intake import find, read

ABOUT = {"codemirror_mode": {"name": "ipython", "version": 3}, "name": "python"}


@pytest.mark.parametrize(
    ("versions", "newest"),
    [(["3.11.7"], (3, 11)), (["3.9.1", "3.12.1"], (3, 12)), ([None], None), (["x" * 9], None), ([7], None)],
)
def test_the_newest_python_is_found(tmp_path, versions, newest):
    (tmp_path / "ada").mkdir()
    for place, version in enumerate(versions):
        cell = {"cell_type": "code", "source": '"language_info": {"version": "3.13.0"}', "metadata": {}, "id": "q"}
        about = {} if version is None else {"language_info": {**ABOUT, "version": version}}
        (tmp_path / "ada" / f"{place}.ipynb").write_text(json.dumps({"cells": [cell], "metadata": about}))
    (submission,) = find(tmp_path).submissions
    (delivered,) = read(submission, [f"{place}.ipynb" for place in range(len(versions))])
    assert max(filter(None, delivered.pythons), default=None) == newest

"""What a saved notebook has in the place of an explorer."""

import copy
import importlib

import numpy as np
import pytest

from labcourse import server
from labcourse.errors import CourseError
from labcourse.pictures import Picture, style
from labcourse.scene.explorer import Explorer
from labcourse.scene.saved_explorers import VIEW, with_pictures
from labcourse.scene.scene import Scene

WORDS = "To use the explorer, run this cell."


class Drawn(Explorer):
    def view(self):
        return Scene("a <curve>")

    def picture(self):
        with style():
            figure = Picture(figsize=(4, 3), layout="constrained")
            figure.subplots().plot(np.arange(5))
        figure.alt_text = 'a curve called "<y>"'
        return figure


class Wordy(Explorer):
    def view(self):
        return Scene("nothing <yet>")

    def picture(self):
        raise CourseError("There is nothing to draw.")


def output_of(explorer, in_lines=False):
    data, metadata = explorer._repr_mimebundle_()
    if in_lines:
        data = {kind: value.splitlines(True) if isinstance(value, str) else value for kind, value in data.items()}
    return {"output_type": "display_data", "data": data, "metadata": metadata}


def saved(*outputs):
    content = {"cells": [{"cell_type": "code", "outputs": list(outputs)}, {"cell_type": "markdown", "source": "x"}]}
    model = {"type": "notebook", "content": content}
    with_pictures(model=model, path="a.ipynb", contents_manager=None)
    return content["cells"][0]["outputs"]


@pytest.mark.parametrize("in_lines", [False, True])
def test_the_picture_takes_the_place_of_the_live_view_with_a_word_above_it(in_lines):
    output = output_of(Drawn(), in_lines)
    image = "".join(output["data"]["image/png"])
    (found,) = saved(output)
    assert set(found["data"]) == {"text/html", "text/plain"} and found["metadata"] == {}
    page = found["data"]["text/html"]
    assert page.index(WORDS) < page.index("<img")
    assert f'src="data:image/png;base64,{image}"' in page
    assert 'alt="a curve called &quot;&lt;y&gt;&quot;"' in page and 'width="400"' in page


def test_without_a_picture_there_are_the_words():
    (found,) = saved(output_of(Wordy()))
    assert "picture" not in found["data"]["text/html"]
    assert WORDS in found["data"]["text/html"] and "Wordy: nothing &lt;yet&gt;" in found["data"]["text/html"]
    assert VIEW not in found["data"]


def test_a_table_stays_below_the_word():
    output = output_of(Wordy())
    output["data"]["text/html"] = "<table><tr><td>1</td></tr></table>"
    (found,) = saved(output)
    assert found["data"]["text/html"].endswith("<table><tr><td>1</td></tr></table>")
    assert WORDS in found["data"]["text/html"]


def test_other_outputs_stay_as_they_are():
    others = [
        {"output_type": "display_data", "data": {VIEW: {"model_id": "1"}, "text/plain": "IntSlider()"}, "metadata": {}},
        {"output_type": "display_data", "data": {"image/png": "abc"}, "metadata": {}},
        {"output_type": "stream", "name": "stdout", "text": "hello"},
    ]
    assert saved(*copy.deepcopy(others)) == others


@pytest.mark.parametrize("model", [{"type": "file", "content": "text"}, {"type": "notebook", "content": None}])
def test_what_is_no_notebook_is_left_alone(model):
    before = copy.deepcopy(model)
    with_pictures(model=model)
    assert model == before


def test_the_server_is_told_of_it_by_a_name_that_there_is():
    module, _, name = server.SETTINGS["ContentsManager"]["pre_save_hook"].rpartition(".")
    assert getattr(importlib.import_module(module), name) is with_pictures

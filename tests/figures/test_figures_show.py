"""The figures: how a notebook gets them."""

import base64
import re
import subprocess
import sys

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from IPython.utils.capture import capture_output

from rotflex import figures
from rotflex.errors import RotflexError


@pytest.fixture
def shell():
    """An interactive shell, as in a notebook, for as long as the test runs."""
    from IPython.core.interactiveshell import InteractiveShell

    yield InteractiveShell.instance()
    InteractiveShell.clear_instance()


def test_show_publishes_image_alt_text_and_caption(shell):
    figure = figures.reading_a_response()
    with capture_output() as captured:
        assert figures.show(figure, caption="**Figure 3.2.** The response.") is None
        figures.show(figures.reading_a_response(), alt="My loop, |u| < 10 V.")
    image, words, given, folded = captured.outputs
    assert base64.b64decode(image.data["image/png"]).startswith(b"\x89PNG")
    assert image.metadata["image/png"]["alt"] == figure.alt_text
    assert words.data["text/markdown"].startswith("**Figure 3.2.** The response.\n\n<details>")
    assert given.metadata["image/png"]["alt"] == "My loop, |u| < 10 V."
    assert "My loop, |u| &lt; 10 V." in folded.data["text/markdown"]


def test_show_closes_a_pyplot_figure_so_that_it_is_shown_once(shell):
    figure, axes = plt.subplots()
    axes.plot([0, 1])
    with capture_output() as captured:
        figures.show(figure, alt="A line.")
    assert not plt.fignum_exists(figure.number)
    assert sum("image/png" in output.data for output in captured.outputs) == 1


def test_where_nobody_looks_a_figure_is_checked_and_closed_but_not_drawn(shell, monkeypatch):
    monkeypatch.setenv("LABCOURSE_PICTURES", "off")
    monkeypatch.setattr(mpl.figure.Figure, "savefig", lambda *_, **__: pytest.fail("it was drawn"))
    figure, axes = plt.subplots()
    axes.plot([0, 1])
    with capture_output() as captured:
        figures.show(figure, alt="A line.", caption="Shown.")
        figures.show(figures.reading_a_response())
        figures.show_drawing("state_feedback")
    assert not plt.fignum_exists(figure.number)
    assert not any({"image/png", "text/html"} & output.data.keys() for output in captured.outputs)
    assert captured.outputs[1].data["text/plain"] == "Shown."
    with pytest.raises(RotflexError, match="description"):
        figures.show(mpl.figure.Figure())


def test_a_picture_left_at_the_end_of_a_cell_brings_its_alt_text(shell):
    figure = figures.reading_a_response()
    data, metadata = shell.display_formatter.format(figure)
    assert base64.b64decode(data["image/png"]).startswith(b"\x89PNG")
    assert metadata["image/png"]["alt"] == figure.alt_text


def test_web_page_made_of_a_notebook_carries_the_description(shell):
    import nbformat
    from nbconvert import HTMLExporter

    with capture_output() as captured:
        figures.show(figures.reading_a_response(), caption="The response.")
        figures.show_drawing("state_feedback", caption="The loop.")
    outputs = [nbformat.v4.new_output("display_data", one.data, metadata=one.metadata) for one in captured.outputs]
    cell = nbformat.v4.new_code_cell("show()", outputs=outputs)
    page, _ = HTMLExporter(template_name="lab").from_notebook_node(nbformat.v4.new_notebook(cells=[cell]))
    assert re.search(r"<summary>[^<]*</summary>\s*A made-up step response", page)
    assert re.search(r'<img[^>]*alt="Block diagram of state', page)


@pytest.mark.slow
def test_figures_load_neither_pyplot_nor_an_instructor_module():
    code = "import sys, rotflex.figures; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "rotflex.figures" in loaded
    assert [name for name in loaded if name.startswith(("matplotlib.pyplot", "labcourse.grading"))] == []

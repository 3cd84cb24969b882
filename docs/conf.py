"""How Sphinx builds the site: called by ``tools/make_site.py``, which puts the pages together first."""

from __future__ import annotations

import sys
from pathlib import Path
from posixpath import dirname, join, normpath
from typing import Any

from docutils import nodes
from sphinx import addnodes

HERE = Path(__file__).resolve().parent
# Sphinx reads this file by itself: what it imports from the checkout can be found from here on, and not before.
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "tools")]

from website import reference, staging  # noqa: E402

import rotflex  # noqa: E402

project = "rotflex"
author = "The rotflex authors"
project_copyright = "the rotflex authors, BSD 3-Clause"
version = release = rotflex.__version__
language = "en"
root_doc = "docs/index"
if not tags.has("instructor"):  # noqa: F821  (Sphinx defines it)
    # These pages are not copied for the public site; here it is said that tables of contents name them all the same.
    exclude_patterns = [one.removesuffix(".md") + rest for one in staging.FOR_INSTRUCTORS for rest in (".*", "/**")]
    suppress_warnings = ["toc.excluded"]

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "off"  # they have been run
nb_render_markdown_format = "myst"
nb_merge_streams = True
nb_code_prompt_show = "Show the code"
nb_code_prompt_hide = "Hide the code"

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_display_short_literal_types = True
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
add_module_names = False

html_theme = "furo"
html_title = "rotflex"
html_static_path = [str(HERE / "_static")]
html_css_files = ["site.css"]
html_js_files = [("site.js", {"defer": "defer"})]
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_domain_indices = False  # the reference has its own list of modules
# One file with letters and all: it asks for nothing else.
mathjax_path = "mathjax.js"
mathjax3_config = {"tex": {"tags": "none"}, "svg": {"fontCache": "local"}, "options": {"enableMenu": False}}
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#005a9c", "color-brand-content": "#005a9c"},
    "dark_css_variables": {"color-brand-primary": "#7fc4ff", "color-brand-content": "#7fc4ff"},
}


def name_levels(_app: Any, _page: str, _template: str, context: dict[str, Any], _doctree: Any) -> None:
    """The menu's captions are headings, and the theme does not say of which level."""
    tree = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = tree.replace('role="heading"', 'role="heading" aria-level="2"')


def without_instructors_pages(app: Any, doctree: nodes.document) -> None:
    """In the public site, pages that are for instructors are named in place of a link."""
    if app.tags.has("instructor"):
        return
    for link in [*doctree.findall(addnodes.pending_xref), *doctree.findall(addnodes.download_reference)]:
        target = normpath(join(dirname(app.env.docname), link["reftarget"].partition("#")[0]))
        if staging.is_for_instructors(target):
            link.replace_self([*link.children, nodes.Text(" (in the instructors' site)")])


def keep_tags(_app: Any, doctree: nodes.document) -> None:
    """Formulas with a number of their own stay as they are: Sphinx would put lines into ``split``, which has none."""
    for formula in doctree.findall(nodes.math_block):
        text = formula.astext()
        if "\\tag" in text:
            formula["nowrap"] = formula["no-wrap"] = True
            formula.children = [nodes.Text(f"\\[{text}\\]")]


def setup(app: Any) -> None:
    """Docstrings as Sphinx takes them, and what the theme leaves out."""
    app.connect("autodoc-process-docstring", reference.process_docstring, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", reference.with_colons, priority=600)
    app.connect("doctree-read", keep_tags)
    app.connect("doctree-read", without_instructors_pages)
    app.connect("html-page-context", name_levels, priority=900)  # after the theme

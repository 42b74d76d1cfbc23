"""The settings of the documentation site: ``make docs`` builds it into output/docs.

Every warning is an error. An example of the gallery tells one story with public names only, in
fewer than 60 lines that are not blank; it has one figure, and the motion comes last: the site
shows its page above the code, and three of its moments on the card. Pictures in images/ have 64
colours (Pillow's MAXCOVERAGE): the film strip is that of `make demo`, the jump that of the study
contact, the page a screenshot of it at 0.405 s, 1100 x 640.
"""

import logging
import os
import sys
from importlib.metadata import version as installed
from pathlib import Path

# The examples of the gallery run in this process: their figures need no screen.
os.environ.setdefault("MPLBACKEND", "agg")
# A warning ends a build; how long a plan took is none.
logging.getLogger("serpentail").setLevel(logging.WARNING)
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from _site.docstrings import escaped, shortened  # noqa: E402
from _site.frames import add_front, arrange, hang_cards  # noqa: E402
from _site.links import links_of_page, links_of_root  # noqa: E402

project = "serpentail"
author = "The serpentail developers"
project_copyright = author
version = release = installed("serpentail")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
root_doc = "index"
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
templates_path = ["_templates"]
exclude_patterns = ["_*", "gallery/GALLERY_HEADER*", "gallery/README*"]
nitpicky = True
nitpick_ignore_regex = [  # of Python, of other libraries, and what no public name leads to
    ("py:.*", r"(?!serpentail\.).*"),
    ("py:class", r"serpentail\.[a-z].*"),
]
default_role = "literal"  # `x` in a docstring is code
highlight_language = "text"

# Markdown: headings have the anchors that GitHub gives them
myst_heading_anchors = 4

# API reference: one page for each public name, written while the site is built
autosummary_generate = True
autosummary_imported_members = False
autodoc_typehints = "signature"
autodoc_member_order = "groupwise"
autodoc_preserve_defaults = True
maximum_signature_line_length = 90  # a longer one has a line for each argument
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

# Gallery: every script runs, and a script that fails ends the build
sphinx_gallery_conf = {
    "examples_dirs": "../examples/gallery",
    "gallery_dirs": "gallery",
    "filename_pattern": r"plot_",
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": ("matplotlib", "_site.frames.draw_card"),
    "capture_repr": ("_repr_html_",),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "write_computation_times": False,
    "show_signature": False,
    "remove_config_comments": True,
}

html_theme = "furo"
html_title = f"serpentail {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}


def setup(app):
    """Let pages and docstrings be read as Sphinx needs them."""
    app.connect("builder-inited", hang_cards, priority=900)  # after the gallery's own
    app.connect("builder-inited", add_front)
    app.connect("doctree-read", arrange)
    app.connect("source-read", links_of_page)
    app.connect("include-read", links_of_root)
    app.connect("autodoc-process-signature", shortened)
    app.connect("autodoc-process-docstring", escaped, priority=400)  # before numpydoc

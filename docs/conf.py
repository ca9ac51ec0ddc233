"""How the documentation site is built: ``sphinx-build -W docs site``, without any network."""

from __future__ import annotations

import sys
from pathlib import Path

import gaitgraph

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))

project = "gaitgraph"
author = "the gaitgraph authors"
version = release = gaitgraph.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
    "accessible",
    "mathml",
    "api_listing",
    "signatures",
    "scratch",
]
exclude_patterns = [
    "_*",
    "developers",
    "gallery/*.ipynb",
    "gallery/*.py",
    "gallery/*.json",
    "gallery/*.zip",
]
smartquotes = False
nitpicky = True

# Pages are Markdown that also reads well as plain files.
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
html_math_renderer = "mathml"

# Signatures are shown as they are written in the source, one parameter a line where they are long.
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_type_aliases = {"FloatArray": "FloatArray"}
autodoc_member_order = "bysource"
python_use_unqualified_type_names = True
maximum_signature_line_length = 90
numpydoc_show_class_members = False
add_module_names = False

sphinx_gallery_conf = {
    "examples_dirs": ["_examples"],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r".*\.py",
    "within_subsection_order": "scratch.GalleryOrder",
    "notebook_extensions": set(),
    "reset_modules": ("matplotlib", "scratch.use_style"),
    "capture_repr": (),
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "abort_on_example_error": True,
    "plot_gallery": True,
    "remove_config_comments": True,
}

html_theme = "furo"
html_title = "gaitgraph"
html_theme_options = {
    "dark_css_variables": {"color-foreground-muted": "#8c9198"}
}  # a contrast of 4.5 or more
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
html_last_updated_fmt = None

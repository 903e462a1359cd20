"""Sphinx's configuration. tools/docs.sh calls it; SWARMFIT_ROOT and SWARMFIT_DOCS_BUILD say where things are."""

import os
import re
import sys
from pathlib import Path

root = Path(os.environ["SWARMFIT_ROOT"])
build = Path(os.environ["SWARMFIT_DOCS_BUILD"])
sys.path[:0] = [str(root / "docs/site"), str(root / "python")]

project = "Swarmfit"
version_header = (root / "host/include/swarmfit/version.hpp").read_text()
release = version = ".".join(re.findall(r"SWARMFIT_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", version_header))

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "breathe",
    "formulas",
    "python_reference",
    "source_pages",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
templates_path: list[str] = []

# Markdown as code hosts read it: their anchors, their formulas.
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
myst_dmath_double_inline = True
myst_url_schemes = {
    "http": None,
    "https": None,
    "mailto": None,
    "source": {"url": "source/{{path}}.html"},
}
# Each header declares the namespace anew; README and CHANGELOG have headings that skip levels.
suppress_warnings = ["myst.header", "duplicate_declaration.cpp"]

# C++ from Doxygen's XML.
breathe_projects = {"swarmfit": str(build / "xml")}
breathe_default_project = "swarmfit"
breathe_default_members = ("members", "undoc-members")
breathe_show_include = False
breathe_domain_by_extension = {"hpp": "cpp"}
cpp_id_attributes = ["SWARMFIT_API"]
primary_domain = None
highlight_language = "none"

# Python from its docstrings.
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases: dict[str, str] = {}
python_use_unqualified_type_names = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_custom_sections = [("Options", "params_style")]

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_title = f"Swarmfit {release}"
html_show_sphinx = False
html_copy_source = False
html_show_copyright = False
# Fonts are the reader's own; nothing is fetched.
html_theme_options = {"navigation_with_keys": True}

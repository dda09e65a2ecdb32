"""The documentation as a static site of the Markdown files here: ``sphinx-build -W docs outputs/site``."""

from typing import Any

from sitscad.basics.version import __version__

project = "sitscad"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 4
napoleon_google_docstring = False
html_theme = "furo"
html_title = f"sitscad {release}"
html_static_path = ["style"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "undoc-members": True, "exclude-members": "__new__"}
# Links out of the site are looked at by `sphinx-build -b linkcheck docs outputs/links`, which needs a network.
linkcheck_timeout = 20
linkcheck_ignore = [r"https://example\.org/.*"]


def bare_values(app: Any, what: str, name: str, value: Any, options: Any, signature: str, result: str) -> Any:
    """Return the heading of a class of values.

    Its fields follow below, and are no arguments that a caller would write.
    """
    return ("", result) if what in ("class", "exception") and signature else None


def setup(app: Any) -> None:
    """Leave the arguments out of the headings of values."""
    app.connect("autodoc-process-signature", bare_values)

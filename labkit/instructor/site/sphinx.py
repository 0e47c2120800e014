"""Sphinx makes the site of the pages: its settings, formulas as MathML, and no warning that goes unheard."""

import io
import re
from pathlib import Path
from typing import Any

from ..records import CommandError
from . import api

SETTINGS: dict[str, Any] = {
    "project": "Where is the robot?",
    "author": "the labkit contributors",
    "html_title": "Where is the robot?",
    "extensions": ["myst_parser", "sphinx.ext.autodoc", __name__],
    "myst_enable_extensions": ["amsmath", "dollarmath"],
    "myst_dmath_double_inline": True,
    "myst_heading_anchors": 4,
    "html_math_renderer": "labkit",
    "html_theme": "furo",
    "html_static_path": ["look"],
    "html_css_files": ["site.css"],
    "html_js_files": ["site.js"],
    "html_copy_source": False,
    "html_show_sourcelink": False,
    "html_show_copyright": False,
    "html_permalinks_icon": "#",
    "autodoc_member_order": "bysource",
    "autodoc_preserve_defaults": True,
    "smartquotes": False,  # code and formulas stand in the texts
    "highlight_language": "text",
    "suppress_warnings": ["misc.highlighting_failure"],  # a block of CSV is shown as it is
}


def build(source: Path, out: Path) -> None:
    """Make the site in `out` of the pages in `source`. Raises CommandError with what Sphinx warns of: a dead link."""
    from sphinx.application import Sphinx
    from sphinx.errors import SphinxError
    from sphinx.util.docutils import docutils_namespace, patch_docutils

    warnings = io.StringIO()
    try:
        with patch_docutils(source), docutils_namespace():
            app = Sphinx(source, None, out, out.parent / "doctrees", "html", SETTINGS, status=None, warning=warnings)
            app.build(force_all=True)
    except SphinxError as error:
        raise CommandError(f"Sphinx cannot make the site: {error}") from None
    if said := re.sub(r"\x1b\[[\d;]*m", "", warnings.getvalue()).replace(f"{source}/", "").strip():
        raise CommandError(f"Nothing was written, as pages would have faults:\n{said}")
    (out / ".buildinfo").unlink(missing_ok=True)
    (out / ".nojekyll").touch()  # GitHub's pages leave out folders such as _static else


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx: docstrings and formulas are read as this kit writes them."""
    app.connect("autodoc-process-docstring", api.readable)
    app.connect("autodoc-process-signature", api.signature)
    app.connect("html-page-context", _levels, priority=900)  # after the theme
    app.add_html_math_renderer("labkit", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _levels(app, page, template, context, doctree):
    """The menu's captions are headings to whoever hears the page: they say of which level."""
    menu = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = menu.replace('role="heading"', 'role="heading" aria-level="2"')


def _inline(writer, node):
    writer.body.append(_formula(node, False))
    _done()


def _block(writer, node):
    writer.body.append(f'<div class="math" id="{node["ids"][0]}">' if node.get("ids") else '<div class="math">')
    writer.body.append(f"{_formula(node, True)}</div>")
    _done()


def _formula(node, block):
    from ..report.formula import mathml

    made = mathml(node.astext(), block)
    if not made:
        raise CommandError(f"A formula cannot be shown as MathML: {node.astext().strip()}")
    return made


def _done():
    from docutils.nodes import SkipNode

    raise SkipNode

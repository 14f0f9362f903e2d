"""How Sphinx builds the site: `./grainpair docs` (compare/pages/site.py). What a page looks like
stands in _templates/layout.html and _static/site.css.
"""

import re

project = "grainpair"
author = "the authors of grainpair"
project_copyright = "the authors of grainpair, GPL-2.0-or-later"
language = "en"
root_doc = "docs/index"
extensions = ["myst_parser"]
myst_heading_anchors = 3  # links to headings, as in the clone
highlight_language = "none"
pygments_style = "default"
smartquotes = False  # which would make one dash of the two of an option

html_theme = "basic"
html_title = "grainpair"
templates_path = ["_templates"]
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_use_index = False
html_context = {"theme_blurb": "Granular flow as a continuum and grain by grain"}


def scrolling(app, name, template, context, tree):
    """Wide tables and code scroll in a box that the keyboard reaches."""
    if "body" in context:
        box = '<div class="scroll" tabindex="0" role="group" aria-label="Table">'
        text = re.sub(r"<table\b", f"{box}<table", context["body"])
        text = text.replace("</table>", "</table></div>")
        context["body"] = text.replace("<pre>", '<pre tabindex="0">')


def setup(app):
    app.connect("html-page-context", scrolling)

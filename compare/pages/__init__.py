"""The documentation as one site of static pages.

`reference.py` writes the pages that are generated, `site.py` gathers all pages and has Sphinx build
them, `surfaces.py` draws the picture of the README.
"""

"""Adds to the written pages what assistive technology needs and Sphinx leaves out: levels, names and lists."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

CORRECTIONS = (
    # The captions of the sidebar are headings without a level.
    (r'(<p class="caption" role="heading")>', r'\1 aria-level="2">'),
    # What scrolls within its box must be reachable by keyboard.
    (r"<pre>", '<pre tabindex="0">'),
    (r'(<div class="(?:table-wrapper[^"]*|math)")>', r'\1 tabindex="0">'),
    # Parameters of a long signature are a definition list without terms.
    (r"<dl>\n((?:<dd>.*</dd>\n)+)</dl>", lambda m: f'<dl role="list">\n{m[1].replace("<dd>", LISTED)}</dl>'),
    # The text of a thumbnail's link is hidden; its title stands below it.
    (r'<a class="reference internal" (href="\w+\.html")>(<span class="doc">([^<]*)</span></a></p>\n +<div class="sphx)',
     r'<a class="reference internal" \1 aria-label="\3">\2'),
)  # fmt: skip
LISTED = '<dd role="listitem">'


def correct_pages(app: Sphinx, exception: Exception | None) -> None:
    """Correct every page of the site."""
    if exception is None and app.builder.format == "html":
        for page in Path(app.outdir).rglob("*.html"):
            text = page.read_text(encoding="utf-8")
            for pattern, corrected in CORRECTIONS:
                text = re.sub(pattern, corrected, text)
            page.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Correct the pages once all are written."""
    app.connect("build-finished", correct_pages)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}

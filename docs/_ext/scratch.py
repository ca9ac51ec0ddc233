"""What the site needs and the repository does not hold: a copy of the examples to run, their pages, the figures."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sphinx.util import logging

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.config import Config

logger = logging.getLogger(__name__)

ORDER = (
    "plan_a_gait",
    "the_four_gaits",
    "check_your_own_gait",
    "judge_a_table",
    "robustness_of_a_gait",
    "draw_a_gait",
    "colour_a_loop",
    "enter_from_hover",
    "graph_tour",
    "list_cycles",
    "your_vehicle",
)
SHOWN = re.compile(r"\b_figures/(\w+)\.png")
NOTE = re.compile(r"\.\. only:: html\n\n    \.\. note::\n.*?(?=^\S)", re.M | re.S)
ZIP = re.compile(
    r" +\.\. container:: sphx-glr-download sphx-glr-download-zip\n\n.*?$", re.M
)


class GalleryOrder:
    """Sorts examples in the order of reading; those that are not listed come last, by name."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __call__(self, name: str) -> tuple[int, str]:
        """Return what an example is sorted by."""
        stem = Path(name).stem
        return ORDER.index(stem) if stem in ORDER else len(ORDER), name


def use_style(conf: dict[str, Any], name: str) -> None:
    """Draw the pictures of the examples as the figures are drawn."""
    import matplotlib as mpl
    import matplotlib.style

    from gaitgraph.plots.axes import STYLE

    mpl.style.use(STYLE)
    mpl.rcParams["savefig.dpi"] = 180


def keep_to_the_example(app: Sphinx, docname: str, source: list[str]) -> None:
    """Remove boilerplate from an example's page, and archives, since they hold the time they were made."""
    if docname.startswith("gallery/"):
        source[0] = ZIP.sub("", NOTE.sub("", source[0]))


def copy_examples(app: Sphinx, config: Config) -> None:
    """Copy the examples beside the pages: what they write when they run stays there."""
    source, target = app.srcdir.parent / "examples", app.srcdir / "_examples"
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))


def draw_figures(app: Sphinx) -> None:
    """Draw the figures that pages show, unless they are there and newer than the code that draws them."""
    import gaitgraph
    from gaitgraph.plots.figures import FIGURES, write_figures

    folder = app.srcdir / "_figures"
    pages = "".join(
        page.read_text(encoding="utf-8") for page in sorted(app.srcdir.rglob("*.md"))
    )
    shown = set(SHOWN.findall(pages))
    code = max(
        file.stat().st_mtime for file in Path(gaitgraph.__file__).parent.rglob("*.py")
    )
    files = {
        figure.name: folder / f"{figure.stem}.png"
        for figure in FIGURES.values()
        if figure.stem in shown
    }
    due = [
        name
        for name, file in files.items()
        if not file.exists() or file.stat().st_mtime < code
    ]
    if due:
        folder.mkdir(exist_ok=True)
        write_figures(folder, only=due, formats=("png",), force=True)
    logger.info("figures: %d shown, %d drawn", len(files), len(due))


def setup(app: Sphinx) -> dict[str, Any]:
    """Copy and draw before anything else."""
    app.connect("config-inited", copy_examples, priority=1)
    app.connect("builder-inited", draw_figures, priority=1)
    app.connect("source-read", keep_to_the_example)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}

"""The documentation builds as a site, with warnings as errors, and loads nothing from elsewhere."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType

import pytest

import gaitgraph
from gaitgraph.plots import figures

pytest.importorskip("sphinx", reason="install the extra 'docs'")

ROOT = Path(__file__).parent.parent
GENERATED = (
    "_build",
    "api",
    "_examples",
    "gallery",
)  # figures too, but those that are newer than the code are kept
DRAWN = "15"
NOWHERE = "http://127.0.0.1:9"  # nothing listens there
RUN = (
    "plan_a_gait",
    "draw_a_gait",
)  # examples that this site runs: one prints, one draws; all of them are tested

# What makes a browser load something, by element; links that a reader clicks are not among them.
LOADED = {
    **dict.fromkeys(("script", "iframe", "embed", "audio", "track", "input"), ("src",)),
    **dict.fromkeys(("img", "source"), ("src", "srcset")),
    **dict.fromkeys(("image", "use"), ("href", "xlink:href")),
    **dict.fromkeys(("link", "base"), ("href",)),
    "form": ("action",),
    "object": ("data",),
    "video": ("src", "poster"),
}

# How wide a page is, and the code on it that is wider than its box.
MEASURED = """
const code = [...document.querySelectorAll("pre")].filter((box) => box.scrollWidth > box.clientWidth + 1);
return [document.documentElement.scrollWidth, code.map((box) => box.textContent)];
"""


class Page(HTMLParser):
    """What a page loads, and what stands on it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.ids: set[str] = set()
        self.counts: dict[str, int] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.counts[tag] = self.counts.get(tag, 0) + 1
        for name, value in attrs:
            if tag == "a" and name == "href":
                self.links.append(value or "")
            if name == "id":
                self.ids.add(value or "")
            if name in LOADED.get(tag, ()) or (
                name == "style" and "url(" in (value or "")
            ):
                self.loads.append(value or "")


pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; the tree that is built is a copy, so that nothing is written beside the sources."""
    tree = tmp_path_factory.mktemp("site")
    for folder in ("docs", "examples"):
        shutil.copytree(
            ROOT / folder,
            tree / folder,
            ignore=shutil.ignore_patterns(*GENERATED, "__pycache__"),
        )
    shutil.copyfile(ROOT / "CHANGELOG.md", tree / "CHANGELOG.md")
    # All figures but one are there already, as copies of a picture; how they are drawn has tests of its own.
    there = tree / "docs" / "_figures"
    shutil.rmtree(there, ignore_errors=True)
    there.mkdir()
    for figure in figures.FIGURES.values():
        if figure.name != DRAWN:
            shutil.copyfile(
                ROOT / "docs" / "images" / "roll_pitch.png",
                there / f"{figure.stem}.png",
            )
    names = ("http_proxy", "https_proxy", "all_proxy")
    proxies = dict.fromkeys((*names, *map(str.upper, names)), NOWHERE)
    # Coverage would trace every example of the gallery again.
    own = {
        name: value for name, value in os.environ.items() if not name.startswith("COV")
    }
    run = ("-D", f"sphinx_gallery_conf.filename_pattern={'|'.join(RUN)}")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", "-q", *run, "docs", "html"],
        cwd=tree, env={**own, **proxies, "PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return tree / "html"


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[str, Page]:
    return {
        str(path.relative_to(site)): Page(path.read_text())
        for path in sorted(site.glob("**/*.html"))
    }


def test_every_page_is_there(pages: dict[str, Page]) -> None:
    listed = re.findall(
        r"^((?:guide/)?\w+)$", (ROOT / "docs" / "index.md").read_text(), re.M
    )
    written = {f"{name}.html" for name in ("index", *listed)}
    assert len(written) == 23
    shown = {f"gallery/{path.stem}.html" for path in (ROOT / "examples").glob("*.py")}
    assert written | shown | {
        "gallery/index.html",
        "search.html",
        "genindex.html",
    } <= set(pages)


def test_nothing_is_loaded_from_elsewhere(site: Path, pages: dict[str, Page]) -> None:
    elsewhere = re.compile(r"^\s*(\w+:)?//")
    loaded = {(name, target) for name, page in pages.items() for target in page.loads}
    assert not {pair for pair in loaded if elsewhere.match(pair[1])}
    for name, target in loaded:
        path = target.partition("#")[0].partition("?")[0]
        assert (
            not path
            or path.startswith("data:")
            or ((site / name).parent / path).exists()
        ), (name, target)
    for sheet in site.glob("**/*.css"):
        targets = re.findall(
            r"url\(\s*['\"]?([^'\")]+)|@import\s+['\"]([^'\"]+)", sheet.read_text()
        )
        assert not [pair for pair in targets if elsewhere.match("".join(pair))], (
            sheet.name
        )
    for script in site.glob("**/*.js"):
        text = script.read_text()
        assert not re.findall(
            r"(?:fetch|importScripts|import)\(\s*['\"`](?:\w+:)?//", text
        ), script.name


def test_formulas_are_mathml(site: Path, pages: dict[str, Page]) -> None:
    theory = (ROOT / "docs" / "theory.md").read_text()
    prose = re.sub(r"^```.*?^```", "", theory, flags=re.M | re.S)
    prose, blocks = re.subn(r"\$\$.*?\$\$", "", prose, flags=re.S)
    inline = len(re.findall(r"(?<!\\)\$[^$]+\$", prose))
    assert pages["theory.html"].counts["math"] == blocks + inline > 400
    for path in site.glob("*.html"):
        text = path.read_text()
        article = text.partition('<article role="main"')[2].partition("</article>")[0]
        outside = re.sub(r"<(pre|code)\b.*?</\1>", "", article, flags=re.S)
        assert not re.search(r"[$\\]", outside), path.name
        assert not re.search("[\ue000-\uf8ff]", text), path.name


def test_the_api_is_whole(pages: dict[str, Page]) -> None:
    names = {
        f"gaitgraph.{name}"
        for name in dir(gaitgraph)
        if not isinstance(getattr(gaitgraph, name), ModuleType)
    }
    names |= {f"gaitgraph.plots.{name}" for name in dir(gaitgraph.plots)}
    for name in names:
        assert name in pages[f"api/{name}.html"].ids
    linked = {link.partition("#")[0] for link in pages["api.html"].links}
    assert {f"api/{name}.html" for name in names} <= linked


def test_the_same_sources_give_the_same_site(site: Path) -> None:
    for path in site.glob("**/*.html"):
        text = path.read_text()
        for private in (
            str(ROOT),
            str(site.parent),
            "Last updated",
            "running time",
            "memory usage",
        ):
            assert private not in text, path.name


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1440])
def test_pages_can_be_read_by_everybody(
    site: Path, tmp_path: Path, width: int, theme: str
) -> None:
    browser = pytest.importorskip("tests.chromium")
    with browser.chromium(tmp_path) as driver:
        browser.show(driver, width, 1000, theme)
        for name in (
            "index",
            "tutorial",
            "command_line",
            "api",
            "api/gaitgraph.plan_loop",
            "limitations",
            "gallery/index",
            "gallery/plan_a_gait",
        ):
            driver.get((site / f"{name}.html").as_uri())
            shown, code = driver.execute_script(MEASURED)
            assert shown <= width, name
            assert width < 1440 or not code, name
            assert browser.serious_findings(driver) == [], name

"""The notebooks run in a real kernel, show what they say they show, and are stored clean."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

pytestmark = pytest.mark.slow

if TYPE_CHECKING:
    from collections.abc import Iterator

FOLDER = Path(__file__).parent.parent / "examples" / "notebooks"
# Cells that show an object, each with what its page must say; and cells that print, with a part of what they print.
PAGES = {
    "reproduce_the_paper": {
        "loops": "Gait, red: 4 corners",
        "verdicts": "the whole blue sheet is singular",
        "plan": "Planned a red gait, R &lt; 0",
        "time": "TimedGait, red: T = 1 s, smooth",
    },
    "plan_for_your_vehicle": {
        "vehicle": "Vehicle mine: κ = 0.08",
        "region": "hover thrusts ≤ 0.765 of m·g",
        "plan": "with the given polygons",
        "robust": "Flyable: yes",
        "pace": "LimitedGait, red: T = 0.74",
        "write": "tilt acceleration",
    },
    "export_to_ros2": {
        "plan": "T = 1.5 s, smooth, 75 samples",
        "again": "Flyable: yes. Obeys",
    },
}
PRINTS = {
    "reproduce_the_paper": {
        "vertices": "Gait 2: blue, off by 5e-04",
        "biased": "biased by 0.8         74.46°",
    },
    "plan_for_your_vehicle": {
        "robust": "shortest and robust: 0.541 0.669",
        "pace": "5 corners rounded",
    },
    "export_to_ros2": {
        "read": "gait4.mcap: a trajectory of 301 points",
        "compare": "301 points over 6 s",
    },
}
IPYTHON = (
    "IPYTHONDIR",
    "JUPYTER_RUNTIME_DIR",
    "JUPYTER_CONFIG_DIR",
    "JUPYTER_DATA_DIR",
)


@pytest.fixture(scope="module")
def nbformat() -> Any:
    return pytest.importorskip("nbformat", reason="install the extra 'dev'")


@pytest.fixture(scope="module")
def kernel() -> Iterator[Any]:
    """A kernel for all notebooks; its sockets are files, in a folder of a short name as sockets want it."""
    pytest.importorskip("ipykernel", reason="install the extra 'dev'")
    from jupyter_client.manager import KernelManager

    folder = tempfile.mkdtemp(prefix="k")
    with pytest.MonkeyPatch.context() as patch:
        for name in IPYTHON:
            patch.setenv(name, folder)
        for name in list(os.environ):
            if name.startswith("COV"):
                patch.delenv(name)  # traced, the same calls take three times as long
        connection = f"{folder}/c.json"
        manager = KernelManager(
            transport="ipc", ip=f"{folder}/s", connection_file=connection
        )
        manager.start_kernel(cwd=folder)
        yield manager
        manager.shutdown_kernel(now=True)
    shutil.rmtree(folder)


@pytest.mark.parametrize("name", PAGES)
def test_notebooks_run_and_show_what_they_state(
    name: str, kernel: Any, nbformat: Any
) -> None:
    nbclient = pytest.importorskip("nbclient", reason="install the extra 'dev'")
    if name == "export_to_ros2":
        pytest.importorskip("rosbags", reason="install the extra 'ros'")
    notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    notebook.cells.append(nbformat.v4.new_code_cell("%reset -f", id="clean"))
    client = nbclient.NotebookClient(notebook, km=kernel, timeout=None)
    client.execute()
    client.kc.stop_channels()
    printed: dict[str, str] = {}
    pages: dict[str, str] = {}
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            if output.get("name") == "stdout":
                printed[cell.id] = printed.get(cell.id, "") + output.text
            if "text/html" in output.get("data", {}):
                pages[cell.id] = output.data["text/html"]
    for cell, text in PRINTS[name].items():
        assert text in printed[cell], cell
    for cell, text in PAGES[name].items():
        assert text in pages[cell], cell
    assert pages.keys() == PAGES[name].keys()


def test_notebooks_are_stored_clean(nbformat: Any) -> None:
    paths = list(FOLDER.glob("*.ipynb"))
    assert {path.stem for path in paths} == PAGES.keys()
    for path in paths:
        text = path.read_text()
        content = json.loads(text)
        nbformat.validate(content)
        assert text == json.dumps(content, indent=1, ensure_ascii=False) + "\n"
        for cell in content["cells"]:
            assert not cell.get("outputs")
            assert not cell.get("execution_count")
        assert "assert" in text

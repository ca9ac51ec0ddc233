"""The notebooks run in a real kernel, show what they say they show, and are stored clean."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

nbformat = pytest.importorskip("nbformat", reason="install the extra 'dev'")
nbclient = pytest.importorskip("nbclient", reason="install the extra 'dev'")
pytest.importorskip("ipykernel", reason="install the extra 'dev'")

pytestmark = pytest.mark.slow

if TYPE_CHECKING:
    from collections.abc import Iterator

FOLDER = Path(__file__).parent.parent / "examples" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
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


@pytest.fixture(scope="module")
def kernel() -> Iterator[Any]:
    """A kernel for all notebooks; its sockets are files, in a folder of a short name as sockets want it."""
    from jupyter_client.manager import KernelManager

    folder = tempfile.mkdtemp(prefix="k")
    with pytest.MonkeyPatch.context() as patch:
        for name in (
            "IPYTHONDIR",
            "JUPYTER_RUNTIME_DIR",
            "JUPYTER_CONFIG_DIR",
            "JUPYTER_DATA_DIR",
        ):
            patch.setenv(name, folder)
        for name in [name for name in os.environ if name.startswith("COV")]:
            patch.delenv(name)  # traced, the same calls take three times as long
        manager = KernelManager(
            transport="ipc", ip=f"{folder}/s", connection_file=f"{folder}/c.json"
        )
        manager.start_kernel(cwd=folder)
        yield manager
        manager.shutdown_kernel(now=True)
    shutil.rmtree(folder)


def outputs(notebook: Any) -> dict[str, tuple[str, str]]:
    """What each code cell printed, and the HTML and the text that it showed."""
    found = {}
    for cell in notebook.cells:
        if cell.cell_type == "code":
            printed = "".join(
                one.text
                for one in cell.outputs
                if one.output_type == "stream" and one.name == "stdout"
            )
            shown = [
                one.data
                for one in cell.outputs
                if one.output_type in ("execute_result", "display_data")
            ]
            found[cell.id] = (
                printed,
                "".join(data.get("text/html", "") for data in shown),
            )
    return found


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run_and_show_what_they_state(path: Path, kernel: Any) -> None:
    if path.stem == "export_to_ros2":
        pytest.importorskip("rosbags", reason="install the extra 'ros'")
    notebook = nbformat.read(path, as_version=4)
    notebook.cells.append(nbformat.v4.new_code_cell("%reset -f", id="clean"))
    client = nbclient.NotebookClient(notebook, km=kernel, timeout=None)
    client.execute()
    client.kc.stop_channels()
    found = outputs(notebook)
    for cell, text in PRINTS[path.stem].items():
        assert text in found[cell][0], cell
    for cell, text in PAGES[path.stem].items():
        assert text in found[cell][1], cell
        assert "<table" in found[cell][1] or "<pre" in found[cell][1], cell
    assert {cell for cell, (_, page) in found.items() if page} == set(PAGES[path.stem])


def test_notebooks_are_stored_clean() -> None:
    assert [path.stem for path in NOTEBOOKS] == [
        "export_to_ros2",
        "plan_for_your_vehicle",
        "reproduce_the_paper",
    ]
    for path in NOTEBOOKS:
        text = path.read_text()
        content = json.loads(text)
        nbformat.validate(content)
        assert text == json.dumps(content, indent=1, ensure_ascii=False) + "\n"
        for cell in content["cells"]:
            assert cell["cell_type"] == "markdown" or (
                cell["execution_count"],
                cell["outputs"],
            ) == (None, [])
        assert any(
            "assert" in line for cell in content["cells"] for line in cell["source"]
        )

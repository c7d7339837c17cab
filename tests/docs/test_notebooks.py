"""The pages of the tutorial, done in a notebook: each block is a cell, and prints there what is shown below it."""

from pathlib import Path

import pytest
from pages import ROOT, name_of, programs

pytest.importorskip("ipykernel")
nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")

PAGES = sorted((ROOT / "docs/tutorial").glob("*.md"))


def executed(cells: list[str], folder: Path) -> list[dict]:
    """Execute the cells in a kernel of their own and return them with their outputs."""
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in cells])
    client = nbclient.NotebookClient(
        book, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    )
    client.execute()
    return list(book.cells)


def written(cell: dict, stream: str) -> str:
    return "".join(output.text for output in cell.outputs if output.output_type == "stream" and output.name == stream)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_each_page_of_the_tutorial_can_be_done_in_a_notebook(page: Path, tmp_path: Path) -> None:
    blocks = list(programs(page))
    for cell, (block, shown) in zip(executed([block.text for block, _ in blocks], tmp_path), blocks, strict=True):
        assert written(cell, "stdout").rstrip() == (shown.text if shown else ""), f"{name_of(page)}:{block.line}"
        assert written(cell, "stderr") == ""

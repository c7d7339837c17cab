"""Pages done in a notebook: each block is a cell, and prints there what is shown below it."""

from pathlib import Path

import nbclient
import nbformat
import pytest
from pages import CANNOT_STOP, ROOT, complaints, name_of, programs

from shared import PATIENCE

PAGES = sorted((ROOT / "docs/tutorial").glob("*.md"))
GUIDE = ROOT / "docs/guides/notebooks.md"
BOOK = ROOT / "docs/notebooks/evolve.ipynb"


def executed(cells: list[str], folder: Path) -> list[dict]:
    """Execute the cells in a kernel of their own and return them with their outputs."""
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in cells])
    client = nbclient.NotebookClient(
        book, timeout=2 * PATIENCE, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    )
    client.execute()
    return list(book.cells)


def written(cell: dict, stream: str) -> str:
    return "".join(output.text for output in cell.outputs if output.output_type == "stream" and output.name == stream)


def shown_as(cell: dict) -> set[str]:
    return {kind for output in cell.outputs if output.output_type == "execute_result" for kind in output.data}


@pytest.mark.long
def test_the_pages_of_the_tutorial_can_be_done_in_notebooks(tmp_path: Path) -> None:
    blocks = [(page, block, shown) for page in PAGES for block, shown in programs(page)]
    sources = [block.text for _, block, _ in blocks]
    firsts = [k for k, (page, *_) in enumerate(blocks) if page != blocks[k - 1][0]]
    for k in reversed(firsts):
        sources.insert(k, "%reset -f")  # each page begins without names, as a notebook of its own does
    cells = [cell for cell in executed(sources, tmp_path) if cell.source != "%reset -f"]
    for cell, (page, block, shown) in zip(cells, blocks, strict=True):
        where = f"{name_of(page)}:{block.line}"
        assert written(cell, "stdout").rstrip() == (shown.text if shown else ""), where
        assert complaints(written(cell, "stderr"), may_be_left_moving=name_of(page) in CANNOT_STOP) == [], where


@pytest.mark.long
def test_the_guide_to_notebooks_holds_in_one(tmp_path: Path) -> None:
    blocks = list(programs(GUIDE, "python", "ipython"))
    kernels_own = "print(elib.robot_url(), elib.robot_urls('sim://1', 'sim://2'))"  # the kernel has a command line
    *cells, last = executed([*(block.text for block, _ in blocks), kernels_own], tmp_path)
    for cell, (block, shown) in zip(cells, blocks, strict=True):
        if shown is not None:
            assert written(cell, "stdout").rstrip() == shown.text, f"{name_of(GUIDE)}:{block.line}"
        assert written(cell, "stderr") == ""
    assert [written(cell, "stdout") for cell in cells[:2]] == ["", "True 0\n"]
    pictures = [kinds for cell in cells if (kinds := shown_as(cell) - {"text/plain"})]
    assert pictures == [{"text/html"}, {"image/png"}, {"image/svg+xml"}, {"text/html"}]
    assert written(last, "stdout") == "sim:// ['sim://1', 'sim://2']\n"


@pytest.mark.long
def test_the_notebook_lets_the_fitness_grow_and_the_champion_drive(tmp_path: Path) -> None:
    book = nbformat.read(BOOK, as_version=4)
    nbformat.validate(book)
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert [cell for cell in code if cell.outputs or cell.execution_count] == [], "clear its outputs before you save it"
    check = "assert mean[-1] > 2 * mean[0] and tested.max() > max(tested[:5]), (mean, tested)"
    *cells, _ = executed([*(cell.source for cell in code), check], tmp_path)
    assert [
        line for cell in cells for line in written(cell, "stderr").splitlines() if line[:15] != "elib: compiling"
    ] == []
    assert [kinds for cell in cells if (kinds := shown_as(cell) - {"text/plain"})] == [{"image/svg+xml"}, {"image/png"}]
    assert (tmp_path / "best.toml").exists()

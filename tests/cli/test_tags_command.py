"""``elib tags``: a sheet of tags to print."""

import re
from pathlib import Path

from elib_process import Told

from elib.base.tags import cells


def test_a_sheet_has_each_tag_at_its_true_size(printed: Told, tmp_path: Path) -> None:
    file = tmp_path / "sheet.svg"
    assert "2 tags" in printed("tags", 0, 7, "--size", 48, "-o", file)
    sheet = file.read_text("utf-8")
    assert 'width="210mm" height="297mm" viewBox="0 0 210 297"' in sheet
    assert len(re.findall(r'width="48\.0" height="48\.0"/>', sheet)) == 2
    white = sum(each for number in (0, 7) for row in cells("16h5", number) for each in row)
    assert len(re.findall(r"h8\.000v8\.000h-8\.000z", sheet)) == white


def test_what_does_not_fit_on_a_sheet_or_is_no_tag_is_refused(refused: Told) -> None:
    assert "room for 6 tags of 60 mm, not for 7" in refused("tags", *range(7))
    assert "there is no tag 30 of 16h5; its numbers are 0 to 29" in refused("tags", 30)
    assert "36h11" in refused("tags", 1, "--family", "25h9")

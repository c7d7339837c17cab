"""What a submission tries is named wherever elib is installed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import sys
from elib.lab import attempts

attempts.watch(sys.argv[1], [sys.argv[2]], [], 2, -1)
exec(compile(open(sys.argv[3]).read(), sys.argv[3], "exec"))
"""


@pytest.mark.parametrize("mode", ["w", "a", "r+"])
def test_a_change_of_elib_is_named_where_elib_is_in_the_folder_for_temporary_files_too(
    tmp_path: Path, mode: str
) -> None:
    installed, home = tmp_path / "installed", tmp_path / "home"
    for folder in (installed, home):
        folder.mkdir()
    (installed / "module.py").touch()
    submission = home / "mine.py"
    submission.write_text(f"print(open({str(installed / 'module.py')!r}).read())\nopen('own', 'w')\n")
    command = [sys.executable, "-c", PROGRAM, str(home), str(installed), str(submission)]
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    honest = subprocess.run(command, env=environment, cwd=home, capture_output=True, text=True, timeout=60)
    assert (honest.returncode, honest.stderr) == (0, "")

    submission.write_text(f"open({str(installed / 'module.py')!r}, {mode!r})\n")
    found = subprocess.run(command, env=environment, cwd=home, capture_output=True, text=True, timeout=60)
    assert found.returncode == 1
    told = [line for line in found.stderr.splitlines() if line.startswith('"')]
    assert [json.loads(line) for line in told] == [f"to reach {installed / 'module.py'}, which is outside its folder"]

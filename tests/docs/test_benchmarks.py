"""The benchmarks, which share helpers with the tests."""

import pytest
from pages import ROOT

from shared import run_python


@pytest.mark.long
def test_each_benchmark_finds_what_it_imports() -> None:
    done = run_python(
        f"""
        import runpy, sys
        from pathlib import Path
        sys.path.insert(0, {str(ROOT / "benchmarks")!r})
        for path in sorted(Path(sys.path[0]).glob("*.py")):
            print(path.name, flush=True)
            runpy.run_path(str(path), run_name="benchmark")
        """
    )
    assert done.returncode == 0, (done.stdout, done.stderr)

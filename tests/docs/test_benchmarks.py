"""The benchmarks, which share helpers with the tests and have one harness."""

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


def test_a_benchmark_takes_its_options_and_shows_a_table_and_json() -> None:
    done = run_python(
        f"""
        import sys
        sys.path.insert(0, {str(ROOT / "benchmarks")!r})
        from harness import in_turns, quick, run

        @quick(rounds=2, name="b")
        def measure(*, rounds: int = 1000, name: str = "a"):
            calls = []
            in_turns({{each: lambda each=each: calls.append(each) for each in (name, "c")}}, rounds)
            yield "turns", {{"order": {{"works": " ".join(calls)}}}}

        sys.argv[1:] = ["--quick", "--json", "--name", "d"]
        run("About.", measure)
        """
    )
    assert done.stdout.splitlines() == [
        "turns          works",
        "  order  d c d c c d",
        '{"turns": {"order": {"works": "d c d c c d"}}}',
    ], done.stderr

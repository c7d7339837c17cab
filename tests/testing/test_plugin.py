"""The pytest plugin in a project that somebody else wrote."""

import subprocess
import sys
from pathlib import Path

import pytest

CONFTEST = """
import sys
import pytest

def pytest_addoption(parser):
    parser.addoption("--robot", default="mine")

@pytest.fixture
def bench():
    return "mine"

def pytest_sessionfinish():
    print("loaded:", *sorted(name for name in sys.modules if name.startswith("elib.") or name == "numpy"))
"""
OWN = """
def test_own_names_are_the_projects_own(bench, request):
    assert (bench, request.config.getoption("--robot")) == ("mine", "mine")
"""
THEIRS = """
import elib

def test_a_robot_is_emulated(elib_emulated_robot):
    assert elib_emulated_robot("btcom-2.0", {"selector": 7}).send(b"C\\r") == b"c,7\\r\\n"

def test_a_robot_is_driven(elib_robot_url):
    with elib.connect(elib_robot_url) as robot:
        assert robot.selector().position == 3

def test_every_script(elib_link_faults):
    assert "fault=" in elib_link_faults
"""


@pytest.fixture
def project(tmp_path: Path):
    def run(test: str, *options: str) -> str:
        (tmp_path / "conftest.py").write_text(CONFTEST)
        (tmp_path / "test_own.py").write_text(test)
        command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-rA", *options]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_a_project_may_have_an_option_and_a_fixture_of_the_same_use_and_pays_for_no_emulator(project) -> None:
    said = project(OWN)
    assert "loaded: elib.base elib.base.lazy elib.testing elib.testing.plugin\n" in said


def test_the_fixtures_of_elib_are_there_by_their_own_names(project) -> None:
    said = project(THEIRS, "--elib-robot", "sim://?speed=max")
    assert "PASSED test_own.py::test_a_robot_is_emulated" in said
    assert "PASSED test_own.py::test_a_robot_is_driven" in said
    assert "PASSED test_own.py::test_every_script[flaky-bluetooth]" in said


def test_without_a_robot_a_test_that_needs_one_is_skipped_and_says_how_to_name_it(project) -> None:
    assert "needs a robot: pytest --elib-robot serial:///dev/rfcomm0" in project(THEIRS)

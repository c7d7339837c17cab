"""Who may import whom, on the page about the architecture: from the import contracts that hold it."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

PROJECT = Path(__file__).parents[2] / "pyproject.toml"


def contracts() -> list[dict[str, Any]]:
    """Return the contracts of import-linter."""
    tools = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["tool"]
    found: list[dict[str, Any]] = tools["importlinter"]["contracts"]
    return found


def layers() -> str:
    """Return the layers as a text block, the uppermost first."""
    (found,) = (contract["layers"] for contract in contracts() if contract["type"] == "layers")
    return "\n".join(["```text", *(layer.replace("elib.", "") for layer in found), "```"])


def rules() -> str:
    """Return the other contracts as a list."""
    return "\n".join(_rule(contract) for contract in contracts() if contract["type"] != "layers")


def _rule(contract: dict[str, Any]) -> str:
    if contract["type"] != "forbidden":
        return f"- {contract['name']}."
    sources, forbidden = (_listed(contract[key]) for key in ("source_modules", "forbidden_modules"))
    return f"- {contract['name']}: no import of {forbidden} in {sources}."


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)

"""The web application: drive, see and understand robots and their virtual world on one page."""

from __future__ import annotations

from elib.errors import Unsupported
from elib.extras import install


def check_web() -> None:
    """Check that what the page needs is installed.

    Raises:
        Unsupported: The extra ``web`` is not installed.
    """
    try:
        import aiohttp  # noqa: F401
        import msgspec  # noqa: F401
    except ImportError:
        raise Unsupported(
            "the page in the browser needs the packages aiohttp and msgspec, which are not installed",
            hint=install("web"),
        ) from None

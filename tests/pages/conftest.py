"""Pages are opened in a real browser."""

from browsers import browser

__all__ = ["browser"]

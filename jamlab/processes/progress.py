"""Progress of long work: one signature for every callback of the package."""

from collections.abc import Callable

Progress = Callable[[float, str], None]  # share of the work that is done, 0 to 1, nan where unknown; what is done now


def no_progress(share: float, text: str) -> None:
    """Tell nobody how far the work is."""

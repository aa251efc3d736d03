"""Colours, all from the colour-blind-safe palette of Okabe & Ito, and what they stand for."""

from collections.abc import Iterable
from typing import Any

BLUE, RED, GREEN, PINK, SKY, ORANGE = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00"
BLACK, GREY = "#222222", "#BBBBBB"
COLOURS = (GREEN, RED, BLUE, PINK, ORANGE, SKY, BLACK)

SMALL, LARGE, RATTLER = PINK, BLUE, GREY
SIDE_COLOURS = {3: RED, 4: SKY, 5: "#F0E442", 6: PINK}
OTHER = GREEN  # voids with another number of sides
PARTICLE, OUTLINE = "#E4E4E4", "#777777"  # of particles that are not what a picture is about


def side_names(sides: Iterable[int]) -> dict[str, str]:
    """Colour -> number of sides or "other", of the voids that occur, for a legend."""
    order = sorted(sides, key=lambda count: (count not in SIDE_COLOURS, count))
    return {SIDE_COLOURS.get(count, OTHER): str(count) if count in SIDE_COLOURS else "other" for count in order}


def ordered_colours(count: int) -> list[Any]:
    """Colours of an ordered series, such as pressures: from dark to light, none as light as paper."""
    import matplotlib

    return [matplotlib.colormaps["cividis"](0.9 * k / max(count - 1, 1)) for k in range(count)]

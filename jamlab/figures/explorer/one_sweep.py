"""What one page can hold: states of the same particles, in the same units, and not too much of them."""

from collections.abc import Sequence

from jamlab.errors import InputError
from jamlab.packing.packing import Packing

MOST_PARTICLES = 20_000  # more do not come out as single particles on a screen, and slow the page down
MOST_BYTES = 50_000_000  # a page that a browser still opens within seconds


def check_one_sweep(packings: Sequence[Packing]) -> None:
    """Refuse states that do not belong on one page.

    Raises:
        InputError: no packing, packings of different particles, or too many particles.
    """
    if not packings:
        raise InputError("no packings: a page needs at least one")
    first = packings[0]
    for k, packing in enumerate(packings):
        for name in ("model", "units", "n"):
            one, other = getattr(first, name), getattr(packing, name)
            if one != other:
                raise InputError(f"packing {k} has {name} = {other}, packing 0 has {one}: write a page for each")
        name = first.difference(packing) or ""
        if name in ("diameters", "offsets", "params['a0']"):  # the law may change along a sweep, the particles may not
            raise InputError(f"packing {k} differs from packing 0 in {name}: they are other particles, write two pages")
    if first.n > MOST_PARTICLES:
        raise InputError(
            f"{first.n} particles: a page shows {MOST_PARTICLES} at most; draw single states instead, "
            "jamlab.geometry_figure(packing)"
        )


def check_bytes(size: float, states: int, every: int) -> None:
    """Refuse a page that grows too large.

    Args:
        size: bytes of a state.
        states: their number.
        every: of how many frames one was taken.

    Raises:
        InputError: naming the size and an `every` that makes it fit.
    """
    if size * states <= MOST_BYTES:
        return
    total = f"{states} states of {size / 1e6:.2g} MB are {size * states / 1e6:.0f} MB"
    limit = f"{MOST_BYTES / 1e6:.0f} MB"
    fewer = int(-(-size * states * every // MOST_BYTES))
    remedy = f"take every {fewer}th frame, every={fewer} or --every {fewer}" if states > 1 else "draw it as a figure"
    raise InputError(f"{total}, and a page holds {limit} at most: {remedy}")

"""Numbers of a picture, how far they are known, and whether they can be trusted: checks that need no truth.

A picture is good if no check objects. Limits were set on pictures rendered from packings (see
`tests/micrographs/benchmark_degraded_pictures.py`), where errors stay within `LIMITS`. A picture of few droplets may be
measured well and say little of others: it is good if means over its droplets are known to the same limits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import expit, ndtr

from jamlab.arrays import Array, Mask
from jamlab.micrographs.illumination import Darkness
from jamlab.micrographs.picture_numbers import Mean
from jamlab.micrographs.ring_segmentation import Candidates
from jamlab.micrographs.segmentation import NECK, Segments, find_markers, meetings
from jamlab.micrographs.walls import THICKEST_FILM, Walls

# errors up to these are right: droplets, packing fraction, coordination, mean shape factor
LIMITS = {"count": 2.0, "rho": 0.02, "z": 0.4, "shape": 0.02}
FEWEST = 20  # whole droplets: contacts have a standard deviation of 0.8, so that z is known to 0.4 (95 %)
SMALLEST = 8.0  # pixels, radius
LEAST_RING = 4.0  # pixels, radius of the light in a ring: below, droplets are missed; set on the foams worked on
# half-widths of intervals of rings: the narrowest ones that hold 24 of the 25 counts of nine foams worked on and of 16
# rendered pictures; standard deviations of what chances say, twice if they were neither too sure nor related, and rings
RING_SIGMAS, RING_COUNT = 3.0, 0.25
RING_EDGE = 0.3  # pixels, by which the edge of the light in rings is uncertain
RING_LIGHT = 0.06  # of the picture: light of droplets at its edge, which hands draw and no wall closes
RING_LIMIT = 0.1  # of count and mean area of rings and labels
# of labels: z that it may be too large by for gaps that pass for contacts, over the gap in diameters, and the part of a
# line between labels that adds to the gap; contacts and A that a droplet has more or less which is two, or half of one.
# Set on label images of packings of the seeds 1 to 8 in `tests/micrographs/benchmark_label_masks.py`
LABEL_DOUBT = 0.03  # share of labels that may be none, several or part of one, up to which z and A are good
LABEL_Z, LABEL_LINE, LABEL_ODD_Z, LABEL_ODD_SHAPE = 22.0, 0.3, 3.0, 0.5
RELATIVE = {"count": 0.045, "area": 0.03, "voids": 0.1}  # largest errors of good rendered pictures, of the value
NOISE = 0.6  # standard deviation over contrast, in the dim part of the picture
LIGHT = 4.0  # brightest over dimmest light: in between, shadows and dim droplets look alike
OUTLINE = 0.0085  # noise over contrast times blur, of the radius: outlines are uncertain by about as much
BLUR = 0.11  # standard deviation, blur and denoising together, of the radius
OPENING = 1.15  # radius of the largest disc in the wide voids over that same blur: below, voids look too bright
ROUND = 0.72  # area of the largest disc inside over area; a hexagon 0.91, a pentagon of aspect 1.2 about 0.75
MEAN_ROUND = 0.8  # of all droplets; a square 0.785
ODD = 0.1  # share of droplets that may be less round than that
CLOSED = 0.25  # of the outline of a droplet must be beside something darker than itself
SPREAD = 0.75  # standard deviation over mean of radii: sizes without a peak
BETWEEN = 0.35  # share of pixels that are neither droplet nor ground, beyond what blur explains
COUNTED = 8  # pixels: radius of small droplets in the picture in which they are counted again
COUNT = 0.06  # share of droplets, and one, that may split or merge when markers are set otherwise
WIDEST = 1.1  # radius of a disc between rings, of that of droplets: larger ones are droplets with a gap in the wall
Z = 0.6  # change of z when contacts may be 0.7 or 1.4 times as far from a film as they may
BLIND = 0.015  # of a diameter: where gaps so wide pass for contacts, z may change by less
BLIND_Z = 0.25  # in that case
RHO = LIMITS["rho"]  # difference between rho by mean grey and by dark pixels: the accuracy that "good" promises
FILM = 0.12  # of the radius: between wider films it is a matter of words what is void
UNSURE = 2  # droplets of which blur hides whether the edge cuts them
LOOSE = 0.4  # share of droplets that may rattle
ANNOTATED = 0.1  # of the picture


@dataclass(frozen=True)
class Checks:
    """What the checks look at, beside the picture itself."""

    whole: Mask  # (n,) bool, droplets that the picture shows whole
    roundness: Array  # (n,) area of the largest disc inside over area; nan for rings below the limit of detection
    closed: Array  # (n,) share of the outline that is beside something darker
    radii: Array  # (n,) pixels
    rho: float  # packing fraction by mean grey
    rho_by_pixels: float  # the same by counting dark pixels
    z: tuple[float, float, float]  # coordination, with the gap as it is, and 0.7 and 1.4 times as wide
    blind: float  # gap beyond a film that passes for a contact, of a diameter
    loose: int  # whole droplets off an open edge that rattle
    held: int  # whole droplets off an open edge
    unsure: int  # droplets that end so near to the edge that blur hides whether it cuts them
    open_edge: float  # share of the edge of the picture that is ground, if droplets end inside it; else 0
    annotated: float  # share of the picture under annotations
    unstable: int  # droplets that split, merge, come or go when they are looked for otherwise
    widest: float  # radius of the largest disc between the droplets, of the typical one of droplets
    pieces: int  # rings in several pieces
    labelled: bool  # droplets are known by labels or walls, not by levels of grey
    rings: bool  # droplets were found by their walls


ALL = frozenset(("count", "area", "interior_fraction", "rho", "z", "shape_rim", "voids"))
WALLS = frozenset(("rho", "z", "shape_rim", "voids"))  # what rests on where walls are and where they touch
CONTACTS = frozenset(("z", "voids"))


class Doubt(NamedTuple):
    """Why some numbers of a picture may be wrong."""

    text: str
    numbers: frozenset[str] = ALL  # names of `Micrograph.numbers`


def find_doubts(darkness: Darkness, blur: float, segments: Segments, walls: Walls, checks: Checks) -> list[Doubt]:
    """Reasons why the numbers may be wrong, in words; none if all is well."""
    return [
        *([] if checks.labelled else _doubt_light(darkness, blur, segments, walls, checks)),
        *_doubt_scale(segments, walls, checks),
        *_doubt_droplets(checks),
        *_doubt_numbers(checks),
    ]


def doubt_few(count: int, means: Mapping[str, Mean]) -> list[Doubt]:
    """Reasons why means over the droplets of a picture may not be those of more droplets. `count`: of whole droplets;
    `means`: rho, z and shape_rim, as in `Micrograph.means`."""
    words = {"rho": "rho", "z": "z", "shape_rim": "A"}
    if count < FEWEST:
        return [Doubt(f"{count} whole droplets only, needs {FEWEST}: means over more may differ", frozenset(words))]
    found = []
    for name, word in words.items():
        mean, limit = means[name], LIMITS["shape" if name == "shape_rim" else name]
        if mean.half_width > limit:
            known = f"within {mean.half_width:.2g} over {mean.count} droplets (95 %)"
            found.append(Doubt(f"{word} is known to {known}, needs {limit:g}: show more", frozenset((name,))))
    return found


def rendered_errors(values: Mapping[str, float]) -> dict[str, float]:
    """Largest errors of good rendered pictures of bright or dark droplets, of numbers as large as those."""
    shares = {name: share * values[name] for name, share in RELATIVE.items()}
    return (
        shares
        | {"z": LIMITS["z"], "shape_rim": LIMITS["shape"]}
        | dict.fromkeys(("rho", "interior_fraction"), LIMITS["rho"])
    )


def ring_errors(candidates: Candidates, areas: Array, light: float, pixels: int) -> dict[str, float]:
    """Half-widths of the intervals of what is known of rings. `areas`: (n,) of the light inside droplets that count,
    pixels; `light`: share of the picture that it covers; `pixels`: of the picture."""
    chance, mean = expit(candidates.odds), float(areas.mean()) if len(areas) else float("nan")
    taken = np.arange(len(chance)) < candidates.taken
    wrong = chance - taken  # what the count lacks on average
    unsure = abs((wrong * candidates.areas).sum())
    unsure += RING_SIGMAS * np.sqrt((chance * (1 - chance) * candidates.areas**2).sum())
    above = np.sqrt(candidates.areas / np.pi) - LEAST_RING
    counts = chance * candidates.whole * ndtr(above / RING_EDGE)  # chance that it is one, whole and above the limit
    lacking = counts - (taken & candidates.whole & (above >= 0))
    spread, larger = counts * (1 - counts), candidates.areas - mean  # variance of each being one; what it adds
    rim = 2 * np.sqrt(np.pi * areas)  # pixels of area for a pixel by which the edge of the light is elsewhere
    count = abs(lacking.sum()) + RING_SIGMAS * np.sqrt(spread.sum())
    shift, scatter = abs((lacking * larger).sum()), np.sqrt((spread * larger**2).sum())
    area = shift + np.hypot(RING_SIGMAS * scatter, RING_EDGE * rim.sum())  # summed over rings; independent causes
    return {
        "count": float(count + RING_COUNT),
        "area": float(area / len(areas)) if len(areas) else float("nan"),
        "interior_fraction": float(
            RING_LIGHT + RING_EDGE * light * rim.sum() / max(areas.sum(), 1.0) + unsure / pixels
        ),
    }


def label_errors(
    values: Mapping[str, float], doubt: float, line: float, gap: float, lengths: tuple[float, float]
) -> dict[str, float]:
    """Half-widths of the intervals of what is known of labels. `values`: of the numbers; `doubt`: droplets by which the
    count may be off; `line`: width of lines between labels that touch, pixels; `gap`: beyond a line, up to which labels
    pass for touching, with the line, over the diameter; `lengths`: mean perimeter of the droplets, pixels, and
    perimeter of all labels beside ground over the pixels of the picture."""
    share = doubt / max(values["count"], 1.0)
    edge = RING_EDGE + 0.5 * line  # pixels by which an edge may be elsewhere: by itself, and for half a line
    covered = edge * lengths[1] or 1.0  # without ground nothing says where droplets end
    return {
        "count": 1.0 + doubt,  # one that the edge of the picture hardly cuts may be whole
        "area": share * values["area"] + edge * lengths[0],
        "rho": covered,
        "interior_fraction": covered,
        "z": max(LIMITS["z"], LABEL_Z * gap) + LABEL_ODD_Z * share,
        "shape_rim": LIMITS["shape"] + LABEL_ODD_SHAPE * share,
        "voids": max(1.0, RELATIVE["voids"] * values["voids"]) + doubt,
    }


def doubt_known(values: Mapping[str, float], errors: Mapping[str, float]) -> list[Doubt]:
    """Reasons why numbers of rings or labels are not known well enough. `errors`: half-widths of those numbers."""
    words = {
        "count": ("the count", max(RING_LIMIT * values["count"], LIMITS["count"])),
        "area": ("the mean area", RING_LIMIT * values["area"]),
        "interior_fraction": ("the share of light inside", LIMITS["rho"]),
        "rho": ("rho", LIMITS["rho"]),
        "z": ("z", LIMITS["z"] + LABEL_ODD_Z * LABEL_DOUBT),
        "shape_rim": ("A", LIMITS["shape"] + LABEL_ODD_SHAPE * LABEL_DOUBT),
    }
    return [
        Doubt(f"{words[name][0]} is known to within {error:.2g}, needs {words[name][1]:.2g}", frozenset((name,)))
        for name, error in errors.items()
        if name in words and not error <= words[name][1]  # nan, too
    ]


def _doubt_light(darkness: Darkness, blur: float, segments: Segments, walls: Walls, checks: Checks) -> Iterator[Doubt]:
    radius = segments.radius
    spread = np.hypot(blur, darkness.filter)
    dim = darkness.noise * np.sqrt(darkness.light)
    if dim > NOISE:
        yield Doubt(f"noise is {darkness.noise:.0%} of the contrast, up to {dim:.0%} where light is dim")
    if darkness.light > LIGHT:
        yield Doubt(f"light falls to {1 / darkness.light:.0%} of its brightest")
    if spread > BLUR * radius:
        yield Doubt(f"blur and noise smear outlines over {spread:.1f} pixels, {spread / radius:.0%} of the radius")
    elif darkness.noise * spread > OUTLINE * radius:
        yield Doubt(f"noise ({darkness.noise:.0%}) and blur ({spread:.1f} pixels) together leave outlines uncertain")
    if darkness.ground < 3:
        yield Doubt("hardly any open ground is seen between droplets, so its level is a guess")
    elif darkness.opening < OPENING * spread:
        yield Doubt("voids are as narrow as the blur, so the level of the ground is a guess")
    grey = ((darkness.smooth > 0.25) & (darkness.smooth < 0.75)).mean()
    edge = (
        (len(meetings(segments.droplets)[0]) * np.pi / 4 + walls.length[walls.touching].sum())
        * 1.4
        * np.hypot(spread, 0.7)
    )
    if grey - edge / segments.cells.size > BETWEEN * max(1 - checks.rho, 0.05):
        yield Doubt(f"{grey:.0%} of the picture is neither droplet nor ground")


def _doubt_scale(segments: Segments, walls: Walls, checks: Checks) -> Iterator[Doubt]:
    radius, share = segments.radius, walls.film / segments.radius
    if radius < SMALLEST:
        text = f"droplets are {radius:.0f} pixels in radius, needs {SMALLEST:.0f}: take it closer"
        yield Doubt(text, WALLS if checks.labelled else ALL)
    if share > FILM and not checks.labelled:
        yield Doubt(f"films are {walls.film:.1f} pixels wide, {share:.0%} of the radius: rho counts them to droplets")
    if share > THICKEST_FILM and checks.labelled:
        text = f"droplets lie {walls.film:.0f} pixels apart, {share:.0%} of the radius: that they touch is a guess"
        yield Doubt(text, CONTACTS)
    if checks.annotated > ANNOTATED:
        yield Doubt(f"{checks.annotated:.0%} of the picture lie under bars and labels")


def _doubt_droplets(checks: Checks) -> Iterator[Doubt]:
    if checks.rings:  # z of rendered pictures to which no other rule objected was off by up to 1
        yield Doubt("of rings no rule tells right rho, z, A and voids from wrong ones: look at the overlay", WALLS)
    whole = checks.whole
    shape = checks.roundness[whole & np.isfinite(checks.roundness)]
    odd = shape < ROUND
    if len(shape) and (odd.mean() > ODD or shape.mean() < MEAN_ROUND):
        found = f"{odd.sum()} of {len(shape)} droplets are less round than {ROUND:g}, where {ODD:.0%} may be"
        if odd.mean() <= ODD:
            found = f"the mean roundness of {len(shape)} droplets is {shape.mean():.2f}, needs {MEAN_ROUND:g}"
        yield Doubt(f"{found}: several in one, or none")
    if checks.labelled and checks.rho == 1:
        yield Doubt("every pixel is labelled: labels are cells, or droplets without voids")
    if checks.pieces:  # of a ring, up to the darkest line of its wall: the light inside is one
        yield Doubt(f"{checks.pieces} labels lie in several pieces each", WALLS if checks.rings else ALL)
    loose = (checks.closed < CLOSED)[whole]
    if loose.sum() > max(1, 0.03 * whole.sum()):
        text = (
            f"{loose.sum()} of {whole.sum()} droplets have something darker beside less than {CLOSED:.0%} of their edge"
        )
        yield Doubt(text)
    radii = checks.radii[whole]
    if len(radii) > 2 and radii.std() > SPREAD * radii.mean():
        text = f"the spread of radii is {radii.std() / radii.mean():.0%} of their mean, more than {SPREAD:.0%}"
        yield Doubt(text, WALLS if checks.labelled else ALL)  # rings and labels may be of any size


def _doubt_numbers(checks: Checks) -> Iterator[Doubt]:
    count = int(checks.whole.sum())
    if checks.unstable > COUNT * count + 1:
        yield Doubt(f"{checks.unstable} of {count} droplets split or merge if thresholds and scale are set otherwise")
    low, high = min(checks.z), max(checks.z)
    if checks.loose > LOOSE * checks.held:
        text = (
            f"{checks.loose} of {checks.held} droplets have fewer than three contacts once such droplets are removed "
            "in turn: they are not jammed, films are wide, or walls, which are not looked for, hold them"
        )
        yield Doubt(text, CONTACTS if checks.labelled else WALLS)  # a wall that is seen as void is missing in rho
    elif np.isfinite(checks.z).all() and high - low > (BLIND_Z if checks.blind > BLIND else Z):
        yield Doubt(f"z changes from {low:.2f} to {high:.2f} with the widest gap that counts as a contact", CONTACTS)
    if checks.widest > WIDEST:
        yield Doubt(f"between droplets a disc of {checks.widest:.1f} of their radius has room: its wall may have a gap")
    if checks.unsure > UNSURE:
        yield Doubt(f"blur hides of {checks.unsure} droplets whether the edge cuts them, so the count may be off")
    if checks.open_edge:
        share = f"{checks.open_edge:.0%} of the edge of the picture is ground"
        yield Doubt(f"{share}: a wall that holds droplets beside it is not seen", WALLS)
    if abs(checks.rho - checks.rho_by_pixels) > RHO:
        yield Doubt(f"rho is {checks.rho:.3f} by mean grey and {checks.rho_by_pixels:.3f} by dark pixels")


def unstable_droplets(smooth: Array, segments: Segments, whole: Mask) -> int:
    """Most whole droplets that hold another number of markers than one, over other thresholds and other necks."""
    most, every = 0, max(1, int(segments.smallest / COUNTED))
    few, cells = smooth[::every, ::every], segments.cells[::every, ::every]
    for level, neck in ((0.35, NECK), (0.65, NECK), (0.5, 0.8), (0.5, 0.94)):
        markers, _ = find_markers(few < level, segments.radius / every, segments.smallest / every, neck)
        places = np.nonzero(markers)
        pairs = np.unique(markers[places] * segments.count + cells[places])
        held = np.bincount(pairs % segments.count, minlength=segments.count)
        most = max(most, int((held[whole] != 1).sum()))
    return most

"""Rules of doubt: checks that need no truth say which numbers of a picture may be wrong, and why.

A picture is good if no check objects. Limits were set on pictures rendered from packings (see
`tests/micrographs/benchmark_degraded_pictures.py`), where errors stay within `LIMITS`. A picture of few droplets may be
measured well and say little of others: it is good if means over its droplets are known to the same limits. Numbers of
labels are good if their intervals hold the truth, however wide, short of saying nothing: see `label_doubts`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, Mask
from jamlab.micrographs.label_doubts import (
    ODD,
    bounds_of_labels,
    doubt_labels,
    in_doubt,
    lie_apart,
    widths_of_labels,
)
from jamlab.micrographs.label_doubts import rules_of_labels as _rules_of_labels
from jamlab.micrographs.picture_numbers import LIMITS, Number
from jamlab.micrographs.segmentation import meetings
from jamlab.micrographs.walls import SeenDroplets


@dataclass(frozen=True)
class Doubt:
    """From where on a picture is in doubt."""

    fewest_labels: int = 5  # whole labels: of fewer their scatter is unknown
    fewest: int = 20  # whole droplets: contacts have a standard deviation of 0.8, so that z is known to 0.4 (95 %)
    smallest: float = 8.0  # pixels, radius
    smallest_labels: float = 4.0  # pixels, radius: smaller labels show no shape
    noise: float = 0.6  # standard deviation over contrast, in the dim part of the picture
    light: float = 4.0  # brightest over dimmest light: in between, shadows and dim droplets look alike
    outline: float = 0.0085  # noise over contrast times blur, of the radius: outlines are uncertain by about as much
    blur: float = 0.11  # standard deviation, blur and denoising together, of the radius
    # radius of the largest disc in the wide voids over that same blur: below, voids look too bright
    opening: float = 1.15
    mean_round: float = 0.8  # of all droplets; a square 0.785
    odd: float = 0.1  # share of droplets that may be less round than that
    between: float = 0.35  # share of pixels that are neither droplet nor ground, beyond what blur explains
    z: float = 0.6  # change of z when contacts may be 0.7 or 1.4 times as far from a film as they may
    blind: float = 0.015  # of a diameter: where gaps so wide pass for contacts, z may change by less
    blind_z: float = 0.25  # in that case
    apart: float = 0.35  # of the radius: droplets with wider gaps between their labels may touch or not
    film: float = 0.12  # of the radius: between wider films it is a matter of words what is void
    # share of the edge of the picture that is ground, where droplets end inside it; in wet foams half is
    open_edge: float = 0.65
    loose: float = 0.4  # share of droplets that may rattle


DOUBT = Doubt()

EVEN = {"rho": 0.83, "z": 0.83}  # scatter of windows over the error of a mean: neighbours even out what they share
RHO = LIMITS["rho"]  # difference between rho by mean grey and by dark pixels: the accuracy that "good" promises

ALL = frozenset(("count", "area", "rho", "z", "shape_factor_rim", "voids"))
WALLS = frozenset(("rho", "z", "shape_factor_rim", "voids"))  # what rests on where walls are and where they touch
CONTACTS = frozenset(("z", "voids"))


@dataclass(frozen=True)
class Checks:
    """What the checks look at, beside the droplets as they were found."""

    roundness: Array  # (n,) area of the largest disc inside over area
    rho: float  # packing fraction by mean grey
    rho_by_pixels: float  # the same by counting dark pixels
    z: tuple[float, float, float]  # coordination, with the gap as it is, and 0.7 and 1.4 times as wide
    blind: float  # gap beyond a film that passes for a contact, of a diameter
    loose: int  # whole droplets that rattle
    open_edge: float  # share of the edge of the picture that is ground


# each: whether a rule objects, in which words, and to which of `Micrograph.numbers`
Rules = list[tuple[bool, str, frozenset[str]]]
Doubts = list[tuple[str, frozenset[str]]]


def find_doubts(droplets: SeenDroplets, checks: Checks) -> Doubts:
    """Reasons why the numbers may be wrong, in words; none if all is well."""
    rules = _rules_of_labels(droplets) if droplets.labelled else _rules_of_light(droplets, checks)
    return [(text, numbers) for objects, text, numbers in rules + _rules_of_droplets(droplets, checks) if objects]


def doubted_droplets(droplets: SeenDroplets, checks: Checks) -> Mask:
    """(n,) droplets that may be none, several or part of one; all where light, noise or blur leave none certain."""
    if droplets.labelled:
        named = [name - 1 for note in droplets.notes for name in note.droplets]
        return (doubt_labels(droplets) > 0) | np.isin(np.arange(len(droplets.areas)), named)
    spoilt = any(objects for objects, *_ in _rules_of_light(droplets, checks))
    return spoilt | (checks.roundness < ODD.round)


def find_bounds(droplets: SeenDroplets, checks: Checks) -> dict[str, float]:
    """How far each number may be off for what the picture shows badly, by the names of `Micrograph.numbers`."""
    if droplets.labelled:
        bounds = bounds_of_labels(droplets, in_doubt(droplets))
        changes = np.abs(np.array(checks.z) - checks.z[0])  # with the widest gap of a contact
        return bounds | {"z": max([bounds["z"], *changes[np.isfinite(changes)].tolist()])}
    areas = droplets.areas[droplets.whole]
    bounds = {name: LIMITS[name] for name in ("count", "rho", "z")}
    bounds |= {"area": LIMITS["rho"] / max(checks.rho, LIMITS["rho"]) * float(areas.mean())}
    return bounds | {"shape_factor_rim": LIMITS["shape"], "voids": ODD.limit_voids * len(areas)}


def doubt_few(numbers: Mapping[str, Number], labelled: bool = False) -> Doubts:
    """Reasons why means over the droplets of a picture may differ from means over more droplets: of labels their
    intervals say so, but for a few labels. `numbers`: as in `Micrograph.numbers`."""
    count, words = int(numbers["count"].value), {"rho": "rho", "z": "z", "shape_factor_rim": "𝒜"}
    if labelled:
        few = {name for name in words if 0 < numbers[name].count < DOUBT.fewest_labels}
        fewest = min((numbers[name].count for name in few), default=0)
        text = f"{', '.join(words[name] for name in words if name in few)} of {fewest} droplets only, needs "
        return [(f"{text}{DOUBT.fewest_labels}: means over more may differ", frozenset(few))] if few else []
    if count < DOUBT.fewest:
        return [(f"{count} whole droplets only, needs {DOUBT.fewest}: means over more may differ", frozenset(words))]
    found = []
    for name, word in words.items():
        mean, limit = numbers[name], LIMITS["shape" if name == "shape_factor_rim" else name]
        if EVEN.get(name, 1.0) * mean.half_width > limit:
            known = f"within {mean.half_width:.2g} over {mean.count} droplets (95 %)"
            found.append((f"{word} is known to {known}, needs {limit:g}: show more", frozenset((name,))))
    return found


def find_widths(droplets: SeenDroplets, numbers: Mapping[str, Number], scale: float) -> Rules:
    """Whether wide intervals of labels say nothing, in words, and of which number. `scale`: length of a pixel."""
    return widths_of_labels(droplets, numbers, scale) if droplets.labelled else []


def _rules_of_light(droplets: SeenDroplets, checks: Checks) -> Rules:
    darkness, segments, walls = droplets.darkness, droplets.segments, droplets.walls
    radius, spread, noise = segments.radius, float(np.hypot(droplets.blur, darkness.filter)), darkness.noise
    dim, smeared, guessed = noise * np.sqrt(darkness.light), spread > DOUBT.blur * radius, darkness.ground < 3
    grey = float(((darkness.smooth > 0.25) & (darkness.smooth < 0.75)).mean())
    edge = len(meetings(segments.droplets)[0]) * np.pi / 4 + walls.length[walls.touching].sum()
    blurred = 1.4 * np.hypot(spread, 0.7) * edge / segments.cells.size
    between = grey - blurred > DOUBT.between * max(1 - checks.rho, 0.05)
    over = f"blur and noise smear outlines over {spread:.1f} pixels, {spread / radius:.0%} of the radius"
    both = f"noise ({noise:.0%}) and blur ({spread:.1f} pixels) together leave outlines uncertain"
    narrow = "voids are as narrow as the blur, so the level of the ground is a guess"
    return [
        (dim > DOUBT.noise, f"noise is {noise:.0%} of the contrast, up to {dim:.0%} where light is dim", ALL),
        (darkness.light > DOUBT.light, f"light falls to {1 / darkness.light:.0%} of its brightest", ALL),
        (smeared, over, ALL),
        (not smeared and noise * spread > DOUBT.outline * radius, both, ALL),
        (guessed, "hardly any open ground is seen between droplets, so its level is a guess", ALL),
        (not guessed and darkness.opening < DOUBT.opening * spread, narrow, ALL),
        (between, f"{grey:.0%} of the picture is neither droplet nor ground", ALL),
    ]


def _rules_of_droplets(droplets: SeenDroplets, checks: Checks) -> Rules:
    radius, film, labelled = droplets.segments.radius, droplets.walls.film, droplets.labelled
    share, shape = film / radius, checks.roundness[droplets.whole]
    sized = WALLS if labelled else ALL  # labels may be of any size
    smallest = DOUBT.smallest_labels if labelled else DOUBT.smallest
    small = f"droplets are {radius:.0f} pixels in radius, needs {smallest:.0f}: take it closer"
    wide = f"films are {film:.1f} pixels wide, {share:.0%} of the radius: rho counts them to droplets"
    apart = f"droplets lie {film:.0f} pixels apart, {share:.0%} of the radius: that they touch is a guess"
    odd, mean = int((shape < ODD.round).sum()), float(shape.mean())
    bent = f"{odd} of {len(shape)} droplets are less round than {ODD.round:g}, and their mean roundness is {mean:.2f}"
    low, high = min(checks.z), max(checks.z)
    rattling = checks.loose > DOUBT.loose * len(shape)
    wavers = bool(np.isfinite(checks.z).all()) and high - low > (
        DOUBT.blind_z if checks.blind > DOUBT.blind else DOUBT.z
    )
    loose = f"{checks.loose} of {len(shape)} droplets have fewer than three contacts once such droplets are removed "
    loose += "in turn: they are not jammed, films are wide, or walls, which are not looked for, hold them"
    changes = f"z changes from {low:.2f} to {high:.2f} with the widest gap that counts as a contact"
    free = checks.open_edge == 1 if labelled and lie_apart(droplets) else checks.open_edge > DOUBT.open_edge
    ground = f"{checks.open_edge:.0%} of the edge of the picture is ground: a wall that holds droplets is not seen"
    differ = f"rho is {checks.rho:.3f} by mean grey and {checks.rho_by_pixels:.3f} by dark pixels"
    return [
        (radius < smallest, small, sized),
        (share > DOUBT.film and not labelled, wide, ALL),
        (share > DOUBT.apart and labelled, apart, CONTACTS),
        (odd > DOUBT.odd * len(shape) or mean < DOUBT.mean_round, f"{bent}: several in one, or none", ALL),
        (labelled and checks.rho == 1, "every pixel is labelled: labels are cells, or droplets without voids", ALL),
        (rattling, loose, CONTACTS if labelled else WALLS),  # a wall that is seen as void is missing in rho
        (not rattling and wavers and not labelled, changes, CONTACTS),
        (free, ground, WALLS - {"shape_factor_rim"} if labelled else WALLS),
        (abs(checks.rho - checks.rho_by_pixels) > RHO, differ, ALL),
    ]

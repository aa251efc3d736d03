"""Rules of doubt: a clean picture passes all of them, and each objects to what it is there for, alone."""

from dataclasses import replace

import numpy as np
import pytest

import jamlab
from jamlab.micrographs import measurement, quality
from jamlab.micrographs.ring_segmentation import Candidates

pytest.importorskip("skimage")


@pytest.fixture(scope="module")
def clean():
    """Darkness, blur, segments, walls and checks of discs with flats on a hexagonal lattice."""
    y, x = np.mgrid[:160, :160] + 0.5
    k, m = np.meshgrid(np.arange(-6, 12), np.arange(-2, 10))
    centres = 14 + 35.0 * np.column_stack([(k + 0.5 * m).ravel(), (np.sqrt(0.75) * m).ravel()])
    first, second = np.partition([np.hypot(x - cx, y - cy) for cx, cy in centres], 1, axis=0)[:2]
    picture = np.clip(np.minimum(18.2 - first, 0.5 * (second - first) - 0.4) + 0.5, 0, 1)  # discs with flats
    seen = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measurement, "find_doubts", lambda *parts: seen.append(parts) or [])
        jamlab.micrograph(picture, contrast="bright")
    return dict(zip(("darkness", "blur", "segments", "walls", "checks"), seen[0], strict=True))


def odd(values, value):
    """The same values with every second one changed."""
    changed = values.copy()
    changed[::2] = value
    return changed


WALLS, CONTACTS = {"rho", "z", "shape_rim", "voids"}, {"z", "voids"}
CONCERNS = dict.fromkeys(("small", "rings", "open edge", "loose"), WALLS) | dict.fromkeys(
    ("labels apart", "z", "z, blind"), CONTACTS
)
RULES = {
    "noise": ("darkness", {"noise": 0.7, "filter": 0.0}, "noise is 70%"),
    "light": ("darkness", {"light": 5.0}, "light falls to 20%"),
    "blur": ("darkness", {"filter": 3.0, "opening": 9.0}, "blur and noise smear"),
    "outline": ("darkness", {"noise": 0.3, "filter": 0.9}, "leave outlines uncertain"),
    "no ground": ("darkness", {"ground": 2}, "hardly any open ground"),
    "narrow voids": ("darkness", {"opening": 0.0}, "voids are as narrow as the blur"),
    "grey": ("darkness", {"smooth": np.full((160, 160), 0.5)}, "neither droplet nor ground"),
    "small": ("segments", {"radius": 7.0}, "pixels in radius, needs 8"),
    "wide films": ("walls", {"film": 2.5}, "films are 2.5 pixels wide"),
    "labels apart": ("walls", {"film": 5.0}, "that they touch is a guess"),
    "annotated": ("checks", {"annotated": 0.2}, "20% of the picture lie under"),
    "rings": ("checks", {"rings": True}, "of rings no rule tells right rho"),
    "not round": ("checks", lambda c: {"roundness": odd(c.roundness, 0.5)}, "are less round than"),
    "torn labels": ("checks", {"pieces": 2}, "2 labels lie in several pieces"),
    "mean roundness": ("checks", lambda c: {"roundness": np.full_like(c.roundness, 0.79)}, "mean roundness"),
    "open border": ("checks", lambda c: {"closed": odd(c.closed, 0.0)}, "something darker beside"),
    "no peak": ("checks", lambda c: {"radii": odd(c.radii, 200.0)}, "spread of radii"),
    "unstable": ("checks", {"unstable": 9}, "split or merge"),
    "loose": ("checks", lambda c: {"loose": int(c.whole.sum())}, "fewer than three contacts"),
    "z": ("checks", {"z": (5.0, 4.5, 5.2), "blind": 0.0}, "z changes from 4.50 to 5.20"),
    "z, blind": ("checks", {"z": (5.0, 4.9, 5.2), "blind": 0.1}, "z changes from 4.90 to 5.20"),
    "gap in a wall": ("checks", {"widest": 1.2}, "has room"),
    "unsure": ("checks", {"unsure": 3}, "blur hides of 3 droplets"),
    "open edge": ("checks", {"open_edge": 1.0}, "edge of the picture is ground"),
    "rho": ("checks", lambda c: {"rho_by_pixels": c.rho - 0.05}, "rho is"),
}


def test_a_clean_picture_passes(clean):
    assert quality.find_doubts(**clean) == []
    checks = replace(clean["checks"], labelled=True)
    assert quality.find_doubts(**clean | {"checks": checks}) == []


@pytest.mark.parametrize("rule", RULES)
def test_each_rule_objects_alone(clean, rule):
    part, change, reason = RULES[rule]
    changed = replace(clean[part], **(change(clean[part]) if callable(change) else change))
    parts = clean | {part: changed}
    if "guess" in reason or part == "segments":  # where darkness is not looked at
        parts["checks"] = replace(clean["checks"], labelled=True)
    if "noise is" in reason:  # and outlines are sharp all the same
        parts["blur"] = 0.0
    (found,) = quality.find_doubts(**parts)
    assert reason in found.text and found.numbers == CONCERNS.get(rule, quality.ALL)


def test_rings_too_small_to_be_judged_are_not_called_odd_and_pieces_leave_their_count(clean):
    odd_ones = replace(clean["checks"], roundness=odd(clean["checks"].roundness, np.nan), rings=True, pieces=1)
    assert {doubt.numbers for doubt in quality.find_doubts(**clean | {"checks": odd_ones})} == {quality.WALLS}


@pytest.mark.parametrize(
    ("count", "change", "reason"),
    [
        (19, {}, "19 whole droplets only"),
        (40, {"rho": 0.012}, "rho is known to"),
        (40, {"z": 0.3}, "z is known to"),
        (40, {"shape_rim": 0.012}, "A is known to"),
    ],
)
def test_few_droplets_are_doubted(count, change, reason):
    means = {name: quality.Mean(1.0, change.get(name, 0.001), 40) for name in ("rho", "z", "shape_rim")}
    assert quality.doubt_few(40, {name: quality.Mean(1.0, 0.001, 40) for name in means}) == []
    (found,) = quality.doubt_few(count, means)
    assert reason in found.text and found.numbers == (change.keys() or {"rho", "z", "shape_rim"})


ROUND_RINGS = Candidates(np.full(50, 6.0), np.full(50, 400.0), np.ones(50, dtype=bool), 50)


def test_rings_that_are_plain_are_known():
    errors = quality.ring_errors(ROUND_RINGS, ROUND_RINGS.areas, 0.5, 40_000)
    edge = quality.RING_EDGE * 2 * np.pi * np.sqrt(400 / np.pi)
    assert errors["count"] < 0.1 * 50 and errors["area"] < 0.1 * 400  # good
    assert errors["area"] == pytest.approx(edge)
    large = replace(ROUND_RINGS, odds=np.append(np.full(49, 99.0), 0.0), areas=np.append(np.full(49, 400.0), 890.0))
    mixed = 0.5 * (890 - large.areas.mean()) / 50  # one of even chance is taken
    errors = quality.ring_errors(large, large.areas, 0.5, 40_000)
    edge = quality.RING_EDGE * 2 * np.sqrt(np.pi * large.areas).mean()
    assert errors["area"] == pytest.approx(mixed + np.hypot(quality.RING_SIGMAS * mixed, edge))
    values = {"count": 50.0, "area": 400.0, "interior_fraction": 0.5}
    assert quality.doubt_known(values, {"count": 1.0, "area": 2.0, "interior_fraction": 0.01}) == []
    for name in values:
        for error in (100.0, np.nan):
            (found,) = quality.doubt_known(
                values, {"count": 1.0, "area": 2.0, "interior_fraction": 0.01} | {name: error}
            )
            assert found.numbers == {name} and "is known to" in found.text


@pytest.mark.parametrize(("odds", "taken"), [(-1.5, 50), (0.0, 60)], ids=["missed", "false"])
def test_rings_that_may_be_none_and_none_that_may_be_rings_are_told(odds, taken):
    """Ten more of chance q: the count may be off by 10 q or 10 (1 - q), and scatters by sqrt(10 q (1 - q))."""
    more = Candidates(
        np.append(ROUND_RINGS.odds, np.full(10, odds)), np.full(60, 400.0), np.ones(60, dtype=bool), taken
    )
    sure, chance = 1 / (1 + np.exp([-6.0, -odds]))
    shift = abs(-50 * (1 - sure) + 10 * (chance if taken == 50 else chance - 1))
    scatter = quality.RING_SIGMAS * np.sqrt(50 * sure * (1 - sure) + 10 * chance * (1 - chance))
    errors = quality.ring_errors(more, more.areas[:taken], 0.5, 40_000)
    assert errors["count"] == pytest.approx(quality.RING_COUNT + shift + scatter)
    small = replace(more, areas=np.where(np.arange(60) < 50, 400.0, 12.0))  # below the limit of detection
    plain = quality.ring_errors(ROUND_RINGS, ROUND_RINGS.areas, 0.5, 40_000)["count"]
    assert quality.ring_errors(small, small.areas[:50], 0.5, 40_000)["count"] == pytest.approx(plain)


@pytest.mark.parametrize(("above", "chance"), [(0.0, 0.5), (1.0, 0.8413447), (-1.0, 0.1586553)])
def test_rings_as_large_as_the_limit_of_detection_may_count_or_not(above, chance):
    """Of one that is certain, by how far it is above the limit, in uncertainties of the edge of the light."""
    radius = quality.LEAST_RING + above * quality.RING_EDGE + 1e-9
    one = replace(ROUND_RINGS, odds=np.full(50, 99.0), areas=np.append(np.full(49, 400.0), np.pi * radius**2))
    found = quality.ring_errors(one, one.areas, 0.5, 40_000)["count"]
    shift, scatter = 1 - chance if above >= 0 else chance, np.sqrt(chance * (1 - chance))
    assert found == pytest.approx(quality.RING_COUNT + shift + quality.RING_SIGMAS * scatter, abs=1e-6)

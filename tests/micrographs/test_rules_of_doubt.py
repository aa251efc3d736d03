"""Rules of doubt: a clean picture passes all of them, and each objects to what it is there for, alone."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

import jamlab
from jamlab.micrographs import micrograph, quality
from jamlab.micrographs.picture_numbers import Number

pytest.importorskip("skimage")


@pytest.fixture(scope="module")
def clean():
    """Droplets and checks of discs with flats on a hexagonal lattice."""
    y, x = np.mgrid[:160, :160] + 0.5
    k, m = np.meshgrid(np.arange(-6, 12), np.arange(-2, 10))
    centres = 14 + 35.0 * np.column_stack([(k + 0.5 * m).ravel(), (np.sqrt(0.75) * m).ravel()])
    first, second = np.partition([np.hypot(x - cx, y - cy) for cx, cy in centres], 1, axis=0)[:2]
    picture = np.clip(np.minimum(18.2 - first, 0.5 * (second - first) - 0.4) + 0.5, 0, 1)  # discs with flats
    seen = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(micrograph, "find_doubts", lambda *parts: seen.append(parts) or [])
        jamlab.micrograph(picture, contrast="bright")
    return seen[0]


def odd(values, value):
    """The same values with every second one changed."""
    changed = values.copy()
    changed[::2] = value
    return changed


WALLS, CONTACTS = {"rho", "z", "shape_factor_rim", "voids"}, {"z", "voids"}
CONCERNS = dict.fromkeys(("small", "open edge", "loose"), WALLS) | dict.fromkeys(
    ("labels apart", "z", "z, blind"), CONTACTS
)
RULES = {
    "noise": ("darkness", {"noise": 0.7, "filter": 0.0}),
    "light": ("darkness", {"light": 5.0}),
    "blur": ("darkness", {"filter": 3.0, "opening": 9.0}),
    "outline": ("darkness", {"noise": 0.3, "filter": 0.9}),
    "no ground": ("darkness", {"ground": 2}),
    "narrow voids": ("darkness", {"opening": 0.0}),
    "grey": ("darkness", {"smooth": np.full((160, 160), 0.5)}),
    "small": ("segments", {"radius": 3.5}),
    "wide films": ("walls", {"film": 2.5}),
    "labels apart": ("walls", {"film": 7.0}),
    "not round": ("checks", lambda c: {"roundness": odd(c.roundness, 0.5)}),
    "mean roundness": ("checks", lambda c: {"roundness": np.full_like(c.roundness, 0.79)}),
    "loose": ("checks", lambda c: {"loose": len(c.roundness)}),
    "z": ("checks", {"z": (5.0, 4.5, 5.2), "blind": 0.0}),
    "z, blind": ("checks", {"z": (5.0, 4.9, 5.2), "blind": 0.1}),
    "open edge": ("checks", {"open_edge": 1.0}),
    "rho": ("checks", lambda c: {"rho_by_pixels": c.rho - 0.05}),
}


def changed(thing, **change):
    """A copy with other attributes."""
    thing = copy(thing)
    vars(thing).update(change)
    return thing


def test_a_clean_picture_passes(clean):
    assert quality.find_doubts(*clean) == []


@pytest.mark.parametrize("rule", RULES)
def test_each_rule_objects_alone(clean, rule, monkeypatch):
    (part, change), (droplets, checks) = RULES[rule], clean
    if part == "checks":
        checks = replace(checks, **(change(checks) if callable(change) else change))
    else:
        change = change if part == "droplets" else {part: replace(getattr(droplets, part), **change)}
        droplets = changed(droplets, **change)
    if rule == "noise":  # and outlines are sharp all the same
        droplets = changed(droplets, blur=0.0)
    if rule in ("labels apart", "small"):  # where darkness is not looked at
        droplets = changed(droplets, labelled=True)
        monkeypatch.setattr(quality, "_rules_of_labels", lambda _: [])
    ((_, numbers),) = quality.find_doubts(droplets, checks)
    assert numbers == CONCERNS.get(rule, quality.ALL)


@pytest.mark.parametrize(
    ("count", "change"), [(19, {}), (40, {"rho": 0.012}), (40, {"z": 0.3}), (40, {"shape_factor_rim": 0.012})]
)
def test_few_droplets_are_doubted(count, change):
    known = {name: Number(1.0, 0.001, 40) for name in ("rho", "z", "shape_factor_rim")} | {"count": Number(40.0)}
    assert quality.doubt_few(known) == []
    worse = {name: Number(1.0, error, 40) for name, error in change.items()} | {"count": Number(float(count))}
    ((_, concerned),) = quality.doubt_few({**known, **worse})
    assert concerned == (change.keys() or {"rho", "z", "shape_factor_rim"})
    assert quality.doubt_few({**known, **worse}, labelled=True) == []  # intervals of labels say it

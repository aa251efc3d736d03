"""What masks of merged, clipped and cut droplets say of themselves: wrong numbers are doubtful, right ones are good."""

import label_masks
import numpy as np
import pytest
from mask_trials import trial

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.label_doubts import doubt_labels
from jamlab.micrographs.labels import labelled_picture, sort_objects
from jamlab.micrographs.walls import SeenDroplets

pytest.importorskip("skimage")
Y, X = np.mgrid[:240, :240] + 0.5


def circles(radius=14.8, pitch=30.0, at=0.0):
    """Circles of a square lattice, numbered from 1; `at`: shift of the first one out of the picture."""
    row, column = np.floor((Y + at) / pitch), np.floor((X + at) / pitch)
    away = np.hypot((X + at) % pitch - pitch / 2, (Y + at) % pitch - pitch / 2)
    return np.where(away < radius, row * 10 + column + 1, 0).astype(int)


def doubt(labels):
    """Droplets in doubt for each label of an image."""
    found, notes = sort_objects(labels)
    return doubt_labels(SeenDroplets("labels", *labelled_picture(found), None, tuple(notes)))


@pytest.fixture(scope="module")
def window():
    """A window of a packing whose edges cut disks, with its truth."""
    return trial(jamlab.pack(36, 1e-3, seed=3), 300, at=(0.3, 0.1))


def outside(found, truth):
    """Numbers that are good and whose interval leaves out the truth."""
    numbers = {key: found.numbers[key] for key in truth}
    return [
        key
        for key, number in numbers.items()
        if number.quality == "good" and not number.interval[0] <= truth[key] <= number.interval[1]
    ]


def test_a_correct_mask_is_good_and_its_intervals_hold_the_truth(window):
    found = jamlab.micrograph(labels=window.labels)
    assert found.quality == "good", found.reasons
    assert outside(found, window.truth) == [] and found.count == window.truth["count"]
    assert set(found.table()["quality"]) == {"good"}
    assert all(
        np.isfinite(found.numbers[key].uncertainty) and found.numbers[key].uncertainty > 0 for key in ("z", "rho")
    )


SPOILT = {
    "third": lambda labels, rng: label_masks.joined(labels, lambda x, y: x < 0.33),
    "closed corner": lambda labels, rng: label_masks.joined(labels, lambda x, y: np.hypot(x, y) < 0.5, 6),
    "middle": lambda labels, rng: label_masks.joined(labels, lambda x, y: np.hypot(x - 0.5, y - 0.5) < 0.3, 6),
    "clipped": lambda labels, rng: label_masks.clipped(labels),
    "clipped 16 bit": lambda labels, rng: label_masks.clipped(labels, 16),
    "modulo": lambda labels, rng: label_masks.modulo(labels),
}


@pytest.mark.parametrize("fault", SPOILT)
def test_what_ran_together_is_doubtful(window, fault):
    found = jamlab.micrograph(labels=SPOILT[fault](window.labels, np.random.default_rng(1)))
    assert outside(found, window.truth) == []
    assert found.numbers["count"].quality == "doubtful" and found.reasons


def test_a_merged_strip_at_the_edge_weighs_as_many_droplets_as_fit_in_it():
    """Count 28 of 49 was good: the strip, which the edge cuts, is one of 41 labels, and 31.6 droplets by area."""
    labels = circles()
    strip = labels.copy()
    strip[:, :90] = 999
    whole = np.bincount(labels.ravel())[1]
    expected = (strip == 999).sum() / whole
    assert doubt(strip).max() == pytest.approx(expected, rel=0.03)
    found = jamlab.micrograph(labels=strip)
    assert {found.numbers[name].quality for name in ("count", "area", "rho", "voids")} == {"doubtful"}
    assert set(found.table()["quality"]) == {"good"}  # whole droplets beside it are what they are


@pytest.mark.parametrize("cut", [*(pytest.param(each, marks=pytest.mark.slow) for each in (2, 5)), 3])
def test_slivers_at_the_edge_and_motes_are_no_evidence_against_droplets(window, cut):
    at = int(np.flatnonzero((window.labels > 0).any(axis=1))[0])
    found = jamlab.micrograph(labels=window.labels[at + cut :])
    motes = jamlab.micrograph(labels=label_masks.motes(window.labels[at + cut :], np.random.default_rng(cut)))
    assert found.quality == motes.quality == "good", (found.reasons, motes.reasons)
    assert motes.count == found.count and motes.label_notes and set(motes.table()["quality"]) == {"good"}


def test_size_alone_is_no_doubt():
    """A disc of five radii is a droplet, whole or cut; a square of its area is not, nor is a region without an end."""
    small = circles(8.8, 18.0)

    def laid(shape):
        """A label over small circles, of which it covers none in part."""
        return np.where(shape, 999, np.where(np.isin(small, small[shape]), 0, small))

    for middle in (120.0, 0.0):
        assert doubt(laid(np.hypot(X - middle, Y - 120) < 44)).max() == 0
    assert doubt(laid(np.maximum(abs(X - 120), abs(Y - 120)) < 40)).max() > 20
    assert doubt(laid(X < 80)).max() > 60


def test_two_classes_are_no_doubt():
    """Half have three times the radius: a class, not a few regions."""
    large, small = circles(24.0, 60.0), circles(8.0, 60.0, at=30.0)
    assert doubt(np.where(large > 0, large, np.where(small > 0, small + 500, 0))).max() == 0


@pytest.mark.parametrize(
    ("labels", "word"),
    [
        (5 * (np.hypot(X - 120, Y - 120) < 121), "only one"),
        (np.where(np.hypot(X - 120, Y - 120) < 121, 5, 0) + 4 * (X < 0), "only one"),
        (np.zeros((60, 60), int), "no droplet"),
        (np.full((60, 60), 7), "no background"),
        (1 + (X > 120).astype(int), "only one"),
        (np.where(X > 120, 2, 1) + (Y > 120) * 2, "cut by the edge"),
        (np.dstack([circles()] * 5).transpose(2, 0, 1), "stack of 5 pages"),
        (np.stack([circles()] * 3), "stack of 3 pages"),
    ],
)
def test_what_holds_no_droplets_to_measure_is_refused_by_name(labels, word):
    with pytest.raises(InputError, match=word):
        jamlab.micrograph(labels=labels)


def test_a_label_on_all_sides_beside_a_ground_of_zeros_is_doubted():
    labels = circles(at=15.0)
    frame = np.where((np.minimum(X, 240 - X) < 8) | (np.minimum(Y, 240 - Y) < 8), 99, labels)
    found = jamlab.micrograph(labels=frame)
    assert found.numbers["count"].quality == "doubtful" and "as 0 is" in found.label_notes[0]
    with pytest.raises(InputError, match="the only one"):
        sort_objects(np.where(np.maximum(abs(X - 120), abs(Y - 120)) > 100, 99, 0))


def test_a_stack_of_one_is_the_labels(window):
    assert jamlab.micrograph(labels=window.labels[None]).rho == jamlab.micrograph(labels=window.labels).rho


def test_few_small_droplets_and_lines_widen_intervals_and_leave_them_good():
    """Each hides what it may hide in the interval, in words among the notes."""
    packing = jamlab.pack(36, 1e-3, seed=3)
    for pixels, line, part in ((300, 3.0, 1.0), (150, 0.0, 1.0), (300, 0.0, 0.6)):
        known = trial(packing, pixels, line, (0.3, 0.1), part)
        found = jamlab.micrograph(labels=known.labels)
        assert found.quality == "good" and outside(found, known.truth) == [], found.reasons
        assert any(note.startswith("rho is known to within") for note in found.label_notes)


@pytest.mark.parametrize("aspect", [2, 3])
def test_elongated_droplets_are_droplets_and_halves_of_round_ones_are_none(window, aspect):
    """Pressed flat, all of them are ellipses of one shape; of halves, bands and pairs none are."""
    known = window.truth | {"area": window.truth["area"] / aspect, "shape_factor_rim": {2: 1.1889, 3: 1.5141}[aspect]}
    found = jamlab.micrograph(labels=window.labels[::aspect])
    assert found.quality == "good" and outside(found, known) == [], found.reasons
    halves = jamlab.micrograph(labels=label_masks.cracks(window.labels, np.random.default_rng(1)))
    assert halves.numbers["count"].quality == "doubtful"


def test_droplets_that_lie_apart_have_sharp_edges():
    """Wide gaps of all widths are no lines between droplets: rho was known to within half of the distance."""
    rng, labels = np.random.default_rng(3), np.zeros((240, 240), dtype=int)
    for number, (x, y) in enumerate(240 * rng.random((50, 2)), 1):
        near = np.hypot(X - x, Y - y)
        if not labels[near < 11].any():
            labels[near < 10] = number
    found = jamlab.micrograph(labels=labels)
    rho = found.numbers["rho"]
    assert rho.quality == "good" and rho.bound < 0.02 and rho.value == pytest.approx((labels > 0).mean())

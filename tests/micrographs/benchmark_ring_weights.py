"""Weights of the odds of rings, fitted anew on paths of foams and rendered rings.

JAMLAB_FOAMS names the folder of foams as for `benchmark_foams.py`, of which the half that was worked on is used;
without it rendered rings alone. A path is right if the light that it encloses and that of one droplet overlap in more
than half of what they cover together. Prints of the shipped and the new weights how many paths fall into each range of
odds and what share of them is right: what the odds say if they are calibrated. The new ones go to `ring_weights.csv` in
the folder JAMLAB_RESULTS; to ship them copy it to `jamlab/micrographs`, and measure all benchmarks of rings again.
"""

import os
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from drawn_foams import FOLDER, pictures
from PIL import Image
from rendered_pictures import RINGS_TO_FIT, SMALL_RINGS_TO_FIT, lattice_distance, rendered_ring, ring_picture
from scipy import ndimage
from scipy.optimize import minimize
from scipy.special import expit

from jamlab.micrographs.picture_files import read_grey
from jamlab.micrographs.ring_segmentation import pixels_within, propose
from jamlab.micrographs.wall_paths import TERMS, UNITS, path_odds

pytestmark = pytest.mark.benchmark
PENALTY = 1e-3  # of the squares of standardized weights, beside the mean log likelihood
FOAM = 4.0  # what a picture of a foam counts for, one that was rendered being 1
RANGES = np.array([-np.inf, -4, -2, -1, 0, 1, 2, 4, np.inf])


def training_pictures():
    """Grey values, labels of the light inside droplets, of any whole multiple of their size, and what it counts for."""
    for picture, mask in pictures(worked_on=True) if FOLDER else ():
        drawn = np.asarray(Image.open(mask).convert("L")) < 128
        yield read_grey(picture), ndimage.label(drawn)[0], FOAM
    for how in RINGS_TO_FIT + SMALL_RINGS_TO_FIT:
        picture, away = rendered_ring(**how)
        yield read_grey(picture), ndimage.label(away < -how["wall"] / 2)[0], 1.0
    for k, (radius, gap, wall) in enumerate(product((11.0, 19.0), (0.0, 3.0, 7.0), (2.0, 4.0))):
        away = lattice_distance(radius, gap, turned=k % 4 in (1, 2))
        yield read_grey(ring_picture(away, wall, 0.8, 0.02, 0.8, k)), ndimage.label(away < -wall / 2)[0], 1.0


def right_paths(seen, labels):
    """(n,) bool, paths that enclose the light of one droplet."""
    h, w = seen.dark.shape
    rows, columns = (np.arange(size) * part // size for size, part in zip((h, w), labels.shape, strict=True))
    fine = labels[np.ix_(rows, columns)].ravel()
    size, right = np.bincount(fine), np.zeros(len(seen.terms), dtype=bool)
    for k, light in enumerate(seen.paths.light):
        inside = pixels_within(light, (h, w))
        common = np.bincount(fine[inside], minlength=len(size))[1:]
        both = len(inside) + size[1:] - common
        right[k] = len(inside) > 0 and (common / both).max(initial=0) > 0.5
    return right


def fit(terms, right, weight):
    """Weights of the largest likelihood with a small penalty, as `odds_weights` has them."""
    centre, spread = terms.mean(axis=0), terms.std(axis=0) + 1e-9
    x, shape, rng = (terms - centre) / spread, (TERMS + 2, UNITS + 1), np.random.default_rng(0)
    start = np.zeros(shape)
    start[:-2, :-1] = 0.6 / np.sqrt(TERMS) * rng.normal(size=(TERMS, UNITS))
    start[-1, :-1] = 0.3 * rng.normal(size=UNITS)
    penalty = np.full(shape, PENALTY)
    penalty[-2] = penalty[-1, -1] = 0.0
    share = weight / weight.sum()

    def loss(flat):
        w = flat.reshape(shape)
        odds, hidden = path_odds(x, w), np.tanh(x @ w[:-2, :-1] + w[-2, :-1])
        off = share * (expit(odds) - right)
        back = np.column_stack([np.outer(off, w[-1, :-1]) * (1 - hidden**2), off])
        slope = np.vstack([x.T @ back, back.sum(axis=0), np.append(off @ hidden, 0.0)])
        likelihood = share @ (np.logaddexp(0, odds) - right * odds)
        return likelihood + 0.5 * (penalty * w**2).sum(), (slope + penalty * w).ravel()

    start[-1, -1] = 1.0
    w = minimize(loss, start.ravel(), jac=True, method="L-BFGS-B", options={"maxiter": 400}).x.reshape(shape)
    w[:-2] /= spread[:, None]
    w[-2] -= centre @ w[:-2]
    return w


def calibration(odds, right):
    """Prints a line for each range of odds."""
    place = np.digitize(odds, RANGES) - 1
    for k in range(len(RANGES) - 1):
        mine = place == k
        if mine.any():
            expected = expit(odds[mine]).mean()
            between = f"odds {RANGES[k]:+.0f} to {RANGES[k + 1]:+.0f}"
            print(f"{between}: {mine.sum()} paths, {expected:.2f} expected, {right[mine].mean():.2f} right")


def test_weights_can_be_fitted_again():
    terms, right, weight = [], [], []
    for grey, labels, counts in training_pictures():
        seen = propose(grey)
        terms.append(seen.terms)
        right.append(right_paths(seen, labels))
        weight.append(np.full(len(seen.terms), counts / len(seen.terms)))
        print(grey.shape, len(seen.terms), right[-1].sum(), flush=True)
    terms, right, weight = (np.concatenate(part) for part in (terms, right, weight))
    weights = fit(terms, right, weight)
    if folder := os.environ.get("JAMLAB_RESULTS"):
        np.savetxt(Path(folder, "ring_weights.csv"), weights, delimiter=",", fmt="%.5g")
    loss = {}
    for name, odds in (("shipped", path_odds(terms)), ("new", path_odds(terms, weights))):
        loss[name] = np.average(np.logaddexp(0, np.where(right, -odds, odds)), weights=weight)
        print(f"{name}: mean negative log likelihood {loss[name]:.4f}")
        calibration(odds, right)
    assert loss["new"] < loss["shipped"] + 3e-3  # the fit found a minimum as low

"""Weights of the score of rings, fitted anew: a logistic regression on paths of foams and rendered rings.

JAMLAB_FOAMS names the folder of foams as for `benchmark_foams.py`, of which the half that was worked on is used;
without it rendered rings alone. A path is right if the light that it encloses and that of one droplet overlap in more
than half of what they cover together. Prints the new weights, and of the shipped and the new ones how many paths fall
into each range of odds and what share of them is right: what the odds say if they are calibrated. To change the weights
copy those printed into `jamlab/micrographs/wall_paths.py`, and measure all benchmarks of rings again.
"""

from itertools import product

import numpy as np
import pytest
from drawn_foams import FOLDER, pictures
from PIL import Image
from rendered_pictures import RINGS_TO_FIT, lattice_distance, rendered_ring, ring_picture
from scipy import ndimage
from scipy.optimize import minimize
from scipy.special import expit

from jamlab.micrographs.picture_files import read_grey
from jamlab.micrographs.ring_segmentation import pixels_within, propose
from jamlab.micrographs.wall_paths import CONSTANT, WEIGHTS, path_odds

pytestmark = pytest.mark.benchmark
PENALTY = 1e-3  # of the squares of standardized weights, beside the mean log likelihood
RANGES = np.array([-np.inf, -4, -2, -1, 0, 1, 2, 4, np.inf])


def training_pictures():
    """Pairs: grey values, and labels of the light inside droplets, of any whole multiple of their size."""
    for picture, mask in pictures(worked_on=True) if FOLDER else ():
        drawn = np.asarray(Image.open(mask).convert("L")) < 128
        yield read_grey(picture), ndimage.label(drawn)[0]
    for how in RINGS_TO_FIT:
        picture, away = rendered_ring(**how)
        yield read_grey(picture), ndimage.label(away < -how["wall"] / 2)[0]
    for k, (radius, gap, wall) in enumerate(product((11.0, 19.0), (0.0, 3.0, 7.0), (2.0, 4.0))):
        away = lattice_distance(radius, gap, turned=k % 4 in (1, 2))
        yield read_grey(ring_picture(away, wall, 0.8, 0.02, 0.8, k)), ndimage.label(away < -wall / 2)[0]


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
    """Constant and weights of the largest likelihood, with a small penalty."""
    centre, spread = terms.mean(axis=0), terms.std(axis=0) + 1e-9
    x = np.column_stack([np.ones(len(terms)), (terms - centre) / spread])
    sign = np.where(right, 1.0, -1.0)

    def loss(w):
        odds = sign * (x @ w)
        slope = -sign * expit(-odds) * weight
        penalty = PENALTY * np.append(0, w[1:])
        return np.average(
            np.logaddexp(0, -odds), weights=weight
        ) + 0.5 * penalty @ w, x.T @ slope / weight.sum() + penalty

    found = minimize(loss, np.zeros(x.shape[1]), jac=True, method="L-BFGS-B").x
    weights = found[1:] / spread
    return found[0] - weights @ centre, weights


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
    for grey, labels in training_pictures():
        seen = propose(grey)
        terms.append(seen.terms)
        right.append(right_paths(seen, labels))
        weight.append(np.full(len(seen.terms), 1 / len(seen.terms)))
        print(grey.shape, len(seen.terms), right[-1].sum(), flush=True)
    terms, right, weight = (np.concatenate(part) for part in (terms, right, weight))
    constant, weights = fit(terms, right, weight)
    print("CONSTANT =", round(constant, 2), "WEIGHTS =", *np.round(weights, 2))
    loss = {}
    for name, odds in (("shipped", path_odds(terms)), ("new", constant + terms @ weights)):
        loss[name] = np.average(np.logaddexp(0, np.where(right, -odds, odds)), weights=weight)
        print(f"{name}: mean negative log likelihood {loss[name]:.4f}")
        calibration(odds, right)
    assert len(weights) == len(WEIGHTS) and np.isfinite(CONSTANT)
    assert loss["new"] < loss["shipped"] + 1e-3  # the fit found its minimum

"""Sixty pictures that nothing was tuned on: right, or "doubtful", or refused; none silently wrong.

Limits and numbers in `jamlab/micrographs` were set on packings of seeds 1 and 2; these have seeds 201, 202, 203. Light
falls to 0.35, noise reaches 0.2, blur 3 pixels, with and without a scale bar, droplets touch at rho 0.84, 0.90, 0.95.
Seeds 101 to 103 and 105 to 107 judged earlier versions, whose wrong counts and shapes led to rules of doubt; who tunes
on what this prints takes new seeds.

Sixty pictures of rings, thirty of the same droplets and thirty of disks of wide sizes, and twelve of small disks: no
count, mean area or share of light that is called good is off by more than its limit; rho, z, A and voids are all
doubtful. JAMLAB_RESULTS names a folder in which rows are kept, so that a run that was stopped goes on.
"""

from functools import cache
from itertools import product

import numpy as np
import pytest
from rendered_pictures import (
    RINGS_TO_JUDGE,
    SMALL_RINGS_TO_JUDGE,
    kept,
    picture_errors,
    print_ring_errors,
    rendered_ring,
    ring_errors,
    ring_picture,
    ring_truth,
    truth,
    wall_distance,
)

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.picture_numbers import LIMITS

pytestmark = pytest.mark.benchmark
SEEDS = (201, 202, 203)
RHO = (0.84, 0.90, 0.95)
NOISE_AND_BLUR = ((0.0, 0.0), (0.05, 1.0), (0.1, 2.0), (0.2, 0.7), (0.2, 3.0))
RING_PIXELS = (400, 500, 600)  # for each seed
RING_NOISE, RING_LIGHT = (0.0, 0.03, 0.1), (1.0, 0.6, 0.4)
CONDITIONS = list(product(RHO, (1.0, 0.35), (False, True), NOISE_AND_BLUR))


def droplets(seed):
    """64 droplets at every rho of `RHO`."""
    packing, states = jamlab.jam(model="dp", n=64, seed=seed), {}
    for rho in RHO:
        if rho > jamlab.packing_fraction(packing):
            *_, packing = jamlab.compress(packing, to=rho, step=0.02)
        states[rho] = packing
    return states


@pytest.fixture(scope="module")
def held_out():
    return {seed: droplets(seed) for seed in SEEDS}


def measure_grid(states, pixels):
    """Errors of every condition, a packing each in turn; prints a line per picture."""
    known = {(seed, rho): truth(packing) for seed, own in states.items() for rho, packing in own.items()}
    rows = []
    print(f"\n{pixels} pixels   rho light bar noise blur seed |  count    rho      z      A  | verdict")
    for k, (rho, light, bar, (noise, blur)) in enumerate(CONDITIONS):
        seed = SEEDS[k % len(SEEDS)]
        how = {"light": light, "noise": noise, "blur": blur, "scale_bar": bar, "seed": k}
        row = kept(f"{pixels}-{k}", lambda: picture_errors(states[seed][rho], pixels, known[seed, rho], **how))  # noqa: B023
        numbers = f"{row['count']:+6.0f} {row['rho']:+.4f} {row['z']:+.3f} {row['shape']:+.4f}"
        verdict = f"{'right' if row['right'] else 'WRONG'}, {row['quality']} {row['reasons']}"
        print(
            f"{rho:16.2f} {light:5.2f} {bar:3d} {noise:5.2f} {blur:4.1f} {seed:4d} | {numbers} | {verdict}", flush=True
        )
        rows.append(row)
    good = [row for row in rows if row["quality"] == "good"]
    right, rest = sum(row["right"] for row in good), len(rows) - len(good)
    print(f"{len(good)} good, of them {right} right; {rest} doubtful or refused")
    print("largest errors of the good:", {name: max(abs(row[name]) for row in good) for name in LIMITS})
    return rows


@pytest.mark.parametrize("pixels", [900, 500])
def test_none_is_silently_wrong(held_out, pixels):
    rows = measure_grid(held_out, pixels)
    assert not [row for row in rows if row["quality"] == "good" and not row["right"]]
    # a verdict that doubts everything would be no verdict
    assert sum(row["quality"] == "good" for row in rows) >= {900: 40, 500: 25}[pixels]


def test_no_ring_is_silently_wrong(held_out):
    rng, rows = np.random.default_rng(2026), []

    @cache
    def away(which, rho):
        return wall_distance(held_out[SEEDS[which]][rho], RING_PIXELS[which])

    def squeezed(k):
        own, light, noise = away(k % 3, RHO[k // 3 % 3]), RING_LIGHT[k // 4 % 3], RING_NOISE[(k + 1 - k % 2) % 3]
        return ring_picture(own, walls[k], blurs[k], noise, light, seed=k + 1000), own, walls[k]

    def wide(k):
        return *rendered_ring(**RINGS_TO_JUDGE[k]), RINGS_TO_JUDGE[k]["wall"]

    def small(k):
        return *rendered_ring(**SMALL_RINGS_TO_JUDGE[k]), SMALL_RINGS_TO_JUDGE[k]["wall"]

    def errors(picture, distance, wall):
        try:
            return ring_errors(jamlab.micrograph(picture), *ring_truth(distance, wall))
        except InputError as error:
            return {"quality": "refused", "reasons": str(error)}

    walls, blurs = rng.uniform(2, 5, 30), rng.uniform(0.5, 1.8, 30)
    for kind, count in ((wide, 30), (squeezed, 30), (small, len(SMALL_RINGS_TO_JUDGE))):
        for k in range(count):
            row = kept(f"{kind.__name__}-ring-{k}", lambda k=k, kind=kind: errors(*kind(k)))
            print(kind.__name__, k, row, flush=True)
            rows += [row] if "count" in row else []
    print_ring_errors(rows)
    assert all(row["right"] and row["others"] == ["doubtful"] for row in rows)

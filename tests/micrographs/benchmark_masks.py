"""Two hundred masks of packings with known truth: no number that is called good lies outside its interval, but for 5 %;
no number of a correct mask is doubtful, but for 5 %, nor is the mask.

Nine packings of two sizes, of one, lognormal, by a power law of 10:1, and of droplets up to rho = 0.95, are drawn as a
perfect segmenter draws them, and spoilt as real ones do. `python tests/micrographs/benchmark_masks.py` is not a way to
run it: `pytest -m benchmark -s tests/micrographs/benchmark_masks.py`.
"""

from collections import Counter

import label_masks as masks
import numpy as np
import pytest
from mask_trials import trial

import jamlab
from jamlab.errors import InputError

pytestmark = pytest.mark.benchmark
RADIUS = 26.0  # pixels
PACKINGS = {
    "two sizes": {"seed": 31},
    "two sizes, dense": {"seed": 32, "pressure": 1.5e-2},
    "one size": {"seed": 33, "sizes": "monodisperse"},
    "ratio of 2": {"seed": 34, "sizes": "bidisperse:2,0.3"},
    "lognormal 0.3": {"seed": 35, "sizes": "lognormal:0.3"},
    "lognormal 0.5": {"seed": 36, "sizes": "lognormal:0.5,random"},
    "power law 10:1": {"seed": 37, "sizes": "power-law:-3,1,10", "n": 150},
}
# what is done to labels, whether they are correct all the same
MASKS = {
    "perfect": (lambda labels, rng: labels, True),
    "labelled ground": (lambda labels, rng: labels + 1, True),
    "stack of one": (lambda labels, rng: labels[None], True),
    "motes": (masks.motes, True),
    "specks": (masks.specks, True),
    "holes": (masks.holes, True),
    "large holes": (lambda labels, rng: masks.holes(labels, rng, 0.5, 0.6), True),
    "clipped at 255": (lambda labels, rng: masks.clipped(labels), False),
    "few clipped": (lambda labels, rng: masks.clipped(labels, 8, 0.15), False),
    "clipped at 65535": (lambda labels, rng: masks.clipped(labels, 16), False),
    "modulo 256": (lambda labels, rng: masks.modulo(labels), False),
    "third joined at the edge": (lambda labels, rng: masks.joined(labels, lambda x, y: x < 0.33), False),
    "third joined, closed": (lambda labels, rng: masks.joined(labels, lambda x, y: x < 0.33, 6), False),
    "corner joined": (lambda labels, rng: masks.joined(labels, lambda x, y: np.hypot(x, y) < 0.4, 6), False),
    "middle joined": (lambda labels, rng: masks.joined(labels, lambda x, y: np.hypot(x - 0.5, y - 0.5) < 0.25), False),
    "middle closed": (
        lambda labels, rng: masks.joined(labels, lambda x, y: abs(x - 0.5) + abs(y - 0.5) < 0.3, 6),
        False,
    ),
    "strip covered": (lambda labels, rng: masks.covered(labels, lambda x, y: x < rng.uniform(0.2, 0.4)), False),
    "block covered": (lambda labels, rng: masks.covered(labels, lambda x, y: (abs(x - 0.5) < 0.2) & (y < 0.3)), False),
    "joined with cut": (lambda labels, rng: masks.joined_with_cut(labels), False),
    "4 merged": (masks.merged, False),
    "12 merged": (lambda labels, rng: masks.merged(labels, rng, 12), False),
    "debris": (masks.debris, False),
    "two labels each": (masks.cracks, False),
    "pieces": (lambda labels, rng: masks.cracks(labels, rng, 6, False, 3.0), False),
    "many pieces": (lambda labels, rng: masks.cracks(labels, rng, 20, False, 3.0), False),
    "mask that touches": (lambda labels, rng: (labels > 0).astype(np.uint8) * 255, False),
    "mask with lines": (lambda labels, rng: masks.lines(labels) > 0, False),
    "inverted": (lambda labels, rng: labels == 0, False),
}


def packings():
    """Packings of disks, and of droplets at three packing fractions."""
    for name, how in PACKINGS.items():
        yield name, jamlab.pack(**({"n": 100, "pressure": 1e-3} | how))
    droplets = jamlab.jam(64, "dp", 38)
    for rho in (0.9, 0.95):
        *_, droplets = jamlab.compress(droplets, to=rho, step=0.03)
        yield f"droplets at {rho}", droplets


def test_what_is_good_is_right_and_what_is_right_is_good():
    rng, good, outside, verdict = np.random.default_rng(1), Counter(), Counter(), Counter()
    correct, doubted, drawn = 0, 0, 0
    for index, (name, packing) in enumerate(packings()):
        pixels = round(RADIUS * np.sqrt(np.pi * packing.n / 0.85))
        known = trial(packing, pixels, at=tuple(rng.random(2)), part=(1.0, 0.85)[index % 2])
        for fault, (spoil, sound) in MASKS.items():
            drawn += 1
            try:
                found = jamlab.micrograph(labels=spoil(known.labels, rng))
            except InputError as error:
                print(f"{name:18s} {fault:26s} refused: {error}")
                continue
            verdicts = {key: found.numbers[key].quality == "good" for key in known.truth}
            wrong = [
                f"{key} {found.numbers[key].value:.4g} ± {found.numbers[key].uncertainty:.2g}, truth {value:.4g}"
                for key, value in known.truth.items()
                if verdicts[key] and not found.numbers[key].interval[0] <= value <= found.numbers[key].interval[1]
            ]
            good[fault] += sum(verdicts.values())
            outside[fault] += len(wrong)
            correct += sound * len(verdicts)
            verdict[found.quality] += sound
            doubted += sound * (len(verdicts) - sum(verdicts.values()))
            if wrong or (sound and not all(verdicts.values())):
                why = "; ".join(found.reasons)
                print(f"{name:18s} {fault:26s} outside: {wrong}; doubted: {why if sound else '-'}", flush=True)
    total = sum(good.values())
    print(f"\n{drawn} masks; {total} numbers good, {sum(outside.values())} of them outside their interval")
    print(f"{correct} numbers of correct masks, {doubted} of them doubtful; correct masks: {dict(verdict)}")
    assert sum(outside.values()) <= 0.05 * total
    assert doubted <= 0.05 * correct
    assert verdict["doubtful"] <= 0.05 * verdict.total()

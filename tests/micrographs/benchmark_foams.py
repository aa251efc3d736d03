"""Real wet foams with hand-drawn interiors: counts, areas and shares of the light inside bubbles.

JAMLAB_FOAMS names the folder `data_set` of github.com/larrygoyeau/bubble_segmentation_Unet, which has no licence and
does not ship. `jamlab/micrographs/wall_paths.py` was fitted to the half that was worked on, with rendered pictures and
lattices of rings; the other half, by a hash of the name of the mask, was measured once when that was done. Who looks at
it or tunes on what this prints needs other pictures.
"""

import os
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import jamlab
from jamlab.micrographs.measured_droplets import LEAST_RING

FOLDER = os.environ.get("JAMLAB_FOAMS")
pytestmark = [pytest.mark.benchmark, pytest.mark.skipif(not FOLDER, reason="JAMLAB_FOAMS names no folder")]


def pictures(worked_on):
    """Pairs of files, picture and mask, of one half."""
    found = {}
    for part in ("train", "validation"):
        for mask in sorted(Path(FOLDER, f"interior_mask_{part}").iterdir()):
            picture = next(Path(FOLDER, f"image_{part}").glob(f"image_{mask.stem[5:]}.*"))
            if (int(sha256(mask.name.encode()).hexdigest()[0], 16) % 2 == 0) == worked_on:
                found.setdefault(mask.stem, (picture, mask))
    return found.values()


@pytest.mark.parametrize("worked_on", [True, False], ids=["worked on", "held out"])
def test_none_is_good_and_wrong(worked_on):
    rows, wrong = [], []
    for picture, mask in pictures(worked_on):
        drawn = np.asarray(Image.open(mask).convert("L")) < 128
        true, seen = jamlab.micrograph(labels=drawn), jamlab.micrograph(picture, contrast="ring")
        large = true.areas[true.areas >= np.pi * LEAST_RING**2]  # the limit of detection for both
        errors = (
            seen.count / true.count - 1,
            seen.interiors.mean() / true.areas.mean() - 1,
            seen.interior_fraction - drawn.mean(),
            seen.measurable.sum() / len(large) - 1,
            seen.interiors[seen.measurable].mean() / large.mean() - 1,
        )
        low, high = true.means["rho"].interval
        print(
            f"{picture.name} {true.count:4d} {seen.count:4d} {errors[0]:+.1%}, area {errors[1]:+.1%}, interior "
            f"{errors[2]:+.3f}, above the limit {len(large)} {errors[3]:+.1%}, area {errors[4]:+.1%}, {seen.quality}; "
            f"as labels rho {true.rho:.3f} ({low:.3f} to {high:.3f}), "
            f"z {true.z:.2f} ({true.z_range[0]:.2f} to {true.z_range[1]:.2f}), {true.quality}",
            flush=True,
        )
        rows.append(errors)
        if seen.quality == "good" and max(abs(errors[0]), abs(errors[1]), 2.5 * abs(errors[2])) > 0.05:
            wrong.append(picture.name)
    print("median errors of count, area, interior; count and area above the limit:")
    print(np.round(np.median(np.abs(rows), axis=0), 4))
    assert not wrong

"""Real wet foams with hand-drawn interiors, which do not ship: JAMLAB_FOAMS names their folder, `data_set` of
github.com/larrygoyeau/bubble_segmentation_Unet."""

import os
from hashlib import sha256
from pathlib import Path

FOLDER = os.environ.get("JAMLAB_FOAMS")


def pictures(worked_on):
    """Pairs of files, picture and mask, of one half."""
    found = {}
    for part in ("train", "validation"):
        for mask in sorted(Path(FOLDER, f"interior_mask_{part}").iterdir()):
            picture = next(Path(FOLDER, f"image_{part}").glob(f"image_{mask.stem[5:]}.*"))
            if (int(sha256(mask.name.encode()).hexdigest()[0], 16) % 2 == 0) == worked_on:
                found.setdefault(mask.stem, (picture, mask))
    return found.values()

"""Pictures and labels of droplets, and tracks."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from constant_battery import draw, droplets, jamlab, read, scenario


def _of_picture(found: Any) -> Any:
    values = {name: (each.value, each.quality) for name, each in found.numbers.items()}
    seen = [found.count, found.rho, found.z, found.shape, len(found.voids.area)]
    return [*seen, found.quality, list(found.reasons), values]


def _picture(packing: Any, pixels: int, **how: Any) -> Any:
    try:
        return _of_picture(jamlab.micrograph(jamlab.synthetic_micrograph(packing, pixels, **how)))
    except jamlab.InputError as error:
        return f"refused: {error}"


@scenario
def picture(folder):
    return [_picture(read(folder, "dp36"), 240), _picture(read(folder, "dp36"), 200, noise=0.05, blur=1.0, light=0.5)]


@scenario
def picture_poor(folder):
    p = read(folder, "dp36")
    return [_picture(p, 180, noise=0.2, blur=3.0, light=0.35), _picture(p, 180, noise=0.1, blur=2.0, film=4.0)]


@scenario
def picture_few(folder):
    few, many = read(folder, "dp8"), read(folder, "dp36")
    return [_picture(few, 120), _picture(droplets(), 160), _picture(many, 100, blur=1.0)]


@scenario
def labels(folder):
    from label_masks import FAULTS
    from mask_trials import trial

    found = []
    for name, pixels, every in (("dp36", 150, 1), ("sp64", 200, 4)):
        drawn = trial(read(folder, name), pixels).labels
        for fault, spoil in list(FAULTS.items())[::every]:
            try:
                found.append([fault, _of_picture(jamlab.micrograph(labels=spoil(drawn, np.random.default_rng(1))))])
            except jamlab.InputError as error:
                found.append([fault, str(error)])
    return found


@scenario
def picture_files(folder):
    from PIL import Image

    found, grey = [], jamlab.synthetic_micrograph(read(folder, "dp36"), 160)
    with tempfile.TemporaryDirectory() as kept:
        for ending in ("png", "jpg", "tif"):
            path = Path(kept) / f"a.{ending}"
            Image.fromarray((255 * np.clip(grey, 0, 1)).astype(np.uint8)).save(path)
            found.append(_of_picture(jamlab.micrograph(path, pixel=0.5)))
        one = jamlab.micrograph(Path(kept) / "a.png")
        draw(kept, one.plot)
        found.append(one.packing("dp") if hasattr(one, "packing") else 0)
    return found


@scenario
def tracks(folder):
    p = read(folder, "dp36")
    moved = [jamlab.synthetic_micrograph(p.with_state(positions=p.positions + s), 150) for s in (0.0, 0.1)]
    return jamlab.track_droplets(moved, memory=1)

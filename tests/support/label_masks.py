"""Faults that segmenters and hands leave in label images, and how the numbers of a faulty image are judged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import ndimage

from jamlab.arrays import Indices
from jamlab.errors import InputError
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.micrograph import micrograph


def inner(labels: Indices) -> Indices:
    """Labels of droplets off the edge."""
    edge = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    return np.setdiff1d(np.unique(labels), np.append(edge, 0))


def specks(labels: Indices, rng: Any, count: int = 20, largest: int = 3) -> Indices:
    """Stray labels of one to `largest` pixels in a row, anywhere."""
    found, new = labels.copy(), labels.max() + 1
    h, w = labels.shape
    for k in range(count):
        row, column = rng.integers(2, h - 6), rng.integers(2, w - 6)
        found[row, column : column + rng.integers(1, largest + 1)] = new + k
    return found


def holes(labels: Indices, rng: Any, share: float = 0.2, size: float = 0.35) -> Indices:
    """Square holes in the middle of a share of the droplets, `size` of their width."""
    found = labels.copy()
    for name in rng.choice(inner(labels), max(1, int(share * len(inner(labels)))), replace=False):
        y, x = np.nonzero(labels == name)
        half = max(1, int(0.5 * size * np.sqrt(len(y))))
        cy, cx = int(y.mean()), int(x.mean())
        found[cy - half : cy + half, cx - half : cx + half] = 0
    return found


def cracks(labels: Indices, rng: Any, count: int = 5, renamed: bool = True, width: float = 0.0) -> Indices:
    """Droplets parted along a line off their middle: `renamed`: the part beyond is a label of its own; `width`: of the
    line without a label."""
    found, new = labels.copy(), labels.max() + 1
    for k, name in enumerate(rng.choice(inner(labels), count, replace=False)):
        y, x = np.nonzero(labels == name)
        angle, radius = rng.uniform(0, 2 * np.pi), np.sqrt(len(y) / np.pi)
        away = (x - x.mean()) * np.cos(angle) + (y - y.mean()) * np.sin(angle) - rng.uniform(0, 0.5) * radius
        if renamed:
            found[y[away > 0], x[away > 0]] = new + k
        on = np.abs(away) < 0.5 * width
        found[y[on], x[on]] = 0
    return found


def merged(labels: Indices, rng: Any, count: int = 4) -> Indices:
    """Pairs of droplets that touch under one label."""
    found = labels.copy()
    for name in rng.choice(inner(labels), count, replace=False):
        around = np.unique(labels[ndimage.binary_dilation(labels == name)])
        others = np.setdiff1d(np.intersect1d(around, inner(labels)), [name])
        if len(others):
            found[found == others[0]] = name
    return found


def wrapped(labels: Indices, most: int = 64) -> Indices:
    """Numbers beyond the range of the file begin again at one."""
    return np.where(labels > 0, (labels - 1) % most + 1, 0)


def lines(labels: Indices) -> Indices:
    """A line of ground, one pixel wide, between all labels that touch."""
    low, high = (
        ndimage.minimum_filter(np.where(labels > 0, labels, labels.max() + 1), 2),
        ndimage.maximum_filter(labels, 2),
    )
    return np.where((low != high) & (high > 0) & (labels > 0) & (low > 0) & (low <= labels.max()), 0, labels)


def debris(labels: Indices, rng: Any, count: int = 12, ratio: float = 4.0) -> Indices:
    """Round objects, `ratio` times smaller than droplets, on the ground or over droplets."""
    found, new = labels.copy(), labels.max() + 1
    radius = np.sqrt((labels > 0).sum() / len(np.unique(labels)) / np.pi) / ratio
    y, x = np.indices(labels.shape)
    h, w = labels.shape
    for k in range(count):
        cy, cx = rng.uniform(2 * radius, h - 2 * radius), rng.uniform(2 * radius, w - 2 * radius)
        found[np.hypot(x - cx, y - cy) < radius] = new + k
    return found


def in_rows(labels: Indices) -> Indices:
    """Labels numbered row by row, as segmenters do."""
    kinds, first = np.unique(labels[labels > 0], return_index=True)
    names = np.zeros(labels.max() + 1, dtype=int)
    names[kinds[np.argsort(first)]] = np.arange(1, len(kinds) + 1)
    return np.asarray(names[labels])


def clipped(labels: Indices, bits: int = 8, share: float = 0.5) -> Indices:
    """Numbers of a share of the labels beyond the range of a file become its largest number."""
    last, rows = 2**bits - 1, in_rows(labels)
    return np.where(rows > 0, np.minimum(rows + last - int((1 - share) * rows.max()), last), 0).astype(f"uint{bits}")


def modulo(labels: Indices) -> Indices:
    """Numbers beyond 255 begin again at 0."""
    rows = in_rows(labels)
    return ((rows + 256 - rows.max() // 2) % 256 * (rows > 0)).astype(np.uint8)


def joined(labels: Indices, where: Callable[[Any, Any], Any], closed: int = 0) -> Indices:
    """One label for all whose middle lies where a condition of x and y, of the picture, holds; `closed`: pixels over
    which the ground between them joins too."""
    names = np.setdiff1d(np.unique(labels), [0])
    middle = np.array(ndimage.center_of_mass(labels > 0, labels, names)) / labels.shape
    chosen = names[where(middle[:, 1], middle[:, 0])]
    region = np.isin(labels, chosen)
    if closed:
        region |= ndimage.binary_closing(region, iterations=closed)
    return np.where(region, labels.max() + 1, labels)


def covered(labels: Indices, where: Callable[[Any, Any], Any]) -> Indices:
    """A label laid over all pixels where a condition of x and y, of the picture, holds."""
    y, x = (np.indices(labels.shape).transpose(1, 2, 0) / labels.shape).transpose(2, 0, 1)
    return np.where(where(x, y), labels.max() + 1, labels)


def joined_with_cut(labels: Indices) -> Indices:
    """Every label that the edge cuts has the number of a whole one beside it."""
    found, whole = labels.copy(), inner(labels)
    edge = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    for name in np.setdiff1d(edge, [0]):
        beside = np.intersect1d(np.unique(labels[ndimage.binary_dilation(labels == name, iterations=2)]), whole)
        if len(beside):
            found[found == beside[0]] = name
    return found


def motes(labels: Indices, rng: Any, count: int = 40, size: int = 2) -> Indices:
    """Square labels of `size` pixels on the ground."""
    found, new = labels.copy(), labels.max() + 1
    free = np.argwhere(ndimage.binary_erosion(labels == 0, np.ones((size, size))))
    for k in range(count):
        row, column = free[rng.integers(len(free))]
        found[row : row + size, column : column + size] = new + k
    return found


def judge(source: Any, truth: dict[str, float], **how: Any) -> dict[str, tuple[float, str]]:
    """Error and quality of every number whose truth is known, see `judged`."""
    return judged(seen(source, **how), truth)


def seen(source: Any, **how: Any) -> Micrograph | None:
    """What is measured of labels; None where the image is refused."""
    try:
        return micrograph(labels=source, **how)
    except InputError:
        return None


def judged(found: Micrograph | None, truth: dict[str, float]) -> dict[str, tuple[float, str]]:
    """Error and quality of every number whose truth is known; all "refused" where the image was refused."""
    if found is None:
        return dict.fromkeys(truth, (np.nan, "refused"))
    return {name: (found.numbers[name].value - value, found.numbers[name].quality) for name, value in truth.items()}


def wrong(row: dict[str, tuple[float, str]], truth: dict[str, float]) -> list[str]:
    """Numbers that are called good and are farther off than docs say."""
    limits = {"count": max(2.0, 0.1 * truth["count"]), "area": 0.1 * truth["area"], "rho": 0.02, "z": 0.5}
    return [name for name, (error, quality) in row.items() if quality == "good" and not abs(error) <= limits[name]]


FAULTS: dict[str, Callable[[Indices, Any], Indices]] = {
    "perfect": lambda labels, rng: labels,
    "specks": specks,
    "holes": holes,
    "large holes": lambda labels, rng: holes(labels, rng, 0.5, 0.6),
    "two labels each": cracks,
    "torn and renamed": lambda labels, rng: cracks(labels, rng, 5, True, 2.0),
    "merged": merged,
    "wrapped numbers": lambda labels, rng: wrapped(labels),
    "lines": lambda labels, rng: lines(labels),
    "mask": lambda labels, rng: (labels > 0).astype(int),
    "mask with lines": lambda labels, rng: 255 * (lines(labels) > 0),
    "inverted mask": lambda labels, rng: labels == 0,
    "debris": debris,
    "twice the pixels": lambda labels, rng: np.kron(labels, np.ones((2, 2), dtype=int)),
    "labelled ground": lambda labels, rng: labels + 1,
    "all at once": lambda labels, rng: specks(holes(cracks(merged(labels, rng, 2), rng, 2), rng), rng),
}

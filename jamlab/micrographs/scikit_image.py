"""scikit-image, which only pictures need (extra `images`), imported when the first picture is read."""

from __future__ import annotations

from typing import Any

from jamlab.errors import InputError


def scikit_image() -> Any:
    """The package with the parts that pictures need.

    Raises:
        InputError: it is not installed.
    """
    try:
        import skimage.color
        import skimage.filters
        import skimage.measure
        import skimage.morphology
        import skimage.segmentation
        import skimage.transform
    except ImportError:
        raise InputError("pictures need scikit-image: install it with pip install 'jamlab[images]'") from None
    return skimage

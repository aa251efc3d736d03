"""Arguments of functions of pictures."""

from typing import get_args

from jamlab.arguments.argument import Argument
from jamlab.arguments.choices import Channel, Contrast

MICROGRAPHS = (
    Argument(
        "picture",
        "A picture: a file, or an array.",
        default=None,
        unset="none, give it or labels",
        habits="image pic array img",
    ),
    Argument(
        "labels",
        "Labels of droplets: a file, or an array.",
        default=None,
        unset="found in the picture",
        text_otherwise={"jamlab analyze": "Label image or mask; of several pages, droplets are tracked."},
    ),
    Argument(
        "pixel",
        "Size of a pixel.",
        "number",
        least=1e-100,
        highest=1e100,
        default=None,
        unset="the one that the file states, or 1 pixel",
        habits="px resolution micron_per_pixel um_per_pixel",
    ),
    Argument(
        "film",
        "Widest gap between droplets in contact, in pixels.",
        "number",
        least=1e-100,
        highest=1e100,
        default=None,
        unset="estimated from the picture",
        otherwise={"synthetic_micrograph": 2.0},
        limits_otherwise={"synthetic_micrograph": (0, 100)},
    ),
    Argument(
        "contrast",
        "Bright or dark droplets; auto: found.",
        "choice",
        choices=get_args(Contrast),
        default="auto",
        habits="invert inverted dark bright polarity",
    ),
    Argument(
        "channel",
        "Channel of a picture in colours.",
        "choice",
        choices=get_args(Channel),
        default="grey",
    ),
    Argument(
        "memory",
        "Frames in which a droplet may be missing and keep its number.",
        "integer",
        least=0,
        default=0,
        otherwise={"jamlab analyze": None},
        unset="0",
    ),
    Argument(
        "overlay",
        "Picture to write of outlines, numbers, contacts and voids.",
        "path",
        default=None,
        unset="none is written",
        habits="plot figure picture overlay_file image_out",
    ),
    Argument(
        "pixels",
        "Width of the picture, in pixels.",
        "integer",
        least=32,
        highest=6000,
        default=512,
        habits="size width shape",
    ),
    Argument("blur", "Standard deviation of the blur, in pixels.", "number", least=0, highest=100, default=0.7),
    Argument(
        "noise",
        "Standard deviation of the noise; droplets in full light are 1.",
        "number",
        least=0,
        highest=10,
        default=0.0,
    ),
    Argument(
        "light", "Brightness at the right edge over that at the left.", "number", least=1e-6, highest=1, default=1.0
    ),
)

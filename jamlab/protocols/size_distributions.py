"""Size distributions of disks: their diameters before they are placed at random.

A distribution is named by text, such as "lognormal:0.3" or "power-law:-3,0.5,2". Its mean is 1, its width the standard
deviation over the mean. By default the diameters are drawn by strata: the law is cut into n parts of equal probability,
and each disk has the mean diameter of its part. A parabola through these means, or an exponential where no parabola
grows, sets mean, width and skewness as in the law. No n numbers have a skewness above (n - 2)/sqrt(n - 1): then
mean and width are as in the law. Disks that would leave the cut-offs of the law keep the means of their parts.
`sizes` of a packing's provenance holds width and skewness, of the law and as drawn. ",random" draws independent
diameters instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_positive, check_seed, finite_array, is_number
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError, named
from jamlab.models.disks import DISKS
from jamlab.packing.recipe import Recipe
from jamlab.protocols.particle_numbers import check_bidisperse, check_count

Sizes = str | Sequence[float] | Array  # a distribution by name, or diameters

SIZES_PROTOCOL = 3  # version, see jamlab.campaign.tasks: 2 and 3 differ by rounding


@dataclass(frozen=True)
class SizeLimits:
    """Which sizes disks may have, and how finely distributions are drawn."""

    largest_ratio: float = 10.0  # of `ratio`: beyond, small disks rattle in the gaps
    widest_ratio: float = 100.0  # of any two disks: neighbor lists grow with the square of the ratio
    fine: int = 64  # points in each stratum, by which its mean is taken
    width: float = 1e-6  # least: sizes in less are alike but for rounding
    any: float = 1e100  # of a length: any that float64 bears


SIZE_LIMITS = SizeLimits()

FROM_FILE = "from-file:"
_LAWS: dict[str, dict[str, tuple[float, float]]] = {  # numbers of each law, and their limits
    "monodisperse": {},
    "bidisperse": {"RATIO": (1.0, SIZE_LIMITS.widest_ratio), "SHARE": (1e-6, 1 - 1e-6)},
    "uniform": {"WIDTH": (SIZE_LIMITS.width, 0.55)},
    "gaussian": {"WIDTH": (SIZE_LIMITS.width, 0.5)},
    "lognormal": {"WIDTH": (SIZE_LIMITS.width, 1.0)},
    "power-law": {
        "EXP": (-20.0, 20.0),
        "SMALLEST": (1 / SIZE_LIMITS.any, SIZE_LIMITS.any),
        "LARGEST": (1 / SIZE_LIMITS.any, SIZE_LIMITS.any),
    },
}
_WRITTEN = {name: name + ":"[: len(limits)] + ",".join(limits) for name, limits in _LAWS.items()}


@dataclass(frozen=True)
class SizeDistribution:
    """A named distribution of diameters with mean 1.

    Example:
        >>> from jamlab.protocols.size_distributions import SizeDistribution
        >>> d = SizeDistribution.of("lognormal:0.3").draw(64, seed=1)
        >>> round(float(d.mean()), 12), round(float(d.std()), 12)
        (1.0, 0.3)
    """

    name: str  # "monodisperse", "bidisperse", "uniform", "gaussian", "lognormal" or "power-law"
    numbers: tuple[float, ...] = ()  # of the law, as written behind its name
    random: bool = False  # whether diameters are drawn independently of each other instead of by strata

    @classmethod
    def of(cls, text: str) -> SizeDistribution:
        """Read a distribution from its name and numbers."""
        name, *words = [word.strip() for word in text.replace(":", ",", 1).split(",")]
        random = words[-1:] == ["random"]
        if name not in _LAWS:
            usage = ", ".join([*_WRITTEN.values(), f"{FROM_FILE}PATH"])
            raise InputError(f"{named('sizes', text)}: use one of {usage}")
        try:
            numbers = tuple(map(float, words[:-1] if random else words))
        except ValueError:
            numbers = (float("nan"),)
        limits = _LAWS[name]
        if len(numbers) != len(limits) or not all(map(is_number, numbers)):
            raise InputError(
                f"{named('sizes', text)}: write it as {_WRITTEN[name]}, with numbers; add ,random for a random draw"
            )
        for number, (word, (low, high)) in zip(numbers, limits.items(), strict=True):
            if not low <= number <= high:
                raise InputError(f"{named('sizes', text)}: {word} is {number:g}, must be from {low:g} to {high:g}")
        if name == "power-law" and not numbers[1] < numbers[2] <= SIZE_LIMITS.widest_ratio * numbers[1]:
            raise InputError(
                f"{named('sizes', text)}: LARGEST = {numbers[2]:g} must be above SMALLEST, at most "
                f"{SIZE_LIMITS.widest_ratio:g} times it"
            )
        return cls(name, numbers, random)

    def draw(self, n: int, seed: int) -> Array:
        """(n,) diameters, ascending.

        Args:
            n: number of disks.
            seed: of a random draw; strata do not depend on it.
        """
        if self.random:
            diameters = np.sort(self.quantiles(np.random.default_rng([seed, 3]).random(n)))
        elif self.name == "bidisperse":
            check_bidisperse(n, 0, 1.0, self.numbers[1])
            many = round(self.numbers[1] * n)
            diameters = np.repeat([1.0, self.numbers[0]], [n - many, many])
            diameters = diameters / diameters.mean()
        else:
            diameters = self._strata(n)
        if diameters[0] <= 0:
            raise InputError(
                f"sizes = {self.name}:{self.numbers[0]:g}: of n = {n} disks one would have the diameter "
                f"{diameters[0]:.3g}: use a smaller width, or lognormal"
            )
        return diameters

    @property
    def _law(self) -> Any:
        """The distribution of scipy, of any mean."""
        from scipy import stats  # only who asks for such sizes waits for it

        if self.name == "power-law":
            exponent, smallest, largest = self.numbers
            power = -1 - exponent
            power = round(power) if abs(power - round(power)) < 1e-7 else power  # nearer, scipy's moments lose digits
            if power == 0:
                return stats.loguniform(smallest, largest)
            return stats.truncpareto(power, largest / smallest, scale=smallest)
        (width,) = self.numbers
        if self.name == "uniform":
            return stats.uniform(1 - np.sqrt(3) * width, 2 * np.sqrt(3) * width)
        if self.name == "gaussian":
            return stats.norm(1, width)
        return stats.lognorm(np.sqrt(np.log1p(width**2)), scale=1 / np.sqrt(1 + width**2))

    def quantiles(self, shares: Array) -> Array:
        """(m,) diameters below which shares (m,) of the disks lie."""
        if self.name == "monodisperse":
            return np.ones_like(shares)
        if self.name == "bidisperse":
            ratio, share = self.numbers
            return np.where(shares < 1 - share, 1.0, ratio) / (1 - share + share * ratio)
        return np.asarray(self._law.ppf(shares) / self._law.mean())

    @property
    def width(self) -> float:
        """Standard deviation over the mean."""
        if self.name == "monodisperse":
            return 0.0
        if self.name == "bidisperse":
            ratio, share = self.numbers
            return float((ratio - 1) * np.sqrt(share * (1 - share)) / (1 - share + share * ratio))
        return float(self._law.std() / self._law.mean())

    @property
    def skewness(self) -> float:
        """Third central moment over the cube of the standard deviation."""
        if self.name == "monodisperse":
            return 0.0
        if self.name == "bidisperse":
            share = self.numbers[1]
            return float((1 - 2 * share) / np.sqrt(share * (1 - share)))
        return float(self._law.stats("s"))

    def _strata(self, n: int) -> Array:
        from scipy.optimize import brentq

        width, skewness = self.width, self.skewness
        if width == 0.0:
            return np.ones(n)
        nodes, weights = np.polynomial.legendre.leggauss(SIZE_LIMITS.fine)
        shares = (np.arange(n)[:, None] + 0.5 * (nodes + 1)) / n
        means = self.quantiles(shares.ravel()).reshape(n, SIZE_LIMITS.fine) @ (0.5 * weights)
        straight = _standard(means)
        # a parabola up to where it begins to fall at an end, an exponential up to where one disk alone is large
        shapes = [straight]
        families: list[tuple[Callable[[float], Array], float, float]] = [
            (lambda bend: straight + bend * straight**2, -0.5 / straight[-1], -0.5 / straight[0]),
            (lambda bend: np.exp(bend * (straight - straight[-1])), 1e-3, 40 / (straight[-1] - straight[-2])),
        ]
        for shape, least, most in families:
            if n > 2 and _skewness(shape(least)) < skewness < _skewness(shape(most)):
                bend = brentq(lambda b, of=shape: _skewness(of(b)) - skewness, least, most, xtol=1e-15)
                shapes.insert(len(shapes) - 1, _standard(shape(bend)))
        smallest, largest = self.quantiles(np.array([0.0, 1.0]))
        for curve in shapes:
            diameters = np.asarray(1 + width * curve)
            if smallest <= diameters[0] and diameters[-1] <= largest:
                return diameters
        return np.asarray(means)


def _standard(values: Array) -> Array:
    return np.asarray((values - values.mean()) / values.std())


def _skewness(values: Array) -> float:
    return float((_standard(values) ** 3).mean()) if np.ptp(values) else 0.0


def disk_diameters(
    n: int, seed: int, *, ratio: float | None = None, large: float = 0.5, sizes: Sizes | None = None
) -> Array:
    """(n,) diameters of disks: of a distribution by name, as given, or of two sizes.

    Args:
        n: number of disks.
        seed: of the packing.
        ratio: two sizes of mean 1: large over small diameter; default as in `sp.parameters`.
        large: two sizes: number share of the large ones.
        sizes: instead of both, a distribution such as "lognormal:0.3", or n diameters, which keep their unit of length.
    """
    check_seed(seed)
    if sizes is None:
        return _two_sizes(n, seed, ratio, large)
    if ratio is not None or large != 0.5:
        given = f"size_ratio = {ratio!r}" if ratio is not None else f"fraction_large = {large!r}"
        raise InputError(
            f"{given} and sizes = {shown_sizes(sizes)}: give one of them; size_ratio and fraction_large are "
            "of two sizes"
        )
    if not isinstance(sizes, str):
        diameters = finite_array("sizes", sizes, (None,))
    elif sizes.startswith(FROM_FILE):
        diameters = _from_file(sizes.removeprefix(FROM_FILE))
    else:
        check_count(n, None)
        diameters = SizeDistribution.of(sizes).draw(n, seed)
    return _checked(n, diameters)


def diameters_of(recipe: Recipe) -> Array:
    """(n,) diameters of the disks of a recipe."""
    return disk_diameters(
        recipe.n, recipe.seed, ratio=recipe.size_ratio, large=recipe.fraction_large, sizes=recipe.sizes
    )


def lasting(recipe: Recipe) -> Recipe:
    """The recipe with the diameters of a file instead of its name: the file may change."""
    from_file = isinstance(recipe.sizes, str) and recipe.sizes.startswith(FROM_FILE)
    return replace(recipe, sizes=diameters_of(recipe).tolist()) if from_file else recipe


def sizes_record(sizes: Sizes | None, diameters: Array) -> dict[str, Any]:
    """Entry of the provenance that says what was drawn; empty for the two sizes of `ratio` and `large`."""
    if sizes is None:
        return {}
    mean = float(diameters.mean())
    drawn = {"mean": mean, "width": float(diameters.std()) / mean, "skewness": _skewness(diameters)}
    if isinstance(sizes, str) and not sizes.startswith(FROM_FILE):
        law = SizeDistribution.of(sizes)
        drawn |= {"law_width": law.width, "law_skewness": law.skewness}
    ends = {"smallest": float(diameters.min()), "largest": float(diameters.max())}
    return {"sizes": {"law": sizes if isinstance(sizes, str) else "given", **drawn, **ends}}


def _two_sizes(n: int, seed: int, ratio: float | None, large: float) -> Array:
    check_bidisperse(n, seed, 1.0, large)
    if ratio is None:
        ratio = float(defaults(DISKS.name)["size_ratio"])
    elif not is_number(ratio) or not 1 <= ratio <= SIZE_LIMITS.largest_ratio:
        raise InputError(
            f"{named('size_ratio', ratio)}: large over small diameter must be a number from 1 to "
            f"{SIZE_LIMITS.largest_ratio:g}"
        )
    small, many = 2 / (1 + ratio), round(large * n)
    return np.repeat([small, ratio * small], [n - many, many])


def _from_file(path: str) -> Array:
    try:
        words = Path(path).read_text(encoding="utf-8").replace(",", " ").split()
        return finite_array("sizes", [float(word) for word in words], (None,))
    except (OSError, ValueError) as error:  # UnicodeDecodeError and InputError, too
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"sizes = '{FROM_FILE}{path}': {reason}; name a text file of diameters") from None


def _checked(n: int, diameters: Array) -> Array:
    if len(diameters) != n:
        remedy = f"give {n} diameters" + (f", or n = {len(diameters)}" if len(diameters) >= 2 else "")
        raise InputError(f"sizes hold {len(diameters)} diameters for n = {n} disks: {remedy}")
    check_count(n, None)
    check_positive("sizes", diameters)
    if diameters.max() > SIZE_LIMITS.widest_ratio * diameters.min():
        raise InputError(
            f"sizes from {diameters.min():.6g} to {diameters.max():.6g}: the largest diameter may be at "
            f"most {SIZE_LIMITS.widest_ratio:g} times the smallest; use a smaller width"
        )
    return diameters


def shown_sizes(sizes: Sizes | float) -> str:
    """Sizes as words for a message: a name or number as it is, an array by its length."""
    return repr(sizes) if isinstance(sizes, str | float | int) else f"{np.size(np.asarray(sizes))} diameters"

"""Size distributions of disks: what their diameters are before they are placed at random.

A distribution is named by text, such as "lognormal:0.3" or "power-law:-3,0.5,2". By default its diameters are drawn by
strata: the law is cut into n parts of equal probability, each disk has the mean diameter of its part, and a growing
parabola through them, or an exponential where none does, sets mean, width and skewness to those of the law, which n
parts alone miss by a little. No n numbers have a skewness above (n - 2)/sqrt(n - 1): laws beyond have mean and width
alone. No diameter leaves the cut-offs of its law: few disks whose width or skewness would ask for that have the mean
alone. `sizes` of a packing's provenance names width and skewness of the law and those drawn. So no two seeds differ in
them. ",random" draws independent diameters instead.

Widths are standard deviations over the mean, and the mean diameter of every named distribution is 1.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_bidisperse, check_count, check_positive, check_seed, finite_array, is_number
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError

Sizes = str | Sequence[float] | Array  # a distribution by name, or diameters

SIZES_PROTOCOL = 2  # version, see jamlab.campaign.versions; 1 let few disks leave the cut-offs of their law
LARGEST_RATIO = 10.0  # of `ratio`: beyond, small disks rattle in the gaps
WIDEST_RATIO = 100.0  # of any two disks: neighbor lists grow with the square of the ratio
LEAST_WIDTH = 1e-6  # of a distribution: sizes in less are alike but for rounding
_FINE = 64  # points in each stratum, by which its mean is taken
_RANDOM = "random"


@dataclass(frozen=True)
class _Law:
    """One kind of distribution."""

    usage: str  # how its numbers are written, for messages
    numbers: int  # how many it takes
    # (m,) diameters below which shares u (m,) of the disks lie, in any unit of length
    quantile: Callable[[Array, tuple[float, ...]], Array]
    fault: Callable[[tuple[float, ...]], str]  # what is wrong with its numbers, with a remedy, or ""


def _bidisperse(u: Array, numbers: tuple[float, ...]) -> Array:
    ratio, share = numbers
    return np.where(u < 1 - share, 1.0, ratio) / (1 - share + share * ratio)


def _uniform(u: Array, numbers: tuple[float, ...]) -> Array:
    return np.asarray(1 + np.sqrt(3) * numbers[0] * (2 * u - 1))


def _gaussian(u: Array, numbers: tuple[float, ...]) -> Array:
    from scipy.special import ndtri  # only who asks for such sizes waits for it

    return np.asarray(1 + numbers[0] * ndtri(u))


def _lognormal(u: Array, numbers: tuple[float, ...]) -> Array:
    from scipy.special import ndtri

    variance = np.log1p(numbers[0] ** 2)
    return np.asarray(np.exp(np.sqrt(variance) * ndtri(u) - 0.5 * variance))


def _power_law(u: Array, numbers: tuple[float, ...]) -> Array:
    """Density d^EXP between the cut-offs."""
    exponent, smallest, largest = numbers
    power = exponent + 1
    if abs(power) < 1e-9:
        return np.asarray(smallest * (largest / smallest) ** u)
    rise = np.expm1(power * np.log(largest / smallest))
    return np.asarray(smallest * np.exp(np.log1p(u * rise) / power))


def _power_law_mean(numbers: tuple[float, ...]) -> float:
    """Ratio of the integrals of d^(EXP + 1) and d^EXP."""
    exponent, smallest, largest = numbers

    def integral(power: float) -> float:
        log = np.log(largest / smallest)
        return float(smallest**power * (np.expm1(power * log) / power if abs(power) > 1e-9 else log))

    return integral(exponent + 2) / integral(exponent + 1)


def _fault_of_width(highest: float) -> Callable[[tuple[float, ...]], str]:
    def fault(numbers: tuple[float, ...]) -> str:
        if LEAST_WIDTH <= numbers[0] <= highest:
            return ""
        return f"the width must be from {LEAST_WIDTH:g} to {highest:g}; disks of one size are monodisperse"

    return fault


def _fault_of_two(numbers: tuple[float, ...]) -> str:
    ratio, share = numbers
    if not 1 <= ratio <= WIDEST_RATIO:
        return f"RATIO, large over small diameter, must be from 1 to {WIDEST_RATIO:g}"
    return "" if 0 < share < 1 else "SHARE, that of the large disks by number, must lie between 0 and 1"


def _fault_of_power_law(numbers: tuple[float, ...]) -> str:
    exponent, smallest, largest = numbers
    if not 0 < smallest < largest <= WIDEST_RATIO * smallest:
        return f"SMALLEST must be above 0 and LARGEST above it, by a factor of at most {WIDEST_RATIO:g}"
    return "" if abs(exponent) <= 20 else "EXP must lie between -20 and 20"


_LAWS = {
    "monodisperse": _Law("monodisperse", 0, lambda u, _: np.ones_like(u), lambda _: ""),
    "bidisperse": _Law("bidisperse:RATIO,SHARE", 2, _bidisperse, _fault_of_two),
    "uniform": _Law("uniform:WIDTH", 1, _uniform, _fault_of_width(0.55)),
    "gaussian": _Law("gaussian:WIDTH", 1, _gaussian, _fault_of_width(0.5)),
    "lognormal": _Law("lognormal:WIDTH", 1, _lognormal, _fault_of_width(1.0)),
    "power-law": _Law("power-law:EXP,SMALLEST,LARGEST", 3, _power_law, _fault_of_power_law),
}
FROM_FILE = "from-file:"
USAGE = ", ".join([*(law.usage for law in _LAWS.values()), f"{FROM_FILE}PATH"])


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
    def of(cls, text: str) -> "SizeDistribution":
        """Read a distribution from its name and numbers."""
        name, _, rest = text.partition(":")
        words = [word.strip() for word in rest.split(",")] if rest else []
        if "," in name:  # monodisperse,random
            name, _, rest = name.partition(",")
            words = [rest.strip()]
        name, random = name.strip(), words[-1:] == [_RANDOM]
        words = words[:-1] if random else words
        if name not in _LAWS:
            raise InputError(f"sizes = {text!r}: use one of {USAGE}")
        law = _LAWS[name]
        try:
            numbers = tuple(map(float, words))
        except ValueError:
            numbers = (float("nan"),)
        if len(numbers) != law.numbers or not all(map(is_number, numbers)):
            raise InputError(f"sizes = {text!r}: write it as {law.usage}, with numbers; add ,random for a random draw")
        if fault := law.fault(numbers):
            raise InputError(f"sizes = {text!r}: {fault}")
        return cls(name, numbers, random)

    def draw(self, n: int, seed: int) -> Array:
        """(n,) diameters, ascending. `n`: number of disks; `seed`: of a random draw; strata do not depend on it."""
        if self.random:
            diameters = np.sort(self.quantiles(np.random.default_rng([seed, 3]).random(n)))
        elif self.name == "bidisperse":
            diameters = self._two_sizes(n)
        else:
            diameters = self._strata(n)
        if diameters[0] <= 0:
            raise InputError(
                f"sizes = {self.text!r}: of n = {n} disks one would have the diameter {diameters[0]:.3g}: take a "
                "smaller width, or lognormal with more disks"
            )
        return diameters

    def quantiles(self, shares: Array) -> Array:
        """(m,) diameters below which shares (m,) of the disks lie."""
        scale = _power_law_mean(self.numbers) if self.name == "power-law" else 1.0
        return _LAWS[self.name].quantile(shares, self.numbers) / scale

    @property
    def width(self) -> float:
        """Standard deviation over the mean."""
        if self.name == "monodisperse":
            return 0.0
        if self.name == "bidisperse":
            ratio, share = self.numbers
            return float((ratio - 1) * np.sqrt(share * (1 - share)) / (1 - share + share * ratio))
        if self.name != "power-law":
            return self.numbers[0]
        first, second, _ = self._power_law_moments
        return float(np.sqrt(second / first**2 - 1))

    @property
    def skewness(self) -> float:
        """Third central moment over the cube of the standard deviation."""
        if self.name == "lognormal":
            return self.width**3 + 3 * self.width
        if self.name == "bidisperse":
            share = self.numbers[1]
            return float((1 - 2 * share) / np.sqrt(share * (1 - share)))
        if self.name != "power-law":
            return 0.0
        first, second, third = self._power_law_moments
        return float((third - 3 * first * second + 2 * first**3) / (second - first**2) ** 1.5)

    @property
    def _power_law_moments(self) -> Array:
        """Means of d, d^2 and d^3."""
        exponent, *ends = self.numbers
        return np.asarray(np.cumprod([_power_law_mean((exponent + power, *ends)) for power in range(3)]), np.float64)

    @property
    def text(self) -> str:
        """The words that `of` reads."""
        words = [f"{number:.17g}" for number in self.numbers] + ([_RANDOM] if self.random else [])
        mark = ":" if self.numbers else ","
        return self.name + (mark + ",".join(words) if words else "")

    def _strata(self, n: int) -> Array:
        from scipy.optimize import brentq

        if self.width == 0.0:
            return np.ones(n)
        nodes, weights = np.polynomial.legendre.leggauss(_FINE)
        ends = np.linspace(0, 1, n + 1)
        shares = ends[:-1, None] + 0.5 * (nodes + 1) / n
        means = self.quantiles(shares.ravel()).reshape(n, _FINE) @ (0.5 * weights)
        straight = _standard(means)

        def parabola(bend: float) -> Array:
            return _standard(straight + bend * straight**2)

        def exponential(bend: float) -> Array:
            return _standard(np.exp(bend * (straight - straight[-1])))

        # a parabola up to where it begins to fall at an end, an exponential up to where one disk alone is large
        curves = [straight]
        for curve, least, most in (
            (parabola, -0.5 / straight[-1], -0.5 / straight[0]),
            (exponential, 1e-3, 40 / (straight[-1] - straight[-2])),
        ):
            if n > 2 and _skewness(curve(least)) < self.skewness < _skewness(curve(most)):
                bend = brentq(lambda b, of=curve: _skewness(of(b)) - self.skewness, least, most, xtol=1e-15)
                curves.insert(len(curves) - 1, curve(bend))
        smallest, largest = self.quantiles(np.array([0.0, 1.0]))
        for shape in curves:
            diameters = np.asarray(1 + self.width * shape)
            if smallest <= diameters[0] and diameters[-1] <= largest:
                return diameters
        return np.asarray(means)

    def _two_sizes(self, n: int) -> Array:
        ratio, share = self.numbers
        check_bidisperse(n, 0, 1.0, share)
        many = round(share * n)
        diameters = np.repeat([1.0, ratio], [n - many, many])
        return np.asarray(diameters / diameters.mean())


def _standard(values: Array) -> Array:
    return np.asarray((values - values.mean()) / values.std())


def _skewness(values: Array) -> float:
    return float((_standard(values) ** 3).mean()) if np.ptp(values) else 0.0


def disk_diameters(
    n: int, seed: int, *, ratio: float | None = None, large: float = 0.5, sizes: Sizes | None = None
) -> Array:
    """(n,) diameters of disks: of a distribution by name, as given, or of two sizes. `n`: number of disks; `seed`: of
    the packing; `ratio`: two sizes: large over small diameter; default that of `sp.parameters`; `large`: two sizes:
    number share of the large ones. The mean of the two diameters is 1; `sizes`: instead of both, a distribution such as
    "lognormal:0.3", or n diameters, which keep their unit of length."""
    check_seed(seed)
    if sizes is None:
        return _short_form(n, seed, ratio, large)
    if ratio is not None or large != 0.5:
        given = f"ratio = {ratio!r}" if ratio is not None else f"large = {large!r}"
        raise InputError(
            f"{given} and sizes = {shown_sizes(sizes)}: give one of them; ratio and large are of two sizes"
        )
    if not isinstance(sizes, str):
        return _checked(n, finite_array("sizes", sizes, (None,)))
    if sizes.startswith(FROM_FILE):
        return _checked(n, _from_file(sizes.removeprefix(FROM_FILE)))
    check_count(n, None)
    return _checked(n, SizeDistribution.of(sizes).draw(n, seed))


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


def _short_form(n: int, seed: int, ratio: float | None, large: float) -> Array:
    check_bidisperse(n, seed, 1.0, large)
    if ratio is None:
        ratio = float(defaults("sp")["ratio"])
    elif not is_number(ratio) or not 1 <= ratio <= LARGEST_RATIO:
        raise InputError(f"ratio = {ratio!r}: large over small diameter must be a number from 1 to {LARGEST_RATIO:g}")
    small, many = 2 / (1 + ratio), round(large * n)
    return np.repeat([small, ratio * small], [n - many, many])


def _from_file(path: str) -> Array:
    try:
        words = Path(path).read_text(encoding="utf-8").replace(",", " ").split()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"sizes = '{FROM_FILE}{path}': {reason}; name a text file of diameters") from None
    found = []
    for word in words:
        try:
            found.append(float(word))
        except ValueError:
            raise InputError(
                f"sizes = '{FROM_FILE}{path}': {word[:40]!r} is no number; write diameters, one a line"
            ) from None
    return finite_array("sizes", found, (None,))


def _checked(n: int, diameters: Array) -> Array:
    if len(diameters) != n:
        remedy = f"give n = {len(diameters)}" if len(diameters) >= 2 else "give 2 or more"
        raise InputError(f"sizes hold {len(diameters)} diameters for n = {n} disks: {remedy}")
    check_count(n, None)
    check_positive("sizes", diameters)
    spread = diameters.max() / diameters.min()
    if spread > WIDEST_RATIO:
        raise InputError(
            f"sizes from {diameters.min():.6g} to {diameters.max():.6g}: the largest may have {WIDEST_RATIO:g} times "
            "the smallest diameter; leave out the ends or take a smaller width"
        )
    return diameters


def shown_sizes(sizes: Sizes | float) -> str:
    """Sizes as words for a message: a name or number as it is, an array by its length."""
    return repr(sizes) if isinstance(sizes, str | float | int) else f"{np.size(np.asarray(sizes))} diameters"

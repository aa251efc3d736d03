"""Mean spectra: G*(omega) of packings, a mean with band and table for each kind of packings.

G* is that of one direction, by default G*_xy, for simple shear along x of the box. A small packing is anisotropic, so
the static modulus averaged over directions, which `jamlab.measure` calls g, stands beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from jamlab.arguments.choices import Direction, SpectrumMethod
from jamlab.arrays import Array, ArrayLike
from jamlab.checks import checked
from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.elasticity import linear_response, mean_shear_modulus
from jamlab.mechanics.like_packings import check_distinct, group_by_kind
from jamlab.mechanics.negative_moduli import warn_of_negative_rows
from jamlab.packing.kinds import MODELS
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LABEL, drawn
from jamlab.plotting.palette import COLOURS, ordered_colours
from jamlab.rheology.complex_modulus import ComplexModulus, index_of, linear_modulus
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.spectra_of_table import spectra_of_table
from jamlab.statistics.rows_of_one_kind import Campaign, DataFrame, Select

if TYPE_CHECKING:
    import pandas as pd

LIMITS = ("g0", "eta0", "eta_inf")


@dataclass(frozen=True)
class MeanSpectrum(Result):
    """G*(omega) of packings of one kind: means over packings.

    Attributes:
        kind: what the packings have in common, and what tells them from other kinds.
        omega: (m,) angular frequencies, 1/tau_1.
        storage: (m,) G' along `direction`.
        loss: (m,) G''.
        error_bound: (m,) bound of the larger of the relative errors of both, by rounding and method.
        storage_stderr: (m,) standard error of `storage` over packings; nan of one packing.
        loss_stderr: (m,) the same of `loss`.
        spectra: `ComplexModulus` of each packing.
        packings: table of a row for each packing: `packing`, its number among those given; g0, eta0, eta_inf as in
            `jamlab.complex_modulus`; g, static modulus, mean over directions, nan of a campaign; `method`; `converged`,
            whether it is at a minimum.
        units: "k" or "eps", of all packings.
        unit: unit of stress, for labels.

    Example:
        >>> (found,) = jamlab.mean_spectra([jamlab.pack(16, 1e-2, seed) for seed in (1, 2)], [1e-3, 1.0])
        >>> found.kind, len(found.spectra), list(found.packings)
        ('disks, p = 0.01 k', 2, ['packing', 'g0', 'eta0', 'eta_inf', 'g', 'method', 'converged'])
    """

    _rows = ("omega", "storage", "loss", "error_bound", "storage_stderr", "loss_stderr")

    kind: str
    omega: Array
    storage: Array
    loss: Array
    error_bound: Array
    storage_stderr: Array
    loss_stderr: Array
    spectra: tuple[ComplexModulus, ...] = field(repr=False)
    packings: pd.DataFrame = field(repr=False)
    units: str
    unit: str = field(default="", repr=False)

    @property
    def method(self) -> str:
        """Solvers used."""
        return ", ".join(sorted({each.method for each in self.spectra}))

    @property
    def direction(self) -> Direction:
        """Direction of shear, as in `jamlab.complex_modulus`."""
        return self.spectra[0].direction

    @classmethod
    def _of(
        cls, kind: str, spectra: list[ComplexModulus], rows: Mapping[str, Any], units: str, unit: str
    ) -> MeanSpectrum:
        """Average spectra of packings; `rows`: columns of `packings` beside those that spectra have."""
        import pandas as pd

        curves = {name: np.array([getattr(each, name) for each in spectra]) for name in ("storage", "loss")}
        count, unknown = len(spectra), np.full(len(spectra[0].omega), np.nan)
        spread = {
            f"{name}_stderr": values.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else unknown
            for name, values in curves.items()
        }
        found = {name: [getattr(each, name) for each in spectra] for name in (*LIMITS, "method")}
        columns = ("packing", *LIMITS, "g", "method", "converged")
        return cls(
            kind=kind,
            omega=spectra[0].omega,
            error_bound=np.mean([each.error_bound for each in spectra], axis=0),
            spectra=tuple(spectra),
            packings=pd.DataFrame({name: {**found, **rows}[name] for name in columns}),
            units=units,
            unit=unit,
            **{name: values.mean(axis=0) for name, values in curves.items()},
            **spread,
        )

    def band(self, name: str) -> tuple[Array, Array, Array]:
        """Mean of "storage" or "loss", and mean minus and plus the standard error; the band of one packing has no
        width."""
        mean, spread = getattr(self, name), np.nan_to_num(getattr(self, f"{name}_stderr"))
        return mean, mean - spread, mean + spread


@dataclass(frozen=True)
class MeanSpectra(Result):
    """Mean G*(omega) of each kind of packings: a sequence of `MeanSpectrum`.

    Attributes:
        means: one for each kind, in the order in which the kinds were given.
        damping: drag law.

    Example:
        >>> packings = [jamlab.pack(16, pressure, 1) for pressure in (1e-2, 1e-3)]
        >>> found = jamlab.mean_spectra(packings, [1e-3, 1.0], prestress=False)
        >>> [spectrum.kind for spectrum in found]
        ['disks, p = 0.01 k', 'disks, p = 0.001 k']
        >>> found.to_dataframe().groupby("kind")["storage"].min().to_list() == [s.storage.min() for s in found][::-1]
        True
    """

    means: tuple[MeanSpectrum, ...]
    damping: DragLaw

    def __iter__(self) -> Iterator[MeanSpectrum]:
        return iter(self.means)

    def __len__(self) -> int:
        return len(self.means)

    def __getitem__(self, k: int) -> MeanSpectrum:
        return self.means[k]

    def _columns(self) -> dict[str, Any]:
        """A row for each kind and frequency."""
        counts = [len(each.omega) for each in self]
        columns = {"kind": np.repeat([each.kind for each in self], counts)}
        columns["packings"] = np.repeat([len(each.spectra) for each in self], counts)
        return columns | {name: np.concatenate([getattr(each, name) for each in self]) for name in MeanSpectrum._rows}

    @drawn("Line2D, of all curves")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw G' (solid, filled) and G'' (dashed, open) of each kind over frequency: means, and bands of one standard
        error.

        >>> ax = jamlab.mean_spectra([jamlab.pack(16, 1e-2, seed) for seed in (1, 2)], [1e-3, 1.0]).plot()
        """
        from jamlab.plotting.axes import legend_below
        from jamlab.plotting.curves import draw_modulus, label_modulus

        several, before = len(self) > 1, len(axes.lines)
        colours = COLOURS[: len(self)] if len(self) <= len(COLOURS) else ordered_colours(len(self))
        for colour, s in zip(colours, self, strict=True):
            look = {"label": s.kind if several else str(self.damping), "color": colour, **style}
            draw_modulus(axes, s.omega, s.band("storage"), s.band("loss"), index=index_of(s.direction), **look)
        unit, index = " or ".join(dict.fromkeys(s.unit for s in self)), index_of(self[0].direction)
        label_modulus(axes, unit, legend=not several, index=index)
        if several:
            axes.set_title(f"{self.damping}; $G'$ filled, $G''$ open", fontsize=LABEL)
            # top of a legend below the label of the axis, in heights of the axes
            legend_below(axes, axes.lines[before::2], bbox_to_anchor=(0.5, -0.17))


@overload
def mean_spectra(
    packings: Packing | Sequence[Packing],
    omega: ArrayLike,
    damping: DragLaw | None = None,
    *,
    direction: Direction = "simple",
    prestress: bool = True,
    method: SpectrumMethod = "auto",
) -> MeanSpectra: ...
@overload
def mean_spectra(packings: Campaign | DataFrame, *, select: Select | None = None) -> MeanSpectra: ...
@checked
def mean_spectra(
    packings: Packing | Sequence[Packing] | Campaign | DataFrame,
    omega: ArrayLike | None = None,
    damping: DragLaw | None = None,
    *,
    direction: Direction = "simple",
    prestress: bool = True,
    method: SpectrumMethod = "auto",
    select: Select | None = None,
) -> MeanSpectra:
    """Average G*(omega) over packings, for each kind of packings by itself.

    Packings are of one kind if they differ in nothing but their random start: their particles, sizes, force law, units,
    ensemble, walls and, to 1e-3, their pressure are the same. Others are never averaged.

    Args:
        packings: one or several, at energy minima. Or a campaign, or its table "spectra": the spectra in it, a mean
            for each target pressure, of packings that converged; the arguments that follow stay at their defaults.
        omega: (m,) angular frequencies, 1/tau_1.
        damping: as in `jamlab.complex_modulus`, as are the arguments that follow.
        direction: of the shear; default: along x.
        prestress: False replaces contacts by unstressed springs; of disks only.
        method: solver.
        select: of a campaign or a table with packings of several kinds: columns and their values in the rows that are
            wanted, such as {"n": 128, "prestress": False, "beta": 1.0}.

    Returns:
        A `MeanSpectrum` for each kind, one after the other, with table and picture of all.

    Warns:
        JamlabWarning: static moduli are negative: packings are unstable to shear at the shape of their box.

    Raises:
        InputError: no packing, one that is given twice, or as `jamlab.complex_modulus`.
        ConvergenceError: a packing is unjammed, not at a minimum or unstable; the error says which.

    Example:
        >>> packings = [jamlab.pack(16, pressure, seed) for pressure in (1e-2, 1e-3) for seed in (1, 2)]
        >>> found = jamlab.mean_spectra(packings, [1e-3, 1.0], jamlab.StokesDrag(), prestress=False)
        >>> [(spectrum.kind, len(spectrum.spectra)) for spectrum in found]
        [('disks, p = 0.01 k', 2), ('disks, p = 0.001 k', 2)]
    """
    if isinstance(packings, Campaign | DataFrame):
        if omega is not None or damping or (direction, prestress, method) != ("simple", True, "auto"):
            raise InputError("a campaign has its spectra: leave out how they are computed, and choose by select=")
        return _of_table(packings, select)
    if select is not None:
        raise InputError("select: applies to a campaign, or its table; choose among packings by hand")
    if omega is None:
        raise InputError("omega is missing: give angular frequencies")
    packings = [packings] if isinstance(packings, Packing) else packings
    if not packings:
        raise InputError("packings: give one or more")
    law = damping or ContactDamping()
    means = []
    for kind, members in group_by_kind(packings).items():
        own = {k: packings[k] for k in members}
        check_distinct(own)
        how: dict[str, Any] = {"direction": direction, "prestress": prestress, "method": method}
        spectra = [_one(f"packing {k}: " * (len(packings) > 1), p, omega, law, **how) for k, p in own.items()]
        tensors = [linear_response(p, prestress=prestress).relaxed for p in own.values()]
        g = np.array([mean_shear_modulus(p, tensor) for p, tensor in zip(own.values(), tensors, strict=True)])
        rows = {"packing": list(own), "g": g, "converged": [p.converged for p in own.values()]}
        first = packings[members[0]]
        means.append(MeanSpectrum._of(kind, spectra, rows, first.units, first.unit_names.stress))
    along = (
        "G_xy"
        if direction == "simple"
        else f"G along {direction if isinstance(direction, str) else f'{np.degrees(direction):.4g} degrees'}"
    )
    moduli = {title: np.concatenate([m.packings[name] for m in means]) for title, name in ((along, "g0"), ("G", "g"))}
    warn_of_negative_rows(moduli, "packings")
    return MeanSpectra(tuple(means), law)


def _of_table(source: Campaign | DataFrame, select: Select | None) -> MeanSpectra:
    """Means of the spectra in the table of a campaign. It has no static modulus over all directions, g."""
    found = spectra_of_table(source, select)
    means = []
    for pressure, spectra in found.by_pressure.items():
        name = f"{MODELS.get(found.model).particles}, p = {pressure:.4g} {found.unit}".rstrip()
        rows = {"packing": range(len(spectra)), "g": np.nan, "converged": True}
        means.append(MeanSpectrum._of(name, spectra, rows, found.units, found.unit))
    warn_of_negative_rows({"G_xy": np.concatenate([m.packings["g0"] for m in means])}, "packings")
    return MeanSpectra(tuple(means), found.damping)


def _one(name: str, packing: Packing, omega: ArrayLike, law: DragLaw, **how: Any) -> ComplexModulus:
    try:
        return linear_modulus(packing, omega, law, **how)
    except ConvergenceError as error:
        raise ConvergenceError(f"{name}{error}") from error

"""Quantities of every frame of a trajectory, as an analysis of MDAnalysis with its parallel backends."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from MDAnalysis.analysis.base import AnalysisBase
from MDAnalysis.analysis.results import ResultsGroup
from numpy.typing import ArrayLike

from jamlab.checks import check_choice, checked
from jamlab.errors import InputError, JamlabError
from jamlab.measure import QUANTITIES, measure
from jamlab.trajectories.foreign_law_and_sizes import Radii
from jamlab.trajectories.from_universe import UniverseFrames


class PackingAnalysis(AnalysisBase):  # type: ignore[misc]
    """Measure the frames of a trajectory, as `jamlab.measure` does those of `jamlab.from_universe(u)`.

    `PackingAnalysis(u, ("rho", "z")).run(step=10).results.rho` is (n_frames,) float64. With
    `run(backend="multiprocessing", n_workers=4)` processes share the frames; so they do with "dask", which in a script
    needs `if __name__ == "__main__":`. Frames are float32: moduli are refused unless `relaxed=True`, and z and rattlers
    are nan where rounding could open or close a contact.

    Args:
        u: Universe, or an AtomGroup of it.
        quantities: of `jamlab.measure`, and psi_6, psi_6_overall.
        radii, units, params, box, relaxed: as in `jamlab.from_universe`.
        verbose: show a progress bar.

    Raises:
        InputError: unknown quantities, moduli of frames that are not relaxed; in `run`, as in `jamlab.from_universe`.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> u = jamlab.universe(jamlab.compress(onset, to=0.9, step=0.02))
        >>> a = jamlab.PackingAnalysis(u, ("rho", "psi_6")).run()
        >>> a.results.rho.shape == (u.trajectory.n_frames,)
        True
    """

    _analysis_algorithm_is_parallelizable = True

    @classmethod
    def get_supported_backends(cls) -> tuple[str, ...]:
        """Names for `run(backend=...)`."""
        return ("serial", "multiprocessing", "dask")

    @checked
    def __init__(
        self,
        u: Any,
        quantities: str | Iterable[str] = ("rho", "z"),
        *,
        radii: Radii = None,
        units: str | None = None,
        params: Mapping[str, Any] | None = None,
        box: ArrayLike | None = None,
        relaxed: bool = False,
        verbose: bool = False,
    ) -> None:
        self._frames = UniverseFrames(u, radii, units, params, box, relaxed)
        super().__init__(self._frames.trajectory, verbose=verbose)
        self._quantities = (quantities,) if isinstance(quantities, str) else tuple(quantities)
        for name in self._quantities:
            check_choice("quantity", name, QUANTITIES)
            if name in ("g", "g_x", "b") and not relaxed:
                raise InputError(f"{name} belongs to an energy minimum, and frames are float32: say relaxed=True")

    def _prepare(self) -> None:
        for name in self._quantities:
            self.results[name] = np.full(self.n_frames, np.nan)

    def _single_frame(self) -> None:
        packing = self._frames.packing()
        try:
            found = measure(packing, self._quantities)
        except JamlabError as error:
            raise type(error)(f"frame {self._ts.frame}: {error}") from error
        for name, value in found.items():
            self.results[name][self._frame_index] = value

    def _get_aggregator(self) -> ResultsGroup:
        return ResultsGroup(lookup=dict.fromkeys(self._quantities, ResultsGroup.ndarray_hstack))

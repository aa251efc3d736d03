"""Write spectra to a picture or an HDF5 file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from jamlab.errors import InputError
from jamlab.figures.html_page import save_png
from jamlab.figures.packing_pictures import modulus_figure
from jamlab.packing.atomic_file import atomic_file, check_target
from jamlab.rheology.damping import Damping
from jamlab.rheology.mean_spectrum import COLUMNS, LIMITS, Spectra


def check_output(path: Path) -> None:
    """Check that a path has a known suffix and can be written.

    Raises:
        InputError: the suffix is neither .png nor .h5.
        StorageError: see `jamlab.packing.atomic_file.check_target`.
    """
    if path.suffix not in (".png", ".h5"):
        raise InputError(f"cannot tell what to write to {path}: end its name in .png (picture) or .h5 (numbers)")
    check_target(path)


def save(curves: Sequence[Spectra], damping: Damping, path: Path) -> None:
    """Write a picture (.png) or an HDF5 file (.h5), all or nothing.

    HDF5: omega (m,), storage, loss, error (packings, m), g0, g, eta0, eta_inf, converged (packings,); attributes
    damping, units, method, label, shear. Several curves: groups curve_1, curve_2, ... that hold the same. Times are in
    tau_1, moduli in the packing's unit of stress; all are for shear along x of the box but g, the mean over directions.
    """
    if path.suffix == ".png":
        several = len(curves) > 1
        named = {spectra.label if several else str(damping): spectra for spectra in curves}
        save_png(
            modulus_figure(
                named, " or ".join(dict.fromkeys(spectra.unit for spectra in curves)), str(damping) if several else ""
            ),
            path,
        )
        return
    with atomic_file(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update({"schema": "jamlab-spectra", "version": 1, "damping": repr(damping)})
        for k, spectra in enumerate(curves, 1):
            _fill(file if len(curves) == 1 else file.create_group(f"curve_{k}"), spectra)


def _fill(group: Any, spectra: Spectra) -> None:
    group.attrs.update({"units": spectra.units, "method": spectra.method, "label": spectra.label})
    group.attrs["shear"] = "storage, loss, g0, eta0, eta_inf: shear along x of the box; g: mean over directions"
    group["omega"] = spectra.omega
    for column in COLUMNS:
        group[column] = spectra.all_of(column)
    for limit in LIMITS:
        group[limit] = np.array([getattr(s, limit) for s in spectra.members])
    group["g"] = np.array(spectra.g)
    group["converged"] = np.array(spectra.converged)

"""Write spectra to a picture or an HDF5 file."""

from pathlib import Path

import h5py
import numpy as np

from jamlab.errors import InputError
from jamlab.figures.html_page import save_png
from jamlab.figures.packing_pictures import modulus_figure
from jamlab.packing.atomic_file import atomic_file, check_target
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


def save(spectra: Spectra, name: str, path: Path) -> None:
    """Write a picture (.png) or an HDF5 file (.h5), all or nothing.

    HDF5: omega (m,), storage, loss, error (packings, m), g0, eta0, eta_inf, converged (packings,); attributes damping,
    units, method. Times are in tau_1, moduli in the packing's unit of stress.
    """
    if path.suffix == ".png":
        save_png(modulus_figure({name: spectra}, "k" if spectra.units == "k" else r"$\epsilon/\sigma^2$"), path)
        return
    with atomic_file(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update({"schema": "jamlab-spectra", "version": 1, "damping": name, "units": spectra.units})
        file.attrs["method"] = spectra.method
        file["omega"] = spectra.omega
        for column in COLUMNS:
            file[column] = spectra.all_of(column)
        for limit in LIMITS:
            file[limit] = np.array([getattr(s, limit) for s in spectra.members])
        file["converged"] = np.array(spectra.converged)

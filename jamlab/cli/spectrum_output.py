"""Write spectra to a picture, a table or an HDF5 file; the ending of the name says which.

A table holds one curve: frequency, storage and loss modulus under the names by which pyRheo and rheojax know them,
separated by commas (.csv) or tabs (.tsv). The window of pyRheo takes tabs alone; rheojax finds separator and columns by
itself, but takes a further column whose name holds one of these for the column itself.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd

from jamlab.errors import InputError
from jamlab.figures.packing_pictures import modulus_figure
from jamlab.figures.save_picture import save_picture
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import Damping
from jamlab.rheology.mean_spectrum import COLUMNS, LIMITS, Spectra, group_packings
from jamlab.storage.atomic_file import atomic_file, check_target
from jamlab.storage.file_endings import FORMATS, check_ending

PICTURES = FORMATS["picture"].endings
_KINDS = ("picture", "table", "tabs", "packings")
_SEPARATOR = {".csv": ",", ".tsv": "\t"}
HEADERS = ("Angular Frequency", "Storage Modulus", "Loss Modulus")


def check_output(path: Path, sources: Sequence[Path] = (), *, replace: bool = True) -> None:
    """Check that a path has a known suffix and can be written; a source never, another file only with `replace`."""
    check_ending(path, *_KINDS)
    if not path.suffix:
        raise InputError(
            f"cannot tell what to write to {path}: end its name in {', '.join(PICTURES)} (picture), "
            ".csv or .tsv (frequency, G' and G'') or .h5 (all numbers)"
        )
    check_target(path, *sources, replace=replace)


def check_one_kind(path: Path, packings: Sequence[Packing]) -> None:
    """Refuse packings of several kinds, which have a curve each, where a table holds one curve."""
    if path.suffix.lower() in _SEPARATOR and (kinds := len(group_packings(packings))) > 1:
        raise InputError(
            f"{path} holds one curve, and these are packings of {kinds} kinds: give those of one kind, or write .h5"
        )


def save(curves: Sequence[Spectra], damping: Damping, path: Path) -> None:
    """Write a picture (.png, .pdf, .svg), a table (.csv, .tsv) or an HDF5 file (.h5), all or nothing.

    Table: frequency, mean storage and loss modulus of one curve, under `HEADERS`.

    HDF5: omega (m,), storage, loss, error (packings, m), g0, g, eta0, eta_inf, converged (packings,); attributes
    damping, units, method, label, shear. Several curves: groups curve_1, curve_2, ... that hold the same. Times are in
    tau_1, moduli in the packing's unit of stress; all are for shear along x of the box but g, the mean over directions.
    """
    kind = path.suffix.lower()
    if kind in PICTURES:
        several = len(curves) > 1
        named = {spectra.label if several else str(damping): spectra for spectra in curves}
        unit = " or ".join(dict.fromkeys(spectra.unit for spectra in curves))
        save_picture(modulus_figure(named, unit, str(damping) if several else ""), path)
    elif kind in _SEPARATOR:
        (curve,) = curves
        columns = (curve.omega, curve.band("storage")[0], curve.band("loss")[0])
        with atomic_file(path) as temporary:
            pd.DataFrame(dict(zip(HEADERS, columns, strict=True))).to_csv(temporary, sep=_SEPARATOR[kind], index=False)
    else:
        with atomic_file(path) as temporary, h5py.File(temporary, "w", locking=False) as file:
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

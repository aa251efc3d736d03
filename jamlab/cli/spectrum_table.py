"""The table of G*(omega) that commands print, with its limits."""

from typing import TYPE_CHECKING

from jamlab.cli.console import print_note, print_table
from jamlab.packing.hdf5 import NEGATIVE_G

if TYPE_CHECKING:
    from jamlab.rheology.mean_spectrum import Spectra


def print_spectra(name: str, spectra: "Spectra", every: int = 1) -> None:
    """Print G*_xy(omega) at every `every`-th frequency, below its limits and the static G averaged over directions."""
    names, rows = spectra.rows()
    print_table(name, names, rows[::every])
    print_note(
        f"G_xy = {spectra.limit('g0'):.5g}: static, for shear along x of the box, as G*; "
        f"G = {spectra.mean_g:.5g}: static, mean over directions"
    )
    if min(spectra.limit("g0"), spectra.mean_g) < 0:
        print_note(f"G {NEGATIVE_G}")
    print_note(f"eta0 = {spectra.limit('eta0'):.5g}, eta_inf = {spectra.limit('eta_inf'):.5g}")

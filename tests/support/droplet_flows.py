"""Droplets in LAMMPS under the plugin's fix overdamped."""

from collections.abc import Mapping
from typing import Any

from disk_flows import Flow

import jamlab

STOKES, CONTACT = "background 1", "drag 1 1 1"  # of the fix, both with tau_1 = 1


def droplet_commands(packing: jamlab.Packing, data: str, newton: str = "on", grid: str = "1 * 1") -> list[str]:
    """Up to where the fix comes in; `data` is a file of the packing."""
    law, reach = packing.params, packing.law.range / packing.params["delta"]
    return [
        *["units lj", "dimension 2", f"newton {newton}", "atom_modify map array sort 10 0.0", f"processors {grid}"],
        *["atom_style molecular", "fix d_a0 all property/atom d_a0", f"read_data {data} fix d_a0 NULL d_a0 nocoeff"],
        *["change_box all triclinic", "bond_style line/tension", f"bond_coeff * {law['gamma']:.17g} {law['eta']:.17g}"],
        "special_bonds lj/coul 1.0 1.0 1.0",
        f"pair_style circuloline {law['delta']:.17g} 1.5 contact {law['contact']}",
        f"pair_coeff * * {law['eps']:.17g} adhesion {law.get('adhesion', 0.0):.17g} {reach:.17g}",
        *[f"fix area all polygon/area {law['ka']:.17g} d_a0", *outline_laws(law)],
        *["neighbor 0.1 bin", "neigh_modify every 1 delay 0 check yes", "thermo 1000000", "thermo_modify norm no"],
    ]


def outline_laws(law: Mapping[str, Any]) -> list[str]:
    """Fixes of bending and of perimeters, where they act."""
    values = {name: law.get(name, 0.0) for name in ("kappa", "kp", "kl")}
    found = []
    if values["kappa"]:
        found += [f"fix bend all polygon/bending {values['kappa']:.17g} {law.get('theta0', 1.0):.17g}"]
    if values["kp"] or values["kl"]:
        found += [f"fix perimeter all polygon/perimeter {values['kp']:.17g} {values['kl']:.17g} {law['p0']:.17g} d_a0"]
    return found


class DropletFlow(Flow):
    """One LAMMPS with one packing of droplets; `drag` is that of the fix."""

    def lines(self, data: str, drag: str, newton: str) -> list[str]:
        return droplet_commands(self.packing, data, newton)

    def fix(self, settings: str, drag: str) -> str:
        return f"{settings} {drag}"

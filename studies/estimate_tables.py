"""Measure the table behind `choose`, `scene` and `estimate`: ways to make packings."""

import json
import lzma
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from jamlab.engine.deck_defaults import defaults
from jamlab.errors import JamlabError
from jamlab.estimates import ways
from jamlab.estimates.ways import ONSET, WAY_QUANTITIES, EnsembleWay, N
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.packing.packing import Packing
from jamlab.storage.atomic_file import atomic_file
from studies.papers.statements import paper
from studies.tables import Task, measure

# rho: from the onsets to confluence, closer where z of droplets reaches 6 and lines between levels bend most
LEVELS = (0.84, 0.85, 0.86, 0.88, 0.90, 0.92, 0.94, 0.96, 0.97, 0.98)
FEW_VERTICES = (8, 11)
OTHER_FORM = "segment/smooth"  # the third, "segment", has no minima to end in
LOOSE = 1e-6  # largest force: 1e-8 saves a third of what it saves, 1e-5 no more
SEEDS = range(20_001, 20_201)  # none that a test, a campaign or `jamlab.estimate` uses
_RARE = 4  # one in so many seeds has fewer vertices, another form, looser minima and fewer particles: these save less

Groups = Callable[[int], Sequence[Sequence[EnsembleWay]]]


def groups(seed: int) -> list[tuple[EnsembleWay, ...]]:
    """Ways to make packings of one seed: the first of a group is made by itself, and carries the others. Droplets from
    the start take most of the time, and stand for one seed in two."""
    nv, rare = ways.default_vertices(), seed % _RARE == 1
    carried = [EnsembleWay("carried", N, nv)]
    if rare:
        carried += [EnsembleWay("carried", N, FEW_VERTICES), EnsembleWay("carried", N, nv, OTHER_FORM)]
    found: list[tuple[EnsembleWay, ...]] = [(EnsembleWay("disks", N), *carried)]
    if seed % 2:
        found.append((EnsembleWay("droplets", N, nv),))
    if rare:
        found.append(
            (EnsembleWay("disks", N, force_tolerance=LOOSE), EnsembleWay("carried", N, nv, force_tolerance=LOOSE))
        )
        found += [(EnsembleWay("disks", 32), EnsembleWay("carried", 32, nv)), (EnsembleWay("droplets", 32, nv),)]
    return found


def make_table(
    out: Path, seeds: range = SEEDS, *, groups: Groups = groups, levels: Sequence[float] = LEVELS, **how: Any
) -> ways.Ways:
    """Measure the table seed by seed, and write it; a run resumes where it stopped. Levels of rho ascend; levels
    of droplets carried beyond 0.88 must include 0.88. `how`: see `measure`."""
    law = {k: v for k, v in defaults("dp").items() if k != "longest_edge"}
    facts = {"seconds": "CPU time of one core from the random start to rho", "step": ways.WAYS.step, "parameters": law}
    tasks = {f"seed {seed}": partial(_rows, seed, groups(seed), levels) for seed in seeds}
    measure_packed(out, tasks, facts, **how)
    return ways.read_ways(out)


def measure_packed(out: Path, tasks: Mapping[str, Task], facts: Mapping[str, Any], **how: Any) -> None:
    """Measure a table into a CSV file beside, from which a run resumes, and pack it as `jamlab.estimates` reads it,
    below a first line of what all rows share."""
    path = measure(out.parent, out.name.partition(".")[0], tasks, **how)
    with atomic_file(out) as temporary:
        first = f"# {json.dumps({'facts': dict(facts)})}\n".encode()
        temporary.write_bytes(lzma.compress(first + path.read_bytes()))


def _rows(seed: int, groups: Sequence[Sequence[EnsembleWay]], levels: Sequence[float]) -> Iterator[dict[str, Any]]:
    """Rows of a seed: droplets are handed over to at every level up to 0.88, and compressed from there on."""
    for group in groups:
        first = _Chain(group[0], seed)
        carried: dict[EnsembleWay, _Chain] = {}
        for rho in levels:
            first.advance(rho)
            yield first.row(rho)
            for way in group[1:]:
                if rho <= paper("B5-z-parts"):
                    carried[way] = _Chain(way, seed, first)
                else:
                    carried[way].advance(rho)
                yield carried[way].row(rho)


class _Chain:
    """A packing on its way up, with the CPU time that it took; without one after a failure."""

    def __init__(self, way: EnsembleWay, seed: int, disks: "_Chain | None" = None) -> None:
        """Jam a packing, or hand over from disks above their onset."""
        self.way, self.seed = way, seed
        self.seconds: float = disks.seconds if disks else 0.0
        self.packing: Packing | None = None
        if disks is None:
            self._timed(lambda: ways.find_onset(way, seed))
            self.onset = packing_fraction(self.packing) if self.packing else float("nan")
            return
        self.onset, state = disks.onset, disks.packing
        if state is not None and packing_fraction(state) > self.onset + 1e-9:
            self._timed(lambda: ways.hand_over(way, state))

    def advance(self, rho: float) -> None:
        packing = self.packing
        if packing is not None and not (rho <= self.onset):
            self._timed(lambda: ways.bring_on(self.way, packing, rho))

    def row(self, rho: float) -> dict[str, Any]:
        found = dict.fromkeys(WAY_QUANTITIES, float("nan"))
        if self.packing is not None and rho > self.onset:
            found = ways.values_at(self.packing, WAY_QUANTITIES)
        way = asdict(self.way) | {"nv": None if self.way.nv is None else f"{self.way.nv[0]}/{self.way.nv[1]}"}
        onset = float(self.onset) if self.way.start != "carried" else None
        return {**way, "seed": self.seed, "rho": rho, **found, ONSET: onset, "seconds": self.seconds}

    def _timed(self, make: Callable[[], Packing]) -> None:
        began = time.process_time()
        try:
            self.packing = make()
        except JamlabError:
            self.packing = None
        self.seconds += time.process_time() - began

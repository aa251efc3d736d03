"""Write reference_of_freud.json: g(r) and S(k) of equal disks as freud 3.6.1 gives them (needs `freud-analysis`).

freud computes in single precision, and takes the wavevectors with numbers from 0 on alone, which are in the file.
"""

import json
from pathlib import Path

import numpy as np

FILE = Path(__file__).with_suffix(".json")
BOXES = {"square": [[10.0, 0.0], [0.0, 10.0]], "tilted": [[10.0, 0.0], [3.0, 9.0]], "thin": [[14.0, 0.0], [-2.0, 6.0]]}
N, BINS, FARTHEST, LONGEST = 90, 25, 2.5, 9.0


def positions(box: np.ndarray) -> np.ndarray:
    """Points at random, with double precision; freud rounds them."""
    return np.random.default_rng(7).random((N, 2)) @ box


def main() -> None:
    import freud

    found = {}
    for name, rows in BOXES.items():
        box = np.array(rows)
        cell = freud.box.Box(Lx=box[0, 0], Ly=box[1, 1], xy=box[1, 0] / box[1, 1], is2D=True)
        points = cell.wrap(np.column_stack([positions(box) - 0.5 * box.sum(axis=0), np.zeros(N)]))
        pairs = freud.density.RDF(bins=BINS, r_max=FARTHEST).compute((cell, points))
        waves = freud.diffraction.StaticStructureFactorDirect(bins=30, k_max=LONGEST, num_sampled_k_points=0)
        waves.compute((cell, points))
        numbers = np.rint(np.asarray(waves.k_points)[:, :2] @ box.T / (2 * np.pi)).astype(int)
        found[name] = {
            "g": pairs.rdf.tolist(),
            "numbers": numbers.tolist(),
            "edges": waves.bin_edges.tolist(),
            "s": waves.S_k.tolist(),
        }
    FILE.write_text(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()

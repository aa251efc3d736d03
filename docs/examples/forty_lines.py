"""A rheologist's script in forty lines: moduli, G* with its collapse, and a flow curve, as figures and a table.

`python docs/examples/forty_lines.py [FOLDER]` takes about a minute on one core.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import jamlab

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
pressures, omega = [1e-2, 1e-3, 1e-4], np.logspace(-6, 2, 33)
damping = jamlab.ContactDamping(beta=1.0)

packings: dict[float, list[jamlab.Packing]] = {}
for pressure in pressures:
    packings[pressure] = [jamlab.pack(128, pressure, seed) for seed in range(1, 9)]

rows = []
for pressure, alike in packings.items():
    g = np.array([jamlab.shear_modulus(p) for p in alike])
    b, z = [jamlab.bulk_modulus(p) for p in alike], [jamlab.contacts(p).z for p in alike]
    rows.append({"p": pressure, "z": np.mean(z), "G": g.mean(), "G_stderr": g.std(ddof=1) / len(g) ** 0.5})
    rows[-1]["B"] = np.mean(b)
table = pd.DataFrame(rows)
table.to_csv(folder / "moduli.csv", index=False)
print(table.round(4).to_string(index=False))

means = [jamlab.mean_spectra(packings[pressure], omega, damping, prestress=False)[0] for pressure in pressures]
collapse = jamlab.scaling_collapse(pressures, [mean.spectra for mean in means])
print(collapse)

curve = jamlab.flow_curve(packings[1e-2][0], np.geomspace(1e-3, 1e-1, 5), damping, strain=3.0)
fit = curve.herschel_bulkley()
print(fit)

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
collapse.plot(left)
curve.plot(right)
fit.plot(right)
figure.savefig(folder / "rheology.png")

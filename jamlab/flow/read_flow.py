"""Read back the result of a flow from its file."""

from typing import Any

from jamlab.checks import checked
from jamlab.flow.creep_and_relaxation import CreepRun, StoppedFlow, StressRelaxation
from jamlab.flow.flow_curve import FlowCurve
from jamlab.flow.oscillate import Oscillation
from jamlab.flow.quasistatic_run import QuasistaticShear
from jamlab.flow.run import read_result
from jamlab.flow.shear import ShearRun
from jamlab.storage.verified_file import FilePath

StoredFlow = ShearRun | FlowCurve | Oscillation | CreepRun | StoppedFlow


@checked
def read_flow(path: FilePath) -> StoredFlow:
    """Read a result of `shear`, `flow_curve`, `oscillate`, `creep` or `relax_stress`; `jamlab.read` reads its packings.

    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=1.0, strain=0.05, rows=5, path="run.h5")
    >>> bool(np.all(jamlab.read_flow("run.h5").stress == r.stress))
    True

    Raises:
        StorageError: no such file, or a file without a flow.
    """
    found: Any = read_result(
        path, ShearRun, QuasistaticShear, FlowCurve, Oscillation, CreepRun, StoppedFlow, StressRelaxation
    )
    return found  # type: ignore[no-any-return]

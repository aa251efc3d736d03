"""`jamlab creep`: strain in time under a constant stress."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.flow_options import Accuracy, Alpha, Background, Beta, Csv, Packing, Plot, Tau
from jamlab.cli.flow_output import expect_files, give
from jamlab.cli.options import Frame, Json, Out
from jamlab.cli.progress import share_bar

_COLUMNS = {"time": ".5g", "strain": ".5g", "compliance": ".6g", "rate": ".4g", "elastic_stress": ".5g"}
_COLUMNS |= {"viscous_stress": ".4g", "pressure": ".5g", "contacts": ".0f"}


def creep(
    file: Packing,
    stress: Annotated[float, typer.Option(help="Stress beside the residual one, in units of the packing.")],
    duration: Annotated[float, typer.Option(help="Time, tau_1.")],
    largest_strain: Annotated[float, typer.Option(help="Strain at which it ends early.")] = 10.0,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    tolerance: Accuracy = 1e-3,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("creep.h5"),
    plot: Plot = None,
    csv: Csv = None,
    as_json: Json = False,
) -> None:
    """Load a packing with a shear stress and follow its strain; says whether it comes to rest, creeps on or flows."""
    from jamlab.flow.creep import creep as run
    from jamlab.packing.hdf5 import read
    from jamlab.rheology.damping import ContactDamping

    expect_files(file, out, plot, csv)
    law = ContactDamping(beta=beta, tau=tau, alpha=alpha)
    with share_bar("creep") as progress:
        how = {"tolerance": tolerance, "background": background or 0.0, "largest_strain": largest_strain}
        found = run(read(file, frame), stress, duration, law, out=out, progress=progress, **how)
    give(found, _COLUMNS, [f"residual stress {found.residual:.5g}"], out, plot, csv, as_json)

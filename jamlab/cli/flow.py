"""Commands of flow in time: `jamlab shear`, `flow-curve`, `oscillate`, `creep`, `relax-stress`.

All share the options of drag, accuracy and files, and how they print and write what they found.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from jamlab.cli.console import print_json, print_note, print_stage, print_table, progress_bar
from jamlab.cli.interruption import describe_kept
from jamlab.cli.options import Alpha, Beta, EtaF, Force, Frame, Json, Out, Stokes, Tau, drag_law, written_as
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_target
from jamlab.storage.table_file import write_table

if TYPE_CHECKING:
    from jamlab.flow.read_flow import Flow
    from jamlab.packing.packing import Packing
    from jamlab.rheology.damping import Damping


T = TypeVar("T")

File = Annotated[Path, typer.Argument(help="HDF5 file with a packing of disks or droplets.")]
Tolerance = Annotated[
    float | None,
    typer.Option(help="Relative error of velocities in a step; flow by a rate: 1e-2, small strains: 1e-3."),
]
Background = Annotated[
    float | None,
    typer.Option(
        help="Background (Stokes) drag added to contact damping, k tau_1; flow by a rate: disks 1e-4, droplets 1e-2; "
        "small strains: 0."
    ),
]
Within = Annotated[float | None, typer.Option(help="Do not start if the predicted run time exceeds this, s.")]
Plot = Annotated[
    Path | None, typer.Option(help="Picture to write as well: .png, .pdf or .svg.", callback=written_as("picture"))
]
Csv = Annotated[
    Path | None, typer.Option(help="Table of all rows to write as well, .csv.", callback=written_as("table"))
]


@dataclass(frozen=True)
class FlowRun:
    """What a flow starts from, and where its results go."""

    file: Path
    frame: int
    law: "Damping | None"  # None: quasi-static
    accuracy: dict[str, float | None]  # tolerance and background; None is left to the flow
    out: Path
    plot: Path | None
    csv: Path | None
    force: bool
    as_json: bool

    def drive(self, flow: Callable[..., T], name: str, *point: Any, **how: Any) -> T:
        """Drive the packing at a point, such as frequency and amplitude, below a bar of this name. With `force` a file
        of another run is replaced; one of the same run is gone on with."""
        from jamlab.flow.run_file import OtherRunError

        how |= {"out": self.out, **{key: value for key, value in self.accuracy.items() if value is not None}}
        while True:
            try:
                with progress_bar(name, resumed=True) as progress:
                    return flow(self.packing(), *point, self.law, progress=progress, **how)
            except OtherRunError:
                if not self.force:
                    raise
                self.out.unlink()

    def packing(self) -> "Packing":
        """Packing of the file."""
        from jamlab.packing.hdf5 import read

        return read(self.file, self.frame)

    def say_seconds(self, rates: list[float], strain: float, within: float | None, processes: int = 1) -> None:
        """Say how long flow at some rates will take, unless it is resumed; refuse what takes longer than `within`."""
        from jamlab.flow.flow_cost import cost_of_flow, require_time

        if self.out.exists():
            return
        how = {key: value for key, value in self.accuracy.items() if value is not None}
        cost = cost_of_flow(self.packing(), rates, self.law, strain=strain, **how)
        if within is not None:
            require_time(cost, within)
        seconds = cost["seconds"]
        print_stage(f"about {max(seconds.sum() / processes, seconds.max()):.2g} s")


_HEADINGS = {"rates": "rate", "normal_stress_difference": "N₁", "z_all": "z all"}
_LINES = 15  # of a table on the screen


def expect_files(run: FlowRun) -> FlowRun:
    """Refuse, before anything runs, what cannot be written at the end."""
    out = run.out
    check_target(out, run.file)
    for path in (run.plot, run.csv):
        if path is not None:
            check_target(path, run.file, out, replace=run.force)
    kept = f"kept {out} as it was last saved; the same command goes on from there"
    describe_kept(lambda: kept if out.exists() else "nothing was written")
    return run


def give(run: FlowRun, found: "Flow", columns: Mapping[str, str], *notes: str) -> None:
    """Write picture and table of a result that is in its file already, and print columns in formats, with notes."""
    if run.plot is not None:
        from matplotlib.figure import Figure

        from jamlab.figures.save_picture import save_picture
        from jamlab.plotting.drawable import CURVES

        figure = Figure(figsize=CURVES, layout="constrained")
        found.plot(figure.subplots())
        save_picture(figure, run.plot)
    if run.csv is not None:
        import pandas as pd

        write_table(pd.DataFrame(_rows(found)), run.csv)
    if run.as_json:
        content: dict[str, Any] = {name: values.tolist() for name, values in _rows(found).items()}
        content["imbalance"] = getattr(found.imbalance, "tolist", lambda: found.imbalance)()
        plain = {f.name: getattr(found, f.name) for f in fields(found)}
        content |= {name: value for name, value in plain.items() if isinstance(value, bool | int | float | str)}
        print_json(content | {"conclusion": found.conclusion, "out": str(run.out), "drag": found.describe()})
        return
    table = {name: values for name in columns if (values := _column(found, name)) is not None}
    count = len(next(iter(table.values())))
    shown = sorted({round(k * (count - 1) / (_LINES - 1)) for k in range(_LINES)})
    lines = [[f"{values[k]:{columns[name]}}" for name, values in table.items()] for k in shown]
    print_table(found.describe(), [_HEADINGS.get(name, name.replace("_", " ")) for name in table], lines)
    for note in (*notes, found.conclusion, f"unit of stress {found.unit}, of time tau_1; wrote {run.out}"):
        print_note(note)


def _rows(found: "Flow") -> dict[str, Any]:
    """Arrays of a result that have one value a row, the first of them first, and what of energy is not balanced."""
    arrays = {f.name: getattr(found, f.name) for f in fields(found)}
    derived = ("compliance", "modulus", "finished", "energy_gap", "z_all")
    arrays |= {name: _column(found, name) for name in derived}
    arrays = {name: value for name, value in arrays.items() if getattr(value, "ndim", 0) == 1}
    count = len(next(iter(arrays.values())))
    return {name: value for name, value in arrays.items() if len(value) == count}


def _column(found: "Flow", name: str) -> Any:
    """Values of a name; None if this result has none, as G(t) of a flow that was stopped."""
    try:
        return getattr(found, name, None)
    except InputError:
        return None


_SHEAR_COLUMNS = {"strain": ".4g", "time": ".5g", "stress": ".5g", "elastic_stress": ".5g", "viscous_stress": ".4g"}
_SHEAR_COLUMNS |= {"pressure": ".5g", "normal_stress_difference": ".4g", "dissipation": ".4g", "z_all": ".3f"}


def shear(
    file: File,
    rate: Annotated[float, typer.Option(help="Rate of shear, 1/tau_1; 0: quasi-static.")],
    strain: Annotated[float, typer.Option(help="Strain at the end.")] = 1.0,
    step: Annotated[float | None, typer.Option(help="Rate 0: strain between two minima; default 1e-4.")] = None,
    rows: Annotated[int | None, typer.Option(help="Rows of the result, but at rate 0; default 200.")] = None,
    frames: Annotated[float | None, typer.Option(help="Strain between two packings that are kept.")] = None,
    within: Within = None,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    tolerance: Tolerance = None,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("shear.h5"),
    plot: Plot = None,
    csv: Csv = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Shear a packing at a constant rate, without inertia; interrupted runs resume from the output file."""
    from jamlab.flow.shear import shear as flow

    # options of drag have no say in quasi-static shear
    law = drag_law(stokes, beta, alpha, tau, eta_f) if rate != 0 else None
    accuracy = {"tolerance": tolerance, "background": background} if rate != 0 else {}
    run = expect_files(FlowRun(file, frame, law, accuracy, out, plot, csv, force, as_json))
    if rate > 0:
        run.say_seconds([rate], strain, within)
    found = run.drive(flow, "shear", rate, strain, step=step, rows=rows, frames=frames)
    note = f"plastic events seen: {found.plastic_events}; {len(found.frames)} packings; {found.steps} steps"
    give(run, found, _SHEAR_COLUMNS, note)


_MEANS = {"rates": ".4g", "stress": ".5g", "stress_error": ".1g", "pressure": ".5g", "pressure_error": ".1g"}
_MEANS |= {"normal_stress_difference": ".4g", "dissipation": ".4g", "z_all": ".4g", "plastic_events": ".3g"}
_MEANS |= {"imbalance": ".1e", "finished": ""}


def flow_curve(
    file: File,
    rates: Annotated[list[float], typer.Option("--rate", help="Rate of shear, 1/tau_1; give it several times.")],
    strain: Annotated[float, typer.Option(help="Strain of the average at each rate.")] = 4.0,
    discard: Annotated[float, typer.Option(help="Transient strain discarded before averaging.")] = 1.0,
    processes: Annotated[int, typer.Option(help="Rates run in parallel, one core each.")] = 1,
    within: Within = None,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    tolerance: Tolerance = None,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("flow-curve.h5"),
    plot: Plot = None,
    csv: Csv = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Measure steady flow at several rates, with a Herschel-Bulkley fit; rates in the file are not run again."""
    from jamlab.errors import JamlabError
    from jamlab.flow.flow_curve import flow_curve as flow

    law, accuracy = drag_law(stokes, beta, alpha, tau, eta_f), {"tolerance": tolerance, "background": background}
    run = expect_files(FlowRun(file, frame, law, accuracy, out, plot, csv, force, as_json))
    run.say_seconds(rates, strain + discard, within, processes)
    found = run.drive(flow, "flow curve", rates, strain=strain, discard=discard, processes=processes)
    try:
        fit = f"Herschel-Bulkley: {found.herschel_bulkley()}"
    except JamlabError as error:
        fit = f"no Herschel-Bulkley fit: {error}"
    give(run, found, _MEANS, fit)


_OSCILLATE_COLUMNS = {"time": ".5g", "strain": ".4g", "stress": ".6g", "elastic_stress": ".6g", "viscous_stress": ".5g"}
_OSCILLATE_COLUMNS |= {"pressure": ".5g", "z_all": ".3f"}


def oscillate(
    file: File,
    omega: Annotated[float, typer.Option(help="Angular frequency, 1/tau_1.")],
    amplitude: Annotated[float, typer.Option(help="Amplitude of the strain.")],
    cycles: Annotated[int, typer.Option(help="Cycles at most; it ends when the answer repeats.")] = 20,
    points: Annotated[int, typer.Option(help="Rows in a cycle.")] = 32,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    tolerance: Tolerance = None,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("oscillate.h5"),
    plot: Plot = None,
    csv: Csv = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Oscillatory shear: G', G'' and higher harmonics of the stress; the picture is the Lissajous figure."""
    from jamlab.flow.oscillate import oscillate as flow

    law, accuracy = drag_law(stokes, beta, alpha, tau, eta_f), {"tolerance": tolerance, "background": background}
    run = expect_files(FlowRun(file, frame, law, accuracy, out, plot, csv, force, as_json))
    found = run.drive(flow, "oscillate", omega, amplitude, cycles=cycles, points=points)
    note = f"G' = {found.storage:.6g}, G'' = {found.loss:.6g}; |G*_3|/|G*_1| = {found.third_over_first:.2g}"
    give(run, found, _OSCILLATE_COLUMNS, note)


_RELAX_STRESS_COLUMNS = {"time": ".5g", "modulus": ".6g", "stress": ".6g", "elastic_stress": ".6g"}
_RELAX_STRESS_COLUMNS |= {"viscous_stress": ".4g", "pressure": ".5g", "z_all": ".3f"}


def relax_stress(
    file: File,
    strain: Annotated[float, typer.Option(help="Strain of the step; 0 stops a flow.")],
    duration: Annotated[float, typer.Option(help="Time, tau_1.")],
    step_time: Annotated[float, typer.Option(help="Time that the step takes, tau_1.")] = 1e-2,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    tolerance: Tolerance = None,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("relax-stress.h5"),
    plot: Plot = None,
    csv: Csv = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Strain a packing by a step and follow its stress, the relaxation modulus G(t); or stop a flow."""
    from jamlab.flow.relax_stress import relax_stress as flow

    law, accuracy = drag_law(stokes, beta, alpha, tau, eta_f), {"tolerance": tolerance, "background": background}
    run = expect_files(FlowRun(file, frame, law, accuracy, out, plot, csv, force, as_json))
    found = run.drive(flow, "relax", strain, duration, step_time=step_time)
    give(run, found, _RELAX_STRESS_COLUMNS, f"elastic stress before {found.residual:.5g}")


_CREEP_COLUMNS = {"time": ".5g", "strain": ".5g", "compliance": ".6g", "rate": ".4g", "elastic_stress": ".5g"}
_CREEP_COLUMNS |= {"viscous_stress": ".4g", "pressure": ".5g", "z_all": ".3f"}


def creep(
    file: File,
    stress: Annotated[float, typer.Option(help="Stress beside the residual one, in units of the packing.")],
    duration: Annotated[float, typer.Option(help="Time, tau_1.")],
    largest_strain: Annotated[float, typer.Option(help="Strain at which it ends early.")] = 10.0,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    tolerance: Tolerance = None,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("creep.h5"),
    plot: Plot = None,
    csv: Csv = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Load a packing with a shear stress and follow its strain; reports whether it arrests, creeps or flows."""
    from jamlab.flow.creep import creep as flow

    law, accuracy = drag_law(stokes, beta, alpha, tau, eta_f), {"tolerance": tolerance, "background": background}
    run = expect_files(FlowRun(file, frame, law, accuracy, out, plot, csv, force, as_json))
    found = run.drive(flow, "creep", stress, duration, largest_strain=largest_strain)
    give(run, found, _CREEP_COLUMNS, f"residual stress {found.residual:.5g}")

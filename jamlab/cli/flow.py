"""Commands of flow in time: `jamlab shear`, `flow-curve`, `oscillate`, `creep`, `relax-stress`.

All share the options of drag, accuracy and files, and how they print and write what they found.
"""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from jamlab.cli.console import print_json, print_note, print_stage, print_table, progress_bar, write_rows
from jamlab.cli.interruption import describe_kept
from jamlab.cli.options import Alpha, Beta, EtaF, Force, Frame, Json, Out, Stokes, Tau, drag_law, written_as
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_target

if TYPE_CHECKING:
    from jamlab.flow.read_flow import Flow
    from jamlab.packing.packing import Packing
    from jamlab.rheology.damping import Damping


T = TypeVar("T")


@dataclass(frozen=True)
class FlowOptions:
    """Options of every command of flow; each name and default is that of the command line."""

    file: Annotated[Path, typer.Argument(help="HDF5 file with a packing of disks or droplets.")]
    beta: Beta = 1.0
    alpha: Alpha = 1.0
    tau: Tau = 1.0
    stokes: Stokes = False
    eta_f: EtaF = 1.0
    tolerance: Annotated[
        float | None,
        typer.Option(help="Relative error of velocities in a step; flow by a rate: 1e-2, small strains: 1e-3."),
    ] = None
    background: Annotated[
        float | None,
        typer.Option(
            help="Drag of every particle beside contact damping, k tau_1; flow by a rate: disks 1e-4, droplets 1e-2; "
            "small strains: 0."
        ),
    ] = None
    frame: Frame = -1
    out: Out = Path("flow.h5")
    plot: Annotated[
        Path | None, typer.Option(help="Picture to write as well: .png, .pdf or .svg.", callback=written_as("picture"))
    ] = None
    csv: Annotated[
        Path | None, typer.Option(help="Table of all rows to write as well, .csv.", callback=written_as("table"))
    ] = None
    force: Force = False
    as_json: Json = False

    def packing(self) -> "Packing":
        """Packing of the file."""
        from jamlab.packing.hdf5 import read

        return read(self.file, self.frame)

    def law(self) -> "Damping":
        """Drag law."""
        return drag_law(self.stokes, self.beta, self.alpha, self.tau, self.eta_f)

    @property
    def accuracy(self) -> dict[str, Any]:
        """Arguments of every flow that are given; the others are left to it."""
        given = {"tolerance": self.tolerance, "background": self.background}
        return {name: value for name, value in given.items() if value is not None}

    def run(self, drive: Callable[..., T], name: str, *point: float, **how: Any) -> T:
        """Drive the packing at a point, such as frequency and amplitude, below a bar of this name."""
        with progress_bar(name, resumed=True) as progress:
            how |= {"out": self.out, "progress": progress, **self.accuracy}
            return drive(self.packing(), *point, self.law(), **how)


Result = tuple["Flow", Sequence[str]]  # with notes
Run = Callable[..., Result]


def flow_command(columns: Mapping[str, str], **other: Any) -> Callable[[Run], Callable[..., None]]:
    """Make a command of a function that takes `FlowOptions` and options of its own, and returns a result and notes;
    `other` are defaults that differ from those of `FlowOptions`."""

    def decorate(run: Run) -> Callable[..., None]:
        _, *own = inspect.signature(run).parameters.values()
        file, *shared = (
            inspect.Parameter(
                f.name,
                inspect.Parameter.POSITIONAL_OR_KEYWORD,
                default=inspect.Parameter.empty if f.default is MISSING else other.get(f.name, f.default),
                annotation=f.type,
            )
            for f in fields(FlowOptions)
        )
        parameters = [file, *own, *shared]

        @wraps(run)
        def command(**values: Any) -> None:
            options = FlowOptions(**{each.name: values.pop(each.name) for each in (file, *shared)})
            from jamlab.flow.run_file import OtherRunError

            expect_files(options)
            try:
                found, notes = run(options, **values)
            except OtherRunError:
                if not options.force:
                    raise
                options.out.unlink()
                found, notes = run(options, **values)
            give(found, columns, notes, options)

        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        command.__annotations__ = {each.name: each.annotation for each in parameters}
        return command

    return decorate


_HEADINGS = {"rates": "rate", "normal_stress_difference": "N₁", "z_all": "z all"}
_LINES = 15  # of a table on the screen


def expect_files(options: FlowOptions) -> None:
    """Refuse, before anything runs, what cannot be written at the end."""
    out, plot = options.out, options.plot
    check_target(out, options.file)
    for path in (plot, options.csv):
        if path is not None:
            check_target(path, options.file, out, replace=options.force)
    kept = f"kept {out} as it was last saved; the same command goes on from there"
    describe_kept(lambda: kept if out.exists() else "nothing was written")


def give(found: "Flow", columns: Mapping[str, str], notes: Sequence[str], options: FlowOptions) -> None:
    """Write picture and table of a result that is in its file already, and print columns in formats, with notes."""
    if options.plot is not None:
        from matplotlib.figure import Figure

        from jamlab.figures.html_page import save_picture
        from jamlab.plotting.drawable import CURVES

        figure = Figure(figsize=CURVES, layout="constrained")
        found.plot(figure.subplots())
        save_picture(figure, options.plot)
    if options.csv is not None:
        import pandas as pd

        write_rows(pd.DataFrame(_rows(found)), options.csv)
    if options.as_json:
        content: dict[str, Any] = {name: values.tolist() for name, values in _rows(found).items()}
        content["imbalance"] = getattr(found.imbalance, "tolist", lambda: found.imbalance)()
        plain = {f.name: getattr(found, f.name) for f in fields(found)}
        content |= {name: value for name, value in plain.items() if isinstance(value, bool | int | float | str)}
        print_json(content | {"verdict": found.verdict, "out": str(options.out), "drag": found.describe()})
        return
    table = {name: values for name in columns if (values := _column(found, name)) is not None}
    count = len(next(iter(table.values())))
    shown = sorted({round(k * (count - 1) / (_LINES - 1)) for k in range(_LINES)})
    lines = [[f"{values[k]:{columns[name]}}" for name, values in table.items()] for k in shown]
    print_table(found.describe(), [_HEADINGS.get(name, name.replace("_", " ")) for name in table], lines)
    for note in (*notes, found.verdict, f"unit of stress {found.unit}, of time tau_1; wrote {options.out}"):
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


@flow_command(_SHEAR_COLUMNS, out=Path("shear.h5"))
def shear(
    options: FlowOptions,
    rate: Annotated[float, typer.Option(help="Rate of shear, 1/tau_1; 0: quasi-static.")],
    strain: Annotated[float, typer.Option(help="Strain at the end.")] = 1.0,
    step: Annotated[float | None, typer.Option(help="Rate 0: strain between two minima; default 1e-4.")] = None,
    rows: Annotated[int | None, typer.Option(help="Rows of the result, but at rate 0; default 200.")] = None,
    frames: Annotated[float | None, typer.Option(help="Strain between two packings that are kept.")] = None,
    within: Annotated[float | None, typer.Option(help="Refuse a run that will take longer, s.")] = None,
) -> "Result":
    """Shear a packing at a constant rate, without inertia; a run that was interrupted goes on from its file."""
    from jamlab.flow.flow_cost import cost_of_flow, require_time
    from jamlab.flow.shear import shear as run

    packing, law, how = options.packing(), None, {}
    if rate != 0:  # options of drag have no say in quasi-static shear
        law, how = options.law(), options.accuracy
    if rate > 0 and law is not None and not options.out.exists():
        cost = cost_of_flow(packing, [rate], law, strain=strain, **how)
        if within is not None:
            require_time(cost, within)
        print_stage(f"about {cost['seconds'].sum():.2g} s")
    with progress_bar("shear", resumed=True) as progress:
        how |= {"step": step, "rows": rows, "frames": frames}
        found = run(packing, rate, strain, law, out=options.out, progress=progress, **how)
    return found, [f"plastic events seen: {found.plastic_events}; {len(found.frames)} packings; {found.steps} steps"]


_MEANS = {"stress": ".5g", "stress_error": ".1g", "pressure": ".5g", "pressure_error": ".1g"}
_MEANS |= {"normal_stress_difference": ".4g", "dissipation": ".4g", "z_all": ".4g", "plastic_events": ".3g"}
_MEANS |= {"imbalance": ".1e"}


@flow_command({"rates": ".4g", **_MEANS, "finished": ""}, out=Path("flow-curve.h5"))
def flow_curve(
    options: FlowOptions,
    rates: Annotated[list[float], typer.Option("--rate", help="Rate of shear, 1/tau_1; give it several times.")],
    strain: Annotated[float, typer.Option(help="Strain of the average at each rate.")] = 4.0,
    discard: Annotated[float, typer.Option(help="Strain of start-up before.")] = 1.0,
    processes: Annotated[int, typer.Option(help="Rates side by side, each on one core.")] = 1,
    within: Annotated[float | None, typer.Option(help="Refuse rates that will take longer, s.")] = None,
) -> "Result":
    """Measure steady flow at several rates, with a Herschel-Bulkley fit; rates in the file are not run again."""
    from jamlab.errors import JamlabError
    from jamlab.flow.flow_cost import cost_of_flow, require_time
    from jamlab.flow.flow_curve import flow_curve as run

    packing, law, how = options.packing(), options.law(), options.accuracy
    if not options.out.exists():
        cost = cost_of_flow(packing, rates, law, strain=strain + discard, **how)
        if within is not None:
            require_time(cost, within)
        seconds = cost["seconds"]
        print_stage(f"about {max(seconds.sum() / processes, seconds.max()):.2g} s")
    with progress_bar("flow curve", resumed=True) as progress:
        how |= {"strain": strain, "discard": discard, "processes": processes}
        found = run(packing, rates, law, out=options.out, progress=progress, **how)
    try:
        fit = f"Herschel-Bulkley: {found.herschel_bulkley()}"
    except JamlabError as error:
        fit = f"no Herschel-Bulkley fit: {error}"
    return found, [fit]


_OSCILLATE_COLUMNS = {"time": ".5g", "strain": ".4g", "stress": ".6g", "elastic_stress": ".6g", "viscous_stress": ".5g"}
_OSCILLATE_COLUMNS |= {"pressure": ".5g", "z_all": ".3f"}


@flow_command(_OSCILLATE_COLUMNS, out=Path("oscillate.h5"))
def oscillate(
    options: FlowOptions,
    omega: Annotated[float, typer.Option(help="Angular frequency, 1/tau_1.")],
    amplitude: Annotated[float, typer.Option(help="Amplitude of the strain.")],
    cycles: Annotated[int, typer.Option(help="Cycles at most; it ends when the answer repeats.")] = 20,
    points: Annotated[int, typer.Option(help="Rows in a cycle.")] = 32,
) -> "Result":
    """Shear a packing to and fro: harmonics of the stress; the picture is the Lissajous figure."""
    from jamlab.flow.oscillate import oscillate as run

    found = options.run(run, "oscillate", omega, amplitude, cycles=cycles, points=points)
    return found, [f"G' = {found.storage:.6g}, G'' = {found.loss:.6g}; |G*_3|/|G*_1| = {found.third_over_first:.2g}"]


_RELAX_STRESS_COLUMNS = {"time": ".5g", "modulus": ".6g", "stress": ".6g", "elastic_stress": ".6g"}
_RELAX_STRESS_COLUMNS |= {"viscous_stress": ".4g", "pressure": ".5g", "z_all": ".3f"}


@flow_command(_RELAX_STRESS_COLUMNS, out=Path("relax-stress.h5"))
def relax_stress(
    options: FlowOptions,
    strain: Annotated[float, typer.Option(help="Strain of the step; 0 stops a flow.")],
    duration: Annotated[float, typer.Option(help="Time, tau_1.")],
    step_time: Annotated[float, typer.Option(help="Time that the step takes, tau_1.")] = 1e-2,
) -> "Result":
    """Strain a packing by a step and follow its stress, the relaxation modulus G(t); or stop a flow."""
    from jamlab.flow.relax_stress import relax_stress as run

    found = options.run(run, "relax", strain, duration, step_time=step_time)
    return found, [f"elastic stress before {found.residual:.5g}"]


_COLUMNS = {"time": ".5g", "strain": ".5g", "compliance": ".6g", "rate": ".4g", "elastic_stress": ".5g"}
_COLUMNS |= {"viscous_stress": ".4g", "pressure": ".5g", "z_all": ".3f"}


@flow_command(_COLUMNS, out=Path("creep.h5"))
def creep(
    options: FlowOptions,
    stress: Annotated[float, typer.Option(help="Stress beside the residual one, in units of the packing.")],
    duration: Annotated[float, typer.Option(help="Time, tau_1.")],
    largest_strain: Annotated[float, typer.Option(help="Strain at which it ends early.")] = 10.0,
) -> "Result":
    """Load a packing with a shear stress and follow its strain; says whether it comes to rest, creeps on or flows."""
    from jamlab.flow.creep import creep as run

    found = options.run(run, "creep", stress, duration, largest_strain=largest_strain)
    return found, [f"residual stress {found.residual:.5g}"]

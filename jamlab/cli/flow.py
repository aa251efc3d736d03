"""Commands of flow in time: `jamlab shear`, `flow-curve`, `oscillate`, `creep`, `relax-stress`.

All share the options of drag, accuracy and files, and how they print and write what they found.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from inspect import signature
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli.console import print_json, print_note, print_stage, print_table, progress_bar
from jamlab.cli.interruption import NOTHING, describe_kept
from jamlab.cli.options import (
    Alpha,
    AnyFile,
    Beta,
    Drag,
    EtaF,
    FrameOption,
    Json,
    Out,
    Overwrite,
    Stokes,
    Tau,
    drag_law,
    reads_any_file,
    with_parameters,
    written_as,
)
from jamlab.errors import InputError, JamlabError
from jamlab.storage.atomic_file import check_target
from jamlab.storage.table_file import write_table
from jamlab.type_variables import T

if TYPE_CHECKING:
    from jamlab.flow.read_flow import StoredFlow
    from jamlab.packing.packing import Packing
    from jamlab.rheology.drag_law import DragLaw


Tolerance = Annotated[
    float | None, typer.Option(help="Relative error of velocities per step (default: 1e-2 at a rate, 1e-3 otherwise).")
]
Background = Annotated[
    float | None,
    typer.Option(
        help="Stokes drag added to contact damping, k tau_1 (default at a rate: disks 1e-4, droplets 1e-2; else 0)."
    ),
]
Trajectory = Annotated[
    bool,
    typer.Option(
        "--trajectory-error", help="Repeat the run at a tenth of the tolerance; state the largest difference."
    ),
]
Within = Annotated[float | None, typer.Option(help="Longest predicted run time (s); longer runs do not start.")]
Plot = Annotated[Path | None, typer.Option(help="Picture to write (.png, .pdf, .svg).", callback=written_as("picture"))]
Csv = Annotated[Path | None, typer.Option(help="Table of all rows to write (.csv).", callback=written_as("table"))]


@dataclass(frozen=True)
class Job:
    """What a flow starts from, its drag and accuracy, and where its results go."""

    file: Path
    frame: int
    reading: dict[str, Any]  # what the file lacks
    law: "DragLaw"
    accuracy: dict[str, float]  # tolerance and background, if given
    out: Path
    plot: Path | None
    csv: Path | None
    overwrite: bool
    as_json: bool

    def packing(self) -> "Packing":
        """Packing of the file."""
        from jamlab.trajectories.files import read

        return read(self.file, self.frame, **self.reading)

    def drive(self, flow: Callable[..., T], name: str, *point: Any, timed: bool = True, **how: Any) -> T:
        """Drive the packing at a point, such as frequency and amplitude, below a bar of this name. `timed`: with drag.
        A file of the same run is resumed; with `overwrite` the first save replaces the file of another run."""
        from jamlab.flow.run import replacing

        how |= {"path": self.out} | (self.accuracy | {"damping": self.law} if timed else {})
        with progress_bar(name) as progress, replacing(self.overwrite):
            return flow(self.packing(), *point, progress=progress, **how)

    def say_seconds(
        self, rates: list[float], strain: float, within: float | None, processes: int = 1, twice: bool = False
    ) -> None:
        """Say how long flow at some rates will take, unless it is resumed; refuse what takes longer than `within`.
        `twice`: each runs again at a tenth of its tolerance."""
        from jamlab.flow.flow_curve import flow_cost, require_time
        from jamlab.flow.flow_run import FLOW_ENERGY
        from jamlab.flow.shear import TOLERANCE

        if within is not None and not within > 0:
            raise InputError(f"--within {within}: must be a number of seconds above 0")
        if self.out.exists():
            return
        cost = flow_cost(self.packing(), rates, self.law, strain=strain, **self.accuracy)
        if twice:
            finer = self.accuracy | {"tolerance": FLOW_ENERGY.finer * self.accuracy.get("tolerance", TOLERANCE)}
            cost["seconds"] += flow_cost(self.packing(), rates, self.law, strain=strain, **finer)["seconds"]
        if within is not None:
            require_time(cost, within)
        seconds = cost["seconds"]
        print_stage(f"about {max(seconds.sum() / processes, seconds.max()):.2g} s")

    def give(self, found: "StoredFlow", columns: dict[str, str], *notes: str) -> None:
        """Write picture and table of a result that is in its file already, and print columns in formats, with notes."""
        from jamlab.flow.report import describe

        if self.plot is not None:
            from matplotlib.figure import Figure

            from jamlab.figures.save_picture import save_picture
            from jamlab.plotting.drawable import CURVES

            figure = Figure(figsize=CURVES, layout="constrained")
            found.plot(figure.subplots())
            save_picture(figure, self.plot)
        table = found.to_dataframe()
        if self.csv is not None:
            write_table(table, self.csv)
        if self.as_json:
            content: dict[str, Any] = {str(name): values.tolist() for name, values in table.items()}
            content["energy_error"] = getattr(found.energy_error, "tolist", lambda: found.energy_error)()
            plain = {f.name: getattr(found, f.name) for f in fields(found)}
            content |= {name: value for name, value in plain.items() if isinstance(value, bool | int | float | str)}
            print_json(content | {"conclusion": found.conclusion, "out": str(self.out), "drag": describe(found)})
            return
        names = [name for name in columns if name in table]
        most = 15  # lines on the screen
        shown = table.iloc[sorted({round(k * (len(table) - 1) / (most - 1)) for k in range(most)})]
        lines = [[f"{row[name]:{columns[name]}}" for name in names] for row in shown.to_dict("records")]
        headings = {"rates": "rate", "normal_stress_difference": "N₁", "z_all": "z all"}
        print_table(describe(found), [headings.get(name, name.replace("_", " ")) for name in names], lines)
        for note in (*notes, found.conclusion, f"unit of stress {found.unit}, of time tau_1; wrote {self.out}"):
            print_note(note)


def make_job(
    file: AnyFile,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    drag: Drag = None,
    tolerance: Tolerance = None,
    background: Background = None,
    frame: FrameOption = -1,
    out: Out = Path("flow.h5"),
    plot: Plot = None,
    csv: Csv = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    *,
    reading: dict[str, Any],
) -> Job:
    """Read the options of all flows; refuse, before anything runs, what cannot be written at the end."""
    check_target(out)
    for path in (plot, csv):
        if path is not None:
            check_target(path, replace=overwrite)
    before = _version(out)
    describe_kept(lambda: _describe(out, before))
    accuracy = {"tolerance": tolerance, "background_drag": background}
    given = {name: value for name, value in accuracy.items() if value is not None}
    return Job(
        file, frame, reading, drag_law(drag, stokes, beta, alpha, tau, eta_f), given, out, plot, csv, overwrite, as_json
    )


def _version(path: Path) -> tuple[int, int] | None:
    """What changes whenever a file is replaced."""
    return (path.stat().st_ino, path.stat().st_mtime_ns) if path.exists() else None


def _describe(out: Path, before: tuple[int, int] | None) -> str:
    if _version(out) != before:
        return f"kept {out} as it was last saved; the same command resumes it"
    return f"{NOTHING}; {out} is as it was before" if before else NOTHING


def _command(function: Callable[..., None]) -> Callable[..., None]:
    """Add the options of all flows to a command, which is called with the job that they describe."""
    name = function.__name__.replace("_", "-")
    shared = dict(signature(make_job).parameters)
    shared["out"] = shared["out"].replace(default=Path(f"{name}.h5"))
    del shared["reading"]
    own = list(signature(function).parameters.values())[1:]
    first, *rest = shared.values()

    def call(reading: dict[str, Any], **given: Any) -> None:
        job = make_job(reading=reading, **{name: given.pop(name) for name in shared})
        function(job, **given)

    return reads_any_file(with_parameters(call, function, [first, *own, *rest]))


_SHEAR = {"strain": ".4g", "time": ".5g", "stress": ".5g", "elastic_stress": ".5g", "viscous_stress": ".4g"}
_SHEAR |= {"pressure": ".5g", "normal_stress_difference": ".4g", "dissipation": ".4g", "z_all": ".3f"}
_SHEAR |= {"trajectory_error": ".2g"}


@_command
def shear(
    job: Job,
    rate: Annotated[float, typer.Option(help="Shear rate (1/tau_1); 0: quasi-static.")],
    strain: Annotated[float, typer.Option(help="Strain at the end.")] = 1.0,
    step: Annotated[float, typer.Option(help="Quasi-static shear: strain step.")] = 1e-4,
    direction: Annotated[
        str, typer.Option(metavar="{simple,pure,ANGLE}", help="Quasi-static shear: direction; angle in degrees.")
    ] = "simple",
    pressure: Annotated[
        str | None,
        typer.Option(metavar="{constant,VALUE}", help="Quasi-static shear at this pressure; the box area adjusts."),
    ] = None,
    rows: Annotated[int, typer.Option(help="Output rows.")] = 200,
    frames: Annotated[float | None, typer.Option(help="Strain interval between stored packings.")] = None,
    trajectory_error: Trajectory = False,
    within: Within = None,
) -> None:
    """Shear a packing at a constant rate, or quasi-statically.

    Motion is overdamped. The same command resumes an interrupted run.
    """
    from jamlab.flow.quasistatic_shear import quasistatic_shear
    from jamlab.flow.shear import shear as flow

    found: Any
    how: dict[str, Any]
    if rate == 0:
        how = {"direction": _read_direction(direction), "snapshot_every": frames}
        how["pressure"] = _number_or_text(pressure)
        found = job.drive(quasistatic_shear, "shear", strain, step, timed=False, **how)
    else:
        if rate > 0:
            job.say_seconds([rate], strain, within, twice=trajectory_error)
        how = {"rows": rows, "snapshot_every": frames, "trajectory_error": trajectory_error}
        found = job.drive(flow, "shear", rate, strain, **how)
    note = f"plastic events seen: {found.plastic_events}; {len(found.frames)} packings; {found.steps} steps"
    job.give(found, _SHEAR, note)


def _read_direction(text: str) -> str | float:
    found = _number_or_text(text)
    return radians(found) if isinstance(found, float) else text


def _number_or_text(text: str | None) -> str | float | None:
    try:
        return text if text is None else float(text)
    except ValueError:
        return text


_MEANS = {"rates": ".4g", "stress": ".5g", "stress_stderr": ".1g", "pressure": ".5g", "pressure_stderr": ".1g"}
_MEANS |= {"normal_stress_difference": ".4g", "dissipation": ".4g", "z_all": ".4g", "plastic_events": ".3g"}
_MEANS |= {"energy_error": ".1e", "finished": ""}


@_command
def flow_curve(
    job: Job,
    rates: Annotated[list[float], typer.Option("--rate", metavar="<float>", help="Shear rate (1/tau_1); repeatable.")],
    strain: Annotated[float, typer.Option(help="Strain over which each rate is averaged.")] = 4.0,
    discard: Annotated[float, typer.Option(help="Transient strain discarded before averaging.")] = 1.0,
    processes: Annotated[int, typer.Option(min=1, help="Number of rates run in parallel.")] = 1,
    within: Within = None,
) -> None:
    """Measure the steady stress at several shear rates.

    A Herschel-Bulkley law is fitted. Rates in the output file are not run again.
    """
    from jamlab.flow.flow_curve import flow_curve as flow

    job.say_seconds(rates, strain + discard, within, processes)
    found = job.drive(flow, "flow curve", rates, strain=strain, discard=discard, workers=processes)
    try:
        fit = f"Herschel-Bulkley: {found.herschel_bulkley()}"
    except JamlabError as error:
        fit = f"no Herschel-Bulkley fit: {error}"
    job.give(found, _MEANS, fit)


_IN_TIME = {"time": ".5g", "strain": ".5g", "compliance": ".6g", "modulus": ".6g", "rate": ".4g", "stress": ".6g"}
_IN_TIME |= {"elastic_stress": ".6g", "viscous_stress": ".5g", "pressure": ".5g", "z_all": ".3f"}
_IN_TIME |= {"trajectory_error": ".2g"}


@_command
def oscillate(
    job: Job,
    omega: Annotated[float, typer.Option(help="Angular frequency, 1/tau_1.")],
    amplitude: Annotated[float, typer.Option(help="Amplitude of the strain.")],
    cycles: Annotated[
        int, typer.Option(help="Largest number of cycles; stops earlier when the response is periodic.")
    ] = 20,
    points: Annotated[int, typer.Option(help="Rows per cycle.")] = 32,
    trajectory_error: Trajectory = False,
) -> None:
    """Apply oscillatory shear: G', G'' and higher harmonics.

    --plot draws the Lissajous figure.
    """
    from jamlab.flow.oscillate import oscillate as flow

    how: dict[str, Any] = {"cycles": cycles, "points_per_cycle": points, "trajectory_error": trajectory_error}
    found = job.drive(flow, "oscillate", omega, amplitude, **how)
    note = f"G' = {found.storage:.6g}, G'' = {found.loss:.6g}; |G*_3|/|G*_1| = {found.third_over_first:.2g}"
    job.give(found, _IN_TIME, note)


@_command
def relax_stress(
    job: Job,
    strain: Annotated[float, typer.Option(help="Step strain; 0: stop a flow.")],
    duration: Annotated[float, typer.Option(help="Simulated time (tau_1).")],
    step_time: Annotated[float, typer.Option(help="Duration of the strain step (tau_1).")] = 1e-2,
    trajectory_error: Trajectory = False,
) -> None:
    """Apply a step strain and follow the stress; or stop a flow."""
    from jamlab.flow.creep_and_relaxation import relax_stress as flow
    from jamlab.flow.creep_and_relaxation import stop_flow

    found: Any
    if strain == 0:
        found = job.drive(stop_flow, "stop", duration, trajectory_error=trajectory_error)
    else:
        how: dict[str, Any] = {"step_time": step_time, "trajectory_error": trajectory_error}
        found = job.drive(flow, "relax", strain, duration, **how)
    job.give(found, _IN_TIME, f"elastic stress before {found.residual:.5g}")


@_command
def creep(
    job: Job,
    stress: Annotated[float, typer.Option(help="Shear stress added to the residual stress (units of the packing).")],
    duration: Annotated[float, typer.Option(help="Simulated time (tau_1).")],
    largest_strain: Annotated[float, typer.Option(help="Stop at this strain.")] = 10.0,
    trajectory_error: Trajectory = False,
) -> None:
    """Apply a shear stress and follow the strain.

    The packing arrests, creeps or flows.
    """
    from jamlab.flow.creep_and_relaxation import creep as flow

    how: dict[str, Any] = {"largest_strain": largest_strain, "trajectory_error": trajectory_error}
    found = job.drive(flow, "creep", stress, duration, **how)
    job.give(found, _IN_TIME, f"residual stress {found.residual:.5g}")

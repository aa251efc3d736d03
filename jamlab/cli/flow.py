"""Commands of flow: `jamlab shear`, `quasistatic-shear`, `flow-curve`, `oscillate`, `creep`, `relax-stress` and
`stop-flow`.

All share the options of files, those with a rate also drag and accuracy, and how they print and write what they found.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from jamlab.cli.console import print_json, print_note, print_stage, print_table, progress_bar
from jamlab.cli.interruption import NOTHING, describe_kept
from jamlab.cli.option_values import Damping, Direction, HeldPressure, Reading
from jamlab.cli.options import MadeBy, Written, command
from jamlab.errors import JamlabError
from jamlab.storage.atomic_file import check_target
from jamlab.storage.table_file import write_table
from jamlab.type_variables import T

if TYPE_CHECKING:
    from jamlab.flow.read_flow import StoredFlow
    from jamlab.packing.packing import Packing


@dataclass(frozen=True)
class Job:
    """What a flow starts from, and where its results go."""

    file: Path
    frame: int
    reading: dict[str, Any]  # what the file lacks
    out: Path
    plot: Path | None
    csv: Path | None
    overwrite: bool
    json: bool

    def packing(self) -> "Packing":
        """Packing of the file."""
        from jamlab.trajectories.files import read

        return read(self.file, self.frame, **self.reading)

    def drive(self, flow: Callable[..., T], name: str, *point: Any, start: Any = None, **how: Any) -> T:
        """Drive the packing, or another start, at a point, such as frequency and amplitude, below a bar of this name. A
        file of the same run is resumed; with `overwrite` the first save replaces the file of another run."""
        from jamlab.flow.run import replacing

        start = self.packing() if start is None else start
        with progress_bar(name) as progress, replacing(self.overwrite):
            return flow(start, *point, path=self.out, progress=progress, **how)

    def say_seconds(
        self,
        rates: list[float],
        strain: float,
        drag: dict[str, Any],
        within: float | None,
        workers: int = 1,
        twice: bool = False,
    ) -> None:
        """Say how long flow at some rates will take, unless it is resumed; refuse what takes longer than `within`.
        `twice`: each runs again at a tenth of its tolerance."""
        from jamlab.flow.flow_curve import flow_cost, require_time
        from jamlab.flow.flow_run import FLOW_ENERGY

        if self.out.exists():
            return
        cost = flow_cost(self.packing(), rates, strain=strain, **drag)
        if twice:
            finer = drag | {"tolerance": FLOW_ENERGY.finer * drag["tolerance"]}
            cost["seconds"] += flow_cost(self.packing(), rates, strain=strain, **finer)["seconds"]
        if within is not None:
            require_time(cost, within)
        seconds = cost["seconds"]
        print_stage(f"about {max(seconds.sum() / workers, seconds.max()):.2g} s")

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
        if self.json:
            print_json(found.to_dict() | {"out": str(self.out)})
            return
        names = [name for name in columns if name in table]
        most = 15  # lines on the screen
        shown = table.iloc[sorted({round(k * (len(table) - 1) / (most - 1)) for k in range(most)})]
        lines = [[f"{row[name]:{columns[name]}}" for name in names] for row in shown.to_dict("records")]
        headings = {"normal_stress_difference": "N₁", "z_all": "z all"}
        print_table(describe(found), [headings.get(name, name.replace("_", " ")) for name in names], lines)
        for note in (*notes, found.conclusion, f"unit of stress {found.unit}, of time tau_1; wrote {self.out}"):
            print_note(note)


def make_job(
    file: Path,
    *,
    frame: int,
    reading: Reading,
    out: Annotated[Path, Written(("packings",))],
    plot: Annotated[Path | None, Written(("picture",))],
    csv: Annotated[Path | None, Written(("table",))],
    overwrite: bool,
    json: bool,
) -> Job:
    """Read the options of all flows; refuse, before anything runs, what cannot be written at the end."""
    check_target(out)
    for path in (plot, csv):
        if path is not None:
            check_target(path, replace=overwrite)
    before = _version(out)
    describe_kept(lambda: _describe(out, before))
    return Job(file, frame, reading, out, plot, csv, overwrite, json)


def how_to_drag(*, damping: Damping, background_drag: float | None, tolerance: float) -> dict[str, Any]:
    """Arguments that all flows in time share."""
    return locals()


def how_to_minimise(
    *,
    cycles: int | None,
    direction: Direction,
    pressure: HeldPressure,
    until_jammed: bool,
    walls: bool | None,
    snapshot_every: float | None,
    event_width: float | None,
    force_tolerance: float | None,
) -> dict[str, Any]:
    """Arguments that flow without time takes as they are given."""
    return locals()


FromFile = Annotated[Job, MadeBy(make_job)]
Drag = Annotated[dict[str, Any], MadeBy(how_to_drag)]
Minima = Annotated[dict[str, Any], MadeBy(how_to_minimise)]


def _version(path: Path) -> tuple[int, int] | None:
    """What changes whenever a file is replaced."""
    return (path.stat().st_ino, path.stat().st_mtime_ns) if path.exists() else None


def _describe(out: Path, before: tuple[int, int] | None) -> str:
    if _version(out) != before:
        return f"kept {out} as it was last saved; the same command resumes it"
    return f"{NOTHING}; {out} is as it was before" if before else NOTHING


_SHEAR = {"strain": ".4g", "time": ".5g", "stress": ".5g", "elastic_stress": ".5g", "viscous_stress": ".4g"}
_SHEAR |= {"pressure": ".5g", "normal_stress_difference": ".4g", "dissipation": ".4g", "z_all": ".3f"}
_SHEAR |= {"trajectory_error": ".2g"}


@command("shear", "read")
def shear(
    job: FromFile,
    *,
    rate: float,
    strain: float,
    drag: Drag,
    walls: bool | None,
    rows: int,
    snapshot_every: float | None,
    trajectory_error: bool,
    within: float | None,
) -> None:
    """Shear a packing at a constant rate.

    Motion is overdamped. The same command resumes an interrupted run.
    """
    from jamlab.flow.shear import shear as flow

    job.say_seconds([abs(rate)], strain, drag, within, twice=trajectory_error)
    how: dict[str, Any] = {"walls": walls, "rows": rows, "snapshot_every": snapshot_every}
    _give_shear(job, job.drive(flow, "shear", rate, strain, trajectory_error=trajectory_error, **how, **drag))


@command("quasistatic_shear", "read")
def quasistatic_shear(
    job: FromFile,
    *,
    strain: list[float],
    strain_step: float,
    minima: Minima,
) -> None:
    """Shear a packing quasi-statically, minimum by minimum.

    Several --strain are turning points. With --pressure the area of the box adjusts. The same command resumes an
    interrupted run.
    """
    from jamlab.flow.quasistatic_shear import quasistatic_shear as flow

    _give_shear(job, job.drive(flow, "shear", strain if len(strain) > 1 else strain[0], strain_step, **minima))


def _give_shear(job: Job, found: Any) -> None:
    note = f"plastic events seen: {found.plastic_events}; {len(found.frames)} packings; {found.steps} steps"
    job.give(found, _SHEAR, note)


_MEANS = {"rate": ".4g", "stress": ".5g", "stress_stderr": ".1g", "pressure": ".5g", "pressure_stderr": ".1g"}
_MEANS |= {"normal_stress_difference": ".4g", "dissipation": ".4g", "z_all": ".4g", "plastic_events": ".3g"}
_MEANS |= {"energy_error": ".1e", "finished": ""}


@command("flow_curve", "read")
def flow_curve(
    job: FromFile,
    *,
    rates: list[float],
    strain: float,
    discard: float,
    drag: Drag,
    workers: int,
    within: float | None,
) -> None:
    """Measure the steady stress at several shear rates.

    A Herschel-Bulkley law is fitted. Rates in the output file are not run again.
    """
    from jamlab.flow.flow_curve import flow_curve as flow

    job.say_seconds(rates, strain + discard, drag, within, workers)
    found = job.drive(flow, "flow curve", rates, strain=strain, discard=discard, workers=workers, **drag)
    try:
        fit = f"Herschel-Bulkley: {found.herschel_bulkley()}"
    except JamlabError as error:
        fit = f"no Herschel-Bulkley fit: {error}"
    job.give(found, _MEANS, fit)


_IN_TIME = {"time": ".5g", "strain": ".5g", "compliance": ".6g", "modulus": ".6g", "rate": ".4g", "stress": ".6g"}
_IN_TIME |= {"elastic_stress": ".6g", "viscous_stress": ".5g", "pressure": ".5g", "z_all": ".3f"}
_IN_TIME |= {"trajectory_error": ".2g"}


@command("oscillate", "read")
def oscillate(
    job: FromFile,
    *,
    omega: float,
    amplitude: float,
    cycles: int,
    points_per_cycle: int,
    drag: Drag,
    trajectory_error: bool,
) -> None:
    """Apply oscillatory shear: G', G'' and higher harmonics.

    --plot draws the Lissajous figure.
    """
    from jamlab.flow.oscillate import oscillate as flow

    how: dict[str, Any] = {"cycles": cycles, "points_per_cycle": points_per_cycle, "trajectory_error": trajectory_error}
    found = job.drive(flow, "oscillate", omega, amplitude, **how, **drag)
    note = f"G' = {found.storage:.6g}, G'' = {found.loss:.6g}; |G*_3|/|G*_1| = {found.third_over_first:.2g}"
    job.give(found, _IN_TIME, note)


@command("relax_stress", "read")
def relax_stress(
    job: FromFile,
    *,
    strain: float,
    duration: float,
    step_time: float,
    drag: Drag,
    trajectory_error: bool,
) -> None:
    """Apply a step strain and follow the stress."""
    from jamlab.flow.creep_and_relaxation import relax_stress as flow

    how: dict[str, Any] = {"step_time": step_time, "trajectory_error": trajectory_error}
    found = job.drive(flow, "relax", strain, duration, **how, **drag)
    job.give(found, _IN_TIME, f"elastic stress before {found.residual_stress:.5g}")


@command("stop_flow", "read")
def stop_flow(job: FromFile, *, duration: float, drag: Drag, trajectory_error: bool) -> None:
    """Stop a flow and follow the stress at constant strain.

    FILE is that of a flow, whose drag law goes on if no other is given, or of packings.
    """
    from jamlab.flow.creep_and_relaxation import stop_flow as flow

    found = job.drive(flow, "stop", duration, start=_flow_in(job), trajectory_error=trajectory_error, **drag)
    job.give(found, _IN_TIME, f"elastic stress before {found.residual_stress:.5g}")


def _flow_in(job: Job) -> Any:
    """The flow of a file whose last packing is taken; None of other files."""
    from jamlab.flow.creep_and_relaxation import CreepRun, StoppedFlow
    from jamlab.flow.oscillate import Oscillation
    from jamlab.flow.read_flow import read_flow
    from jamlab.flow.shear import ShearRun
    from jamlab.storage.verified_file import is_hdf5, opened

    if job.frame != -1 or not is_hdf5(job.file):
        return None
    with opened(job.file) as file:
        holds = "flow" in file
    found = read_flow(job.file) if holds else None
    return found if isinstance(found, ShearRun | Oscillation | CreepRun | StoppedFlow) else None


@command("creep", "read")
def creep(
    job: FromFile,
    *,
    stress: float,
    duration: float,
    largest_strain: float,
    drag: Drag,
    trajectory_error: bool,
) -> None:
    """Apply a shear stress and follow the strain.

    The packing arrests, creeps or flows.
    """
    from jamlab.flow.creep_and_relaxation import creep as flow

    how: dict[str, Any] = {"largest_strain": largest_strain, "trajectory_error": trajectory_error}
    found = job.drive(flow, "creep", stress, duration, **how, **drag)
    job.give(found, _IN_TIME, f"residual stress {found.residual_stress:.5g}")

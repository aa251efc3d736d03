"""`jamlab campaign`: ensembles of packings from one file."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli.console import err_console, out_console, print_json, print_note, print_table, progress_bar
from jamlab.cli.interruption import describe_kept, expect_output
from jamlab.cli.options import Force, Json, written_as
from jamlab.errors import InputError, StorageError
from jamlab.storage.atomic_file import check_target
from jamlab.storage.system_errors import system_said

if TYPE_CHECKING:
    from jamlab.campaign.campaign import Campaign
    from jamlab.campaign.driver import Outcome
    from jamlab.campaign.plan import SweepStatus
    from jamlab.campaign.tasks import Batch

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Ensembles of packings from one file: thousands of tasks that can be stopped and resumed.",
    epilog="Start with: jamlab campaign new campaign.toml",
)


@contextmanager
def _warnings_as_lines() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = lambda message, *_, **__: err_console.print(str(message), soft_wrap=True, markup=False)
        yield


@app.callback()
def options(context: typer.Context) -> None:
    """Show warnings as lines on stderr."""
    context.with_resource(_warnings_as_lines())


Where = Annotated[Path, typer.Argument(metavar="FILE", help="Campaign file (TOML), or the folder of a campaign.")]
Folder = Annotated[
    Path | None, typer.Option("--out", help="Folder of the tasks; default: beside the file, under the campaign's name.")
]
Only = Annotated[list[str] | None, typer.Option(help="Name of a sweep; can be repeated.")]
Count = Annotated[int | None, typer.Option(help="Number of worker processes (with --slurm: jobs); default: all cores.")]
Scheduler = Annotated[str | None, typer.Option(help="Address of a running Dask scheduler.")]
SLURM_HELP = (
    "Run on SLURM: every worker is a job of 1 core, 2 GB and 24 h, unless the table [slurm] of the file "
    'says otherwise: queue = "short", account, walltime = "04:00:00", memory = "4 GB", '
    'job_extra_directives = ["--qos=low"], job_script_prologue = ["module load python"], interface = "ib0": '
    "the keys of dask_jobqueue.SLURMCluster."
)
Slurm = Annotated[bool, typer.Option("--slurm", help=SLURM_HELP)]
Retry = Annotated[bool, typer.Option("--retry-failed", help="Run tasks again that failed before.")]
Pilot = Annotated[bool, typer.Option("--pilot", help="One task of each sweep, model and n, so that plan knows times.")]
Dry = Annotated[
    bool, typer.Option("--dry-run", help="Run nothing; print the script of a job of --slurm, and how many there are.")
]
Trust = Annotated[bool, typer.Option("--no-verify", help="Do not check the finished files first.")]


@app.command(epilog="Example: jamlab campaign new campaign.toml")
def new(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="Campaign file (TOML) to write.", callback=written_as("campaign")),
    ],
) -> None:
    """Write a commented campaign file to start from.

    It has two small sweeps, to be edited. No file is ever replaced.
    """
    text = files("jamlab.campaign").joinpath("starter.toml").read_text(encoding="utf-8")
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(f"{file} exists: name another file, or remove it first") from None
    except OSError as error:
        raise StorageError(f"cannot write {file}: {system_said(error, 'name another file')}") from error
    print_note(f"wrote {file}; next: jamlab campaign plan {file}")


@app.command(epilog="Example: jamlab campaign plan campaign.toml --workers 2")
def plan(file: Where, out: Folder = None, workers: Count = None, only: Only = None, as_json: Json = False) -> None:
    """Count tasks, and say what those that are left take.

    Nothing is run. Times are those of finished tasks of the same sweep, model and n.
    """
    from jamlab.campaign.campaign import open_campaign
    from jamlab.campaign.plan import total_time

    campaign = open_campaign(file, out)
    lines = campaign.plan(only)
    seconds, core_seconds, cores = total_time(lines, workers)
    left = sum(line.left for line in lines)
    size = None if any(line.bytes is None for line in lines) else sum(line.bytes or 0 for line in lines)
    if as_json:
        totals = {"workers": workers or cores, "seconds": seconds, "core_seconds": core_seconds, "bytes": size}
        print_json({**totals, "tasks": left, "sweeps": [vars(line) for line in lines]})
        return
    names = ["sweep", "model", "n", "tasks", "left", "stored", "core time", "size"]
    cells = []
    for line in lines:
        counts = [str(value) for value in (line.n, line.tasks, line.left, line.stored)]
        cells.append([line.sweep, line.model, *counts, _format_time(line.seconds), _format_size(line.bytes)])
    print_table(f"campaign {campaign.name}", names, cells)
    out_console.print(f"{left} tasks left: {_format_time(seconds)} on {cores} free cores, {_format_size(size)}")
    if seconds is None:
        out_console.print(
            f"?: not known before a task of that kind ends: `jamlab campaign run {file} --pilot` runs one of each",
            soft_wrap=True,
        )
    if stored := sum(line.stored for line in lines):
        out_console.print(f"{stored} of them measure states that are stored already")
    _print_earlier(campaign)
    for line in lines:
        if line.ranks > 1 and line.left:
            held = f"each task by {line.ranks} threads, on a worker of {line.ranks} cores"
            out_console.print(f"{line.sweep} {line.model} n={line.n}: {held}", soft_wrap=True, highlight=False)
        if line.until and line.left:
            aims = ", ".join(f"{column} to {error:g}" for column, error in line.until.items())
            out_console.print(f"{line.sweep} {line.model} n={line.n}: at most, until the means are known: {aims}")


def _format_spent(*sweeps: "SweepStatus") -> list[str]:
    """Wall and CPU time of the finished tasks of sweeps as text; nothing where the files were not read."""
    if sweeps[0].seconds is None:
        return []
    return [_format_time(sum(getattr(s, kind) for s in sweeps)) for kind in ("seconds", "cpu_seconds")]


def _format_time(seconds: float | None) -> str:
    if seconds is None:
        return "?"
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def _format_size(size: int | None) -> str:
    return "?" if size is None else f"{size / 1e6:.1f} MB"


@app.command(epilog="Example: jamlab campaign run campaign.toml --workers 2")
def run(
    file: Where,
    out: Folder = None,
    workers: Count = None,
    scheduler: Scheduler = None,
    slurm: Slurm = False,
    only: Only = None,
    retry_failed: Retry = False,
    pilot: Pilot = False,
    no_verify: Trust = False,
    dry_run: Dry = False,
    as_json: Json = False,
) -> None:
    """Run the remaining tasks.

    Stop it at any time; the same command resumes it.
    """
    from jamlab.campaign.campaign import open_campaign
    from jamlab.campaign.tasks import batches

    campaign = open_campaign(file, out)
    if dry_run:
        _print_scripts(campaign, only, workers)
        return
    chosen = batches(campaign.content, only)
    describe_kept(lambda: _describe(campaign, chosen))
    with progress_bar(campaign.name, resumed=True) as progress:
        where: dict[str, Any] = {"scheduler": scheduler, "slurm": slurm, "verify": not no_verify, "pilot": pilot}
        where |= {"only": only, "retry_failed": retry_failed, "progress": progress, "done": _print_failure}
        ran = campaign.run(workers, **where)
    for task, line in ran.repaired.items():
        err_console.print(f"run again: {task}: {line}", soft_wrap=True, highlight=False)
    if as_json:
        print_json({"finished": ran.finished, "failed": ran.failed, "repaired": ran.repaired})
        raise typer.Exit(1 if ran.failed else 0)
    if ran.finished or ran.failed or ran.repaired:
        out_console.print(f"{ran.finished} tasks finished, {ran.failed} failed; files in {campaign.folder.path}")
    else:
        print_note(_describe_nothing_left(campaign, only))
    if ran.failed:
        out_console.print(f"Reasons: jamlab campaign status {file}", soft_wrap=True)
        raise typer.Exit(1)


def _print_scripts(campaign: "Campaign", only: list[str] | None, jobs: int | None) -> None:
    """Print the script of a job for each number of ranks, and on stderr how many tasks and jobs there would be."""
    lines = campaign.plan(only)
    for ranks, script in campaign.job_scripts(only).items():
        left = sum(line.left for line in lines if line.ranks == ranks)
        print(script)
        said = f"{left} tasks left for --slurm, by {min(jobs or 1, left)} jobs of {ranks} cores; nothing was run"
        err_console.print(said, highlight=False)


app.command("resume", epilog="Example: jamlab campaign resume campaign.toml --retry-failed")(run)


def _describe_nothing_left(campaign: "Campaign", only: list[str] | None) -> str:
    """Say that a run had nothing to do, and what would give it something."""
    chosen = [sweep for sweep in campaign.status().sweeps if not only or sweep.sweep in only]
    finished, failed = sum(s.finished for s in chosen), sum(s.failed for s in chosen)
    failures = f", {failed} failed before (--retry-failed runs them again)" if failed else ""
    remedy = "" if failed else "; more seeds, sizes or observables in the file give it more to do"
    return f"nothing left to run: {finished} tasks are finished in {campaign.folder.path}{failures}{remedy}"


def _print_failure(outcome: "Outcome") -> None:
    from jamlab.campaign.driver import FAILED

    if outcome.state == FAILED:
        err_console.print(f"failed: {outcome.line}", soft_wrap=True, highlight=False)


def _describe(campaign: "Campaign", chosen: "list[Batch]") -> str:
    """How many tasks are finished, of at most how many if `until` decides, and what resumes them."""
    from jamlab.campaign.tasks import task_names

    names = task_names(chosen)
    most = "at most " if any(batch.until for batch in chosen) else ""
    path = campaign.folder.path
    elsewhere = "" if path in (campaign.file.parent, campaign.file.parent / campaign.name) else f" --out {path}"
    return (
        f"{len(names & campaign.folder.finished())} of {most}{len(names)} tasks are finished in {path}; "
        f"`jamlab campaign resume {campaign.file}{elsewhere}` resumes"
    )


@app.command(epilog="Example: jamlab campaign status campaign.toml --verify")
def status(
    file: Where,
    out: Folder = None,
    verify: Annotated[bool, typer.Option("--verify", help="Read every file: check it, add up times.")] = False,
    as_json: Json = False,
) -> None:
    """Count tasks finished, failed and left.

    It says why tasks failed, and with --verify how long they took and which files are damaged.
    """
    from jamlab.campaign.campaign import open_campaign

    campaign = open_campaign(file, out)
    found = campaign.status(verify=verify)
    if as_json:
        sweeps = [{**vars(sweep), "left": sweep.left} for sweep in found.sweeps]
        totals = {key: getattr(found, key) for key in ("tasks", "finished", "failed", "left", "foreign")}
        more = {"damaged": found.damaged, "gaps": found.gaps, "failures": found.failures, "sweeps": sweeps}
        print_json({**totals, **more})
        return
    counts = ("tasks", "finished", "failed", "left")
    lines = [
        [s.sweep, s.model, str(s.n), *(str(getattr(s, key)) for key in counts), *_format_spent(s)] for s in found.sweeps
    ]
    lines.append(["total", "", "", *(str(getattr(found, key)) for key in counts), *_format_spent(*found.sweeps)])
    times = ["wall time", "CPU time"] if verify else []
    print_table(f"campaign {campaign.name}", ["sweep", "model", "n", *counts, *times], lines)
    for s in found.sweeps:
        for column, wanted in s.until.items():
            state = "met" if s.errors[column] <= wanted else "not met"
            seeds = f"{s.finished} of at most {s.most} seeds finished"
            error = f"error of mean {column} {s.errors[column]:.3g}, until {wanted:g}: {state}"
            out_console.print(f"{s.sweep} {s.model} n={s.n}: {error}; {seeds}", soft_wrap=True, highlight=False)
    said = [f"failed: {record['label']}: {record['reason']}" for record in found.failures.values()]
    said += [f"damaged: {campaign.folder.task_file(t)}: {why}" for t, why in (found.damaged or {}).items()]
    said += [f"incomplete: {line}" for line in (found.gaps or {}).values()]
    for line in said:
        out_console.print(line, soft_wrap=True, highlight=False)
    if found.damaged:
        out_console.print(f"`jamlab campaign resume {file}` runs them again", soft_wrap=True)
    if found.foreign:
        out_console.print(f"{found.foreign} further files belong to no task of this campaign file", soft_wrap=True)
    _print_earlier(campaign)


def _print_earlier(campaign: "Campaign") -> None:
    from jamlab.campaign.campaign import describe_earlier

    if others := campaign.earlier():
        out_console.print(describe_earlier(others), soft_wrap=True, highlight=False)


@app.command(epilog="Example: jamlab campaign page campaign.toml --out campaign.html")
def page(
    file: Where,
    out: Annotated[Path, typer.Option("--out", "--to", help="HTML file to write.", callback=written_as("page"))] = Path(
        "campaign.html"
    ),
    folder: Annotated[Path | None, typer.Option(help="Folder of the tasks; default: beside the file.")] = None,
    force: Force = False,
) -> None:
    """Write an interactive page of all sweeps.

    One packing of each to look through, means over packings, and tasks done.
    """
    from jamlab.campaign.campaign import open_campaign
    from jamlab.cli.campaign_report import write_campaign_page

    campaign = open_campaign(file, folder)
    if out.is_dir():
        raise InputError(f"--out {out} is a folder: name the HTML file to write, and the tasks with --folder {out}")
    check_target(out, file, replace=force)
    expect_output(out)
    with progress_bar(f"page of {campaign.name}") as progress:
        write_campaign_page(campaign, out, progress)
    print_note(f"wrote {out}; open it in a browser")


@app.command(epilog="Example: jamlab campaign merge campaign.toml other-machine/first")
def merge(
    file: Where,
    folders: Annotated[list[Path], typer.Argument(help="Folders in which parts of the campaign ran.")],
    out: Folder = None,
    as_json: Json = False,
) -> None:
    """Copy finished tasks from other folders."""
    from jamlab.campaign.campaign import merge as copy
    from jamlab.campaign.campaign import open_campaign

    campaign = open_campaign(file, out)
    expect_output(campaign.folder.path)
    counts = copy(campaign, folders)
    if as_json:
        print_json(counts)
    else:
        out_console.print(", ".join(f"{count} {what}" for what, count in counts.items()))


@app.command(epilog="Example: jamlab campaign export campaign.toml --to tables --format csv --table states")
def export(
    file: Where,
    to: Annotated[Path, typer.Option(help="Folder to write to.")] = Path("tables"),
    form: Annotated[str, typer.Option("--format", help="csv, parquet, or dump (frames for OVITO).")] = "csv",
    table: Annotated[list[str] | None, typer.Option(help="Name of a table; can be repeated; default: all.")] = None,
    sweep: Annotated[str | None, typer.Option(help="Name of a sweep; default: all.")] = None,
    out: Folder = None,
    force: Force = False,
    earlier: Annotated[
        bool, typer.Option("--earlier", help="Also write rows that other versions of protocols or definitions made.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Write tables, or the frames of every task."""
    from jamlab.campaign.campaign import export as write
    from jamlab.campaign.campaign import open_campaign

    expect_output(to)
    campaign = open_campaign(file, out)
    written = [str(path) for path in write(campaign, to, form, table or (), sweep, replace=force, earlier=earlier)]
    if as_json:
        print_json({"written": written})
    else:
        none = f"no task is finished in {campaign.folder.path}, the folder of the tasks: nothing written to {to}"
        out_console.print("\n".join(written) or none, soft_wrap=True)

"""`jamlab campaign`: ensembles of packings from one file."""

from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from contextlib import ExitStack
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli.commands import Once
from jamlab.cli.console import err_console, print_json, print_line, print_note, print_table, progress_bar
from jamlab.cli.interruption import describe_kept, expect_output
from jamlab.cli.options import Json, Overwrite, written_as
from jamlab.errors import InputError, StorageError
from jamlab.processes.progress import in_words
from jamlab.storage.system_errors import system_said

if TYPE_CHECKING:
    from jamlab.campaign.campaign import Campaign
    from jamlab.campaign.standing import CampaignRun
    from jamlab.campaign.workers import Outcome

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Ensembles of packings from one file: thousands of tasks that can be stopped and resumed.",
    epilog="Start with: jamlab campaign new campaign.toml",
)


Where = Annotated[Path, typer.Argument(metavar="FILE", help="Campaign file (TOML), or the folder of a campaign.")]
Folder = Annotated[
    Path | None, typer.Option("--out", help="Folder of the tasks; default: beside the file, under the campaign's name.")
]
Only = Annotated[list[str] | None, typer.Option(metavar="NAME", help="Name of a sweep; repeatable.")]
Count = Annotated[int | None, typer.Option(help="Number of worker processes; default: all cores.")]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="WHERE",
        help="Address or file of a Dask scheduler, or slurm, pbs, sge, lsf, oar, moab or htcondor.",
    ),
]
Jobs = Annotated[int | None, typer.Option(help="Largest number of jobs at a time; every batch system needs it.")]


@app.command(cls=Once, epilog="Example: jamlab campaign new campaign.toml")
def new(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Campaign file (TOML) to write.", callback=written_as("campaign"))
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


@app.command(cls=Once, epilog="Example: jamlab campaign plan campaign.toml --workers 2")
def plan(file: Where, out: Folder = None, workers: Count = None, only: Only = None, as_json: Json = False) -> None:
    """Estimate time and disk space of the remaining tasks.

    Nothing is run. Times come from finished tasks of the same sweep, model and n.
    """
    from jamlab.campaign.campaign import open_campaign
    from jamlab.campaign.plan import total_time

    campaign = open_campaign(file, out)
    lines = campaign.plan(only)
    seconds, core_seconds, cores = total_time(lines, workers)
    left = sum(line.left for line in lines)
    size, files = _sum(line.bytes for line in lines), _sum(line.files for line in lines)
    if as_json:
        totals = {"workers": workers or cores, "seconds": seconds, "core_seconds": core_seconds, "bytes": size}
        print_json({**totals, "files": files, "tasks": left, "sweeps": [vars(line) for line in lines]})
        return
    names = ("sweep", "model", "n", "tasks", "left", "stored", "ranks")
    costs = ("core time", "size", "files")
    cells = [
        [*_texts(line, names), _format_time(line.seconds), _format_size(line.bytes), _format_count(line.files)]
        for line in lines
    ]
    print_table(f"campaign {campaign.name}", [*names, *costs], cells)
    said = f"{left} tasks left: {_format_time(seconds)} on {cores} free cores, {_format_size(size)}"
    print_line(f"{said} in {_format_count(files)} files")
    if failed := sum(line.failed for line in lines):
        print_line(f"{failed} tasks failed and are not among these; reasons: jamlab campaign status {file}")
    if seconds is None:
        print_line(
            f"?: unknown until a task of that kind is finished; `jamlab campaign run {file} --pilot` runs one of each"
        )
    for line in lines:
        if line.files is not None and line.files < min(line.left, cores // line.ranks):
            print_line(f"sweep {line.sweep} has work for {line.files} workers only: lower its chunk to use more")
    if stored := sum(line.stored for line in lines):
        print_line(f"{stored} of these tasks only measure states that are already stored")


def _sum(numbers: Iterable[int | None]) -> int | None:
    """Sum of numbers; None if one is not known."""
    known = list(numbers)
    return None if None in known else sum(number or 0 for number in known)


def _texts(entry: Any, names: Iterable[str]) -> list[str]:
    return [str(getattr(entry, name)) for name in names]


def _format_time(seconds: float | None) -> str:
    return "?" if seconds is None else in_words(seconds)


def _format_size(size: int | None) -> str:
    if size is None:
        return "?"
    return f"{size / 1e6:.1f} MB" if size < 1e9 else f"{size / 1e9:.1f} GB"


def _format_count(count: int | None) -> str:
    return "?" if count is None else str(count)


@app.command(cls=Once, epilog="Example: jamlab campaign run campaign.toml --workers 2")
def run(
    file: Where,
    out: Folder = None,
    workers: Count = None,
    scheduler: Scheduler = None,
    jobs: Jobs = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the job script; submit and run nothing.")] = False,
    share: Annotated[
        str, typer.Option(metavar="K/N", help="Run every N-th task only, from the K-th on, as in a job array.")
    ] = "1/1",
    only: Only = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Run failed tasks again.")] = False,
    pilot: Annotated[
        bool, typer.Option("--pilot", help="Run one task of each sweep, model and n only; `plan` then estimates times.")
    ] = False,
    no_verify: Annotated[bool, typer.Option("--no-verify", help="Skip the integrity check of finished files.")] = False,
    as_json: Json = False,
) -> None:
    """Run the remaining tasks.

    Stop it at any time; the same command resumes it.
    """
    from jamlab.campaign.campaign import open_campaign

    campaign = open_campaign(file, out)
    _check_engine(workers, scheduler, jobs, dry_run)
    if dry_run:
        print(campaign.job_script(str(scheduler), only=only), end="")
        return
    words = f"{file} --out {out}" if out else str(file)
    words += f" --scheduler {scheduler}" if scheduler else ""
    words += f" --jobs {jobs}" if jobs else ""
    words += f" --share {share}" if share != "1/1" else ""
    describe_kept(lambda: f"{_describe(campaign, only)}; `jamlab campaign resume {words}` resumes")
    how: dict[str, Any] = {"share": _share(share), "verify": not no_verify, "pilot": pilot}
    how |= {"only": only, "retry_failed": retry_failed, "done": _failure_printer(file)}
    with ExitStack() as stack:
        where: int | Executor | None = workers
        if scheduler:
            cluster = stack.enter_context(campaign.cluster(scheduler, jobs, only=only, tell=_print_told))
            where = cluster.executor
            if cluster.dashboard:
                print_line(f"dashboard of Dask: {cluster.dashboard}", err_console)
        ran = campaign.run(where, progress=stack.enter_context(progress_bar(campaign.name, guess=False)), **how)
    if as_json:
        print_json(vars(ran))
    _print_ran(ran, file, campaign, only, quiet=as_json)
    raise typer.Exit(1 if ran.failed else 0)


app.command("resume", cls=Once, epilog="Example: jamlab campaign resume campaign.toml --retry-failed")(run)


def _print_ran(ran: "CampaignRun", file: Path, campaign: "Campaign", only: list[str] | None, *, quiet: bool) -> None:
    """Print what a run did; on stderr alone if it is quiet."""
    for task, line in ran.repaired.items():
        print_line(f"run again: {task}: {line}", err_console)
    for line in ran.gaps[:_LINES]:
        print_line(f"incomplete: {line}", err_console)
    if (more := len(ran.gaps) - _LINES) > 0:
        print_line(f"and {more} more: jamlab campaign status {file} --verify", err_console)
    if quiet:
        return
    if ran.finished or ran.failed or ran.repaired:
        print_line(f"{ran.finished} tasks finished, {ran.failed} failed; files in {campaign.folder.path}")
        if ran.failed:
            print_line(f"Reasons: jamlab campaign status {file}")
    else:
        print_note(f"nothing left to run: {_describe(campaign, only)}")
    if ran.left:
        print_line(f"{ran.left} tasks are left to other shares")


def _check_engine(workers: int | None, scheduler: str | None, jobs: int | None, dry_run: bool) -> None:
    """Refuse options of which one would be ignored."""
    if scheduler is None and (jobs is not None or dry_run):
        given = "--dry-run" if dry_run else f"--jobs {jobs}"
        raise InputError(f"{given} needs --scheduler: name the batch system, such as --scheduler slurm")
    if scheduler is not None and workers is not None:
        raise InputError(
            f"--workers {workers} are processes of this machine: leave it out beside --scheduler {scheduler}"
        )


def _print_told(line: str) -> None:
    print_line(f"note: {line}", err_console)


def _share(text: str) -> tuple[int, int]:
    k, slash, n = text.partition("/")
    if not (slash and k.isdecimal() and n.isdecimal()):
        raise InputError(f"--share {text}: give K/N, such as 3/32")
    return int(k), int(n)


_LINES = 20  # of one kind that a run prints: of a million tasks all may fail


def _failure_printer(file: Path) -> "Callable[[Outcome], None]":
    """A function that prints outcomes that are failures, the first ones."""
    from jamlab.campaign.workers import FAILED

    count = 0

    def show(outcome: "Outcome") -> None:
        nonlocal count
        if outcome.state == FAILED:
            count += 1
            if count <= _LINES:
                print_line(f"failed: {outcome.line}", err_console)
            elif count == _LINES + 1:
                print_line(f"failed: more than {_LINES} tasks; reasons: jamlab campaign status {file}", err_console)

    return show


def _describe(campaign: "Campaign", only: list[str] | None) -> str:
    """How many tasks are finished."""
    from jamlab.campaign.plan import status
    from jamlab.campaign.tasks import batches

    found = status(batches(campaign.content, only), campaign.folder, verify=False)
    again = f", {found.failed} failed (--retry-failed runs them again)" if found.failed else ""
    return f"{found.finished} of {found.tasks} tasks are finished in {campaign.folder.path}{again}"


@app.command(cls=Once, epilog="Example: jamlab campaign status campaign.toml --verify")
def status(
    file: Where,
    out: Folder = None,
    verify: Annotated[bool, typer.Option("--verify", help="Check every file.")] = False,
    as_json: Json = False,
) -> None:
    """Count tasks finished, failed and left.

    It says why tasks failed, and with --verify which files are damaged and which states they lack.
    """
    from jamlab.campaign.campaign import open_campaign

    campaign = open_campaign(file, out)
    found = campaign.status(verify=verify)
    counts = ("tasks", "finished", "failed", "left")
    if as_json:
        print_json(vars(found) | {"sweeps": [vars(sweep) for sweep in found.sweeps]})
        return
    headings = ("sweep", "model", "n", *counts)
    lines = [[*_texts(sweep, headings)] for sweep in found.sweeps]
    lines.append(["total", "", "", *_texts(found, counts)])
    print_table(f"campaign {campaign.name}", headings, lines)
    said = [f"failed: {record['label']}: {record['reason']}" for record in found.failures.values()]
    said += [f"damaged: {campaign.folder.task_file(t)}: {why}" for t, why in (found.damaged or {}).items()]
    said += [f"incomplete: {line}" for line in (found.gaps or {}).values()]
    if found.damaged:
        said.append(f"`jamlab campaign resume {file}` runs damaged tasks again")
    if found.running:
        said.append(f"{found.running} tasks are under way")
    if found.foreign:
        said.append(
            f"{found.foreign} further tasks, of other keys or another jamlab, are finished; tables leave them out"
        )
    for line in said:
        print_line(line)


@app.command(cls=Once, epilog="Example: jamlab campaign export campaign.toml --to tables --table states")
def export(
    file: Where,
    to: Annotated[Path, typer.Option(help="Folder to write to.")] = Path("tables"),
    table: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Name of a table; repeatable (default: all).")
    ] = None,
    sweep: Annotated[str | None, typer.Option(help="Name of a sweep; default: all.")] = None,
    format: Annotated[str, typer.Option(metavar="NAME", help="csv, tsv, json, h5 (HDF5) or parquet.")] = "csv",
    out: Folder = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Write tables for other programs, a file each."""
    from jamlab.campaign.campaign import open_campaign

    expect_output(to)
    campaign = open_campaign(file, out)
    written = [str(path) for path in campaign.export(to, table or (), sweep, format=format, overwrite=overwrite)]
    if as_json:
        print_json({"written": written})
    else:
        none = f"no task is finished in {campaign.folder.path}, the folder of the tasks: nothing written to {to}"
        print_line("\n".join(written) or none)

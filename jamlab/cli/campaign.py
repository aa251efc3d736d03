"""`jamlab campaign`: ensembles of packings from one file."""

from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from contextlib import ExitStack
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli.commands import OwnCommand
from jamlab.cli.console import err_console, print_json, print_line, print_note, print_table, progress_bar
from jamlab.cli.interruption import describe_kept, expect_output
from jamlab.cli.option_values import Bins, Share
from jamlab.cli.options import Written, command
from jamlab.errors import InputError, StorageError
from jamlab.processes.progress import in_words
from jamlab.storage.system_errors import system_said

if TYPE_CHECKING:
    from jamlab.campaign.campaign import Campaign
    from jamlab.campaign.plan import SweepStatus
    from jamlab.campaign.standing import CampaignRun
    from jamlab.campaign.workers import Outcome

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Ensembles of packings from one file: thousands of tasks that can be stopped and resumed.",
    epilog="Start with: jamlab campaign new campaign.toml",
)


def _command(words: str, *python: str, name: str = "") -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make a command of the group, whose help ends with an example."""

    def add(function: Callable[..., None]) -> Callable[..., None]:
        called = name or function.__name__
        made = command(*python, name=f"campaign {called}")(function)
        app.command(called, cls=OwnCommand, epilog=f"Example: jamlab campaign {called} {words}")(made)
        return function

    return add


@_command("campaign.toml")
def new(campaign: Annotated[Path, Written(("campaign",))]) -> None:
    """Write a commented campaign file to start from.

    It has two small sweeps, to be edited. No file is ever replaced.
    """
    text = files("jamlab.campaign").joinpath("starter.toml").read_text(encoding="utf-8")
    try:
        with campaign.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(f"{campaign} exists: name another file, or remove it first") from None
    except OSError as error:
        raise StorageError(f"cannot write {campaign}: {system_said(error, 'name another file')}") from error
    print_note(f"wrote {campaign}; next: jamlab campaign plan {campaign}")


@_command("campaign.toml --workers 2", "open_campaign", "Campaign.plan")
def plan(campaign: Path, *, folder: Path | None, workers: int | None, only: list[str] | None, json: bool) -> None:
    """Estimate time and disk space of the remaining tasks.

    Nothing is run. Times come from finished tasks of the same sweep, model and n; before one is finished, they are
    estimates, marked by ~.
    """
    from jamlab.campaign.open_campaign import open_campaign

    opened = open_campaign(campaign, folder)
    from jamlab.campaign.plan import total_time

    lines = opened.plan(only)
    seconds, core_seconds, cores = total_time(lines, workers)
    left = sum(line.left for line in lines)
    size, files = _sum(line.bytes for line in lines), _sum(line.files for line in lines)
    if json:
        totals = {"workers": workers or cores, "seconds": seconds, "core_seconds": core_seconds, "bytes": size}
        print_json({**totals, "files": files, "tasks": left, "sweeps": [vars(line) for line in lines]})
        return
    names = ("sweep", "model", "n", "tasks", "left", "stored", "ranks")
    costs = ("core time", "size", "files")
    cells = [
        [*_texts(line, names), _core_time(line), _format_size(line.bytes), _format_count(line.files)] for line in lines
    ]
    print_table(f"campaign {opened.name}", [*names, *costs], cells)
    about = "~" * any(line.estimated for line in lines)
    if seconds is None:
        known, _, _ = total_time([line for line in lines if line.seconds is not None], workers)
        about, seconds = (f"more than {about}", known) if known else ("", None)
    said = f"{left} tasks left: {about}{_format_time(seconds)} on {cores} free cores, {_format_size(size)}"
    print_line(f"{said} in {_format_count(files)} files")
    if failed := sum(line.failed for line in lines):
        again = f"jamlab campaign status {_words(campaign, folder)}"
        print_line(f"{failed} tasks failed and are not among these; reasons: {again}")
    for said in _sources(lines, _words(campaign, folder)):
        print_line(said)
    for line in lines:
        if line.files is not None and line.files < min(line.left, cores // line.ranks):
            print_line(f"sweep {line.sweep} has work for {line.files} workers only: lower its chunk to use more")
    if stored := sum(line.stored for line in lines):
        print_line(f"{stored} of these tasks only measure states that are already stored")


def _core_time(line: "SweepStatus") -> str:
    return "~" * (line.estimated and line.seconds is not None) + _format_time(line.seconds)


def _sources(lines: "list[SweepStatus]", campaign: str) -> list[str]:
    """Where the numbers of a plan are from that no finished task of this campaign gave, and what they leave out."""
    from jamlab.campaign.cost import table_facts

    said = []
    if any(line.estimated for line in lines):
        facts = table_facts()
        said.append(
            f"~: estimated from the work of a task, by jamlab's table of costs ({facts['machine']}, {facts['date']}); "
            "this machine is not measured"
        )
    left_out = {name: [each.sweep for each in lines if name in each.without] for line in lines for name in line.without}
    for name, sweeps in left_out.items():
        count = len(set(sweeps))
        said.append(f"~ leaves out {name} of {f'{count} sweeps' if count > 1 else f'sweep {sweeps[0]}'}: cost unknown")
    if any(line.seconds is None or line.bytes is None for line in lines):
        said.append(
            "?: unknown until a task of that kind is finished; "
            f"`jamlab campaign run {campaign} --pilot` runs one of each and measures all numbers here"
        )
    return said


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


@_command("campaign.toml --retry-failed", "open_campaign", "Campaign.run", "Campaign.cluster", name="resume")
@_command("campaign.toml --workers 2", "open_campaign", "Campaign.run", "Campaign.cluster")
def run(
    campaign: Path,
    *,
    folder: Path | None,
    workers: int | None,
    scheduler: str | None,
    jobs: int | None,
    dry_run: bool,
    share: Share,
    only: list[str] | None,
    retry_failed: bool,
    pilot: bool,
    verify: bool,
    json: bool,
) -> None:
    """Run the remaining tasks.

    Stop it at any time; the same command resumes it.
    """
    from jamlab.campaign.open_campaign import open_campaign

    _check_engine(workers, scheduler, jobs, dry_run)
    opened = open_campaign(campaign, folder)
    if dry_run:
        print(opened.job_script(str(scheduler), only=only), end="")
        return
    words = _words(campaign, folder)
    words += f" --workers {workers}" if workers else ""
    words += "".join(f" --only {name}" for name in only or ())
    words += f" --scheduler {scheduler}" if scheduler else ""
    words += f" --jobs {jobs}" if jobs else ""
    words += f" --share {share[0]}/{share[1]}" if share != (1, 1) else ""
    describe_kept(lambda: f"{_describe(opened, only)}; `jamlab campaign resume {words}` resumes")
    how: dict[str, Any] = {"share": share, "verify": verify, "pilot": pilot}
    how |= {"only": only, "retry_failed": retry_failed, "done": _failure_printer(_words(campaign, folder))}
    with ExitStack() as stack:
        where: int | Executor | None = workers
        if scheduler:
            cluster = stack.enter_context(opened.cluster(scheduler, jobs, only=only, tell=_print_told))
            where = cluster.executor
            if cluster.dashboard:
                print_line(f"dashboard of Dask: {cluster.dashboard}", err_console)
        ran = opened.run(where, progress=stack.enter_context(progress_bar(opened.name, guess=False)), **how)
    if json:
        print_json(vars(ran))
    _print_ran(ran, _words(campaign, folder), opened, only, quiet=json)
    raise typer.Exit(1 if ran.failed else 0)


def _words(campaign: Path, folder: Path | None) -> str:
    """How a command names an open campaign."""
    return f"{campaign} --folder {folder}" if folder else str(campaign)


def _print_ran(ran: "CampaignRun", campaign: str, opened: "Campaign", only: list[str] | None, *, quiet: bool) -> None:
    """Print what a run did; on stderr alone if it is quiet."""
    for task, line in ran.repaired.items():
        print_line(f"run again: {task}: {line}", err_console)
    for line in ran.gaps[:_LINES]:
        print_line(f"incomplete: {line}", err_console)
    if (more := len(ran.gaps) - _LINES) > 0:
        print_line(f"and {more} more: jamlab campaign status {campaign} --verify", err_console)
    if quiet:
        return
    if ran.finished or ran.failed or ran.repaired:
        print_line(f"{ran.finished} tasks finished, {ran.failed} failed; files in {opened.folder.path}")
        if ran.failed:
            print_line(f"Reasons: jamlab campaign status {campaign}")
    else:
        print_note(f"nothing left to run: {_describe(opened, only)}")
    if ran.left:
        print_line(f"left to other shares: {ran.left} tasks")


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


_LINES = 20  # of one kind that a run prints: of a million tasks all may fail


def _failure_printer(campaign: str) -> "Callable[[Outcome], None]":
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
                print_line(f"failed: more than {_LINES} tasks; reasons: jamlab campaign status {campaign}", err_console)

    return show


def _describe(opened: "Campaign", only: list[str] | None) -> str:
    """How many tasks are finished."""
    from jamlab.campaign.plan import status
    from jamlab.campaign.tasks import batches

    found = status(batches(opened.content, only), opened.folder, verify=False)
    again = f", {found.failed} failed (--retry-failed runs them again)" if found.failed else ""
    return f"{found.finished} of {found.tasks} tasks are finished in {opened.folder.path}{again}"


@_command("campaign.toml --verify", "open_campaign", "Campaign.status")
def status(campaign: Path, *, folder: Path | None, verify: bool, json: bool) -> None:
    """Count tasks finished, failed and left.

    It says why tasks failed, and with --verify which files are damaged and which states they lack. If a file is
    damaged, the exit code is 1.
    """
    from jamlab.campaign.open_campaign import open_campaign

    opened = open_campaign(campaign, folder)
    found = opened.status(verify=verify)
    counts = ("tasks", "finished", "failed", "left")
    if json:
        print_json(vars(found) | {"sweeps": [vars(sweep) for sweep in found.sweeps]})
        raise typer.Exit(1 if found.damaged else 0)
    headings = ("sweep", "model", "n", *counts)
    lines = [[*_texts(sweep, headings)] for sweep in found.sweeps]
    lines.append(["total", "", "", *_texts(found, counts)])
    print_table(f"campaign {opened.name}", headings, lines)
    said = [f"failed: {record['label']}: {record['reason']}" for record in found.failures.values()]
    said += [f"damaged: {opened.folder.task_file(t)}: {why}" for t, why in (found.damaged or {}).items()]
    said += [f"incomplete: {line}" for line in (found.gaps or {}).values()]
    if found.damaged:
        said.append(f"`jamlab campaign resume {_words(campaign, folder)}` runs damaged tasks again")
    if found.running:
        said.append(f"{found.running} tasks are under way")
    if found.foreign:
        said.append(
            f"{found.foreign} further tasks, of other keys or another jamlab, are finished; tables leave them out"
        )
    for line in said:
        print_line(line)
    raise typer.Exit(1 if found.damaged else 0)


@_command("campaign.toml --out tables --table states", "open_campaign", "Campaign.export")
def export(
    campaign: Path,
    *,
    out: Path,
    tables: list[str] | None,
    sweep: str | None,
    format: str,
    folder: Path | None,
    overwrite: bool,
    json: bool,
) -> None:
    """Write tables for other programs, a file each."""
    from jamlab.campaign.open_campaign import open_campaign

    expect_output(out)
    opened = open_campaign(campaign, folder)
    how: dict[str, Any] = {"tables": tables or (), "format": format}
    written = [str(path) for path in opened.export(out, sweep=sweep, overwrite=overwrite, **how)]
    if json:
        print_json({"written": written})
    else:
        none = f"no task is finished in {opened.folder.path}, the folder of the tasks: nothing written to {out}"
        print_line("\n".join(written) or none)


@_command("campaign.toml z g --along d_rho --bins 0,0.01,0.1", "open_campaign", "Campaign.aggregate")
def aggregate(
    campaign: Path,
    values: list[str],
    *,
    by: list[str],
    table: str,
    sweep: str | None,
    converged: bool,
    along: str | None,
    bins: Bins,
    confidence: float,
    folder: Path | None,
    csv: Annotated[Path | None, Written(("table",))],
    overwrite: bool,
    json: bool,
) -> None:
    """Average columns of a table over packings.

    Each mean stands between both ends of its bootstrap interval.
    """
    from jamlab.campaign.open_campaign import open_campaign
    from jamlab.storage.atomic_file import check_target
    from jamlab.storage.table_file import write_table

    if csv is not None:
        check_target(csv, replace=overwrite)
        expect_output(csv)
    how: dict[str, Any] = {"table": table, "along": along, "bins": bins, "confidence": confidence}
    opened = open_campaign(campaign, folder)
    found = opened.aggregate(values, by, sweep=sweep, converged=converged, **how)
    if csv is not None:
        write_table(found, csv)
    if json:
        print_json({str(name): column.tolist() for name, column in found.items()})
        return
    lines = [[f"{value:.5g}" if isinstance(value, float) else str(value) for value in row] for row in found.to_numpy()]
    print_table(f"campaign {opened.name}, table {table}", [str(name) for name in found], lines)

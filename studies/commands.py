"""`python -m studies`: list, draw and run evidence, compare with other codes, reduce campaigns to tables."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from jamlab.checks import check_choice
from jamlab.cli.commands import Commands
from jamlab.cli.console import err_console, out_console, print_json, print_line, print_stage, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import option
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_targets, make_folder
from studies.campaign_costs import make_costs
from studies.contact_sheet import pictures_in, write_sheets
from studies.ensemble_tables import NAMES
from studies.estimate_tables import SEEDS, make_table
from studies.flow_errors import measure_runs
from studies.other_codes.compare import CODES, LIBRARIES, compare, compare_analysis, jolted_minimum, text_of
from studies.pages import file_names, write_page, write_verdicts
from studies.panels import Drawing
from studies.papers.controls.control import write_controls
from studies.papers.controls.passed import NAME as CONTROLS
from studies.reference_data import open_tables, write_tables
from studies.reference_packings import FOLDER, check_sets, make_sets
from studies.registry import GROUPS, chosen
from studies.speed_history.losses import changes
from studies.speed_history.record import PROCESSES, RECORDS, measure_record, read_records, write_record
from studies.tables import DATA, commit, forget, measure, read_manifest

app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Evidence about jamlab: figures of the papers, cost against accuracy, where methods fail, other codes.",
    epilog="Start with: python -m studies list",
)
STYLES = {"differs": "red", "tension": "yellow"}  # of verdicts in the terminal
Names = Annotated[
    list[str], typer.Argument(help="papers, beyond, speed-accuracy, stability, all, or names that `list` prints.")
]


def tell(share: float, text: str) -> None:
    """Print the present step on stderr."""
    print_stage(text)


@app.command("list", short_help="List all studies.", epilog="Example: python -m studies list")
def list_studies() -> None:
    """List all studies by group."""
    lines = [[study.name, name, study.title] for name, group in GROUPS.items() for study in group.studies]
    print_table("studies", ["name", "group", "shows"], lines)


@app.command("draw", short_help="Draw pictures, tables and pages.", epilog="Example: python -m studies draw papers")
def draw(
    names: Names,
    source: Annotated[
        Path | None, typer.Option("--from", help="Campaign or folder of tables; default: those that ship.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for PNG, PDF, CSV and HTML.")] = Path("jamlab-studies"),
    overwrite: Annotated[bool, option("overwrite")] = False,
    as_json: Annotated[bool, option("json")] = False,
) -> None:
    """Draw studies from the tables that ship, or from a campaign or results of your own."""
    if source is not None and source.resolve() == out.resolve():
        raise InputError(f"--out {out}: pictures must not lie among results: name another folder")
    pages, tables = chosen(names), open_tables(source or DATA)
    files = [file for page, group in pages.items() for file in file_names([s.name for s in group.studies], page)]
    expect_output(out)
    check_targets(out, files, replace=overwrite)
    drawn: list[Drawing] = []
    missing: dict[str, str] = {}
    for page, group in pages.items():
        pdf = page == "studies"  # of those that were named
        found, failed = write_page(out, page, group, tables, pdf=pdf, progress=tell)
        drawn += found
        missing |= failed
        if not as_json:
            print_line(f"Open {out / page}.html")
    claims = [claim for each in drawn for claim in each.claims]
    if claims:
        write_verdicts(out, claims)
    if as_json:
        rows = [claim.row() for claim in claims]
        values, captions = ({each.name: getattr(each, part) for each in drawn} for part in ("numbers", "caption"))
        print_json({"out": str(out), "rows": rows, "values": values, "captions": captions, "not_drawn": missing})
        return
    for claim in claims:
        out_console.print(Text(claim.line, style=STYLES.get(claim.verdict, "")), soft_wrap=True)
    for each in drawn if "studies" in pages else ():
        print_line(f"{each.name}: {each.caption}")
    for name, reason in missing.items():
        err_console.print(Text(f"not drawn: {name}: {reason}", style="red"), soft_wrap=True)


@app.command("sheet", short_help="Put pictures on contact sheets.", epilog="Example: python -m studies sheet .github")
def sheet(
    places: Annotated[list[Path], typer.Argument(help="Folders of pictures, or pictures (.png).")],
    out: Annotated[Path, typer.Option(help="Folder of sheets.")] = Path("jamlab-sheets"),
) -> None:
    """Put many pictures on few pages, each with its name: of the gallery as built, of `draw`, of the README."""
    pictures = pictures_in(places)
    expect_output(out)
    make_folder(out)
    for path in write_sheets(pictures, out):
        print_line(f"wrote {path}")


@app.command("run", short_help="Measure anew.", epilog="Example: python -m studies run spectrum --out results")
def run(
    names: Names,
    out: Annotated[Path, typer.Option(help="Folder of tables; run again to resume.")] = Path("jamlab-results"),
    anew: Annotated[bool, typer.Option("--anew", help="Remove what the folder holds of them first.")] = False,
) -> None:
    """Measure the tasks of studies that a folder of tables does not hold. Rows are saved task by task."""
    measured = [study for group in chosen(names).values() for study in group.studies if study.tasks]
    if not measured:
        raise InputError(
            f"{', '.join(names)}: drawn from campaigns: jamlab campaign run studies/campaigns/reference.toml, "
            "dynamics.toml or beyond_the_papers.toml"
        )
    expect_output(out)
    for study in measured if anew else ():
        forget(out, study.name)
    for study in measured:
        measure(out, study.name, study.tasks, tell)
    print_line(f"Draw it: python -m studies draw {' '.join(names)} --from {out}")


@app.command(
    "tables", short_help="Measure the tables behind estimates.", epilog="Example: python -m studies tables ways"
)
def tables(
    name: Annotated[
        str, typer.Argument(help="ways (of `estimate`), flow-errors (of `choose_flow`) or costs (of `campaign plan`).")
    ],
    out: Annotated[Path, typer.Option(help="Folder; run again to resume.")] = Path("jamlab-estimates"),
    seeds: Annotated[int, typer.Option(help="Packings of each way, 12 s of one core each.")] = 200,
) -> None:
    """Measure a table of jamlab/estimates, or jamlab/campaign/costs.csv."""
    check_choice("table", name, ("ways", "flow-errors", "costs"))
    file = out / f"{name.replace('-', '_')}.csv{'' if name == 'costs' else '.xz'}"
    expect_output(file)
    if name == "ways":
        make_table(file, range(SEEDS.start, SEEDS.start + seeds), progress=tell)
    elif name == "costs":
        make_costs(file, progress=tell)
    else:
        measure_runs(file, progress=tell)
    print_line(f"wrote {file}")


@app.command("compare", short_help="Compare with other codes.", epilog="Example: python -m studies compare --n 64")
def compare_codes(
    n: Annotated[int, typer.Option("--n", help="Number of disks, even.")] = 64,
    seed: Annotated[int, option("seed")] = 1,
    phi: Annotated[float, typer.Option(help="Nominal packing fraction, above onset.")] = 0.88,
    as_json: Annotated[bool, option("json")] = False,
) -> None:
    """Compare energy, minimum, time on one core with jax-md, ASE, LAMMPS; analysis: freud, matscipy."""
    found = compare(n, seed, phi, progress=tell)
    analysis = compare_analysis(jolted_minimum(n, seed, phi)[1])
    if as_json:
        print_json({"rows": found, "analysis": analysis})
        return
    for tables, rows in ((CODES, found), (LIBRARIES, analysis)):
        for heading, columns in tables.items():
            print_table(heading, list(columns), [[text_of(row[name]) for name in columns] for row in rows])


@app.command(
    "reduce",
    short_help="Reduce a campaign to the tables of figures.",
    epilog="Example: python -m studies reduce studies/campaigns/reference.toml --out tables",
)
def reduce(
    campaign: Annotated[Path, typer.Argument(help="File or folder of a campaign.")],
    out: Annotated[Path, typer.Option(help="Folder of tables.")] = Path("jamlab-tables"),
    commit: Annotated[str, typer.Option(help="Commit to record.")] = "unknown",
    only: Annotated[list[str] | None, typer.Option("--only", help="A table to write; default: all.")] = None,
    add: Annotated[bool, typer.Option("--add", help="Append rows to the tables of the folder.")] = False,
    overwrite: Annotated[bool, option("overwrite")] = False,
) -> None:
    """Reduce the tables of a campaign to what figures are drawn from."""
    for name in only or ():
        check_choice("only", name, NAMES)
    expect_output(out)
    check_targets(out, [f"{name}.parquet" for name in only or NAMES], replace=overwrite or add)
    for path in write_tables(open_tables(campaign), out, commit, only or NAMES, add=add):
        print_line(f"wrote {path}")


@app.command(
    "controls",
    short_help="Control the estimators of the papers' numbers.",
    epilog="Example: python -m studies controls --out controls",
)
def controls(
    names: Annotated[list[str] | None, typer.Argument(help="Numbers by id; default: all that need a control.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the table.")] = Path("jamlab-controls"),
    overwrite: Annotated[bool, option("overwrite")] = False,
) -> None:
    """Measure what each estimator gives for packings in which the law of its paper holds."""
    expect_output(out)
    check_targets(out, [f"{CONTROLS}.csv"], replace=overwrite)
    print_line(f"wrote {write_controls(out, open_tables(DATA), names or (), tell)}")


@app.command("speed", short_help="Compare speed with earlier commits.", epilog="Example: python -m studies speed")
def speed(
    python: Annotated[str, typer.Option(help="Python of another checkout to measure.")] = sys.executable,
    stored: Annotated[str, typer.Option(help="Commit whose record is compared; nothing is measured.")] = "",
    out: Annotated[Path, typer.Option(help="Folder of records.")] = RECORDS,
    only: Annotated[list[str] | None, typer.Option("--only", help="Work to measure and show; no record.")] = None,
    processes: Annotated[int, typer.Option(help="Processes, 20 s of one core each.", min=1)] = PROCESSES,
    overwrite: Annotated[bool, option("overwrite")] = False,
    as_json: Annotated[bool, option("json")] = False,
) -> None:
    """Record what fixed work costs at this commit; ends with 1 if work is slower than before, beyond its error."""
    known = read_records(out)
    if stored:
        check_choice("stored", stored, [record.commit for record in known])
        record = next(record for record in known if record.commit == stored)
    else:
        expect_output(out)
        if not only:
            check_targets(out, [f"{commit()}.json"] if python == sys.executable else [], replace=overwrite)
        record = measure_record(python, processes, only=only or (), progress=tell)
        if not only and record.commit.endswith("-dirty"):
            raise InputError(f"the record of {record.commit} would be of no commit: commit first, or give --only")
        if not only:
            check_targets(out, [record.name], replace=overwrite)
            print_line(f"wrote {write_record(record, out)}", err_console)
    found = changes(record, known)
    if as_json:
        print_json({"commit": record.commit, "changes": [asdict(one) | {"lost": one.lost} for one in found]})
    elif found:
        lines = [[one.work, one.against, *one.cells] for one in found]
        heads = ["work", "against", "ratio", "error", "said"]
        print_table(f"{record.commit}: time over plain work, over that of earlier records", heads, lines)
    else:
        print_line(f"{record.commit}: no earlier record")
    if any(one.lost for one in found):
        raise typer.Exit(1)


@app.command(
    "packings", short_help="Make or check the reference packings.", epilog="Example: python -m studies packings --check"
)
def packings(
    names: Annotated[list[str] | None, typer.Argument(help="Sets, as files are called; default: all.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of files; run again to resume.")] = Path("jamlab-packings"),
    check: Annotated[bool, typer.Option("--check", help="Compare those that ship with what is made again.")] = False,
) -> None:
    """Make sets of reference packings with their data card, or check those that ship: ends with 1 if one differs."""
    if check:
        if names:
            raise InputError(f"--check with {' '.join(names)}: all sets are checked, give no names")
        wrong = check_sets(progress=tell)
        for line in wrong:
            print_line(line)
        if wrong:
            raise typer.Exit(1)
        print_line(f"{len(read_manifest(FOLDER))} files are what their manifest says, and can be made again")
        return
    expect_output(out)
    for path in make_sets(out, names or (), tell):
        print_line(f"wrote {path}")

"""Tables of the reference data: written, read, joined, damaged, and drawn as they ship."""

import gzip
import json
import lzma
from importlib import resources
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commands import call_studies
from drawn_figures import REFERENCE, TABLES, drawn, saved, tables
from matplotlib.figure import Figure

from jamlab.errors import InputError, StorageError
from studies import gallery
from studies.claims import SUMMARY, Verdict, first_line
from studies.ensemble_tables import COUNTS, NAMES, EnsembleTables
from studies.ensembles import fill_states, thin_states
from studies.reference_data import combine, pack, read_folder, read_record, reference_tables, save
from studies.study import write_files


def test_reference_tables_give_the_same_figures(tmp_path):
    back = read_folder(saved(tmp_path))
    assert back.facts == {"commit": "old"} and set(read_record(tmp_path)["rows"]) == set(NAMES)
    for name in ("boromand-11", "boromand-8", "baumgarten-5"):
        for a, b in zip(drawn(name).claims, gallery.draw(name, back).claims, strict=True):
            assert (b.value, b.low, b.high) == pytest.approx((a.value, a.low, a.high), rel=1e-2, nan_ok=True)


def test_new_packings_join_those_that_are_there(tmp_path):
    """Seeds 4 to 8 of a new campaign replace 4 and 5 of the old one and leave 1 to 3; both origins are on record."""
    saved(tmp_path)
    new = EnsembleTables(
        lambda name: TABLES[name]().assign(seed=lambda t: t["seed"] + 3) if name == "spectra" else pd.DataFrame(),
        {"commit": "new"},
    )
    old = read_folder(tmp_path)
    both = combine(new, old)
    assert both.facts["commit"] == "new"
    assert sorted(both.spectra["seed"].unique()) == list(range(1, 9))
    keys = ["n", "seed", "target_pressure", "law", "beta", "eta_f", "prestress", "omega"]
    assert not both.spectra.duplicated(keys).any()
    fourth = both.spectra[(both.spectra["seed"] == 4) & (both.spectra["n"] == 256)]
    assert fourth["g0"].max() == pytest.approx(TABLES["spectra"]().query("seed == 1 and n == 256")["g0"].max())
    assert len(both.states) == len(old.states)


def test_packings_that_are_there_are_not_added_again(tmp_path):
    """Numbers that tell them apart were rounded when they were written, and another machine's last digits differ."""
    saved(tmp_path)
    old, held = read_folder(tmp_path), {name: getattr(tables(), name) for name in NAMES}
    again = {name: t.assign(**{c: t[c] * (1 + 1e-13) for c in ("rho", "phi") if c in t}) for name, t in held.items()}
    both = combine(EnsembleTables(again.__getitem__), old)
    assert {name: len(getattr(both, name)) for name in NAMES} == {name: len(t) for name, t in again.items()}


def test_states_ship_without_what_follows_from_others():
    """rho, phi, z, shape and differences to the first state come back in the digits that were written."""
    whole = tables().states
    held = whole["n"] - whole["rattlers"]
    even = whole.assign(z=2 * (0.5 * whole["z"] * held).round() / held, shape=whole["excess"] + 1.0)
    first = even[even["state"] == 0].set_index(["model", "n", "seed"])[["z", "overlap"]]
    even = even.drop(columns=[c for c in ("z_J", "overlap_J") if c in even])
    there = even.join(first.add_suffix("_J"), on=["model", "n", "seed"])
    even["d_z"], even["d_rho"] = there["z"] - there["z_J"], there["d_phi"] - there["overlap"] + there["overlap_J"]
    even["rho"] = even["phi"] - even["overlap"]
    thin = thin_states(even)
    later = thin["state"] > 0
    assert thin.loc[later, ["rho", "phi", "shape", "d_rho", "d_z", "lost"]].isna().all(axis=None)
    back = fill_states(thin)
    for name in ("rho", "phi", "z", "d_z", "d_rho", "shape"):
        rows = (even["model"] == "sp") & even[name].notna()
        np.testing.assert_allclose(back.loc[rows, name], even.loc[rows, name], atol=1e-12, err_msg=name)
    cut = even[(even["state"] > 0) | (even["seed"] > 1)]  # a packing without its first state keeps all
    assert thin_states(cut).loc[cut["seed"] == 1, "rho"].notna().all()


def test_tables_are_never_lost(tmp_path):
    """Not where another campaign writes, nor where a file that is to be added to cannot be read."""
    saved(tmp_path)
    record, other = (tmp_path / "reference.json.xz").read_bytes(), EnsembleTables({"flow": tables().flow}.__getitem__)
    with pytest.raises(InputError, match=r"holds states, .*--add"):
        save(other, tmp_path, {})
    assert (tmp_path / "reference.json.xz").read_bytes() == record and len(read_folder(tmp_path).states)
    save(combine(other, read_folder(tmp_path)), tmp_path, {"commit": "new"}, add=True, names=["flow"])
    now, before = read_record(tmp_path), json.loads(lzma.decompress(record))
    assert now["rows"] == before["rows"] and now["runs"][:1] == before["runs"]
    assert [run.get("commit") for run in now["runs"]] == ["old", "new"] and list(now["runs"][1]["rows"]) == ["flow"]
    (tmp_path / "flow.columns.xz").write_bytes(b"no xz")
    with pytest.raises(StorageError, match=r"flow\.columns\.xz cannot be read"):
        len(combine(other, read_folder(tmp_path)).flow)


@pytest.mark.slow
def test_reference_tables_are_written_alike_every_time(tmp_path):
    assert set(save(tables(), tmp_path / "a", {"commit": "old"})) == set(NAMES)
    for path in saved(tmp_path / "b").iterdir():
        assert path.read_bytes() == (tmp_path / "a" / path.name).read_bytes()


def test_tables_that_a_campaign_lacks_are_left_out_and_named(tmp_path):
    def read(name):
        if name == "onset":
            return TABLES["onset"]()
        raise InputError(f"no table {name}")

    assert set(save(EnsembleTables(read), tmp_path, {})) == {"onset"}
    back = read_folder(tmp_path)
    assert gallery.draw("boromand-10", back).claims
    with pytest.raises(StorageError, match=r"spectra.*cannot be read"):
        gallery.draw("baumgarten-1", back)
    with pytest.raises(InputError, match="no table has rows"):
        save(EnsembleTables(lambda name: pd.DataFrame()), tmp_path, {})


def test_damaged_reference_tables_are_refused(tmp_path):
    with pytest.raises(StorageError, match=r"reference\.json"):
        read_folder(tmp_path)
    saved(tmp_path)
    (tmp_path / "onset.columns.xz").write_bytes(b"no xz")
    with pytest.raises(StorageError, match="onset"):
        gallery.draw("boromand-10", read_folder(tmp_path))
    (tmp_path / "onset.columns.xz").unlink()
    (tmp_path / "reference.json.xz").write_bytes(b"no xz")
    with pytest.raises(StorageError, match=r"reference\.json\.xz cannot be read"):
        read_folder(tmp_path)
    (tmp_path / "reference.json.xz").unlink()
    (tmp_path / "reference.json").write_text('{"facts": {}, "rows": {"onset": 1}}')
    (tmp_path / "onset.csv.gz").write_bytes(gzip.compress(b"model,n\nsp,32\n"))
    with pytest.raises(StorageError, match=r"onset\.csv\.gz has no column seed"):  # nor may it be added to
        gallery.draw("boromand-10", read_folder(tmp_path))
    (tmp_path / "onset.csv.gz").write_bytes(gzip.compress(b"model,n,seed,ensemble\nsp,32,1,fixed-box\n"))
    with pytest.raises(InputError, match="column"):
        gallery.draw("boromand-10", read_folder(tmp_path))
    (tmp_path / "reference.json").write_text('{"facts": {}}')
    with pytest.raises(StorageError, match=r"reference\.json.*lacks"):
        read_folder(tmp_path)


def test_a_folder_of_the_version_before_is_read(tmp_path):
    """Rows in csv.gz, and every run inside the record of the next one; what is added makes the list flat."""
    saved(tmp_path)
    for path in list(tmp_path.glob("*.columns.xz")):
        old = path.with_name(path.name.replace(".columns.xz", ".csv.gz"))
        old.write_bytes(gzip.compress("\n".join([*lines_of(path), ""]).encode()))
        path.unlink()
    rows = read_record(tmp_path)["rows"]
    first = {"facts": {"campaign": "a", "commit": "1"}, "rows": rows, "campaign": "text of 1"}
    second = {
        "facts": {"campaign": "b", "commit": "2"},
        "rows": {"flow": rows["flow"]},
        "campaign": "",
        "before": first,
    }
    (tmp_path / "reference.json.xz").unlink()
    (tmp_path / "reference.json").write_text(json.dumps(second))
    back = read_folder(tmp_path)
    assert back.facts == {"campaign": "b", "commit": "2", "campaign a": "commit 1"}
    assert [run["commit"] for run in read_record(tmp_path)["runs"]] == ["1", "2"]
    for name in NAMES:
        pd.testing.assert_frame_equal(getattr(back, name), getattr(read_folder(tmp_path), name))
    new = EnsembleTables({"flow": tables().flow}.__getitem__)
    save(combine(new, back), tmp_path, {"commit": "3"}, add=True, names=["flow"])
    assert [run["commit"] for run in read_record(tmp_path)["runs"]] == ["1", "2", "3"]
    assert (tmp_path / "states.csv.gz").exists() and not (tmp_path / "flow.csv.gz").exists()
    assert len(read_folder(tmp_path).flow) == rows["flow"]


def lines_of(path):
    columns = [line.split(",") for line in lzma.decompress(path.read_bytes()).decode().splitlines()]
    return [",".join(row) for row in zip(*columns, strict=True)]


def write_lines(path, lines):
    path.write_bytes(pack("\n".join(lines)))


@pytest.mark.parametrize("column", ["rho_J", "converged"])
def test_one_bad_cell_is_named(tmp_path, column):
    """Text in a column of numbers, or of truth values, where any text would pass for True."""
    saved(tmp_path)
    path = tmp_path / "onset.columns.xz"
    lines = lines_of(path)
    cells = lines[7].split(",")
    cells[lines[0].split(",").index(column)] = "x.8"
    write_lines(path, [*lines[:7], ",".join(cells), *lines[8:]])
    done = call_studies(tmp_path, "draw", "boromand-10", "--from", tmp_path, "--out", tmp_path / "out")
    told = " ".join(done.stderr.split())
    assert done.exit_code == 1 and f"onset.columns.xz cannot be read (line 8, column {column}: 'x.8')" in told


def test_a_cut_table_is_refused(tmp_path):
    """Of a whole file with fewer rows, and of a packed one that breaks off or is spoilt inside."""
    saved(tmp_path)
    path = tmp_path / "states.columns.xz"
    packed, lines = path.read_bytes(), lines_of(path)
    write_lines(path, lines[:301])
    with pytest.raises(StorageError, match=rf"states\.columns\.xz has 300 rows, {len(lines) - 1} expected"):
        _ = read_folder(tmp_path).states
    for spoilt in (packed[:-200], packed[:40] + b"\xff" * 40 + packed[80:]):
        path.write_bytes(spoilt)
        with pytest.raises(StorageError, match=r"states\.columns\.xz cannot be read"):
            _ = read_folder(tmp_path).states


def test_no_table_stands_in_for_a_damaged_one(tmp_path):
    """Droplets of several laws are made from the states of a campaign, never where their own table is spoilt; nor is
    such a table replaced by new packings alone, or removed."""
    saved(tmp_path)
    for name in ("droplet_states", "onset"):
        path = tmp_path / f"{name}.columns.xz"
        write_lines(path, lines_of(path)[:-1])
    old = read_folder(tmp_path)
    with pytest.raises(StorageError, match=r"droplet_states\.columns\.xz has"):
        _ = old.droplet_states
    with pytest.raises(StorageError, match=r"onset\.columns\.xz has"):
        save(combine(tables(), old), tmp_path, {}, names=["onset"])
    with pytest.raises(StorageError, match=r"onset\.columns\.xz has"):
        save(old, tmp_path, {}, names=["onset"])
    assert path.exists()


def test_rows_of_tables_that_were_not_written_anew_are_those_of_the_record_before(tmp_path):
    saved(tmp_path)
    save(tables(), tmp_path, {}, add=True, names=["onset"])
    path = tmp_path / "states.columns.xz"
    assert len(read_folder(tmp_path).states)
    write_lines(path, lines_of(path)[:-1])
    with pytest.raises(StorageError, match=r"states\.columns\.xz has"):
        _ = read_folder(tmp_path).states


def test_the_record_of_the_reference_data_names_every_table_its_rows_and_its_runs():
    record = read_record(REFERENCE)
    assert set(record["rows"]) == set(NAMES)
    assert {path.name for path in REFERENCE.glob("*.columns.xz")} == {f"{name}.columns.xz" for name in NAMES}
    for name, count in record["rows"].items():
        lines = lzma.decompress((REFERENCE / f"{name}.columns.xz").read_bytes()).decode().splitlines()
        assert {line.count(",") for line in lines} == {count} and count > 0
    assert [run["campaign"] for run in record["runs"]] == ["dynamics"] + 2 * ["beyond_the_papers"] + 10 * [
        "reference"
    ] + ["beyond_the_papers"] + 11 * ["reference"] + 3 * ["beyond_the_papers"]
    assert all(run["commit"] and run["file"] and run["rows"] for run in record["runs"])


def test_data_of_the_package_are_small():
    """What installs beside the code: tables, example packings."""
    code = {".py", ".pyi", ".js", ".css", ".html", ".toml", ".typed"}
    root = Path(str(resources.files("jamlab")))
    files = [p for p in root.rglob("*") if p.is_file() and p.suffix not in code and "__pycache__" not in p.parts]
    size = sum(path.stat().st_size for path in files if path.suffix not in (".so", ".h", ".cpp"))
    assert size < 6e6


def test_the_summary_counts_numbers_of_the_papers_alone():
    theirs, beside = drawn("boromand-6").claims, drawn("dynamics-flow-curves").claims
    assert beside and first_line([*theirs, *beside]) == first_line(theirs)
    assert first_line(theirs).startswith(f"{sum(c.counted for c in theirs)} numbers of both papers: ")
    tables = drawn("tables").claims
    assert first_line(tables).startswith(f"{len(tables) - 2} numbers") and "2 identities and dup" in first_line(tables)


def test_the_readme_repeats_how_many_numbers_agree():
    """`python -m studies draw papers` writes the file; the slow test below draws it anew."""
    told = (REFERENCE / SUMMARY).read_text().splitlines()[0]
    readme = Path(__file__).parents[2] / "README.md"
    assert told in " ".join(readme.read_text().split())


@pytest.mark.slow
def test_the_page_of_contradictions_has_the_numbers_of_the_figure():
    """Where droplets reach z = 6, the exponent of their missing contacts in 1 - rho, by N, and where models part."""
    values = gallery.draw("boromand-9", reference_tables()).values
    sizes = [name.rpartition(" = ")[2] for name in values if name.startswith("1 - rho where z = 6")]
    reached = ", ".join(f"{values[f'1 - rho where z = 6, DP, N = {n}'].value:.4f}" for n in sizes)
    slopes = ", ".join(f"{values[f'exponent of z_conf - z in 1 - rho, DP, N = {n}'].value:.2f}" for n in sizes)
    page = " ".join((Path(__file__).parents[2] / "docs" / "explanation" / "against_the_papers.md").read_text().split())
    assert sizes and [numbers for numbers in (", ".join(sizes), reached, slopes) if numbers not in page] == []
    claims = {c.quantity: c for c in gallery.draw("boromand-5", reference_tables()).claims}
    part = claims["rho from which z of DP exceeds SP by 2 %"]
    words = f"by 2 % from ρ = {part.value:.2f} and by 3 % from {float(part.family['share = 0.03'].value):.2f}"
    limits = (Path(__file__).parents[2] / "docs" / "explanation" / "limits.md").read_text(encoding="utf-8")
    assert words in " ".join(limits.split())


@pytest.mark.slow
def test_every_figure_is_drawn_from_the_reference_data(tmp_path):
    """Two processes write, this one draws once more: pictures are the same to the last byte."""
    drawn, failures = gallery.write_all(list(gallery.FIGURES), reference_tables(), tmp_path / "two", processes=2)
    assert not failures and [d.name for d in drawn] == list(gallery.FIGURES)
    measured = [c for d in drawn for c in d.claims if c.measured]
    assert len(measured) > 60
    differing = [c for d in drawn for c in d.claims if c.verdict is Verdict.DIFFERS]
    assert [c.line for c in differing if not (c.cause and c.shown_by)] == []  # a difference has a measured cause
    assert (tmp_path / "two" / SUMMARY).read_text() == (REFERENCE / SUMMARY).read_text()
    for name in gallery.FIGURES:
        shown = gallery.draw_shown(name, reference_tables())
        for path in write_files(name, shown, tmp_path)[0]:
            assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()
        assert (name, covered(shown.figure)) == (name, 0)


def covered(figure):
    """How many points of curves, of lines between them and of bands lie under a legend or an inset."""
    figure.canvas.draw()
    count = 0
    for axes in figure.axes:
        legend = axes.get_legend()
        boxes = [legend.get_window_extent()] if legend else []
        boxes += [inset.get_tightbbox() for inset in axes.child_axes]
        paths = [(line.get_transform(), line.get_path(), line.get_linestyle() != "None") for line in axes.lines]
        paths += [(band.get_transform(), path, True) for band in axes.collections for path in band.get_paths()]
        for transform, path, joined in paths:
            points = transform.transform(path.vertices)
            points = points[np.isfinite(points).all(axis=1)]
            if joined and len(points) > 1:
                points = np.concatenate([points[:-1] + t * np.diff(points, axis=0) for t in np.linspace(0, 1, 20)])
            count += sum(box.contains(*point) and axes.bbox.contains(*point) for box in boxes for point in points)
    return count


def test_what_a_legend_covers_is_counted():
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], label="a line")
    axes.legend(loc="center")
    assert covered(figure) > 0
    axes.legend(loc="upper left")
    assert covered(figure) == 0


def test_counts_that_came_later_are_nan_in_packings_from_before():
    """Other columns stay those that both have."""
    onset = TABLES["onset"]().query("model == 'dp'")
    new, old = onset.query("n == 32"), onset.query("n == 64").drop(columns=[*COUNTS, "phi_J"])
    states = onset.assign(state=0)[["task", "state"]]
    both = combine(*(EnsembleTables({"onset": part, "states": states}.get) for part in (new, old))).onset
    assert both.groupby("n")["pairs"].count().to_dict() == {32: 30, 64: 0}
    assert len(both) == 60 and "phi_J" not in both

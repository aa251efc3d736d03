"""What a terminal shows: tables that fit it, progress with the time left, plain lines where there is none."""

import io

import pytest
from rich.console import Console

from jamlab.cli import console
from jamlab.cli.console import print_packings, progress_bar

COLUMNS = ["rho", *(f"column_{k}" for k in range(12))]
LINES = [[f"0.8{row}", *(f"{row}.{k:04d}" for k in range(12))] for row in range(3)]


@pytest.fixture
def printed(monkeypatch):
    """Function that prints into a text of a given width."""

    def run(width, action):
        text = io.StringIO()
        monkeypatch.setattr(console, "out_console", Console(file=text, width=width))
        action()
        return text.getvalue()

    return run


@pytest.mark.parametrize("width", [40, 80, 140, 160])
def test_tables_fit_the_terminal_and_lose_nothing(printed, width):
    text = printed(width, lambda: console.print_table("title", COLUMNS, LINES))
    assert max(map(len, text.splitlines())) <= width
    words = text.split()
    for word in [*COLUMNS, *(cell for line in LINES for cell in line)]:
        assert word in words, word
    assert (words.count("rho") > 1) == (width < 140)


def test_names_with_brackets_are_printed_as_they_are(printed):
    assert "a[red]b.h5" in printed(80, lambda: console.print_table("a[red]b.h5", ["x", "y"], [["[1]", "2"]]))


def test_empty_columns_are_left_out_and_missing_moduli_explained(printed, random_disks):
    """Disks that were never minimised have no modulus; the table says why instead of printing nan."""
    text = printed(160, lambda: print_packings([random_disks(phi=1.1), random_disks(phi=1.1)], None, False))
    assert "G_xy" not in text and "nan" not in text
    assert text.count("not stable: ") == 1 and "minimum" in text


def test_plain_lines_where_there_is_no_terminal(monkeypatch):
    text = io.StringIO()
    monkeypatch.setattr(console, "err_console", Console(file=text, width=80))
    clock = iter(range(0, 1000, 6))
    monkeypatch.setattr(console, "_LINE_INTERVAL", 10.0)
    monkeypatch.setattr(console.time, "monotonic", lambda: float(next(clock)))
    with progress_bar("soft particles") as show:
        for share, phi in ((0.01, 0.3), (float("nan"), 0.5), (0.2, 0.7), (0.3, 0.82)):
            show(share, f"onset {phi}")
    lines = text.getvalue().splitlines()
    assert len(lines) == 2 and all(line.startswith("soft particles: onset 0.") for line in lines)
    assert "s so far" in lines[0] and "left" in lines[1] and "\x1b" not in text.getvalue()


def test_a_log_of_a_day_is_short(monkeypatch):
    """A line every 30 s at first, every 10 min later."""
    text, now = io.StringIO(), [0.0]
    monkeypatch.setattr(console, "err_console", Console(file=text, width=80))
    monkeypatch.setattr(console.time, "monotonic", lambda: now[0])
    with progress_bar("soft particles", guess=False) as show:
        for second in range(0, 86_400, 5):
            now[0] = float(second)
            show(0.5, f"at {second} s")
    lines = text.getvalue().splitlines()
    assert lines[0] == "soft particles: at 35 s, 35 s so far"
    assert 150 < len(lines) < 250


def test_a_run_that_goes_on_from_its_file_counts_only_what_it_does_itself(monkeypatch):
    """Half of the work was done before: a tenth more in 6 s leaves four tenths, 24 s."""
    text = io.StringIO()
    monkeypatch.setattr(console, "err_console", Console(file=text, width=80))
    clock = iter([0.0, 0.0, 6.0, 100.0])
    monkeypatch.setattr(console.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(console, "_LINE_INTERVAL", 1.0)
    with progress_bar("shear") as show:
        show(0.5, "strain 0.5")
        show(0.6, "strain 0.6")
    assert "strain 0.6, about 24 s left, 6 s so far" in text.getvalue()

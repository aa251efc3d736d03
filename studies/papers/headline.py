"""Draw 16 headline numbers of both papers beside ours, and five differences with their reasons, in one picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import ceil, floor, hypot, log10
from typing import Any

from matplotlib.ticker import FormatStrFormatter

from jamlab.plotting.palette import BLACK
from studies.panels import Drawing, drawing
from studies.papers.forest import BAND
from studies.papers.statements import caption, reasons, statements
from studies.papers.verdicts import LOOKS, NORMAL, TOLERANCE, Comparison, Verdict

NAME = "papers-headline"
TITLE = "Headline numbers of both papers beside ours, and what differs"
HEADLINES: Mapping[str, str] = {  # rows, in the order of the picture -> what they are, in short
    "B10-onset-sp": r"onset, large $N$, $\varphi_J$",
    "B10-theta-sp": r"spread of onsets, $\theta$",
    "B11-kappa": r"overlap energy, $\kappa$",
    "B11-omega-small-sp": r"shape of disks, $\omega$",
    "B6-alpha0": r"contacts of disks, $\alpha_0$",
    "B8-P3-dense-dp": r"three-sided voids, $P_3$",
    "BT-G0-sp-phi": r"modulus of disks, $G_0$",
    "T3-mu": r"static modulus, $\mu$",
    "T3-lambda": r"relaxation time, $\lambda$",
    "T3-Delta-loss": r"critical loss, $\Delta$",
    "T3-Delta-storage": r"critical storage, $\Delta$",
    "T4-beta-star": r"damping of sliding, $\beta^*$",
    "T5-rms-approach": r"r.m.s. $\Delta u_\parallel$, exponent",
    "T5-rms-sliding": r"r.m.s. $\Delta u_\perp$, exponent",
    "T8-a-contact": "size, contact damping, $a$",
    "T8-a-stokes": "size, Stokes drag, $a$",
}
PAPERS = {"[B]": "[B] Boromand et al.", "[T]": "[T] Baumgarten & Tighe"}
MOST = 5  # differences that are shown
SPAN = (0.79, 1.21)  # of the axis of ratios
SOFT = "#444444"
MARKED = (Verdict.DIFFERS, Verdict.TENSION)


@dataclass(frozen=True)
class Look:
    """Where things stand in a picture, in inches, and how large its letters are."""

    width: float
    height: float
    letters: float  # points
    axis: tuple[float, float]  # ends of the axis of ratios; names stand before it
    paper: float  # column of the paper's numbers
    ours: float  # column of ours
    rows: tuple[float, float]  # bottom and top of the rows
    differences: tuple[float, float, float, float]  # left, bottom, width, height


WIDE = Look(9.4, 4.9, 9.5, (1.95, 3.75), 3.87, 4.42, (0.55, 4.85), (5.35, 0.2, 4.0, 4.6))
NARROW = Look(4.0, 8.2, 8.2, (1.55, 2.65), 2.73, 3.18, (3.95, 8.15), (0.08, 0.05, 3.9, 3.3))


def with_error(value: float, error: float) -> str:
    """Write a value with its standard error in its last digits, rounded up: one digit, or two that begin with 1.

    >>> from studies.papers.headline import with_error
    >>> with_error(0.84212, 0.00077), with_error(0.5087, 0.0121), with_error(-0.2551, 0.0098), with_error(2.93, 0)
    ('0.8421(8)', '0.509(13)', '−0.255(10)', '2.93')
    """
    if error <= 0:
        return f"{value:.3g}".replace("-", "−")
    power = floor(log10(error))
    digits = -power + (error < 2 * 10.0**power)
    tail = ceil(error * 10.0**digits - 1e-9)
    if digits <= 0:
        return f"{round(value, digits):.0f}({tail * 10**-digits})".replace("-", "−")
    return f"{value:.{digits}f}({tail})".replace("-", "−")


def ours(c: Comparison) -> str:
    """Write our number with the standard errors of packings and of other analyses as one."""
    return with_error(c.measured.value, hypot(c.statistical, c.systematic))


def theirs(c: Comparison) -> str:
    """Write the paper's number to three digits."""
    sign = "" if c.statement.relation == "=" else c.statement.relation
    return f"{sign}{c.statement.value:.3g}".replace("-", "−")


def headlines(comparisons: Sequence[Comparison]) -> list[Comparison]:
    """Pick the headline numbers that are measured, in their order."""
    found = {c.statement.id: c for c in comparisons if c.measured.known}
    return [found[name] for name in HEADLINES if name in found]


def differences(comparisons: Sequence[Comparison]) -> list[tuple[str, str, Comparison]]:
    """List what differs or is in tension and can be tested, one row for each reason: what it is, why, and the row that
    is farthest off, rows that differ first."""
    apart = {c.statement.id: c for c in comparisons if c.statement.tested and c.verdict in MARKED}
    found = []
    for text, names in groupby(reasons().items(), key=lambda item: item[1]):
        rows = [apart[name] for name, _ in names if name in apart]
        if rows:
            what, _, why = text.partition(": ")
            found.append((what, why, rows[0]))
    return found


def unexplained(comparisons: Sequence[Comparison]) -> list[str]:
    """List the numbers of both papers that differ or are in tension, can be tested, and have no line in reasons.md."""
    tests = [c.statement for c in comparisons if c.verdict in MARKED and c.statement.tested and c.statement.counted]
    return [s.id for s in tests if s.id not in reasons()]


# picture --------------------------------------------------------------------------------------------------------------


def headline(comparisons: Sequence[Comparison], look: Look = WIDE) -> Drawing:
    """Draw the headline numbers as ratios, and what differs with one line of reason each, beside them or below."""
    name = NAME if look is WIDE else f"{NAME}-narrow"
    out, (ratios, words) = drawing(name, 1, 2, look.width / 2, look.height)
    out.figure.set_layout_engine("none")
    left, bottom, width, height = look.differences
    size = (look.width, look.height) * 2
    span, (low, high) = look.axis[1] - look.axis[0], look.rows
    ratios.set_position([x / unit for x, unit in zip((look.axis[0], low, span, high - low), size, strict=True)])
    words.set_position([x / unit for x, unit in zip((left, bottom, width, height), size, strict=True)])
    _draw_ratios(out, ratios, headlines(comparisons), look)
    _write_differences(words, differences(comparisons), look)
    out.caption = caption(NAME)
    return out


def _draw_ratios(out: Drawing, axes: Any, found: Sequence[Comparison], look: Look) -> None:
    """Draw a row for each number: name, ratio with its 95 % interval, the paper's value, ours."""

    def write(x: float, y: float, text: str, **more: Any) -> None:
        place: dict[str, Any] = {"xycoords": ("figure fraction", "data"), "annotation_clip": False, "va": "center"}
        axes.annotate(text, (x / look.width, y), fontsize=look.letters, **place, **more)

    axes.axvspan(1 - TOLERANCE, 1 + TOLERANCE, color=BAND, zorder=0)
    axes.axvline(1, color=BLACK, linewidth=0.8, zorder=1)
    write(look.paper, 0, "paper", weight="bold")
    write(look.ours, 0, "jamlab", weight="bold")
    y = 0.0
    for letter, group in groupby(found, key=lambda c: c.statement.where[:3]):
        write(0.05, y, PAPERS[letter], weight="bold")
        for c in group:
            y -= 1
            _draw_ratio(out, axes, c, y)
            write(0.05, y, HEADLINES[c.statement.id])
            write(look.paper, y, theirs(c))
            write(look.ours, y, ours(c))
        y -= 1.2
    axes.set_yticks([])
    axes.set_xticks([0.8, 0.9, 1.0, 1.1, 1.2])
    axes.tick_params(axis="x", labelsize=look.letters)
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.set_xlim(*SPAN)
    axes.set_ylim(y + 0.6, 0.6)
    axes.set_xlabel("jamlab / paper, 95 %", fontsize=look.letters)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)


def _draw_ratio(out: Drawing, axes: Any, c: Comparison, y: float) -> None:
    value, unit = c.measured.value, c.statement.value
    half = 0.5 * NORMAL * hypot(c.statistical, c.systematic) / abs(unit)
    colour, marker = LOOKS[c.verdict]
    ends = [min(max(x, SPAN[0]), SPAN[1]) for x in (value / unit - half, value / unit + half)]
    axes.plot(ends, [y, y], color=colour, linewidth=2, zorder=2, solid_capstyle="butt")
    look: dict[str, Any] = {"color": colour, "marker": marker, "linestyle": "none", "markersize": 6, "zorder": 3}
    out.curve(axes, c.statement.id, [value / unit], [y], label=None, **look)


def _write_differences(axes: Any, found: Sequence[tuple[str, str, Comparison]], look: Look) -> None:
    """Write what differs: the quantity, the paper's value and ours, and the reason below."""
    axes.set_axis_off()
    place: dict[str, Any] = {"xycoords": "axes fraction", "va": "top"}
    axes.annotate("What differs, and why", (0.0, 1.0), weight="bold", fontsize=look.letters, **place)
    top, step = 0.92, 0.86 / MOST
    for k, (what, why, c) in enumerate(found[:MOST]):
        y, letter = top - step * k, c.statement.where[:3]
        lines = (f"{letter} {what}", f"paper {theirs(c)}, jamlab {ours(c)}: {c.verdict}", why)
        for row, (line, colour) in enumerate(zip(lines, (BLACK, BLACK, SOFT), strict=True)):
            axes.annotate(line, (0.05 * (row > 0), y - 0.3 * row * step), fontsize=look.letters, color=colour, **place)
    if len(found) > MOST:
        rest = ", ".join(what for what, _, _ in found[MOST:])
        axes.annotate(f"Also: {rest}", (0.0, top - step * MOST), fontsize=look.letters, color=BLACK, **place)


def missing_rows() -> list[str]:
    """List names that no row of `statements.csv` has, of headline numbers and of reasons."""
    return sorted({*HEADLINES, *reasons()} - set(statements()))

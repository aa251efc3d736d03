"""Draw all numbers of both papers in one picture: ours less the paper's, over the scale of such numbers."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from markupsafe import Markup
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from studies.html_page import render
from studies.panels import Drawing, drawing
from studies.papers.statements import caption
from studies.papers.verdicts import LOOKS, NORMAL, TOLERANCE, Comparison, Verdict, scale

NAME = "papers-forest"
TITLE = "Every number of both papers: ours less the paper's"
SPAN = 0.62  # of the axis to either side; what lies beyond is an arrow with its number
HEADING, MARGIN = 1.1, 4.0  # heights of a heading and of title and axis, in rows
BAND, TICK = "#DCE9F5", "#555555"  # colours of what agrees and of the paper's error, as in forest.html
PARTS = {  # of the picture: heading -> beginnings of the names of figures
    "[B], figs 4 to 7": tuple(f"boromand-{k}" for k in range(4, 8)),
    "[B], figs 8 to 11, tables 1 and 2": ("boromand-", "tables"),
    "[T]": ("baumgarten-",),
}


@dataclass(frozen=True)
class Bar:
    """One number, all lengths over its scale."""

    comparison: Comparison
    off: float  # ours less the paper's
    # half widths of 95 % intervals: of packings, and with other analyses
    packings: float
    both: float
    paper: float  # standard error of the paper's statement
    low: float  # ends of what agrees: the tolerance, or all on one side of a bound
    high: float

    @property
    def shown(self) -> float:
        """Where its mark stands on the axis."""
        return min(max(self.off, -SPAN), SPAN)

    @property
    def look(self) -> tuple[str, str]:
        """Colour and marker of its verdict."""
        return LOOKS[self.comparison.verdict]

    def within(self, half: float) -> tuple[float, float]:
        """Ends of an interval around ours, cut to the axis."""
        return max(self.off - half, -SPAN), min(self.off + half, SPAN)


def bars(comparisons: Sequence[Comparison]) -> list[Bar]:
    """Scale the counted numbers of both papers that are measured."""
    found = []
    for c in comparisons:
        s, m = c.statement, c.measured
        if not (s.counted and m.known):
            continue
        unit = scale(s.number, s.value)
        both = (c.statistical**2 + c.systematic**2) ** 0.5
        tolerance = max(TOLERANCE, s.margin / unit)
        low, high = {"=": (-tolerance, tolerance), ">": (0.0, SPAN), "<": (-SPAN, 0.0)}[s.relation]
        packings, analyses = 0.5 * NORMAL * c.statistical / unit, 0.5 * NORMAL * both / unit
        found.append(Bar(c, (m.value - s.value) / unit, packings, analyses, c.paper / unit, low, high))
    return found


def by_figure(given: Sequence[Bar]) -> Iterator[tuple[str, list[Bar]]]:
    """Group bars by figure, in their order, with its heading."""
    for name, group in groupby(given, key=lambda bar: bar.comparison.statement.figure):
        letter = {"boromand": "[B]", "baumgarten": "[T]"}.get(name.partition("-")[0], "[B]")
        number = name.partition("-")[2]
        yield f"{letter} fig {number}" if number else f"{letter} tables 1 and 2", list(group)


# picture --------------------------------------------------------------------------------------------------------------


def forest(
    comparisons: Sequence[Comparison], name: str = NAME, parts: Mapping[str, tuple[str, ...]] = PARTS
) -> Drawing:
    """Draw a row for each number, by paper and figure, one part below the other."""
    rest, shown = bars(comparisons), {}
    for title, belong in parts.items():
        shown[title] = [bar for bar in rest if bar.comparison.statement.figure.startswith(belong)]
        rest = [bar for bar in rest if bar not in shown[title]]
    heights = [len(part) + HEADING * len(list(by_figure(part))) + MARGIN for part in shown.values()]
    out, places = drawing(name, len(parts), 1, 10.5, 0.21 * sum(heights) / len(parts))
    places[0].get_gridspec().set_height_ratios(heights)
    for axes, (title, part) in zip(places, shown.items(), strict=True):
        _draw_part(out, axes, part)
        axes.set_title(title, fontsize=12, loc="right")
        axes.annotate("ours | paper", (1.01, 1.0), xycoords="axes fraction", fontsize=10, va="bottom")
        axes.set_xlabel("(ours − paper) / scale", fontsize=11)
    handles = _verdicts()
    handles += [
        Line2D([], [], color="#777777", linewidth=4, label="95 %, packings"),
        Line2D([], [], color="#777777", linewidth=1.2, label="with other analyses"),
        Line2D([], [], color=TICK, linewidth=1.5, label="the paper's standard error"),
        Patch(facecolor=BAND, label="agrees: a tenth of the scale, or half the last digit"),
    ]
    out.figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=10, frameon=False)
    out.caption = caption(name)
    return out


def _verdicts() -> list[Any]:
    """Make the entries of a legend for the verdicts."""
    looks: list[tuple[Any, ...]] = [
        (str(verdict), *look, "full") for verdict, look in LOOKS.items() if verdict != Verdict.MISSING
    ]
    looks.append(("open: no test", "#777777", "o", "none"))
    return [
        Line2D([], [], color=colour, marker=marker, fillstyle=fill, linestyle="none", markersize=8, label=name)
        for name, colour, marker, fill in looks
    ]


def _draw_part(out: Drawing, axes: Any, given: Sequence[Bar]) -> None:
    """Draw the rows of one part, below the heading of each figure."""
    y, places, names = 0.0, [], []
    for heading, group in by_figure(given):
        axes.annotate(heading, (-SPAN, y), fontsize=11, weight="bold", va="center")
        for bar in group:
            y -= 1
            _draw_bar(out, axes, bar, y)
            places.append(y)
            names.append(bar.comparison.statement.latex)
        y -= HEADING
    axes.axvline(0, color="black", linewidth=0.8)
    axes.set_yticks(places, names, fontsize=10)
    axes.set_ylim(y, 0.9)
    axes.set_xlim(-1.03 * SPAN, 1.03 * SPAN)
    axes.grid(axis="x", alpha=0.25)


def _draw_bar(out: Drawing, axes: Any, bar: Bar, y: float) -> None:
    statement, (colour, marker) = bar.comparison.statement, bar.look
    axes.barh(y, bar.high - bar.low, left=bar.low, height=0.8, color=BAND, zorder=0)
    if bar.paper:
        error = min(bar.paper, SPAN)
        axes.plot([-error, error], [y - 0.28] * 2, color=TICK, linewidth=1.5, zorder=1, solid_capstyle="butt")
    beyond = bar.shown != bar.off
    look: dict[str, Any] = {"color": colour, "linestyle": "none", "markersize": 6.5, "zorder": 3}
    if beyond:
        look["marker"], way = (">", -1) if bar.off > 0 else ("<", 1)
        place: dict[str, Any] = {"ha": "right" if way < 0 else "left", "va": "center", "fontsize": 9, "color": colour}
        axes.annotate(f"{bar.off:+.1f}", (bar.shown, y), xytext=(10 * way, 0), textcoords="offset points", **place)
    else:
        look["marker"] = marker
        for half, width in ((bar.both, 1.2), (bar.packings, 4.0)):
            axes.plot(bar.within(half), [y, y], color=colour, linewidth=width, zorder=2, solid_capstyle="butt")
    fill = colour if statement.tested else "white"
    out.curve(axes, statement.id, [bar.shown], [y], label=None, markerfacecolor=fill, **look)
    sign = "" if statement.relation == "=" else statement.relation
    text = f"{bar.comparison.measured.value:.3g} | {sign}{statement.value:.3g}  {statement.reason}"
    axes.annotate(text, (1.01, y), xycoords=("axes fraction", "data"), va="center", fontsize=9.5)


# page -----------------------------------------------------------------------------------------------------------------


def forest_rows(comparisons: Sequence[Comparison], anchors: Mapping[str, str]) -> Markup:
    """Write the same as rows of a page, each a link to the section of its figure; anchors are by figure."""
    looks = {verdict: colour for verdict, (colour, _) in LOOKS.items() if verdict != Verdict.MISSING}
    words = {"groups": by_figure(bars(comparisons)), "anchors": anchors, "looks": looks, "text": caption(NAME)}
    return render("forest.html", span=SPAN, **words)

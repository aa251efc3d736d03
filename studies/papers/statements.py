"""Numbers and sentences of the papers, a row each of `statements.csv`, and what measures them in our packings.

The column `sentence` says what a number is, by `words` that are quoted from the place `where`: whether it is a test
follows from that, unless `no_test` says why not.

A number is measured by a short function, its statistic, of a sample of packings, with settings and other defensible
analyses (`variants`) as keywords of either. Rows with the same analysis take its numbers in their order. Prose stands
in `explanations.md` and `captions.md`.
"""

from ast import literal_eval
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from fractions import Fraction
from functools import cache, partial
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from jamlab.errors import ConvergenceError, InputError, StorageError
from jamlab.statistics.confidence import Interval
from studies.ensembles import RESAMPLES, Sample, name_keywords, vary_bootstrap
from studies.papers.controls.passed import failed
from studies.tables import AbsentTableError

if TYPE_CHECKING:
    from studies.ensemble_tables import EnsembleTables

FOLDER = Path(__file__).parent
DUPLICATE = "duplicate"  # another row measures the same
IDENTITY = "identity"  # every packing of the model gives it: linear response, or a count of contacts
UNTESTED = (  # why a number is no test although its sentence is one
    *(DUPLICATE, IDENTITY, "paper inconsistent"),  # it contradicts another number of the same paper
    "not comparable",  # other conditions
    *("ensemble not printed", "threshold not printed"),  # which packings are averaged, what "begins" means
    "no power law",  # local exponents run through the window
    "collinear coefficients",  # of a fit of two terms: windows move them, not the curve, which is a number of its own
    "corrections to scaling",  # larger than the differences in reach of packings
)
BLIND = "estimator fails a control"  # it does not find a law that it is given, see `studies.papers.controls`


class Sentence(StrEnum):
    """What the sentence of a paper is from which a number comes."""

    MEASURED = "measured"  # a result, of packings or of an argument that a figure of the paper tests
    DRAWN = "drawn"  # a line or a curve of a figure
    GUESS = "guess"  # said to be likely, while the paper measures something else
    APPROXIMATE = "approximate"  # a word, or a place without a threshold: "similar", "near", "of order 1"
    UNPRINTED = "unprinted parameters"  # decided by parameters that the paper does not print; ours are fitted to it
    DEFINITION = "definition"  # follows from an equation, a count, or the choice of a name

    @property
    def is_test(self) -> bool:
        """Whether packings can contradict such a sentence."""
        return self in (Sentence.MEASURED, Sentence.DRAWN, Sentence.APPROXIMATE)


@dataclass(frozen=True)
class Statement:
    """One number that a paper prints, or says in words."""

    id: str
    figure: str  # that shows it, such as "boromand-6"
    where: str  # section, figure or table of the paper
    quantity: str  # in plain words
    latex: str  # the same with symbols
    value: float
    relation: str  # "=", or ">" and "<" where the paper gives a bound only
    margin: float  # error that the paper states, or half a unit of its last digit
    stated: str  # how: stated, fit, line, read, share, word, about, order, theory, bound, digits
    argument: float  # error that goes with it; of a line the decades over which the paper shows it
    number: str  # what it is: exponent, coefficient, ratio, density, contacts, shape, void shape, share, decades
    sentence: Sentence  # what it is, by the words below
    words: str = ""  # of the paper at that place, quoted
    no_test: str = ""  # one of `UNTESTED`, whatever the sentence is
    note: str = ""  # on its definition
    # functions below `studies`, "" without data; keywords of both; others, parted by semicolons
    statistic: str = ""
    sample: str = ""
    settings: str = ""
    variants: str = ""

    @property
    def analysis(self) -> tuple[str, ...]:
        """What gives its number, with others."""
        return self.statistic, self.sample, self.settings, self.variants

    @property
    def listed(self) -> bool:
        """Whether figures show it: it is a number of its own, and has something to measure."""
        derived = self.sentence == Sentence.DEFINITION or self.no_test == IDENTITY
        return self.no_test != DUPLICATE and (bool(self.statistic) or not derived)

    @property
    def counted(self) -> bool:
        """Whether it is a number of one of the two papers, of its own."""
        return self.listed and self.where.startswith(("[B]", "[T]"))

    @property
    def reason(self) -> str:
        """Why our packings cannot test it, in a word or two; "" for a test."""
        if self.no_test or not self.sentence.is_test:
            return self.no_test or str(self.sentence)
        return BLIND if failed(self.id) else ""

    @property
    def tested(self) -> bool:
        """Whether our packings can test it."""
        return not self.reason

    @property
    def text(self) -> str:
        """Write the paper's value, with half its last digit or the error that it prints."""
        return self.text_with(self.margin)

    def text_with(self, error: float) -> str:
        """Write the paper's value with an error."""
        sign = "" if self.relation == "=" else f"{self.relation} "
        return f"{sign}{self.value:.4g}{f' ± {error:.2g}' if error else ''}"


@cache
def statements() -> dict[str, Statement]:
    """Read all numbers by id, in the order of the table."""
    table = pd.read_csv(FOLDER / "statements.csv", dtype=str, keep_default_na=False)
    table = table[table["id"] != ""]  # sentences without a number
    numbers = {"value": table["value"].map(lambda text: float(Fraction(text)))}
    numbers |= {name: pd.to_numeric(table[name]).astype(float) for name in ("margin", "argument")}
    rows: list[dict[str, Any]] = table.assign(**numbers).to_dict("records")  # type: ignore[assignment]
    return {row["id"]: Statement(**row | {"sentence": Sentence(row["sentence"])}) for row in rows}


def paper(statement: str) -> float:
    """Look up the value that a paper prints."""
    return statements()[statement].value


@cache
def _read_prose(name: str) -> dict[str, str]:
    """Read the paragraph under each heading of the Markdown files of a name, by the names in the heading."""
    found: dict[str, str] = {}
    for path in FOLDER.parent.glob(f"*/{name}"):
        for part in path.read_text(encoding="utf-8").split("\n## ")[1:]:
            headings, _, text = part.partition("\n")
            found |= {heading.strip(): " ".join(text.split()) for heading in headings.split(",")}
    return found


def explanations() -> dict[str, str]:
    """Why numbers differ, by id."""
    return _read_prose("explanations.md")


def reasons() -> dict[str, str]:
    """What numbers are that differ, and why, in one line, by id; rows of one reason have the same line."""
    return _read_prose("reasons.md")


def caption(figure: str, **numbers: Any) -> str:
    """Write what a figure shows, by the `captions.md` of its folder."""
    return _read_prose("captions.md")[figure].format(**numbers)


# measurements ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Measured:
    """A number of our packings; nan where the data do not give it."""

    value: float = np.nan
    # low, high: ends of its 95 % interval over packings
    low: float = np.nan
    high: float = np.nan
    variants: Mapping[str, Interval] = field(default_factory=dict)  # name of another analysis -> what it gives
    how: str = ""  # definition and settings
    lacking: str = ""  # why it is not measured

    @property
    def known(self) -> bool:
        """Whether the data give a value with an interval."""
        return bool(np.isfinite([self.value, self.low, self.high]).all())

    @property
    def systematic(self) -> tuple[float, float]:
        """How far variants lie below and above the value."""
        moved = [float(other.value) - self.value for other in self.variants.values()]
        return max([0.0, *(-m for m in moved)]), max([0.0, *moved])


def keywords(text: str) -> dict[str, Any]:
    """Read pairs such as "low=0.01, y=d_rho"; numbers, True, False and None as such, else words."""
    found = {}
    for pair in text.split(", ") if text else ():
        name, _, value = pair.partition("=")
        try:
            found[name] = literal_eval(value)
        except (SyntaxError, ValueError):
            found[name] = value
    return found


def find(name: str) -> Callable[..., Any]:
    """Import a function by its name below `studies`."""
    module, _, function = name.rpartition(".")
    return getattr(import_module(f"studies.{module}"), function)  # type: ignore[no-any-return]


def measure(name: str, tables: "EnsembleTables") -> Measured:
    """Measure a number in some tables; once, for its figure and its row, and for all rows with the same analysis."""
    wanted = statements()[name]
    if not wanted.statistic:
        return Measured(lacking="there are no data to measure it in")
    if wanted.analysis not in tables.measured:
        try:
            tables.measured[wanted.analysis] = analyse(wanted, tables)
        except (InputError, ConvergenceError, StorageError) as error:
            tables.measured[wanted.analysis] = [Measured(lacking=str(error))]
    found: Sequence[Measured] = tables.measured[wanted.analysis]
    alike = [s.id for s in statements().values() if s.analysis == wanted.analysis]
    return found[min(alike.index(name), len(found) - 1)]


def analyse(wanted: Statement, tables: "EnsembleTables") -> Sequence[Measured]:
    """Compute a statistic of a sample of packings, with its variants: of the statistic alone on the same
    resamples, of the sample on their own, such as the other `count` of contacts. Without a sample the statistic takes
    the tables, and does all that."""
    function, settings = find(wanted.statistic), keywords(wanted.settings)
    variants = [keywords(text) for text in wanted.variants.split("; ") if text]
    if not wanted.sample:
        return function(tables, **settings)  # type: ignore[no-any-return]
    sample: Callable[..., Sample] = find(wanted.sample)
    own, resamples = {*signature(sample).parameters, "count"}, settings.pop("resamples", RESAMPLES)

    def run(more: Mapping[str, Any], *within: Mapping[str, Any]) -> tuple[Interval, dict[str, Interval]]:
        given = {**settings, **more}
        counted = tables.strong if given.pop("count", "all") == "strong" else tables
        taken = sample(counted, **{k: v for k, v in given.items() if k in own})
        filled = partial(function, **{k: v for k, v in given.items() if k not in own})
        return vary_bootstrap(taken, filled, *within, resamples=resamples)

    found, family = run({}, *(v for v in variants if not set(v) & own))
    for other in (v for v in variants if set(v) & own):
        with suppress(
            InputError, ConvergenceError, AbsentTableError
        ):  # a campaign of one's own may lack a study's table
            family[name_keywords(other)] = run(other)[0]
    doc = " ".join((function.__doc__ or "").partition(".")[0].split())
    how = f"{doc}; {wanted.settings}".removesuffix("; ")
    numbers = []
    for k in np.ndindex(found.value.shape):
        others = {name: v[k] for name, v in family.items() if np.isfinite(v.value[k])}
        numbers.append(Measured(float(found.value[k]), float(found.low[k]), float(found.high[k]), others, how))
    return numbers


def names(figure: str) -> list[str]:
    """List the ids of the numbers of a figure that are measured."""
    return [name for name, s in statements().items() if s.figure == figure and s.listed]

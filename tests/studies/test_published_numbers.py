"""Numbers of the papers: fits of their tables, margins from the digits printed."""

import numpy as np
import pytest

from studies import published_numbers
from studies.published_numbers import (
    TABLE_1,
    TABLE_2,
    Published,
    printed,
    table_contacts,
    table_entry,
    table_law,
    table_modulus,
)


@pytest.mark.parametrize("series", list(TABLE_1))
def test_fits_of_the_tables(series):
    d = np.array([0.0, 0.01, 0.09])
    z_j, _, z_0, z_1 = TABLE_1[series]
    g_0, g_1 = TABLE_2[series]
    # d = 0.01 and 0.09 have roots without rounding to speak of: 0.1 and 0.3
    assert table_contacts(series, d) == pytest.approx([z_j, z_j + 0.1 * z_0 + 0.01 * z_1, z_j + 0.3 * z_0 + 0.09 * z_1])
    assert table_modulus(series, d) == pytest.approx([0, 0.1 * g_0 + 0.01 * g_1, 0.3 * g_0 + 0.09 * g_1])
    assert [table_law((g_0, g_1), float(x)) for x in d] == table_modulus(series, d).tolist()


@pytest.mark.parametrize(
    ("text", "more", "margin"),
    [
        ("0.55", {}, 0.005),
        ("0.5", {}, 0.05),
        ("1/2", {}, 0.005),
        ("-1/4", {}, 0.005),
        ("2/3", {}, 0.005),
        ("1", {}, 0.05),
        ("1", {"decimals": 2}, 0.005),
        ("0.842", {"decimals": 2}, 0.0005),
        ("0.28", {"error": 0.02}, 0.02),
    ],
)
def test_one_rule_for_margins(text, more, margin):
    """The error that is stated, else half a unit of the last decimal; of a bound none."""
    assert printed(text, "sec 3", **more).margin == pytest.approx(margin)
    assert printed(text, "sec 3", ">", **more)[1:] == (0.0, ">", "sec 3")


def test_every_number_of_the_papers_has_its_margin_by_the_rule():
    """What is no bound is printed with one, two or three decimals, or has an error that the paper states."""
    numbers = [
        v for v in vars(published_numbers).values() if isinstance(v, Published) and v.where[:3] in ("[B]", "[T]")
    ]
    odd = {n.where: n.margin for n in numbers if n.relation == "=" and n.margin not in (0.05, 0.005, 0.0005)}
    assert len(numbers) > 60 and set(odd.values()) == {published_numbers.EXACT, published_numbers.ORDER}


@pytest.mark.parametrize(("value", "margin"), [(3.7, 0.05), (0.42, 0.005), (1.7, 0.05), (0.07, 0.005)])
def test_margins_are_half_a_unit_of_the_last_digit(value, margin):
    found = table_entry(value)
    assert (found.value, found.margin, found.relation) == (value, pytest.approx(margin), "=")

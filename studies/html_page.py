"""Write HTML pages from templates, with symbols set as mathematics."""

import re
from typing import Any

from jinja2 import Environment, PackageLoader, select_autoescape
from markupsafe import Markup, escape

_NAMES = "alpha beta gamma delta eps zeta eta theta kappa lambda mu rho sigma tau phi omega Delta"
_GREEK = dict(zip(_NAMES.split(), "αβγδεζηθκλμρστφωΔ", strict=True))
_LETTER = rf"(?<![\w.-])(?:(d?)({_NAMES.replace(' ', '|')})|([A-Za-zα-ωΔ]))"
_SYMBOL = re.compile(_LETTER + r"(?:_(\w+))?(?![\w=-])|\^(-?)([\w.]*\w)|(?<= )~(?= )")


def typeset(text: str) -> Markup:
    """Set symbols that words write in plain letters as mathematics.

    >>> from studies.html_page import typeset
    >>> print(typeset("z_J, p N^2 <a> ~ drho^alpha_0 N^-theta, --rho 0.9, a dot"))
    z<sub>J</sub>, p N<sup>2</sup> &lt;a&gt; ∝ Δρ<sup>α<sub>0</sub></sup> N<sup>−θ</sup>, --rho 0.9, a dot
    """

    def written(found: re.Match[str]) -> str:
        change, greek, latin, index, minus, power = found.groups()
        if power is not None:
            return f"<sup>{minus.replace('-', '−')}{_SYMBOL.sub(written, power)}</sup>"
        if not (greek or latin):
            return "∝"
        return ("Δ" if change else "") + (latin or _GREEK[greek]) + (f"<sub>{index}</sub>" if index else "")

    return Markup(_SYMBOL.sub(written, str(escape(text))))


def with_symbols(text: str) -> str:
    """Write Greek letters and differences as such in plain text.

    >>> from studies.html_page import with_symbols
    >>> with_symbols("tau* ~ p^-lambda, eta_0 at drho = 0.1")
    'τ* ~ p^-λ, η_0 at Δρ = 0.1'
    """
    found = rf"(?<![\w.])(d?)({_NAMES.replace(' ', '|')})(?![^\W_])"
    return re.sub(found, lambda m: ("Δ" if m[1] else "") + _GREEK[m[2]], text)


def render(template: str, **words: Any) -> Markup:
    """Fill a template beside this file."""
    environment = Environment(loader=PackageLoader("studies", ""), autoescape=select_autoescape())
    environment.filters["typeset"] = typeset
    return Markup(environment.get_template(template).render(**words))

"""What comparing the laws of the plugin with those of the analysis costs, over a run: pytest -m benchmark -s FILE."""

import time

import pytest

import jamlab
from jamlab.flow import agreement, overdamped_session
from tests.support.wca_law import WcaLaw

pytestmark = pytest.mark.benchmark


def of_wca(n):
    p = jamlab.pack(n, 1e-2, 1, ensemble="shear-stabilized")
    return jamlab.relax(jamlab.Packing("sp", p.box, p.positions, {"law": WcaLaw.name, "eps": 1.0}, "eps", p.diameters))


RUNS = {
    "64 disks, shear to 1": lambda: jamlab.shear(jamlab.pack(64, 1e-2, 1), 1e-2, 1.0),
    "256 disks, shear to 1": lambda: jamlab.shear(jamlab.pack(256, 1e-2, 1), 1e-2, 1.0),
    "64 disks, oscillation": lambda: jamlab.oscillate(jamlab.pack(64, 1e-2, 1), 0.1, 1e-3),
    "64 disks of WCA, shear to 1": lambda: jamlab.shear(of_wca(64), 1e-2, 1.0),
}


@pytest.mark.parametrize("name", RUNS)
def test_comparison_costs_a_hundredth(name, monkeypatch):
    spent = [0.0]

    def timed(*given):
        began = time.process_time()
        try:
            return agreement.compare(*given)
        finally:
            spent[0] += time.process_time() - began

    monkeypatch.setattr(overdamped_session, "compare", timed)
    RUNS[name]()  # imports, which the first comparison pays
    agreement.forget_flows()
    spent[0], began = 0.0, time.process_time()
    RUNS[name]()
    whole = time.process_time() - began
    print(f"\n{name}: comparison {1e3 * spent[0]:.2f} ms of {whole:.2f} s, {100 * spent[0] / whole:.2f} %")
    assert spent[0] < 0.01 * whole

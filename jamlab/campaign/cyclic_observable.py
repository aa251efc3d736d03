"""An observable of campaigns: cyclic quasi-static shear, a row for each state and amplitude."""

from typing import Annotated, Any, ClassVar

import numpy as np

from jamlab.campaign.keys import usual, within
from jamlab.campaign.observable import STATE, FileTable, Grid, Observable, Row
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.packing.packing import Packing

_PLACE = "sweep.cyclic_shear"


class CyclicShearing(FileTable):
    """Arguments of `jamlab.quasistatic_shear`, for every state and amplitude; the turning points are amplitude,
    -amplitude and amplitude."""

    amplitudes: Grid[Annotated[float, within("amplitudes", _PLACE)]]
    cycles: Annotated[int, within("cycles", _PLACE)] = usual("cycles", _PLACE)
    strain_step: Annotated[float, within("strain_step")] = usual("strain_step")
    force_tolerance: Annotated[float, within("force_tolerance")] | None = usual("force_tolerance")


class CyclicShearOfStates(Observable):
    """Limit cycles at each amplitude, at the area of the state, see `LimitCycle` and `ShearCycles`: the period is 0 and
    `cycles_before` nan of packings that do not repeat. `displacement` is the mean of the last cycle; `dissipated`,
    `plastic_events` and `hysterons` are means over the cycles of a period. Converged: repeats, by minima alone."""

    name, needs = "cyclic_shear", "a table with amplitudes"
    _OF_LIMIT: ClassVar = ("cycles_before", "dissipated", "plastic_events", "hysterons")
    columns = ("phi", "rho", *STATE, "amplitude", "cycles", "period", *_OF_LIMIT, "displacement", "converged")

    cyclic_shear: CyclicShearing

    def check(self, sites: float) -> None:
        how = self.cyclic_shear
        if (least := how.amplitudes[0]) < how.strain_step:
            raise ValueError(
                f"cyclic_shear.strain_step = {how.strain_step:g}: above the amplitude {least:g}: lower it to that"
            )

    def cases(self) -> list[tuple[dict[str, Any], Row]]:
        return [({"amplitude": each}, {"amplitude": each}) for each in self.cyclic_shear.amplitudes]

    def amount(self) -> float:
        how = self.cyclic_shear
        return 4 * how.cycles * sum(how.amplitudes) / how.strain_step

    def one(self, packing: Packing, **case: Any) -> list[Row]:
        how, amplitude = self.cyclic_shear, float(case["amplitude"])
        turns = [amplitude, -amplitude, amplitude]
        run = quasistatic_shear(packing, turns, how.strain_step, cycles=how.cycles, force_tolerance=how.force_tolerance)
        cycles, limit = run.cycles, run.limit_cycle
        row: Row = {"cycles": len(cycles), "period": run.period, "converged": bool(run.period and run.converged.all())}
        row["displacement"] = cycles.displacement[-1] if len(cycles) else np.nan
        if limit is not None:
            row |= {"cycles_before": limit.cycles_before, "dissipated": limit.dissipated / limit.period}
            row |= {"plastic_events": limit.events / limit.period, "hysterons": len(limit.hysterons) / limit.period}
        return [row]

    def refused(self) -> list[Row]:
        return [{}]

"""An observable of campaigns: plastic events of quasi-static shear, a row each."""

from typing import Annotated, Any, ClassVar

from pydantic import Field

from jamlab.campaign.keys import usual, within
from jamlab.campaign.observable import STATE, FileTable, Observable, Row
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.packing.packing import Packing

_PLACE = "sweep.plastic_events"


class EventSearch(FileTable):
    """Arguments of `jamlab.quasistatic_shear`, for every state."""

    strain: Annotated[float, within("strain", _PLACE)] = usual("strain", _PLACE)
    strain_step: Annotated[float, within("strain_step", _PLACE)] = usual("strain_step")
    event_width: Annotated[float, within("event_width", _PLACE)] = usual("event_width", _PLACE)
    force_tolerance: Annotated[float, within("force_tolerance", _PLACE)] | None = usual("force_tolerance")


class PlasticEventsOfStates(Observable):
    """Plastic events under quasi-static shear of every state at its area, see `PlasticEvents`; no rows of a state
    without events."""

    name = "plastic_events"
    _OF_EVENTS: ClassVar = (
        *("strain", "stress_drop", "released", "event_width", "energy", "participation", "contacts_lost"),
        *("contacts_gained", "neighbors_lost", "neighbors_gained", "t1"),
    )
    columns = ("phi", "rho", *STATE, *_OF_EVENTS, "converged")

    plastic_events: EventSearch = Field(default=EventSearch())

    def check(self, sites: float) -> None:
        how = self.plastic_events
        if how.event_width >= how.strain_step:
            raise ValueError(
                f"plastic_events.event_width = {how.event_width:g}: must be below strain_step = {how.strain_step:g}"
            )

    def amount(self) -> float:
        return self.plastic_events.strain / self.plastic_events.strain_step

    def one(self, packing: Packing, **_: Any) -> list[Row]:
        how = self.plastic_events
        run = quasistatic_shear(
            packing, how.strain, how.strain_step, event_width=how.event_width, force_tolerance=how.force_tolerance
        )
        events = run.events
        found: Row = {name: getattr(events, name) for name in self._OF_EVENTS if name != "event_width"}
        return [found | {"event_width": events.width, "converged": bool(run.converged.all())}] if len(events) else []

"""
Plastic events
==============

Disks under quasi-static shear. The strain of each event is bracketed to 10⁻⁵. Left: stress over strain. Right: D²min of
each disk in the event that loses most energy. See :doc:`/how_to/plastic_events`.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=64, pressure=1e-2, seed=1)
r = jamlab.quasistatic_shear(p, strain=0.04, strain_step=2e-3, event_width=1e-5)
events = r.events
largest = int(events.energy.argmax())
figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.6), layout="constrained")
r.plot(ax=left)
jamlab.local_strain(events.before[largest], events.after[largest]).plot(ax=right)
right.set_title(f"{events.kind[largest]} event, {events.participation[largest]:.0f} disks take part")

// Mouse, touch, keyboard, slider and buttons; they call the explorer and know nothing of what it draws.

const REACH = {mouse: 5, pen: 8, touch: 14}; // pixels
const STRIDE = 40; // pixels that an arrow key with shift moves the picture
const TOGGLES = {f: 'forces', r: 'rattlers', v: 'voids', c: 'cells', d: 'displacements'};

/** Drag to pan, two fingers or the wheel to zoom, point or tap to ask. */
function watchPointers(canvas, explorer) {
  const held = new Map(), place = event => {
    const corner = canvas.getBoundingClientRect();
    return [event.clientX - corner.left, event.clientY - corner.top];
  };
  let moved = 0;
  canvas.addEventListener('pointerdown', event => {
    canvas.setPointerCapture(event.pointerId);
    if (held.size === 0) moved = 0;
    held.set(event.pointerId, place(event));
  });
  canvas.addEventListener('pointermove', event => {
    const now = place(event), before = held.get(event.pointerId);
    if (before === undefined) {
      if (event.pointerType !== 'touch') explorer.point(...now, REACH[event.pointerType] ?? REACH.mouse);
      return;
    }
    moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
    const others = [...held].filter(([id]) => id !== event.pointerId).map(([, where]) => where);
    held.set(event.pointerId, now);
    if (others.length === 0) {
      explorer.pan(now[0] - before[0], now[1] - before[1]);
    } else {
      const [still] = others, span = where => Math.hypot(where[0] - still[0], where[1] - still[1]);
      explorer.zoomBy(span(now) / (span(before) || 1), (now[0] + still[0]) / 2, (now[1] + still[1]) / 2);
      explorer.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    }
  });
  const release = event => {
    const where = held.get(event.pointerId);
    held.delete(event.pointerId);
    if (event.type === 'pointerup' && event.pointerType === 'touch' && moved < 8) explorer.point(...where, REACH.touch);
  };
  canvas.addEventListener('pointerup', release);
  canvas.addEventListener('pointercancel', release);
  canvas.addEventListener('pointerleave', event => event.pointerType === 'touch' || explorer.leave());
  canvas.addEventListener('wheel', event => {
    // a page that scrolls by on the way to something else is not to be held up
    if (!event.ctrlKey && !explorer.section.contains(document.activeElement)) return;
    event.preventDefault();
    explorer.zoomBy(Math.exp(-0.0015 * event.deltaY), ...place(event));
  }, {passive: false});
}

/** What a key does; the keys that are none of ours go on to the browser. */
function keyAction(explorer, {key: name, shiftKey, target}) {
  if (name === ' ' && target.matches('button, [type=checkbox]')) return undefined; // it presses what has the focus
  const arrows = {ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
  if (shiftKey && name in arrows) return () => explorer.pan(...arrows[name].map(part => STRIDE * part));
  if (name.toLowerCase() in TOGGLES) return () => explorer.toggle(TOGGLES[name.toLowerCase()]);
  return {
    ArrowLeft: () => explorer.jump(explorer.current - 1), ArrowRight: () => explorer.jump(explorer.current + 1),
    Home: () => explorer.jump(0), End: () => explorer.jump(Infinity), ' ': () => explorer.play(),
    '+': () => explorer.zoomBy(1.25), '=': () => explorer.zoomBy(1.25), '-': () => explorer.zoomBy(0.8),
    0: () => explorer.resetView(), Escape: () => explorer.leave(),
  }[name];
}

function watchKeys(section, explorer) {
  section.addEventListener('keydown', event => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const action = keyAction(explorer, event);
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}

function watchButtons(section, explorer) {
  const actions = {
    play: () => explorer.play(), nearer: () => explorer.zoomBy(1.25), farther: () => explorer.zoomBy(0.8),
    whole: () => explorer.resetView(),
  };
  for (const [name, action] of Object.entries(actions)) {
    section.querySelector(`[data-action=${name}]`)?.addEventListener('click', action);
  }
  for (const box of section.querySelectorAll('[data-toggle]')) {
    box.addEventListener('change', () => explorer.toggle(box.dataset.toggle, box.checked));
  }
  const slider = section.querySelector('[type=range]');
  slider?.addEventListener('input', () => explorer.jump(Number(slider.value)));
}

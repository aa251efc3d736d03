// What lies under the pointer, and what is said of it. All numbers come from the page, none is computed here.

/** The nearest image of what is drawn at a point of the screen: contacts first, then particles, then voids; or null. */
function pick(scene, px, py, reach) {
  const {view, state} = scene, [x, y] = view.toWorld(px, py);
  const moves = imagesAround(view, x, y), near = reach / view.scale;
  if (scene.shown.forces) {
    let best = null, least = near;
    state.contacts.forEach((contact, index) => {
      const [left, bottom, right, top] = contact.bounds;
      for (const move of moves) {
        const cx = x - move[0], cy = y - move[1];
        if (cx < left - near || cx > right + near || cy < bottom - near || cy > top + near) continue;
        const distance = distanceToContact(contact, cx, cy);
        if (distance < least) [best, least] = [{kind: 'contact', index, move}, distance];
      }
    });
    if (best !== null) return best;
  }
  return pickParticle(scene, x, y, moves) ?? (scene.shown.voids ? pickVoid(scene, x, y, moves) : null);
}

function imagesAround(view, x, y) {
  const [u, v] = view.toLattice(x, y).map(Math.floor), around = [-1, 0, 1];
  return around.flatMap(a => around.map(b => view.fromLattice(u + a, v + b)));
}

function distanceToContact({start, end}, x, y) {
  const ex = end[0] - start[0], ey = end[1] - start[1];
  const along = ((x - start[0]) * ex + (y - start[1]) * ey) / (ex * ex + ey * ey || 1);
  const t = Math.min(1, Math.max(0, along));
  return Math.hypot(x - start[0] - t * ex, y - start[1] - t * ey);
}

const paper = document.createElement('canvas').getContext('2d'); // for tests whether a path holds a point

function pickParticle({view, state, head}, x, y, moves) {
  for (const move of moves) {
    const px = x - move[0], py = y - move[1];
    for (let index = 0; index < head.n; index++) {
      const distance = Math.hypot(px - state.centres[2 * index], py - state.centres[2 * index + 1]);
      if (distance > state.radius[index]) continue;
      const path = new Path2D();
      traceParticle(path, state, head, index, 0, 0, 1 / view.scale);
      if (paper.isPointInPath(path, px, py)) return {kind: 'particle', index, move};
    }
  }
  return null;
}

function pickVoid({state}, x, y, moves) {
  for (const move of moves) {
    for (let index = 0; index < state.voids.list.length; index++) {
      const path = new Path2D();
      for (const points of state.voids.list[index].rings) tracePolygon(path, points, 0, 0);
      if (paper.isPointInPath(path, x - move[0], y - move[1], 'evenodd')) return {kind: 'void', index, move};
    }
  }
  return null;
}

/** A line with a number; none where the model does not say it. */
function known(name, value, unit = '') {
  return Number.isFinite(value) ? [`${name} ${number(value)}${unit}`] : [];
}

/** Lines of text about it, the first a heading. */
function describe({state, head, shown}, {kind, index}) {
  const {length, area, force} = head.units, particles = state.particles;
  if (kind === 'contact') {
    const contact = state.contacts[index];
    const lines = [
      `contact ${contact.i} – ${contact.j}`,
      `${contact.gap > 0 ? 'pull' : 'force'} ${number(contact.force)} [${force}]`,
      `gap ${number(contact.gap)} [${length}]`,
    ];
    return contact.bearing ? lines : [...lines, 'of a rattler: not counted in z'];
  }
  if (kind === 'void') {
    const gap = state.voids.list[index];
    return [`void between ${gap.sides} particles`, `area ${number(gap.area)} [${area}]`];
  }
  const name = head.particle, {sizes} = head, two = head.large[index] ? 'large' : 'small';
  const size = sizes ? `${sizes.name} ${number(sizes.values[index], 4)} [${length}]` : two;
  const lines = [
    `${name} ${index}, ${size}${particles.rattler[index] ? ', rattler' : ''}`,
    ...known('𝒜', particles.shape[index]),
    `z ${particles.z[index]}`,
    ...known('area', particles.area[index], ` [${area}]`),
    ...known('cell', particles.cell[index], ` [${area}]`),
  ];
  if (shown.displacements && state.moves !== null) {
    const moved = Math.hypot(state.moves[2 * index], state.moves[2 * index + 1]);
    lines.push(`moved ${number(moved)} [${length}]`);
  }
  return lines;
}

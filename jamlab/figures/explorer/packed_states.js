// From the text inside the page to arrays: the other side of states.py.

function decode(text, Kind) {
  return new Kind(Uint8Array.from(atob(text), character => character.charCodeAt(0)).buffer);
}

/** Lines of several points, each with the box around it: left, bottom, right, top. */
function unpackLines(packed) {
  const points = decode(packed.points, Float32Array), lines = [];
  let begin = 0;
  for (const end of decode(packed.ends, Uint32Array)) {
    const line = points.subarray(2 * begin, 2 * end);
    lines.push({points: line, bounds: boundsOf(line)});
    begin = end;
  }
  return lines;
}

function boundsOf(points) {
  const bounds = [Infinity, Infinity, -Infinity, -Infinity];
  for (let k = 0; k < points.length; k += 2) {
    bounds[0] = Math.min(bounds[0], points[k]);
    bounds[1] = Math.min(bounds[1], points[k + 1]);
    bounds[2] = Math.max(bounds[2], points[k]);
    bounds[3] = Math.max(bounds[3], points[k + 1]);
  }
  return bounds;
}

function unpackVoids(packed) {
  if (packed.why !== undefined) return {why: packed.why, list: [], percolating: 0};
  const lines = unpackLines(packed), list = [];
  const sides = decode(packed.sides, Uint16Array), area = decode(packed.area, Float32Array);
  let first = 0;
  decode(packed.rings, Uint32Array).forEach((count, k) => {
    const own = lines.slice(first, first + count), rings = own.map(({points}) => points);
    const bounds = own.map(line => line.bounds).reduce(([a, b, c, d], [e, f, g, h]) =>
      [Math.min(a, e), Math.min(b, f), Math.max(c, g), Math.max(d, h)]);
    list.push({sides: sides[k], area: area[k], rings, bounds});
    first += count;
  });
  return {why: '', list, percolating: packed.percolating};
}

/** `walls`: number of the first flat wall, which a particle meets right above or below. */
function unpackContacts(packed, box, centres, walls) {
  const pairs = decode(packed.pairs, Uint16Array), image = decode(packed.image, Int16Array);
  const force = decode(packed.force, Float32Array), gap = decode(packed.gap, Float32Array);
  const bearing = decode(packed.bearing, Uint8Array);
  const [[ax, ay], [bx, by]] = box;
  return Array.from(force, (size, k) => {
    const i = pairs[2 * k], j = pairs[2 * k + 1], u = image[2 * k], v = image[2 * k + 1];
    const shift = [u * ax + v * bx, u * ay + v * by];
    const start = [centres[2 * i], centres[2 * i + 1]];
    const end = [j < walls ? centres[2 * j] + shift[0] : start[0], centres[2 * j + 1] + shift[1]];
    const bounds = boundsOf([...start, ...end]);
    return {i, j, start, end, bounds, force: size, gap: gap[k], bearing: bearing[k] === 1};
  });
}

/** One state as the picture needs it. Particles lie with their centres in the cell, outlines whole. */
function unpackState(raw, head) {
  const sites = decode(raw.sites, Float32Array);
  const centres = raw.centres === undefined ? sites : decode(raw.centres, Float32Array);
  const particles = {
    shape: decode(raw.particles.shape, Float32Array), area: decode(raw.particles.area, Float32Array),
    cell: decode(raw.particles.cell, Float32Array), z: decode(raw.particles.z, Uint16Array),
    rattler: decode(raw.particles.rattler, Uint8Array),
  };
  const contacts = unpackContacts(raw.contacts, raw.box, centres, raw.planes ? head.n - 2 : Infinity);
  const bearing = contacts.filter(contact => contact.bearing);
  const [[ax], [, by]] = raw.box;
  return {
    box: raw.box, rim: raw.rim, planes: raw.planes, sites, centres, particles, contacts, size: Math.sqrt(ax * by / head.n),
    radius: boundingRadii(sites, centres, raw.rim, head),
    meanForce: bearing.reduce((sum, contact) => sum + contact.force, 0) / (bearing.length || 1),
    voids: unpackVoids(raw.voids), walls: unpackLines(raw.walls),
    moves: raw.moves === null ? null : decode(raw.moves, Float32Array), affine: raw.affine,
  };
}

/** Radius around each centre that holds the particle. */
function boundingRadii(sites, centres, rim, head) {
  if (head.offsets === null) return Float64Array.from(head.radii);
  const radius = new Float64Array(head.n);
  for (let m = 0; m < head.n; m++) {
    for (let k = head.offsets[m]; k < head.offsets[m + 1]; k++) {
      const width = head.radii === null ? rim : head.radii[m];
      const reach = Math.hypot(sites[2 * k] - centres[2 * m], sites[2 * k + 1] - centres[2 * m + 1]) + width;
      if (reach > radius[m]) radius[m] = reach;
    }
  }
  return radius;
}

/** States of one explorer; each is unpacked when it is first shown, and the last few stay. */
class PackedStates {
  constructor(scripts, head) {
    this.scripts = scripts;
    this.head = head;
    this.kept = new Map();
  }

  get count() {
    return this.scripts.length;
  }

  at(k) {
    let state = this.kept.get(k);
    if (state === undefined) {
      state = unpackState(JSON.parse(this.scripts[k].textContent), this.head);
      this.kept.set(k, state);
      if (this.kept.size > 100) this.kept.delete(this.kept.keys().next().value);
    }
    return state;
  }
}

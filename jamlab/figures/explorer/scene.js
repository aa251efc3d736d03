// The picture of one state: particles and what is switched on, in every periodic image that is seen.

const WIDEST = 0.25, MEAN_WIDTH = 0.06, THINNEST = 0.7; // of force lines: in mean particle sizes, and in pixels
const LONG_MOVE = 0.4, LONGEST_MOVE = 1.6; // of arrows, in particle sizes: one in ten is longer; where they are cut
const SMALLEST = 4; // pixels of a particle below which its outline would cover it
const ROOM = 200; // square pixels that a digit needs

/** Draw everything on a canvas whose picture is `view.pixels` large. */
function drawScene(context, ratio, scene) {
  const {view, colours} = scene, [width, height] = view.pixels;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.fillStyle = colours.paper;
  context.fillRect(0, 0, width, height);
  const [left, , , top] = view.limits(), scale = ratio * view.scale;
  context.setTransform(scale, 0, 0, -scale, -scale * left, scale * top);
  context.lineJoin = 'round';
  const pixel = 1 / view.scale, seen = copies(scene);
  if (scene.state.planes) drawFlatWalls(context, scene);
  drawParticles(context, scene, seen, pixel);
  if (scene.shown.voids) drawVoids(context, scene, pixel);
  if (scene.shown.cells) drawCells(context, scene, pixel);
  if (scene.shown.forces) drawForces(context, scene, pixel);
  if (scene.shown.displacements && scene.state.moves !== null) drawMoves(context, scene, seen, pixel);
  if (scene.pointed !== null) drawPointed(context, scene, pixel);
  drawCell(context, scene, pixel);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  if (scene.shown.voids) writeSides(context, scene);
  drawScaleBar(context, scene);
}

/** Particles, with the translation of each image, that can be seen. */
function copies({view, state, head}) {
  const reach = Math.max(...state.radius), [left, bottom, right, top] = view.limits(), found = [];
  for (const [dx, dy] of view.moves(reach)) {
    for (let m = 0; m < head.n; m++) {
      const x = state.centres[2 * m] + dx, y = state.centres[2 * m + 1] + dy, r = state.radius[m];
      if (x + r > left && x - r < right && y + r > bottom && y - r < top) found.push([m, dx, dy]);
    }
  }
  return found;
}

/** Things with bounds, such as contacts and voids, with the translation of each image that can be seen. */
function seenOf(things, {view}) {
  const [left, bottom, right, top] = view.limits(), found = [];
  let reach = 0; // beyond the cell
  for (const {bounds} of things) reach = Math.max(reach, bounds[2] - bounds[0], bounds[3] - bounds[1]);
  for (const [dx, dy] of view.moves(reach)) {
    for (const thing of things) {
      const [x0, y0, x1, y1] = thing.bounds;
      if (x1 + dx > left && x0 + dx < right && y1 + dy > bottom && y0 + dy < top) found.push([thing, dx, dy]);
    }
  }
  return found;
}

/** Which colour a particle has: beside coloured voids all are pale. */
function particleKind(m, {state, head, shown}) {
  if (shown.rattlers && state.particles.rattler[m]) return 'rattler';
  if (shown.voids) return 'beside';
  return head.large[m] ? 'large' : 'small';
}

function particleColour(m, scene) {
  const kind = particleKind(m, scene), {sizes} = scene.head;
  return sizes && (kind === 'large' || kind === 'small') ? sizes.colours[m] : scene.colours[kind];
}

function drawParticles(context, scene, seen, pixel) {
  const {state, head, colours} = scene, droplets = head.radii === null;
  // one path for each particle: canvases fill many small paths faster than a large one
  const outlines = seen.map(([m, dx, dy]) => {
    const path = new Path2D();
    traceParticle(path, state, head, m, dx, dy, pixel);
    return path;
  });
  context.globalAlpha = colours.fill;
  seen.forEach(([m], k) => {
    context.fillStyle = particleColour(m, scene);
    context.fill(outlines[k]);
  });
  context.globalAlpha = 1;
  if (state.size < SMALLEST * pixel) return;
  context.strokeStyle = droplets ? colours.edge : colours.outline;
  context.lineWidth = 0.8 * pixel;
  for (const path of outlines) context.stroke(path);
  if (!droplets) return;
  context.strokeStyle = colours.outline;
  context.lineWidth = 0.6 * pixel;
  for (const [m, dx, dy] of seen) {
    const path = new Path2D();
    tracePolygon(path, ring(state, head, m), dx, dy);
    context.stroke(path);
  }
}

function drawFlatWalls(context, {view, state, colours}) {
  const [left, bottom, right, top] = view.limits(), [low, high] = state.planes, height = state.box[1][1];
  context.fillStyle = colours.rattler;
  for (let k = Math.floor(bottom / height) - 1; k * height + high < top; k++) {
    context.fillRect(left, k * height + high, right - left, height - high + low);
  }
}

function drawVoids(context, scene, pixel) {
  const {state, colours} = scene;
  context.strokeStyle = colours.ink;
  context.lineWidth = 0.5 * pixel;
  for (const [gap, dx, dy] of seenOf(state.voids.list, scene)) {
    const path = new Path2D();
    for (const points of gap.rings) tracePolygon(path, points, dx, dy);
    context.fillStyle = colours.sides[gap.sides] ?? colours.otherSides;
    context.fill(path, 'evenodd');
    context.stroke(path);
  }
}

function writeSides(context, scene) {
  const {view, state, colours} = scene;
  context.font = '11px system-ui, sans-serif';
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.fillStyle = colours.digit;
  const large = state.voids.list.filter(({area}) => area * view.scale ** 2 > ROOM);
  for (const [{sides, rings: [points]}, dx, dy] of seenOf(large, scene)) {
    const count = points.length / 2;
    let x = 0, y = 0;
    for (let k = 0; k < points.length; k += 2) {
      x += points[k] / count;
      y += points[k + 1] / count;
    }
    context.fillText(sides, ...view.toScreen(x + dx, y + dy));
  }
}

/** Walls between cells, in a colour that no void beside them has. */
function wallColour({shown, colours}) {
  return shown.voids ? colours.wallBesideVoids : colours.wall;
}

function drawCells(context, scene, pixel) {
  context.strokeStyle = wallColour(scene);
  context.lineWidth = 1.8 * pixel;
  for (const [{points}, dx, dy] of seenOf(scene.state.walls, scene)) {
    const path = new Path2D();
    traceLine(path, points, dx, dy);
    context.stroke(path);
  }
}

/** Width of a force line, in units of length. */
function forceWidth(state, force, pixel) {
  return Math.max(THINNEST * pixel, state.size * Math.min(WIDEST, MEAN_WIDTH * force / (state.meanForce || 1)));
}

function drawForces(context, scene, pixel) {
  const {state, colours} = scene;
  for (const [{start, end, force, gap, bearing}, dx, dy] of seenOf(state.contacts, scene)) {
    context.strokeStyle = gap > 0 ? colours.tension : colours.force;
    context.lineCap = bearing ? 'round' : 'butt';
    context.lineWidth = bearing ? forceWidth(state, force, pixel) : pixel;
    context.setLineDash(bearing ? [] : [3 * pixel, 3 * pixel]);
    context.beginPath();
    context.moveTo(start[0] + dx, start[1] + dy);
    context.lineTo(end[0] + dx, end[1] + dy);
    context.stroke();
  }
  context.lineCap = 'butt';
  context.setLineDash([]);
}

/** How many times larger displacements are drawn: 1, 2 or 5 times a power of ten; 0 if nothing moved. */
function moveScale({moves, size}) {
  const lengths = [];
  for (let k = 0; k < moves.length; k += 2) lengths.push(Math.hypot(moves[k], moves[k + 1]));
  lengths.sort((a, b) => a - b);
  const most = lengths[Math.floor(0.9 * (lengths.length - 1))], largest = lengths.at(-1);
  // where all but a few rest, these set the scale, not the noise of the others
  const long = most > 1e-3 * largest ? most : largest;
  if (long < 1e-12 * size) return 0;
  return roundDown(LONG_MOVE * size / long);
}

/** The largest of 1, 2 and 5 times a power of ten that is not above a number. */
function roundDown(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (value >= 5 * power ? 5 : value >= 2 * power ? 2 : 1);
}

function drawMoves(context, {state, colours}, seen, pixel) {
  const times = moveScale(state), arrows = new Path2D(), cut = new Path2D();
  for (const [m, dx, dy] of seen) {
    const x = state.centres[2 * m] + dx, y = state.centres[2 * m + 1] + dy;
    const ux = times * state.moves[2 * m], uy = times * state.moves[2 * m + 1], length = Math.hypot(ux, uy);
    if (length > LONGEST_MOVE * state.size) {
      const part = LONGEST_MOVE * state.size / length;
      cut.moveTo(x, y);
      cut.lineTo(x + part * ux, y + part * uy);
    } else if (length > pixel) {
      traceArrow(arrows, x, y, ux, uy, Math.min(0.4, 7 * pixel / length));
    }
  }
  for (const [colour, width] of [[colours.paper, 4.5], [colours.move, 2.4]]) {
    context.strokeStyle = colour;
    context.lineWidth = width * pixel;
    context.stroke(arrows);
    context.setLineDash([6 * pixel, 4 * pixel]);
    context.stroke(cut);
    context.setLineDash([]);
  }
}

/** An arrow along u whose head has a part of its length. */
function traceArrow(path, x, y, ux, uy, head) {
  path.moveTo(x, y);
  path.lineTo(x + ux, y + uy);
  path.moveTo(x + ux - head * (ux - 0.6 * uy), y + uy - head * (uy + 0.6 * ux));
  path.lineTo(x + ux, y + uy);
  path.lineTo(x + ux - head * (ux + 0.6 * uy), y + uy - head * (uy - 0.6 * ux));
}

function drawPointed(context, {state, head, pointed, colours}, pixel) {
  const path = new Path2D();
  if (pointed.kind === 'particle') traceParticle(path, state, head, pointed.index, ...pointed.move, pixel);
  if (pointed.kind === 'void') {
    for (const points of state.voids.list[pointed.index].rings) tracePolygon(path, points, ...pointed.move);
  }
  if (pointed.kind === 'contact') {
    const {start, end} = state.contacts[pointed.index], [dx, dy] = pointed.move;
    path.moveTo(start[0] + dx, start[1] + dy);
    path.lineTo(end[0] + dx, end[1] + dy);
  }
  context.lineCap = 'round';
  const width = pointed.kind === 'contact' ? forceWidth(state, state.contacts[pointed.index].force, pixel) : 2 * pixel;
  for (const [colour, extra] of [[colours.paper, 5], [colours.pointed, 2]]) {
    context.strokeStyle = colour;
    context.lineWidth = width + extra * pixel;
    context.stroke(path);
  }
  context.lineCap = 'butt';
}

/** A veil over all images but one, and the outline of the cell. */
function drawCell(context, {view, colours}, pixel) {
  const [left, bottom, right, top] = view.limits(), cell = new Path2D(), around = new Path2D();
  const corners = [[0, 0], [1, 0], [1, 1], [0, 1]].flatMap(([u, v]) => view.fromLattice(u, v));
  tracePolygon(cell, corners, 0, 0);
  around.rect(left, bottom, right - left, top - bottom);
  around.addPath(cell);
  context.fillStyle = colours.veil;
  context.fill(around, 'evenodd');
  context.strokeStyle = colours.ink;
  context.lineWidth = 1.8 * pixel;
  context.stroke(cell);
}

function drawScaleBar(context, {view, head, colours}) {
  const length = roundDown(0.25 * view.pixels[0] / view.scale), label = `${plain(length)} ${head.units.length}`;
  const x = 14, y = view.pixels[1] - 14, pixels = length * view.scale;
  context.font = '13px system-ui, sans-serif';
  context.textAlign = 'left';
  context.textBaseline = 'alphabetic';
  context.fillStyle = colours.paper;
  context.globalAlpha = 0.85;
  context.fillRect(x - 8, y - 26, Math.max(pixels, context.measureText(label).width) + 16, 34);
  context.globalAlpha = 1;
  context.fillStyle = colours.ink;
  context.fillRect(x, y - 3, pixels, 3);
  context.fillText(label, x, y - 9);
}

// Outlines of particles as canvas paths, in units of length: circles, or polygons with their rims.

function traceDisk(path, x, y, radius) {
  path.moveTo(x + radius, y);
  path.arc(x, y, radius, 0, 2 * Math.PI);
  path.closePath();
}

function tracePolygon(path, points, dx, dy) {
  for (let k = 0; k < points.length; k += 2) {
    if (k) path.lineTo(points[k] + dx, points[k + 1] + dy);
    else path.moveTo(points[k] + dx, points[k + 1] + dy);
  }
  path.closePath();
}

function traceLine(path, points, dx, dy) {
  for (let k = 0; k < points.length; k += 2) {
    if (k) path.lineTo(points[k] + dx, points[k + 1] + dy);
    else path.moveTo(points[k] + dx, points[k + 1] + dy);
  }
}

/** Radians of an arc that a straight line may replace, so that it errs by a sixth of a pixel. */
function arcStep(radius, pixel) {
  return 2 * Math.acos(Math.max(0.5, 1 - pixel / (6 * radius)));
}

/**
 * A counter-clockwise polygon grown by its rim: edges moved outwards, arcs around convex corners. At a reflex corner
 * the path goes back to the corner itself; filled by the nonzero rule nothing is missing and nothing cut out.
 */
function traceRim(path, points, rim, dx, dy, pixel) {
  const step = arcStep(rim, pixel), last = points.length - 2;
  const direction = (k, next) => Math.atan2(points[k] - points[next], points[next + 1] - points[k + 1]);
  let before = direction(last, 0), started = false;
  for (let k = 0; k <= last; k += 2) {
    const next = k === last ? 0 : k + 2, x = points[k] + dx, y = points[k + 1] + dy;
    if (points[k] === points[next] && points[k + 1] === points[next + 1]) continue;
    const after = direction(k, next);
    let turn = after - before;
    if (turn <= -Math.PI) turn += 2 * Math.PI;
    if (turn > Math.PI) turn -= 2 * Math.PI;
    const parts = turn > 0 ? Math.ceil(turn / step) : 1;
    for (let part = 0; part <= parts; part++) {
      const angle = before + turn * part / parts;
      if (turn <= 0 && part === 1) path.lineTo(x, y);
      if (started) path.lineTo(x + rim * Math.cos(angle), y + rim * Math.sin(angle));
      else path.moveTo(x + rim * Math.cos(angle), y + rim * Math.sin(angle));
      started = true;
    }
    before = after;
  }
  path.closePath();
}

/** The lens in which two disks overlap; the smaller disk if it lies inside the other. */
function traceLens(path, [x0, y0], r0, [x1, y1], r1, dx, dy) {
  const distance = Math.hypot(x1 - x0, y1 - y0), toward = Math.atan2(y1 - y0, x1 - x0);
  if (distance <= Math.abs(r0 - r1)) {
    traceDisk(path, ...(r0 < r1 ? [x0 + dx, y0 + dy, r0] : [x1 + dx, y1 + dy, r1]));
    return;
  }
  const half = (own, other) => Math.acos((distance ** 2 + own ** 2 - other ** 2) / (2 * distance * own));
  const one = half(r0, r1), two = half(r1, r0);
  path.moveTo(x0 + dx + r0 * Math.cos(toward - one), y0 + dy + r0 * Math.sin(toward - one));
  path.arc(x0 + dx, y0 + dy, r0, toward - one, toward + one);
  path.arc(x1 + dx, y1 + dy, r1, toward + Math.PI - two, toward + Math.PI + two);
  path.closePath();
}

/** Vertices of droplet m. */
function ring(state, head, m) {
  return state.sites.subarray(2 * head.offsets[m], 2 * head.offsets[m + 1]);
}

function traceParticle(path, state, head, m, dx, dy, pixel) {
  if (head.radii !== null) traceDisk(path, state.centres[2 * m] + dx, state.centres[2 * m + 1] + dy, head.radii[m]);
  else traceRim(path, ring(state, head, m), state.rim, dx, dy, pixel);
}

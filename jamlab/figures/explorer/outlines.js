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

/** Vertices of droplet m. */
function ring(state, head, m) {
  return state.sites.subarray(2 * head.offsets[m], 2 * head.offsets[m + 1]);
}

function traceParticle(path, state, head, m, dx, dy, pixel) {
  const disks = head.radii === null ? null : head.offsets === null ? state.centres.subarray(2 * m, 2 * m + 2) : ring(state, head, m);
  if (disks !== null) for (let k = 0; k < disks.length; k += 2) traceDisk(path, disks[k] + dx, disks[k + 1] + dy, head.radii[m]);
  else traceRim(path, ring(state, head, m), state.rim, dx, dy, pixel);
}

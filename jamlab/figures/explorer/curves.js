// z, G and pressure along the sweep, drawn as SVG: sharp in print, and coloured by the style sheet.

const SVG = 'http://www.w3.org/2000/svg';
const FRAME = {width: 400, height: 118, left: 58, right: 10, top: 10, bottom: 24};

function draw(tag, attributes, text) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

/** Round numbers from low to high, about `count` of them. */
function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(factor => factor * power >= rough);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) {
    found.push(Number((k * step).toPrecision(10)));
  }
  return found;
}

function range(values) {
  const low = Math.min(...values), high = Math.max(...values), room = 0.06 * (high - low) || 0.05 * Math.abs(high) || 1;
  return [low - room, high + room];
}

class Curve {
  /** `jump` is called with the number of the state that was clicked. */
  constructor(figure, quantity, head, jump) {
    this.rows = head.rows;
    this.xs = head.rows.map((row, k) => head.along.name === 'number' ? k + 1 : row[head.along.name]);
    this.ys = head.rows.map(row => row[quantity.name]);
    const known = this.ys.filter(y => y !== null);
    [this.x0, this.x1] = range(this.xs);
    [this.y0, this.y1] = range(known.length ? known : [0, 1]);
    this.svg = draw('svg', {viewBox: `0 0 ${FRAME.width} ${FRAME.height}`, role: 'img', 'aria-label': quantity.label});
    this.drawAxes();
    this.drawStates();
    this.now = this.svg.appendChild(draw('line', {class: 'now', y1: FRAME.top, y2: FRAME.height - FRAME.bottom}));
    this.dot = this.svg.appendChild(draw('circle', {class: 'now', r: 5}));
    this.svg.addEventListener('pointerdown', event => jump(this.nearest(event)));
    this.svg.addEventListener('pointermove', event => event.buttons === 1 && jump(this.nearest(event)));
    figure.append(this.svg);
  }

  place(k) {
    const {width, height, left, right, top, bottom} = FRAME, y = this.ys[k];
    const up = y === null ? 0 : (y - this.y0) / (this.y1 - this.y0);
    return [
      left + (this.xs[k] - this.x0) / (this.x1 - this.x0) * (width - left - right),
      height - bottom - up * (height - top - bottom),
    ];
  }

  drawAxes() {
    const {width, height, left, right, top, bottom} = FRAME;
    const inside = {x: left, y: top, width: width - left - right, height: height - top - bottom};
    this.svg.append(draw('rect', {class: 'frame', ...inside}));
    for (const tick of ticks(this.x0, this.x1, 5)) {
      const x = left + (tick - this.x0) / (this.x1 - this.x0) * inside.width;
      this.svg.append(draw('line', {class: 'grid', x1: x, x2: x, y1: top, y2: height - bottom}));
      this.svg.append(draw('text', {x, y: height - 8, 'text-anchor': 'middle'}, plain(tick)));
    }
    for (const tick of ticks(this.y0, this.y1, 5)) {
      const y = height - bottom - (tick - this.y0) / (this.y1 - this.y0) * inside.height;
      const kind = this.y0 < 0 && tick === 0 ? 'zero' : 'grid';
      this.svg.append(draw('line', {class: kind, x1: left, x2: width - right, y1: y, y2: y}));
      this.svg.append(draw('text', {x: left - 5, y: y + 4, 'text-anchor': 'end'}, plain(tick)));
    }
  }

  drawStates() {
    let line = '', pen = 'M';
    this.ys.forEach((y, k) => {
      const place = this.place(k).map(value => value.toFixed(1)).join(' ');
      line += y === null ? '' : `${pen}${place}`;
      pen = y === null ? 'M' : 'L';
    });
    this.svg.append(draw('path', {class: 'curve', d: line}));
    const radius = this.ys.length > 150 ? 1.2 : 2.4;
    this.ys.forEach((y, k) => {
      const [cx, cy] = this.place(k), {converged, on_target: met, why} = this.rows[k], sound = converged && met;
      const mark = y === null
        ? draw('path', {class: 'missing', d: `M${cx - 4} ${cy - 8}l8 8m0 -8l-8 8`})
        : draw('circle', {class: sound ? 'state' : 'state doubtful', cx, cy, r: sound ? radius : radius + 1});
      if (y === null) mark.append(draw('title', {}, `none${why ? `: ${why}` : ''}`));
      this.svg.append(mark);
    });
  }

  /** Number of the state nearest to a click: by its place on the screen where a sweep turns back, else by x. */
  nearest(event) {
    const corner = this.svg.getBoundingClientRect(), zoom = FRAME.width / corner.width;
    const px = zoom * (event.clientX - corner.left), py = zoom * (event.clientY - corner.top);
    let best = 0, least = Infinity;
    this.ys.forEach((_, k) => {
      const [x, y] = this.place(k), distance = Math.hypot(x - px, 0.2 * (y - py));
      if (distance < least) [best, least] = [k, distance];
    });
    return best;
  }

  show(k) {
    const [x, y] = this.place(k);
    this.now.setAttribute('x1', x);
    this.now.setAttribute('x2', x);
    this.dot.setAttribute('cx', x);
    this.dot.setAttribute('cy', y);
    this.dot.style.display = this.ys[k] === null ? 'none' : '';
  }
}

// Which part of the periodic plane is seen: a place in lattice coordinates, so that it moves with the box, and a zoom.

const FARTHEST = 0.25, NEAREST = 60, MARGIN = 1.08;

class View {
  /** `extent` holds the cells of all states: lengths keep their scale, and a box that shrinks is seen to shrink. */
  constructor(extent, box) {
    [this.width, this.height] = extent.map(length => MARGIN * length);
    this.box = box;
    this.pixels = [1, 1];
    this.reset();
  }

  reset() {
    this.zoom = 1;
    this.middle = [0.5, 0.5];
  }

  /** Pixels per unit of length. */
  get scale() {
    return this.zoom * Math.min(this.pixels[0] / this.width, this.pixels[1] / this.height);
  }

  get centre() {
    return this.fromLattice(...this.middle);
  }

  fromLattice(u, v) {
    const [[ax, ay], [bx, by]] = this.box;
    return [u * ax + v * bx, u * ay + v * by];
  }

  toLattice(x, y) {
    const [[ax], [bx, by]] = this.box;
    return [(x - y * bx / by) / ax, y / by];
  }

  toScreen(x, y) {
    const [cx, cy] = this.centre, scale = this.scale;
    return [this.pixels[0] / 2 + scale * (x - cx), this.pixels[1] / 2 - scale * (y - cy)];
  }

  toWorld(px, py) {
    const [cx, cy] = this.centre, scale = this.scale;
    return [cx + (px - this.pixels[0] / 2) / scale, cy - (py - this.pixels[1] / 2) / scale];
  }

  pan(dx, dy) {
    const [cx, cy] = this.centre, scale = this.scale;
    this.middle = this.toLattice(cx - dx / scale, cy + dy / scale);
  }

  /** Zoom about a point of the screen, which stays where it is. */
  zoomAt(factor, px, py) {
    const before = this.toWorld(px, py);
    this.zoom = Math.min(NEAREST, Math.max(FARTHEST, this.zoom * factor));
    const after = this.toWorld(px, py), [cx, cy] = this.centre;
    this.middle = this.toLattice(cx + before[0] - after[0], cy + before[1] - after[1]);
  }

  /** Left, bottom, right, top of what is seen, larger by `reach`. */
  limits(reach = 0) {
    const [left, top] = this.toWorld(0, 0), [right, bottom] = this.toWorld(...this.pixels);
    return [left - reach, bottom - reach, right + reach, top + reach];
  }

  /** Translations of the cell whose images, larger by `reach`, may be seen. */
  moves(reach) {
    const [left, bottom, right, top] = this.limits(reach);
    const corners = [[left, bottom], [right, bottom], [left, top], [right, top]].map(([x, y]) => this.toLattice(x, y));
    const [us, vs] = [corners.map(c => c[0]), corners.map(c => c[1])], moves = [];
    for (let u = Math.floor(Math.min(...us)); u <= Math.floor(Math.max(...us)); u++) {
      for (let v = Math.floor(Math.min(...vs)); v <= Math.floor(Math.max(...vs)); v++) {
        moves.push(this.fromLattice(u, v));
      }
    }
    return moves;
  }
}

// One explorer: its states, what of them is shown, and the parts of the page that show it.

const STATES_PER_SECOND = 12, SHORTEST = 3; // s that playing takes at least
const PRINTED = {width: 440, ratio: 4}; // pixels of the picture on paper, and canvas pixels of each: print is sharp

class Explorer {
  constructor(section) {
    const find = selector => section.querySelector(selector);
    this.section = section;
    this.head = JSON.parse(find('script.head').textContent);
    this.states = new PackedStates(section.querySelectorAll('script.state'), this.head);
    this.parts = {
      canvas: find('canvas'), tip: find('.tip'), legend: find('.legend'), numbers: find('.numbers'),
      warning: find('.warning'), slider: find('[type=range]'), output: find('output'), play: find('[data-action=play]'),
    };
    this.context = this.parts.canvas.getContext('2d');
    this.view = new View(this.head.extent, this.states.at(0).box);
    this.shown = {};
    for (const box of section.querySelectorAll('[data-toggle]')) this.shown[box.dataset.toggle] = box.checked;
    this.current = 0;
    this.pointed = null;
    this.playing = false;
    this.printing = false;
    this.parts.canvas.style.aspectRatio = `${this.view.width} / ${this.view.height}`;
    this.curves = this.states.count > 1 ? this.makeCurves() : [];
    this.watch();
    this.show(0);
  }

  makeCurves() {
    const figures = [...this.section.querySelectorAll('.curve-figure')];
    return figures.map((figure, k) => new Curve(figure, this.head.curves[k], this.head, state => this.jump(state)));
  }

  watch() {
    watchPointers(this.parts.canvas, this);
    watchKeys(this.section, this);
    watchButtons(this.section, this);
    new ResizeObserver(() => this.redraw()).observe(this.parts.canvas);
    darkness.addEventListener('change', () => this.redraw());
    addEventListener('beforeprint', () => this.print(true));
    addEventListener('afterprint', () => this.print(false));
  }

  get scene() {
    const colours = palette(this.printing), {view, head, shown, pointed} = this;
    return {view, head, shown, pointed, colours, state: this.states.at(this.current)};
  }

  show(wanted) {
    this.current = Math.max(0, Math.min(this.states.count - 1, wanted));
    const row = this.head.rows[this.current];
    this.pointed = null;
    this.parts.tip.hidden = true;
    this.parts.numbers.replaceChildren(
      ...facts(row, this.head).flatMap(([name, value]) => [element('dt', {}, name), element('dd', {}, value)]));
    this.parts.warning.textContent = warning(row, this.head);
    if (this.parts.slider !== null) {
      this.parts.slider.value = this.current;
      this.parts.output.textContent = `state ${this.current + 1} of ${this.states.count}`;
    }
    this.curves.forEach(curve => curve.show(this.current));
    this.redraw();
  }

  jump(wanted) {
    this.stop();
    this.show(wanted);
  }

  play() {
    if (this.playing || this.states.count < 2) return this.stop();
    this.playing = true;
    this.parts.play.textContent = '⏸';
    const first = this.current < this.states.count - 1 ? this.current : 0;
    const rate = Math.min(STATES_PER_SECOND, this.states.count / SHORTEST);
    let began;
    const go = now => {
      if (!this.playing) return;
      began ??= now;
      const wanted = first + Math.floor((now - began) / 1000 * rate);
      if (wanted !== this.current) this.show(wanted);
      if (this.current < this.states.count - 1) requestAnimationFrame(go);
      else this.stop();
    };
    requestAnimationFrame(go);
  }

  stop() {
    this.playing = false;
    if (this.parts.play !== null) this.parts.play.textContent = '▶';
  }

  toggle(name, on = !this.shown[name]) {
    this.shown[name] = on;
    this.section.querySelector(`[data-toggle=${name}]`).checked = on;
    this.redraw();
  }

  pan(dx, dy) {
    this.view.pan(dx, dy);
    this.leave();
    this.redraw();
  }

  zoomBy(factor, x = this.view.pixels[0] / 2, y = this.view.pixels[1] / 2) {
    this.view.zoomAt(factor, x, y);
    this.leave();
    this.redraw();
  }

  resetView() {
    this.view.reset();
    this.redraw();
  }

  /** Say what lies at a point of the canvas. */
  point(x, y, reach) {
    const found = pick(this.scene, x, y, reach), {tip} = this.parts;
    if (JSON.stringify(found) !== JSON.stringify(this.pointed)) {
      this.pointed = found;
      this.redraw();
    }
    tip.hidden = found === null;
    if (found === null) return;
    const [heading, ...lines] = describe(this.scene, found);
    tip.replaceChildren(element('strong', {}, heading), ...lines.map(line => element('div', {}, line)));
    const [width, height] = this.view.pixels;
    tip.style.left = `${Math.max(4, Math.min(x + 14, width - tip.offsetWidth - 4))}px`;
    tip.style.top = `${y + 18 + tip.offsetHeight < height ? y + 18 : Math.max(4, y - tip.offsetHeight - 12)}px`;
  }

  leave() {
    this.parts.tip.hidden = true;
    if (this.pointed === null) return;
    this.pointed = null;
    this.redraw();
  }

  print(printing) {
    this.printing = printing;
    this.leave();
    this.drawNow();
  }

  /** Width and height of the picture, and canvas pixels per pixel. */
  measure() {
    if (this.printing) return [PRINTED.width, PRINTED.width * this.view.height / this.view.width, PRINTED.ratio];
    return [this.parts.canvas.clientWidth, this.parts.canvas.clientHeight, Math.min(2, devicePixelRatio || 1)];
  }

  /** Draw before the next frame, once however much has changed. */
  redraw() {
    this.waiting ??= requestAnimationFrame(() => this.drawNow());
  }

  drawNow() {
    cancelAnimationFrame(this.waiting);
    this.waiting = undefined;
    const {canvas, legend: place} = this.parts, [width, height, ratio] = this.measure();
    if (width === 0) return;
    const [across, down] = [Math.round(ratio * width), Math.round(ratio * height)];
    if (canvas.width !== across || canvas.height !== down) [canvas.width, canvas.height] = [across, down];
    const {scene} = this;
    this.view.pixels = [width, height];
    this.view.box = scene.state.box;
    drawScene(this.context, ratio, scene);
    place.replaceChildren(...legend(scene));
    const said = facts(this.head.rows[this.current], this.head).map(fact => fact.join(' ')).join(', ');
    canvas.setAttribute('aria-label', `state ${this.current + 1}: ${said}`);
  }
}

function start() {
  const sections = document.querySelectorAll('.explorer');
  for (const section of sections) section.explorer = new Explorer(section);
  // keys work at once, but for a frame, which leaves them to the page around it
  if (sections.length === 1 && window === window.parent) sections[0].focus({preventScroll: true});
}

if (document.readyState === 'loading') addEventListener('DOMContentLoaded', start);
else start();

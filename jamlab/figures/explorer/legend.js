// Numbers as text, and the lines beside the picture: what is drawn, and what the state is.

function number(value, digits = 4) {
  if (value === null || Number.isNaN(value)) return 'none';
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(digits - 1) : value.toPrecision(digits);
  return text.replaceAll('-', '−');
}

/** A number as short as it can be. */
function plain(value) {
  return String(Number(value.toPrecision(6))).replaceAll('-', '−');
}

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function key(colour, text, kind = 'patch', opacity = 1) {
  const swatch = element('i', {className: kind});
  swatch.style.setProperty('--colour', colour);
  swatch.style.opacity = opacity;
  return element('span', {}, swatch, text);
}

/** What is drawn, one entry each. */
function legend(scene) {
  const {state, head, shown, colours} = scene, {force} = head.units;
  const particle = kind => key(colours[kind], kind === 'beside' ? 'particle' : kind, 'patch', colours.fill);
  const present = new Set(Array.from({length: head.n}, (_, m) => particleKind(m, scene)));
  const kinds = head.sizes ? ['beside', 'rattler'] : ['large', 'small', 'beside', 'rattler'];
  const entries = kinds.filter(kind => present.has(kind)).map(particle);
  if (head.sizes && (present.has('large') || present.has('small'))) entries.unshift(sizeBar(head.sizes, colours.fill));
  if (head.radii === null) entries.push(element('span', {}, 'line: bare polygon, fill: with its rim'));
  if (shown.forces) {
    const mean = `${number(state.meanForce, 3)} [${force}]`;
    entries.push(key(colours.force, `width: force, mean of the state ${mean}`, 'line'));
    if (state.contacts.some(({gap}) => gap > 0)) entries.push(key(colours.tension, 'contact that pulls', 'line'));
    const loose = state.contacts.some(({bearing}) => !bearing);
    if (loose) entries.push(key(colours.force, 'contact of a rattler', 'dashes'));
  }
  if (shown.voids) entries.push(...voidKeys(state.voids, colours));
  if (shown.cells) entries.push(key(wallColour(scene), head.radii === null ? 'set-Voronoi cells' : 'power cells', 'line'));
  if (shown.displacements) entries.push(moveKey(state, colours));
  return entries;
}

/** Colours from the smallest to the largest of many sizes. */
function sizeBar({name, bar, ends}, opacity) {
  const entry = key('', `${name} ${number(ends[0], 3)} to ${number(ends[1], 3)}`, 'bar', opacity);
  entry.firstChild.style.background = `linear-gradient(to right, ${bar.join(', ')})`;
  return entry;
}

function voidKeys({why, list, percolating}, colours) {
  if (why) return [element('span', {}, `no voids: ${why}`)];
  const present = [...new Set(list.map(({sides}) => sides))].sort((a, b) => a - b);
  const coloured = present.filter(sides => sides in colours.sides);
  const keys = coloured.map(sides => key(colours.sides[sides], `void of ${sides}`));
  if (coloured.length < present.length) keys.push(key(colours.otherSides, 'void of another number'));
  if (percolating) keys.push(element('span', {}, `blank: ${percolating} that percolate${percolating > 1 ? '' : 's'}`));
  return keys;
}

function moveKey(state, colours) {
  if (state.moves === null) return element('span', {}, 'displacements: no state before this one');
  const times = moveScale(state), {area, shear} = state.affine;
  if (times === 0) return element('span', {}, 'displacements since the previous state: only the box has moved');
  const box = `without the affine part (box: area ${number(100 * area, 3)} %, shear ${number(shear, 3)}) and drift`;
  const what = `displacements since the state before, drawn × ${plain(times)}, ${box}; dashed: cut`;
  return key(colours.move, what, 'line');
}

/** A number with its unit, on one line: no space and no slash at which a browser may break it. */
function inUnit(value, unit) {
  return `${number(value)}\u00a0[${unit.replaceAll('/', '/\u2060')}]`;
}

/** The numbers of a state: name and value in turn. */
function facts(row, {units, along}) {
  const found = [];
  // G comes last: its reason for being absent takes a line of its own
  if (along.name === 'strain') found.push(['strain γ', number(row.strain)]);
  found.push(
    ['ρ', number(row.rho)],
    ['φ', number(row.phi)],
    ['z', number(row.z)],
    ['z of all', number(row.z_all)],
    ['rattlers', row.rattlers === null ? 'uncertain' : String(row.rattlers)],
    ['pressure', inUnit(row.pressure, units.stress)],
    ['G', row.g === null ? `none: ${row.why}` : `${inUnit(row.g, units.stress)} ${row.why}`],
  );
  return found;
}

/** A warning if the state is no minimum, or not the one that was asked for; else "". */
function warning({converged, on_target: met, max_force: left}, {units}) {
  if (converged === true) return met ? '' : 'not at the packing fraction that was asked for';
  if (converged === null) return 'not known to be at an energy minimum';
  return `NOT CONVERGED${left === null ? '' : `: residual force ${number(left, 2)} [${units.force}]`}`;
}

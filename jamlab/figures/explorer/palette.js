// Colours of pictures, from the palette of Okabe & Ito, which the colour-blind tell apart; print is always light.

const SHARED = {
  large: '#0072B2', small: '#CC79A7', rattler: '#BBBBBB', wall: '#D55E00', wallBesideVoids: '#0072B2',
  move: '#E69F00', pointed: '#E69F00',
  sides: {3: '#D55E00', 4: '#56B4E9', 5: '#F0E442', 6: '#CC79A7'}, otherSides: '#009E73',
};
const LIGHT = {
  ...SHARED, paper: '#ffffff', ink: '#1a1a1a', force: '#000000', edge: '#ffffff', outline: '#333333', fill: 0.55,
  beside: '#E4E4E4', overlap: '#3a3a3a', veil: 'rgba(255, 255, 255, 0.55)', digit: '#000000',
};
const DARK = {
  ...SHARED, paper: '#15181c', ink: '#e6e6e6', force: '#ffffff', edge: '#15181c', outline: '#b8bec6', fill: 0.6,
  beside: '#3b4149', overlap: '#f4f4f4', veil: 'rgba(21, 24, 28, 0.6)', digit: '#000000',
};

const darkness = matchMedia('(prefers-color-scheme: dark)');

function palette(printing) {
  return darkness.matches && !printing ? DARK : LIGHT;
}

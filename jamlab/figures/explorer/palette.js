// Colours of pictures beside those of `SHARED`, which Python writes from its palette; print is always light.

const LIGHT = {
  ...SHARED, paper: '#ffffff', ink: '#1a1a1a', force: '#000000', tension: '#D55E00', edge: '#ffffff',
  outline: '#333333', fill: 0.55, beside: '#E4E4E4', veil: 'rgba(255, 255, 255, 0.55)', digit: '#000000',
};
const DARK = {
  ...SHARED, paper: '#15181c', ink: '#e6e6e6', force: '#ffffff', tension: '#FF8A3D', edge: '#15181c',
  outline: '#b8bec6', fill: 0.6, beside: '#3b4149', veil: 'rgba(21, 24, 28, 0.6)', digit: '#000000',
};

const darkness = matchMedia('(prefers-color-scheme: dark)');

function palette(printing) {
  return darkness.matches && !printing ? DARK : LIGHT;
}

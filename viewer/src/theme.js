// Colours: the style sheet has them, for light and for dark.

const dark = matchMedia("(prefers-color-scheme: dark)");

export const colour = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const COLOURS = 8; // of runs and curves
export const series = (k) => colour(`series-${k % COLOURS}`);

export const onChange = (listener) => dark.addEventListener("change", listener);

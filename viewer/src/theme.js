// Reads colours from the style sheet, which has a light and a dark set.

const dark = matchMedia("(prefers-color-scheme: dark)");

export const colour = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const COLOURS = 8; // for runs and for curves
export const series = (k) => colour(`series-${k % COLOURS}`);

export const onChange = (listener) => dark.addEventListener("change", listener);

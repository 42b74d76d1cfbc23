// Words with numbers in them, as Python writes them.

// A number that a user gave, as Python's errors repeat it.
export const asPython = (value) =>
  String(value).replace("NaN", "nan").replace("Infinity", "inf");

// A number as Python's format "g" has it, with all zeros if asked for.
export function general(x, digits, zeros = false) {
  if (!Number.isFinite(x)) return Number.isNaN(x) ? "nan" : x > 0 ? "inf" : "-inf";
  const [, power] = x.toExponential(digits - 1).split("e");
  const short = (text) => (zeros || !text.includes(".") ? text : text.replace(/\.?0+$/, ""));
  if (power >= -4 && power < digits) return short(x.toFixed(digits - 1 - power));
  const [number] = x.toExponential(digits - 1).split("e");
  return `${short(number)}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
}

// Fills {name} and {name:.3g} of a text.
export const filled = (text, values) =>
  text.replace(/\{(\w+)(?::\.(\d+)g)?\}/g, (_, name, digits) =>
    digits ? general(values[name], Number(digits)) : values[name],
  );

// A number of a run, or yes or no: five digits.
export function asWord(value) {
  if (typeof value === "boolean") return value ? "yes" : "no";
  const rounded = Math.abs(value) < 1e3 ? Number(value.toFixed(12)) : value;
  return general(rounded + 0, 5, true).replace(/\.$/, "");
}

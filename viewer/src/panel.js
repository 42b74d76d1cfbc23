// The panel beside the stage: notes, a switch for each run, and a table of numbers.
import { onChange, series } from "./theme.js";

const made = (name, text = "", more = {}) =>
  Object.assign(document.createElement(name), { textContent: text }, more);

// Tells notes in place of earlier ones.
export function tellNotes(holder, notes) {
  const before = [...holder.querySelectorAll("p")];
  if (before.length === notes.length && before.every((p, i) => p.textContent === notes[i])) return;
  before.forEach((note) => note.remove());
  holder.append(...notes.map((note) => made("p", note)));
  holder.hidden = !notes.length;
}

// Warnings are folded, so that plots and numbers below them stay in view.
export function tellWarnings(holder, warnings) {
  const count = `${warnings.length} warning${warnings.length === 1 ? "" : "s"}`;
  holder.querySelector("summary").textContent = count;
  tellNotes(holder, warnings);
}

// Adds a switch for each run; returns the switches.
export function addSwitches(holder, runs, change) {
  const switches = runs.map((run, k) => {
    const box = made("input", "", { type: "checkbox", checked: true });
    box.addEventListener("change", () => change(k, box.checked));
    const swatch = made("span", "", { className: "swatch" });
    const label = made("label");
    label.append(box, swatch, run.name);
    holder.append(label);
    return box;
  });
  const paint = () =>
    holder
      .querySelectorAll(".swatch")
      .forEach((swatch, k) => swatch.style.setProperty("background", series(k)));
  paint();
  onChange(paint);
  holder.hidden = runs.length === 1;
  return switches;
}

// Fills a table: one row for each number, one column for each run.
export function tellNumbers(table, runs) {
  table.replaceChildren();
  const labels = [...new Set(runs.flatMap((run) => run.numbers.map(([label]) => label)))];
  if (runs.length > 1) {
    const head = table.createTHead().insertRow();
    head.append(made("td"), ...runs.map((run) => made("th", run.name, { scope: "col" })));
  }
  const body = table.createTBody();
  for (const label of labels) {
    const row = body.insertRow();
    row.append(made("th", label, { scope: "row" }));
    for (const run of runs) row.append(made("td", Object.fromEntries(run.numbers)[label] ?? "–"));
  }
}

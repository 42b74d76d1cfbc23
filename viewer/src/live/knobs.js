// Sliders and fields for the numbers of a computed run.

const GROUPS = { start: "Start", body: "Body and ground", controller: "Controller" };
const made = (name, more = {}) => Object.assign(document.createElement(name), more);
const short = (x) => String(Number(x.toPrecision(6)));

// The limits of a slider: a part of the value, and some times it.
function limits({ rule, value, slider }) {
  if (slider) return [Math.min(slider[0], value), Math.max(slider[1], value)];
  const most = Math.max(Math.abs(value), 1);
  if (rule === "finite") return [value - most, value + most];
  return [rule === "positive" ? value / 10 : 0, 3 * value || 1];
}

export class Knobs {
  // change: takes the values of the changed knobs, a map, and a push or none; returns why it
  // refuses them
  constructor(holder, knobs, change) {
    Object.assign(this, { knobs, change, values: new Map(), rows: new Map() });
    for (const [group, title] of Object.entries(GROUPS)) {
      const rows = knobs.filter((knob) => knob.group === group).map((knob) => this.row(knob));
      const box = made("details", { open: group === "start", hidden: !rows.length });
      box.append(made("summary", { textContent: title }), ...rows);
      holder.append(box);
    }
    this.refused = made("p", { role: "alert", hidden: true });
    const reset = made("button", { textContent: "As it was" });
    reset.addEventListener("click", () => this.set({}));
    holder.append(this.refused, reset);
    holder.hidden = false;
  }

  row(knob) {
    const name = `${knob.name} (${knob.unit})`.replace(" (1)", "");
    const row = made("div", { className: "knob", title: knob.meaning ?? "" });
    const [min, max] = limits(knob);
    row.append(
      made("span", { textContent: name }),
      made("input", { type: "range", min, max, step: "any", ariaLabel: name }),
      made("input", { type: "number", step: "any", ariaLabel: name }),
    );
    this.rows.set(knob, row);
    this.show(knob);
    row.addEventListener("input", ({ target }) => {
      this.values.set(knob, target.valueAsNumber);
      this.show(knob, target);
      this.due ??= requestAnimationFrame(() => this.tell());
    });
    return row;
  }

  // Shows the value of a knob, but not in the input where it is being typed.
  show(knob, typed) {
    const row = this.rows.get(knob);
    const value = this.values.get(knob) ?? knob.value;
    row.classList.toggle("turned", this.values.has(knob));
    for (const input of row.querySelectorAll("input"))
      if (input !== typed && Number.isFinite(value)) input.value = short(value);
  }

  // Sets knobs by their names, all others as the run had them; returns why that is refused.
  set(values) {
    this.values = new Map();
    this.push = undefined;
    for (const knob of this.knobs) {
      if (Object.hasOwn(values, knob.name)) this.values.set(knob, values[knob.name]);
      this.show(knob);
    }
    return this.tell();
  }

  // Pushes the animal at the start; a push that is refused is forgotten.
  pushBy(push) {
    this.push = push;
    const refused = this.tell();
    if (refused) this.push = undefined;
    return refused;
  }

  tell() {
    this.due = undefined;
    this.refused.textContent = this.change(this.values, this.push);
    this.refused.hidden = !this.refused.textContent;
    return this.refused.textContent;
  }
}

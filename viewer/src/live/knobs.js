// Sliders and fields for the numbers of a computed run.

const GROUPS = { start: "Start", body: "Body and ground", controller: "Controller" };
const made = (name, more = {}) => Object.assign(document.createElement(name), more);
const short = (x) => String(Number(x.toPrecision(6)));

export class Knobs {
  // change: called with the values of the changed knobs, a map, before the next frame
  constructor(holder, knobs, change) {
    Object.assign(this, { knobs, change, values: new Map(), parts: new Map() });
    for (const [group, title] of Object.entries(GROUPS)) {
      const of = knobs.filter((knob) => knob.group === group);
      if (!of.length) continue;
      const box = made("details", { open: group === "start" });
      box.append(made("summary", { textContent: title }), ...of.map((knob) => this.row(knob)));
      holder.append(box);
    }
    this.refused = made("p", { className: "refused", hidden: true });
    this.refused.setAttribute("role", "alert");
    const reset = made("button", { textContent: "As it was", id: "reset" });
    reset.addEventListener("click", () => this.set({}));
    holder.append(this.refused, reset);
    holder.hidden = false;
  }

  row(knob) {
    const words = `${knob.name} (${knob.unit})`.replace(" (1)", "");
    const row = made("div", { className: "knob", title: knob.meaning });
    const [least, most] = [Math.min(knob.least, knob.value), Math.max(knob.most, knob.value)];
    const slider = made("input", { type: "range", min: least, max: most, step: "any" });
    const field = made("input", { type: "number", step: "any" });
    for (const part of [slider, field]) part.setAttribute("aria-label", words);
    slider.addEventListener("input", () => {
      field.value = short(slider.valueAsNumber);
      this.turn(knob, Number(field.value));
    });
    field.addEventListener("input", () => {
      slider.value = field.value;
      this.turn(knob, field.valueAsNumber);
    });
    row.append(made("span", { textContent: words }), slider, field);
    this.parts.set(knob, [slider, field]);
    this.show(knob, knob.value);
    return row;
  }

  show(knob, value) {
    const [slider, field] = this.parts.get(knob);
    slider.value = value;
    field.value = short(value);
  }

  turn(knob, value) {
    this.values.set(knob, value);
    this.parts.get(knob)[1].parentElement.classList.add("turned");
    this.due ??= requestAnimationFrame(() => this.tell());
  }

  // Sets knobs by their names, all others as the run had them; returns why that was refused.
  set(values) {
    this.values.clear();
    for (const knob of this.knobs) {
      const own = Object.hasOwn(values, knob.name);
      if (own) this.values.set(knob, values[knob.name]);
      this.parts.get(knob)[1].parentElement.classList.toggle("turned", own);
      this.show(knob, own ? values[knob.name] : knob.value);
    }
    return this.tell();
  }

  tell() {
    this.due = undefined;
    const refused = this.change(this.values);
    this.refused.textContent = refused;
    this.refused.hidden = !refused;
    return refused;
  }
}

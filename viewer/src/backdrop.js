// A reader's own film behind the model. The browser reads it from their disk; nothing is sent.

const made = (name, more = {}) => Object.assign(document.createElement(name), more);
const KNOBS = {
  offset: ["film's time at the start (s)", 0],
  pace: ["film's seconds per second", 1],
};

export class Backdrop {
  // holder: of the controls; video: behind the canvas; seen: takes whether there is a film
  constructor({ holder, video, player, seen }) {
    Object.assign(this, { video, player, seen, knobs: {} });
    const file = made("input", { type: "file", accept: "video/*", ariaLabel: "Film" });
    file.addEventListener("change", () => this.open(file.files[0]));
    this.told = made("p", { role: "alert", hidden: true });
    this.rows = Object.keys(KNOBS).map((name) => this.row(name));
    holder.append(file, this.told, ...this.rows);
    holder.hidden = false;
    video.addEventListener("loadedmetadata", () => this.begin());
    video.addEventListener("error", () => this.refuse(file.files[0]));
    video.addEventListener("seeked", () => this.show(player.time));
  }

  row(name) {
    const [label, value] = KNOBS[name];
    const row = made("div", { className: "knob", hidden: true });
    const slider = made("input", { type: "range", step: "any", ariaLabel: label });
    const field = made("input", { type: "number", step: "any", value, ariaLabel: label });
    const middle = name === "offset" ? slider : made("span");
    row.append(made("span", { textContent: label }), middle, field);
    row.addEventListener("input", ({ target }) => {
      if (target === slider) field.value = target.valueAsNumber.toFixed(3);
      else slider.value = target.value;
      this.show(this.player.time);
    });
    this.knobs[name] = { slider, field };
    return row;
  }

  // Opens a film in place of an earlier one; without a file there is none.
  open(file) {
    URL.revokeObjectURL(this.video.src);
    this.set(false, "");
    if (file) this.video.src = URL.createObjectURL(file);
  }

  begin() {
    const { slider, field } = this.knobs.offset;
    const { begin, end } = this.player;
    const { duration } = this.video; // infinite where the file does not tell it
    const max = Number.isFinite(duration) ? duration : end - begin;
    Object.assign(slider, { min: begin - end, max, value: field.value });
    this.set(true, "");
    this.show(this.player.time);
  }

  refuse(file) {
    if (file) this.set(false, `${file.name}: this browser cannot play it; try an MP4 or a WebM.`);
  }

  set(on, told) {
    Object.assign(this.told, { textContent: told, hidden: !told });
    for (const row of this.rows) row.hidden = !on;
    this.video.hidden = !on;
    this.on = on;
    this.seen(on);
  }

  // Shows the film's picture of a time of the run, as soon as the film is not seeking another one.
  show(t) {
    if (!this.on || this.video.seeking) return;
    const [offset, pace] = ["offset", "pace"].map((name) => this.knobs[name].field.valueAsNumber);
    const wanted = offset + pace * (t - this.player.begin);
    const { currentTime, duration } = this.video;
    const time = Math.min(Math.max(wanted, 0), duration);
    if (Math.abs(time - currentTime) > 1e-3) this.video.currentTime = time;
  }
}

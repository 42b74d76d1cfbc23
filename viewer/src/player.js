// Controls the time that is shown: play, seek and step, by mouse and by keyboard.

const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 5];
const WATCHED = 8; // s that a run takes at the initial speed
const PRESSED = "button, input[type=checkbox], summary"; // controls that the space bar presses
const MOST_MARKS = 200;
const LONGEST = 50; // ms between frames of a video: a slow computer skips none

export class Player {
  constructor(find, runs, show) {
    Object.assign(this, { runs, show, marks: find("marks") });
    this.jumps = [find("before"), find("after")];
    this.slider = find("time");
    this.clock = find("clock");
    this.button = find("play");
    this.speed = find("speed");
    this.renew();
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.button.addEventListener("click", () => this.toggle());
    this.jumps.forEach((button, i) => button.addEventListener("click", () => this.jump(2 * i - 1)));
    this.addSpeeds();
    this.time = this.begin;
    this.playing = false;
  }

  // Takes the times and events of the runs as they are now.
  renew() {
    const { runs } = this;
    this.begin = Math.min(...runs.map((run) => run.times[0]));
    this.end = Math.max(...runs.map((run) => run.times.at(-1)));
    this.events = runs.flatMap((run) => run.events).sort((a, b) => a.time - b.time);
    Object.assign(this.slider, { min: this.begin, max: this.end, step: "any" });
    for (const button of this.jumps) button.hidden = !this.events.length;
    this.marks.replaceChildren();
    this.addMarks(this.marks);
  }

  addSpeeds() {
    const wanted = (this.end - this.begin) / WATCHED;
    for (const speed of SPEEDS)
      this.speed.add(new Option(speed < 1 ? `1/${Math.round(1 / speed)}` : `${speed}`, speed));
    this.speed.value = SPEEDS.findLast((speed) => speed <= wanted) ?? SPEEDS[0];
  }

  addMarks(holder) {
    const step = Math.ceil(this.events.length / MOST_MARKS);
    for (const event of this.events.filter((_, i) => i % step === 0)) {
      const mark = document.createElement("i");
      mark.style.left = `${(100 * (event.time - this.begin)) / (this.end - this.begin || 1)}%`;
      mark.className = event.kind;
      mark.title = event.label;
      mark.addEventListener("click", () => this.seek(event.time));
      holder.append(mark);
    }
  }

  seek(t) {
    this.time = Math.min(Math.max(t, this.begin), this.end);
    this.slider.value = this.time;
    const near = this.events.filter((event) => Math.abs(event.time - this.time) < 1e-9);
    this.clock.textContent = [
      `${this.time.toFixed(4)} s`,
      ...near.map((event) => event.label),
    ].join(", ");
    this.slider.setAttribute("aria-valuetext", this.clock.textContent);
    this.show(this.time);
  }

  toggle(on = !this.playing) {
    this.playing = on && this.end > this.begin;
    this.button.textContent = this.playing ? "Pause" : "Play";
    this.before = undefined;
    if (!this.playing) this.finish();
    if (this.playing) requestAnimationFrame((now) => this.frame(now));
  }

  // Plays until the end or a pause, and then calls a function.
  playOnce(done) {
    this.done = done;
    this.toggle(true);
  }

  finish() {
    const { done } = this;
    this.done = undefined;
    done?.();
  }

  frame(now) {
    if (!this.playing) return;
    if (this.done && this.time >= this.end) return this.toggle(false);
    const passed = Math.min(now - (this.before ?? now), this.done ? LONGEST : Infinity);
    const next = this.time + (Number(this.speed.value) * passed) / 1000;
    this.before = now;
    this.seek(this.time >= this.end ? this.begin : next);
    requestAnimationFrame((later) => this.frame(later));
  }

  // Steps by samples of the run that has the most samples.
  step(count) {
    const run = this.runs.reduce((most, each) => (each.rows > most.rows ? each : most));
    const row = Math.min(Math.max(run.row(this.time) + count, 0), run.rows - 1);
    this.toggle(false);
    this.seek(run.times[row]);
  }

  jump(way) {
    const ahead = this.events.filter((event) => way * (event.time - this.time) > 1e-9);
    if (ahead.length) this.seek(ahead.at(way > 0 ? 0 : -1).time);
  }

  faster(by) {
    const last = this.speed.length - 1;
    this.speed.selectedIndex = Math.min(Math.max(this.speed.selectedIndex + by, 0), last);
  }

  // Return the action of a key; undefined if the player does not use the key, or if the focused
  // control uses it itself.
  action(event) {
    const { key, shiftKey, target } = event;
    const count = shiftKey ? 10 : 1;
    const actions = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.step(-count),
      ArrowRight: () => this.step(count),
      Home: () => this.seek(this.begin),
      End: () => this.seek(this.end),
      n: () => this.jump(1),
      p: () => this.jump(-1),
      "+": () => this.faster(1),
      "-": () => this.faster(-1),
    };
    return key === " " && target.matches(PRESSED) ? undefined : actions[key];
  }
}

// Plots curves over time, with a cursor at the time that is shown; a click or a drag seeks.
import uPlot from "uplot";
import { colour, onChange, series } from "./theme.js";

const HEIGHT = 150;
const REST = 60; // ms between curves that are drawn anew: the animal moves meanwhile
const DASHES = [[], [6, 4], [2, 3], [9, 3, 2, 3]];

// Four digits; a value below 1e-6 of the plot's largest one is shown as 0, since it is rounding.
const digits = (value, largest) =>
  Number((Math.abs(value) < 1e-6 * largest ? 0 : value).toPrecision(4)).toString();

const LEAST_PART = 1e-3; // of the largest value: the axis spans this or more, not rounding alone

// Labels of an axis, with as many decimals as its step needs.
const ticks = (_plot, values, _axis, _space, step) => {
  const decimals = Math.min(Math.max(2 - Math.floor(Math.log10(step)), 0), 20);
  return values.map((value) => {
    const rounded = Number(value.toFixed(decimals));
    return rounded && Math.abs(rounded) < 1e-3 ? rounded.toExponential() : rounded.toString();
  });
};

class Plot {
  constructor(holder, meta, runs, seek) {
    Object.assign(this, { meta, runs, curves: meta.curves });
    this.alone = runs.length === 1;
    this.box = document.createElement("figure");
    this.key = document.createElement("figcaption");
    this.box.append(this.key);
    holder.append(this.box);
    this.addKey();

    const options = {
      ...this.size(),
      scales: {
        x: { time: false },
        y: meta.compressed
          ? { distr: 4, asinh: meta.compressed }
          : { range: (_, low, high) => this.range(low, high) },
      },
      series: [{}, ...this.curves.map((curve, i) => this.look(curve, i))],
      axes: [
        this.axis({ size: 26, values: (_, times) => times.map((time) => `${time} s`) }),
        this.axis({ size: 56, ...(meta.compressed ? {} : { values: ticks }) }),
      ],
      legend: { show: false },
      cursor: { show: false },
      padding: [8, 18, 0, 0],
    };
    this.plot = new uPlot(options, this.data(), this.box);
    this.now = document.createElement("div");
    this.now.className = "now";
    this.plot.over.append(this.now);
    const at = (event) =>
      seek(this.plot.posToVal(event.clientX - this.plot.over.getBoundingClientRect().left, "x"));
    this.plot.over.addEventListener("pointerdown", at);
    this.plot.over.addEventListener("pointermove", (event) => event.buttons && at(event));
  }

  // One run: each curve has a colour. Several runs: each run has a colour, each curve a dash.
  stroke(curve, i) {
    return series(this.alone ? i : curve.run);
  }

  look(curve, i) {
    return {
      stroke: () => this.stroke(curve, i),
      width: 1.5,
      dash: this.dash(curve),
      spanGaps: true,
    };
  }

  dash(curve) {
    return this.alone ? [] : DASHES[curve.column % DASHES.length];
  }

  range(low, high) {
    if (low === null || high === null) return [null, null];
    const least = Math.max(this.meta.least, LEAST_PART * this.largest);
    const more = Math.max(least - (high - low), 0) / 2;
    return uPlot.rangeNum(low - more, high + more, 0.1, true);
  }

  axis(more) {
    const grid = { stroke: () => colour("grid"), width: 1 };
    return {
      stroke: () => colour("ink"),
      grid,
      ticks: grid,
      font: "11px system-ui, sans-serif",
      ...more,
    };
  }

  // Runs may be sampled at different times.
  data() {
    const tables = this.curves.map(({ run, array, column }) => {
      const { times, rows } = this.runs[run];
      return [
        Array.from(times),
        Array.from({ length: rows }, (_, k) => this.runs[run].value(array, k, column)),
      ];
    });
    this.largest = 0;
    for (const [, values] of tables)
      for (const value of values) this.largest = Math.max(this.largest, Math.abs(value));
    return this.alone ? [tables[0][0], ...tables.map(([, values]) => values)] : uPlot.join(tables);
  }

  renew() {
    this.stale = !this.seen;
    if (this.seen) this.plot.setData(this.data());
  }

  see(seen) {
    this.seen = seen;
    if (seen && this.stale) this.renew();
  }

  addKey() {
    const title = document.createElement("b");
    title.textContent = this.meta.title;
    this.key.append(title);
    this.values = this.curves.map((curve, i) => {
      const entry = document.createElement("span");
      const value = document.createElement("output");
      const line = document.createElementNS("http://www.w3.org/2000/svg", "svg");
      line.setAttribute("aria-hidden", "true");
      const dashes = this.dash(curve).join(" ");
      line.innerHTML = `<line y1="5" x2="22" y2="5" stroke-dasharray="${dashes}"/>`;
      entry.append(line, `${curve.label} `, value);
      this.key.append(entry);
      return { entry, value, line };
    });
    this.paint();
  }

  paint() {
    this.values.forEach(({ line }, i) =>
      line.style.setProperty("stroke", this.stroke(this.curves[i], i)),
    );
    this.plot?.redraw(false);
  }

  show(t) {
    this.now.style.transform = `translateX(${this.plot.valToPos(t, "x")}px)`;
    this.values.forEach(({ value }, i) => {
      const { run, array, column } = this.curves[i];
      value.textContent = digits(
        this.runs[run].value(array, this.runs[run].row(t), column),
        this.largest,
      );
    });
  }

  switchRun(run, on) {
    this.curves.forEach((curve, i) => {
      if (curve.run !== run) return;
      this.plot.setSeries(i + 1, { show: on });
      this.values[i].entry.hidden = !on;
    });
  }

  size() {
    return { width: Math.max(this.box.clientWidth, 200), height: HEIGHT };
  }
}

export class Plots {
  constructor(holder, metas, runs, seek) {
    this.plots = metas.map((meta) => new Plot(holder, meta, runs, seek));
    onChange(() => this.plots.forEach((plot) => plot.paint()));
    const sight = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries)
        this.plots.find((plot) => plot.box === target).see(isIntersecting);
    });
    for (const plot of this.plots) sight.observe(plot.box);
  }

  show(t) {
    for (const plot of this.plots) plot.show(t);
  }

  // Takes other samples of runs, not with every frame; plots out of sight do so when they are seen.
  renew() {
    this.due ??= setTimeout(() => {
      this.due = undefined;
      for (const plot of this.plots) plot.renew();
    }, REST);
  }

  switchRun(run, on) {
    for (const plot of this.plots) plot.switchRun(run, on);
  }

  resize() {
    for (const plot of this.plots) plot.plot.setSize(plot.size());
  }
}

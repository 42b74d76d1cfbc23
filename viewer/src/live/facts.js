// What a computed run did: its samples, events, forces, books. All numbers are SI.
import { massOf, nameIn } from "./chains.js";

export const norm = Math.hypot;
export const sum = (list) => list.reduce((all, x) => all + x, 0);
export const range = (count) => Array.from({ length: count }, (_, i) => i);

// The largest of the values of f of 0 to count - 1, and the first number that has it.
export function largest(count, f) {
  let [most, at] = [-Infinity, 0];
  for (let k = 0; k < count; k++) {
    const value = f(k);
    if (value > most) [most, at] = [value, k];
  }
  return [most, at];
}

export const of = ({ data, width }, k, i) => data[k * width + i];
export const three = (array, k, i = 0) => [0, 1, 2].map((axis) => of(array, k, i + axis));

export class Facts {
  constructor(engine, status) {
    const { live } = engine;
    const rows = engine.member("done");
    Object.assign(this, { engine, live, status, rows, t: live.times.slice(0, rows) });
    for (const name of Object.keys(live.calls)) engine.call(name, rows);
    const array = (name) => engine.array(name, rows);
    for (const name of ["q", "v", "tau"]) this[name] = array(name);
    this.kinetic = array("energy.kinetic").data;
    this.potential = array("energy.potential").data;
    this.linear = array("momentum.linear");
    this.angular = array("momentum.angular");
    this.tail = array("tail_points.points");
    this.legs = array("leg_points.joints");
    this.com = array("center_of_mass.position");
    this.points = array("contact_points.positions");
    this.forces = array("contact_rates.forces");
    this.groups = Object.keys(live.groups);
    this.mass = massOf(engine);
    this.weight = this.mass * this.number("gravity");
    this.axes = this.semiAxes();
    this.events = this.points ? this.eventsOf() : [];
    if (this.points) this.peaks = this.peaksOf();
    this.addBooks();
  }

  number(name) {
    return this.engine.parameter(name)?.[0];
  }

  place(k) {
    return three(this.q, k);
  }

  // The torso's axes in the world: columns of its rotation matrix.
  columns(k) {
    const [w, x, y, z] = [3, 4, 5, 6].map((i) => of(this.q, k, i));
    return [
      [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
      [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
      [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ];
  }

  // The world's z axis in the torso's axes.
  up(k) {
    return this.columns(k).map((column) => column[2]);
  }

  // Degrees between the torso's z axis and the vertical.
  tilt(k) {
    const [w, x, y, z] = [3, 4, 5, 6].map((i) => of(this.q, k, i));
    return (360 / Math.PI) * Math.atan2(norm(x, y), norm(w, z));
  }

  // What a parameter of the tail is at a coordinate, in the chain that has this coordinate.
  passive(name, i) {
    const { owner, first } = this.live.chains.find(({ stop }) => i < stop);
    return this.engine.parameter(nameIn(owner, name))?.[i - first];
  }

  // A coordinate of the tail.
  angle(k, i) {
    return of(this.q, k, this.q.width - this.live.nt + i);
  }

  semiAxes() {
    const own = this.engine.parameter("torso_semi_axes");
    if (own || this.live.fixed) return own ? [...own] : [0, 0, 0];
    const inertia = [...this.engine.parameter("torso_inertia")];
    const part = 2.5 / this.number("torso_mass");
    return inertia.map((each) => Math.sqrt(Math.max(part * (sum(inertia) - 2 * each), 0)));
  }

  // The first point of a group, and the one after its last; of all points without one.
  span(group) {
    const before = this.groups.slice(0, group ? this.groups.indexOf(group) : 0);
    const first = sum(before.map((name) => this.live.groups[name]));
    return [first, group ? first + this.live.groups[group] : this.forces.width / 3];
  }

  groupOf(point) {
    return this.groups.find((name) => point < this.span(name)[1]);
  }

  // The ground's force on some points together.
  force(k, [first, last]) {
    const total = [0, 0, 0];
    for (let i = 3 * first; i < 3 * last; i++) total[i % 3] += of(this.forces, k, i);
    return total;
  }

  // A group whose force ceases and comes again while it is still in the ground has not left it.
  eventsOf() {
    const { engine, groups } = this;
    const count = Math.min(engine.member("events"), engine.member("most_events"));
    const times = engine.reals(engine.member("event_times"), count);
    const kinds = new Int32Array(engine.memory.buffer, engine.member("event_kinds"), count);
    const [events, left] = [[], {}];
    for (let i = 0; i < count; i++) {
      const [number, up] = [kinds[i] >> 1, kinds[i] % 2];
      const group = groups[number];
      if (group === undefined) {
        delete left[groups[kinds[i] - 2 * groups.length]];
      } else if (!up && left[group]) {
        events.splice(events.indexOf(left[group]), 1);
        delete left[group];
      } else {
        const event = { time: times[i], group, kind: up ? "take_off" : "touch_down" };
        if (up) left[group] = event;
        events.push(event);
      }
    }
    return events;
  }

  // The largest forces, and their times, on all points, each group and each foot.
  peaksOf() {
    const { engine, live, t } = this;
    const spans = { all: this.span() };
    for (const group of this.groups) spans[group] = this.span(group);
    if (spans.feet) {
      const [first, last] = spans.feet;
      spans.right_foot = [first, (first + last) / 2];
      spans.left_foot = [(first + last) / 2, last];
    }
    const stored = engine.reals(engine.member("peaks"), 2 * live.parts.length);
    const found = {};
    for (const [name, span] of Object.entries(spans)) {
      const [force, k] = largest(this.rows, (row) => norm(...this.force(row, span)));
      const part = 2 * live.parts.indexOf(name);
      const [peak, time] = part < 0 ? [] : stored.subarray(part, part + 2);
      const larger = time >= t[0] && time <= t.at(-1) && peak > force;
      found[name] = larger ? [peak, time] : [force, t[k]];
    }
    return found;
  }

  // Works, and impulses of the ground, by their names.
  addBooks() {
    Object.assign(this, { works: {}, impulses: {} });
    let place = this.engine.member("ledger");
    for (const [name, size] of this.live.ledger) {
      const entry = [...this.engine.reals(place, size)];
      if (size === 1) this.works[name] = entry[0];
      else this.impulses[name] = entry;
      place += 8 * size;
    }
  }

  // The energy that springs and stops of the tail store.
  stored(k) {
    const energies = range(this.live.nt).map((i) => {
      const p = (name) => this.passive(name, i);
      const spring = ((p("tail_stiffness") ?? 0) * (this.angle(k, i) - p("tail_rest")) ** 2) / 2;
      const stops = this.ways(k, i).map((way) => {
        const [s, beyond] = [Math.min(Math.max(way, 0), 1), Math.max(way - 1, 0)];
        const scale = p("tail_stop_stiffness") * p("tail_stop_width") ** 2;
        return scale * ((s ** 4 * (5 - 2 * s)) / 20 + (beyond * (1 + beyond)) / 2);
      });
      return sum([spring || 0, ...stops]);
    });
    return sum(energies);
  }

  // How far a coordinate is in both stops, in widths.
  ways(k, i) {
    const p = (name) => this.passive(name, i);
    if (p("tail_stop_lower") === undefined) return [];
    const [angle, width] = [this.angle(k, i), p("tail_stop_width")];
    return [(p("tail_stop_lower") - angle) / width, (angle - p("tail_stop_upper")) / width];
  }
}

// What a computed run did: its samples, events, forces, books. All numbers are SI.

const KINDS = ["touch_down", "take_off"];
const TAIL = 7; // first coordinate of the tail in q, of a torso that moves

export const norm = (...x) => Math.hypot(...x);
export const sum = (list) => list.reduce((all, x) => all + x, 0);

// The largest of the values of f at all samples, and the first sample that has it.
export function largest(rows, f) {
  let [most, at] = [-Infinity, 0];
  for (let k = 0; k < rows; k++) {
    const value = f(k);
    if (value > most) [most, at] = [value, k];
  }
  return [most, at];
}

// The third row of the rotation matrix of a quaternion: the world's z axis in the torso's axes.
export const upOf = ([w, x, y, z]) => [
  2 * (x * z - w * y),
  2 * (y * z + w * x),
  1 - 2 * (x * x + y * y),
];

export class Facts {
  constructor(engine, status) {
    const { live } = engine;
    const rows = engine.member("done");
    Object.assign(this, { engine, live, status, rows, end: engine.member("t") });
    this.t = live.times.slice(0, rows);
    for (const name of Object.keys(live.calls)) engine.call(name, rows);
    const of = (name) => engine.array(name, rows);
    Object.assign(this, {
      q: of("q"),
      v: of("v"),
      tau: of("tau"),
      kinetic: of("energy.kinetic").data,
      potential: of("energy.potential").data,
      linear: of("momentum.linear"),
      tail: of("tail_points.points"),
      legs: of("leg_points.joints"),
      com: of("center_of_mass.position"),
      points: of("contact_points.positions"),
      forces: of("contact_rates.forces"),
    });
    this.tailAt = live.fixed ? 0 : TAIL;
    this.groups = Object.keys(live.groups);
    this.events = this.points ? this.eventsOf() : [];
  }

  parameter(name) {
    return this.engine.parameter(name);
  }

  number(name) {
    return this.parameter(name)?.[0];
  }

  get mass() {
    return (this.number("torso_mass") ?? 0) + this.number("tail_mass");
  }

  get weight() {
    return this.mass * this.number("gravity");
  }

  quaternion(k) {
    const { data, width } = this.q;
    return data.subarray(k * width + 3, k * width + 7);
  }

  up(k) {
    return upOf(this.quaternion(k));
  }

  height(k) {
    return this.q.data[k * this.q.width + 2];
  }

  // A coordinate of the tail.
  angle(k, i) {
    return this.q.data[k * this.q.width + this.tailAt + i];
  }

  // The torso's semi-axes; zeros on a fixed base.
  get axes() {
    if (this.live.fixed) return [0, 0, 0];
    const own = this.parameter("torso_semi_axes");
    if (own) return [...own];
    const inertia = [...this.parameter("torso_inertia")];
    const most = sum(inertia);
    return inertia.map((i) =>
      Math.sqrt(Math.max((2.5 / this.number("torso_mass")) * (most - 2 * i), 0)),
    );
  }

  // The first point of a group, and the one after its last.
  span(group) {
    let first = 0;
    for (const [name, count] of Object.entries(this.live.groups)) {
      if (name === group) return [first, first + count];
      first += count;
    }
    return [0, first];
  }

  // The ground's force on some points together.
  force(k, [first, last]) {
    const { data, width } = this.forces;
    const total = [0, 0, 0];
    for (let i = first; i < last; i++)
      for (let axis = 0; axis < 3; axis++) total[axis] += data[k * width + 3 * i + axis];
    return total;
  }

  // A group whose force ceases and comes again while it is still in the ground has not left it.
  eventsOf() {
    const count = Math.min(this.engine.member("events"), this.engine.member("most_events"));
    const times = this.engine.reals(this.engine.member("event_times"), count);
    const kinds = new Int32Array(this.engine.buffer, this.engine.member("event_kinds"), count);
    const events = [];
    const left = new Map();
    for (let i = 0; i < count; i++) {
      const group = Math.floor(kinds[i] / 2);
      const kind = kinds[i] % 2;
      if (group >= this.groups.length) {
        left.delete(kinds[i] - 2 * this.groups.length);
        continue;
      }
      const event = { time: times[i], group: this.groups[group], kind: KINDS[kind] };
      if (kind === 0 && left.has(group)) {
        events.splice(events.indexOf(left.get(group)), 1);
        left.delete(group);
        continue;
      }
      if (kind === 1) left.set(group, event);
      events.push(event);
    }
    return events;
  }

  // Works, and impulses of the ground, by their names.
  books() {
    const works = {};
    const impulses = {};
    let place = this.engine.member("ledger");
    for (const [name, size] of this.live.ledger) {
      const entry = [...this.engine.reals(place, size)];
      place += 8 * size;
      if (size === 1) works[name] = entry[0];
      else impulses[name] = entry;
    }
    return { works, impulses };
  }

  // The largest forces, and their times, on all points, each group and each foot.
  get peaks() {
    if (!this.forces) return {};
    const spans = { all: this.span() };
    for (const group of this.groups) spans[group] = this.span(group);
    if (spans.feet) {
      const [first, last] = spans.feet;
      spans.right_foot = [first, (first + last) / 2];
      spans.left_foot = [(first + last) / 2, last];
    }
    const stored = this.engine.reals(this.engine.member("peaks"), 2 * this.live.parts.length);
    const found = {};
    for (const [name, span] of Object.entries(spans)) {
      const [force, k] = largest(this.rows, (row) => norm(...this.force(row, span)));
      found[name] = [force, this.t[k]];
      const part = this.live.parts.indexOf(name);
      const [peak, time] = part < 0 ? [] : stored.subarray(2 * part, 2 * part + 2);
      const within = time >= this.t[0] && time <= this.t.at(-1);
      if (within && (peak > force || (peak === force && time > this.t[k])))
        found[name] = [peak, time];
    }
    return found;
  }

  // The energy that springs and stops of the tail store.
  stored(k) {
    const of = (name, i) => this.parameter(name)[i];
    let energy = 0;
    for (let i = 0; i < this.live.nt; i++) {
      const angle = this.angle(k, i);
      if (this.parameter("tail_stiffness"))
        energy += (of("tail_stiffness", i) * (angle - of("tail_rest", i)) ** 2) / 2;
      for (const [stop, way] of this.ways(k, i)) {
        const s = Math.min(Math.max(way, 0), 1);
        const beyond = Math.max(way - 1, 0);
        const scale = of("tail_stop_stiffness", i) * of("tail_stop_width", i) ** 2;
        energy += stop && scale * ((s ** 4 * (5 - 2 * s)) / 20 + (beyond * (1 + beyond)) / 2);
      }
    }
    return energy;
  }

  // How far a coordinate is in both stops, in widths.
  ways(k, i) {
    if (!this.parameter("tail_stop_lower")) return [];
    const signs = { tail_stop_lower: -1, tail_stop_upper: 1 };
    return Object.entries(signs).map(([stop, sign]) => [
      stop,
      (sign * (this.angle(k, i) - this.parameter(stop)[i])) / this.parameter("tail_stop_width")[i],
    ]);
  }
}

// A run that is computed again with other numbers, and drawn in place of the one that was given.
import { Engine } from "./engine.js";
import { Facts, largest } from "./facts.js";
import { numbersOf, rowsOf, tilt } from "./numbers.js";
import { warningsOf } from "./warnings.js";
import { filled } from "./words.js";

const DEG = 180 / Math.PI;
const STILL = [0, 0, 0, 1, 0, 0, 0]; // place and quaternion of a fixed base

// The quaternion of pitch, roll and yaw in degrees: R = Rz(yaw) Rx(pitch) Ry(roll).
function quaternionOf(degrees) {
  const [cp, cr, cy] = degrees.map((angle) => Math.cos(angle / DEG / 2));
  const [sp, sr, sy] = degrees.map((angle) => Math.sin(angle / DEG / 2));
  return [
    cy * cp * cr - sy * sp * sr,
    cy * sp * cr - sy * cp * sr,
    cy * cp * sr + sy * sp * cr,
    cy * sp * sr + sy * cp * cr,
  ];
}

export class LiveRun {
  static async of(live, run, prefix) {
    return new LiveRun(await Engine.of(live), run, prefix);
  }

  // run: what the page shows; prefix: of words about it
  constructor(engine, run, prefix) {
    Object.assign(this, { engine, run, prefix, live: engine.live });
  }

  // Computes the run with other values of knobs (a map), and fills the shown one. Returns notes and
  // warnings; an error refuses the values, and leaves the run as it was.
  compute(values) {
    const refused = [...values].map(([knob, value]) => refusal(knob, value)).find(Boolean);
    if (refused) throw new Error(refused);
    this.engine.reset();
    this.apply(values);
    this.refuseDeep();
    const status = this.engine.advance();
    const facts = new Facts(this.engine, status);
    const failure = status ? this.failure(facts) : "";
    if (facts.rows < 2) throw new Error(failure);
    this.fill(facts);
    const notes = failure ? [`the run failed, and ends here: ${failure}`] : [];
    const told = [notes, warningsOf(facts)].map((each) => each.map((text) => this.prefix + text));
    return { notes: told[0], warnings: told[1] };
  }

  apply(values) {
    const { engine, live } = this;
    for (const [knob, value] of values)
      for (const place of knob.places) engine.write(place, knob.scale * value);
    const of = (knob) => (values.has(knob) ? values.get(knob) : knob.value);
    const angles = live.knobs.filter((knob) => knob.angle !== null);
    if (angles.some((knob) => values.has(knob))) {
      const q = engine.reals(engine.member("q"), 7);
      q.set(quaternionOf(angles.map(of)), 3);
    }
    // equal links are ellipsoids: their inertia follows from mass, length and radius
    const thick = live.knobs.find((knob) => knob.name === "link_radius");
    if (!thick || ![...values.keys()].some(({ group }) => group === "body")) return;
    const [m, length] = ["tail_mass", "tail_length"].map(
      (name) => engine.parameter(name)[0] / live.pieces,
    );
    const r = of(thick);
    const across = (m / 5) * ((length * length) / 4 + r * r);
    engine.parameter("link_inertia").set([across, (m / 5) * (2 * r * r), across]);
  }

  // Refuses a start with a point deeper than a static force could press it.
  refuseDeep() {
    const { engine, live } = this;
    if (!live.calls.contact_points) return;
    for (const name of ["q", "v"]) {
      const { data, width } = engine.array(name, 1);
      data.set(engine.reals(engine.member(name), width));
    }
    engine.call("contact_points", 1);
    const { data, width } = engine.array("contact_points.positions", 1);
    const [depth, point] = largest(width / 3, (i) => -data[3 * i + 2]);
    const number = (name) => engine.parameter(name)?.[0] ?? 0;
    const weight = (number("torso_mass") + number("tail_mass")) * number("gravity");
    const limit = ((live.limits.static * weight) / number("K_n")) ** (2 / 3);
    if (!(depth > limit)) return;
    let ends = 0;
    const group = Object.keys(live.groups).find((name) => point < (ends += live.groups[name]));
    const lengths = { depth: 1e3 * depth, limit: 1e3 * limit, height: depth };
    throw new Error(filled(live.words.deep, { whose: "", point, group, ...lengths }));
  }

  // The words of what ended a run.
  failure(facts) {
    const { live } = this;
    const words = filled(live.words.failed, { t: facts.end, why: live.why[facts.status] });
    const most = (array, from) => {
      const { data, width } = array;
      return data.reduce((all, x, i) => (i % width < from ? all : Math.max(all, Math.abs(x))), 0);
    };
    const numbers = { torque: most(facts.tau, 0), rate: most(facts.v, facts.v.width - live.nt) };
    const strong = live.short.includes(facts.status) && numbers.rate > live.limits.fastest;
    return strong && numbers.torque ? words + filled(live.words.too_strong, numbers) : words;
  }

  // Fills the shown run with samples, events and numbers.
  fill(facts) {
    const { live, run, prefix } = this;
    const { rows, q, tau, kinetic, potential } = facts;
    const filledBy = (width, value) => {
      const data = new Float64Array(rows * width);
      for (let k = 0; k < rows; k++)
        for (let i = 0; i < width; i++) data[k * width + i] = value(k, i);
      return { data, width };
    };
    const bent = live.polar ? undefined : (k, i) => DEG * live.joints[i >> 1] * facts.angle(k, i);
    const energies = [(k) => kinetic[k] + potential[k], (k) => kinetic[k], (k) => potential[k]];
    const pose = live.fixed ? filledBy(7, (_, i) => STILL[i]) : q;
    const columns = {
      pose,
      tail: facts.tail,
      com: (live.fixed ? undefined : facts.com) ?? pose,
      height: filledBy(1, (k) => pose.data[k * pose.width + 2]),
      tilt: filledBy(1, (k) => tilt(pose.data.subarray(k * pose.width + 3, k * pose.width + 7))),
      bends: filledBy(live.nt, bent ?? ((k, i) => polarBend(facts, k, i))),
      torque: tau,
      energy: filledBy(3, (k, i) => energies[i](k)),
    };
    if (facts.legs) columns.legs = facts.legs;
    if (facts.forces) {
      Object.assign(columns, { touching: facts.points, forces: facts.forces });
      const totals = facts.groups.map((name) => facts.span(name));
      const force = (k, i) => Math.hypot(...facts.force(k, totals[i]));
      columns.force = filledBy(facts.groups.length, force);
    }
    run.fill(facts.t, columns);
    run.numbers = rowsOf(numbersOf(facts), live.labels, rows);
    run.events = facts.events.map(({ time, group, kind }) => ({
      time,
      kind,
      label: `${prefix}${group} ${kind.replace("_", " ")}`,
    }));
  }
}

// Pitch and yaw in degrees of an arc in polar coordinates (phi, theta).
function polarBend(facts, k, i) {
  const [phi, theta] = [facts.angle(k, i & ~1), facts.angle(k, i | 1)];
  return DEG * theta * (i % 2 ? Math.sin(phi) : Math.cos(phi));
}

// What is wrong with a value, in the words of Python; nothing if it is sound.
function refusal({ above, low, words }, value) {
  const inside = value > (above ?? -Infinity) && value >= (low ?? -Infinity);
  const sound = Number.isFinite(value) && inside;
  return sound ? undefined : filled(words, { value: Number.isNaN(value) ? "nan" : value });
}

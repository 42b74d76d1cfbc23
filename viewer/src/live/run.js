// A run that is computed again with other numbers, and drawn in place of the one that was given.
import { massOf, shapeLinks } from "./chains.js";
import { Engine } from "./engine.js";
import { Facts, largest, norm } from "./facts.js";
import { numbersOf, rowsOf } from "./numbers.js";
import { pushed } from "./push.js";
import { warningsOf } from "./warnings.js";
import { asPython, asWord, filled } from "./words.js";

const DEG = 180 / Math.PI;
const STILL = [0, 0, 0, 1, 0, 0, 0]; // place and quaternion of a fixed base
const SOUND = { positive: (x) => x > 0, not_negative: (x) => x >= 0 };

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
  // run: what the page shows; prefix: of words about it
  static async of(live, run, prefix) {
    return Object.assign(new LiveRun(), { engine: await Engine.of(live), live, run, prefix });
  }

  // Computes the run with other values of knobs (a map) and maybe a push, and fills the shown one.
  // Returns notes and warnings; an error refuses the values, and leaves the run as it was.
  compute(values, push) {
    for (const [{ rule, words }, value] of values) {
      const sound = Number.isFinite(value) && (SOUND[rule]?.(value) ?? true);
      if (!sound) throw new Error(filled(words, { value: asPython(value) }));
    }
    const { live, prefix } = this;
    const [facts, failure] = this.factsOf(values, push);
    this.run.fill(facts.t, this.columns(facts));
    this.run.numbers = rowsOf(numbersOf(facts), live.labels, facts.rows);
    this.run.events = facts.events.map(({ time, group, kind }) => {
      return { time, kind, label: `${prefix}${group} ${kind.replace("_", " ")}` };
    });
    const notes = [];
    const size = push && asWord(norm(...push.impulse));
    if (push) notes.push(`${prefix}pushed at the start: ${size} N s`);
    if (failure) notes.push(`${prefix}the run failed, and ends here: ${failure}`);
    return { notes, warnings: warningsOf(facts).map((text) => prefix + text) };
  }

  // Computes what the run does, and how it fails. The shown samples lie in the memory of the C:
  // where values are refused, it gets back what it had.
  factsOf(values, push) {
    const { engine, live } = this;
    const before = engine.kept();
    try {
      engine.reset();
      this.apply(values);
      if (push) pushed(engine, push);
      if (live.calls.contact_points) this.refuseDeep();
      const status = engine.advance();
      const facts = new Facts(engine, status);
      const told = { t: engine.member("t"), why: live.why[status] };
      const failure = status ? filled(live.words.failed, told) : "";
      if (facts.rows < 2) throw new Error(failure);
      return [facts, failure];
    } catch (error) {
      engine.reset(before);
      throw error;
    }
  }

  number(name) {
    return this.engine.parameter(name)[0];
  }

  get mass() {
    return massOf(this.engine);
  }

  apply(values) {
    const { engine, live } = this;
    for (const [{ places, scale }, value] of values)
      for (const place of places) engine.view.setFloat64(place, scale * value, true);
    const of = (knob) => values.get(knob) ?? knob.value;
    const angles = live.knobs.filter((knob) => knob.angle !== undefined);
    if (angles.some((knob) => values.has(knob)))
      engine.reals(engine.member("q"), 7).set(quaternionOf(angles.map(of)), 3);
    if ([...values.keys()].some(({ group }) => group === "body")) shapeLinks(engine, of);
  }

  // Refuses a start with a point deeper than a static force could press it.
  refuseDeep() {
    const { engine, live } = this;
    for (const name of ["q", "v"]) {
      const { data, width } = engine.array(name, 1);
      data.set(engine.reals(engine.member(name), width));
    }
    engine.call("contact_points", 1);
    const { data, width } = engine.array("contact_points.positions", 1);
    const [depth, point] = largest(width / 3, (i) => -data[3 * i + 2]);
    const weight = this.mass * this.number("gravity");
    const limit = ((live.limits.MAX_STATIC_LOAD * weight) / this.number("K_n")) ** (2 / 3);
    if (!(depth > limit)) return;
    let ends = 0;
    const group = Object.keys(live.groups).find((name) => point < (ends += live.groups[name]));
    const lengths = { depth: 1e3 * depth, limit: 1e3 * limit, height: depth };
    throw new Error(filled(live.words.deep, { whose: "", point, group, ...lengths }));
  }

  // The samples as the page draws them.
  columns(facts) {
    const { live } = this;
    const { kinetic, potential, points, forces, legs, groups } = facts;
    const table = (width, value) => {
      const data = new Float64Array(facts.rows * width);
      return { data: data.map((_, j) => value(Math.floor(j / width), j % width)), width };
    };
    const pose = live.fixed ? table(7, (_, i) => STILL[i]) : facts.q;
    const energies = [(k) => kinetic[k] + potential[k], (k) => kinetic[k], (k) => potential[k]];
    const spans = groups.map((name) => facts.span(name));
    return {
      pose,
      tail: facts.tail,
      com: (live.fixed ? undefined : facts.com) ?? pose,
      height: table(1, (k) => pose.data[k * pose.width + 2]),
      tilt: table(1, (k) => (live.fixed ? 0 : facts.tilt(k))),
      bends: table(live.nt, (k, i) => DEG * (live.polar ? polar : jointed)(facts, k, i)),
      torque: facts.tau,
      momentum: facts.angular,
      energy: table(3, (k, i) => energies[i](k)),
      ...(legs && { legs }),
      ...(forces && { touching: points, forces }),
      ...(forces && { force: table(spans.length, (k, i) => norm(...facts.force(k, spans[i]))) }),
    };
  }
}

// Pitch and yaw of a segment: the sum of its joints' angles, or those of an arc (phi, theta).
const jointed = (facts, k, i) => facts.live.joints[i] * facts.angle(k, i);
function polar(facts, k, i) {
  const [phi, theta] = [facts.angle(k, i & ~1), facts.angle(k, i | 1)];
  return theta * (i % 2 ? Math.sin(phi) : Math.cos(phi));
}

// Doubts about a computed run, in the words of Python: its books, touches, stops, and what no
// animal can do.
import { largest, norm, sum } from "./facts.js";
import { filled } from "./words.js";

const TINY = 2.2250738585072014e-308;
const KNEES = 3; // hip, D and knee come first in a leg, and are no contacts

export function warningsOf(facts) {
  const books = facts.status ? [] : [...booked(facts), ...touched(facts), ...stopped(facts)];
  return [...books, ...buried(facts), ...sunk(facts), ...pushed(facts), ...bent(facts)];
}

// What of energy and momentum the works and impulses do not explain, relative to what was moved.
function booked(facts) {
  const { live, rows, kinetic, potential, linear, t } = facts;
  const { words, allowed, remedy } = live;
  const { works, impulses } = facts.books();
  const last = rows - 1;
  const worked = sum(Object.values(works));
  const energy = kinetic[last] + potential[last] - kinetic[0] - potential[0] - worked;
  const at = (k) => [...linear.data.subarray(3 * k, 3 * k + 3)];
  const span = t[last] - t[0];
  const moved = [0, 1, 2].map((i) => {
    const pull = i === 2 ? -facts.weight * span : 0;
    const pushed = sum(Object.values(impulses).map((each) => each[i]));
    return live.fixed ? 0 : at(last)[i] - at(0)[i] - pull - pushed;
  });
  const effort = sum(Object.values(works).map(Math.abs));
  const flies = Object.values(impulses).every((each) => each.every((x) => x === 0));
  const inner = (k) => Math.max(kinetic[k] - norm(...at(k)) ** 2 / (2 * facts.mass), 0);
  const share = (samples) => {
    const most = (f) => Math.max(...samples.map(f));
    const stored = most((k) => facts.stored(k));
    if (live.fixed || !flies) {
      const lifted = facts.weight * facts.number("tail_length");
      return Math.abs(energy) / Math.max(most((k) => kinetic[k]) + lifted + stored + effort, TINY);
    }
    const change = inner(last) - inner(0) + facts.stored(last) - facts.stored(0) - worked;
    const rounding = live.limits.difference * live.eps * Math.max(kinetic[0], kinetic[last]);
    const least = 0.5 * Math.min(...[...facts.parameter("torso_inertia")].slice(0, 3));
    const within = Math.max(most(inner) + stored + least + effort, TINY);
    return Math.max(Math.abs(change) - rounding, 0) / within;
  };
  let found = share([0, last]);
  if (found > allowed) found = share(facts.t.map((_, k) => k));
  const size = (each) => norm(...each);
  const momenta = Math.max(size(at(0)), size(at(last))) + facts.weight * span;
  const all = momenta + sum(Object.values(impulses).map(size));
  const relative = Math.max(found, size(moved) / Math.max(all, TINY));
  if (relative <= allowed) return [];
  const numbers = { share: 100 * relative, allowed: 100 * allowed, momentum: size(moved) };
  return [filled(words.unbalanced, { ...numbers, energy, remedy })];
}

// Touches that may have been missed.
function touched({ engine, live, groups }) {
  if (!groups.length) return [];
  const { words } = live;
  const found = [];
  const count = engine.member("unfelt");
  if (count) found.push(filled(words.unfelt, { count }));
  const error = 1e3 * engine.member("near_error");
  if (!(error > 0)) return found;
  const point = engine.member("near_point");
  let ends = 0;
  const group = groups.find((name) => point < (ends += live.groups[name]));
  const height = 1e3 * engine.member("near_height");
  const near = { group, point, error, height, time: engine.member("near_time") };
  return [...found, filled(words.near, near)];
}

// The first stop that a coordinate of the tail is behind by more than its width.
function stopped(facts) {
  const { live, rows } = facts;
  const { words } = live;
  for (const [end, stop] of ["tail_stop_lower", "tail_stop_upper"].entries()) {
    if (!facts.parameter(stop)) return [];
    const each = Array.from({ length: live.nt }, (_, i) => i);
    const way = (k, i) => facts.ways(k, i)[end][1];
    const [most, k] = largest(rows, (row) => Math.max(...each.map((i) => way(row, i))));
    if (!(most > 1)) continue;
    const i = each.find((index) => way(k, index) === most);
    const place = { name: live.names[i], angle: facts.angle(k, i), stop };
    const at = facts.parameter(stop)[i];
    const behind = filled(words.behind, {
      ...place,
      at,
      width: facts.parameter("tail_stop_width")[i],
    });
    return [filled(words.ease_stops, { behind })];
  }
  return [];
}

// Parts that are deep in the ground, because the scene gives them no contact.
function buried(facts) {
  const { live, rows, tail, legs } = facts;
  if (!facts.points) return [];
  const { words, limits } = live;
  const axes = facts.axes;
  const lowest = ({ data, width }, k, points) =>
    Math.max(...points.map((i) => -data[k * width + 3 * i + 2]));
  const count = (width) => Array.from({ length: width / 3 }, (_, i) => i);
  const parts = {};
  if (!live.groups.torso)
    parts.torso = (k) => norm(...facts.up(k).map((x, i) => axes[i] * x)) - facts.height(k);
  if (!live.groups.tail) parts.tail = (k) => lowest(tail, k, count(tail.width));
  if (legs) {
    const above = count(legs.width).filter((i) => i % 6 < KNEES);
    parts.legs = (k) => lowest(legs, k, above);
  }
  const allowed = limits.deep * 2 * Math.max(...axes);
  const found = [];
  for (const [part, depthAt] of Object.entries(parts)) {
    const [depth, k] = largest(rows, depthAt);
    if (!(depth > allowed)) continue;
    const remedy = filled(words[part === "legs" ? "knees" : "add"], { part });
    const lengths = { depth: 1e3 * depth, allowed: 1e3 * allowed, time: facts.t[k] };
    found.push(filled(words.buried, { part, remedy, ...lengths }));
  }
  return found;
}

// A tail that bends into the torso, or comes back into it.
function sunk(facts) {
  const axes = facts.axes;
  const { words, limits } = facts.live;
  if (!axes.every((axis) => axis > 0)) return [];
  const [depth, k] = largest(facts.rows, (row) => depthInTorso(facts, row, axes));
  if (!(depth > limits.sunk)) return [];
  return [filled(words.sunk, { time: facts.t[k], depth, allowed: limits.sunk })];
}

// How far the tail goes into the torso, as the unit ball: 0 not at all, 1 to its centre.
function depthInTorso(facts, k, axes) {
  const { data, width } = facts.tail;
  const [w, x, y, z] = facts.quaternion(k);
  const columns = [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
  const base = k * facts.q.width;
  const own = (i) => {
    const from = [0, 1, 2].map((j) => data[k * width + 3 * i + j] - facts.q.data[base + j]);
    return columns.map((c, j) => (c[0] * from[0] + c[1] * from[1] + c[2] * from[2]) / axes[j]);
  };
  let deepest = 0;
  let outside = false;
  let a = own(0);
  const mount = norm(...a);
  for (let i = 1; i < width / 3; i++) {
    outside ||= norm(...a) > 1;
    const b = own(i);
    const way = b.map((to, j) => to - a[j]);
    const length = Math.max(sum(way.map((d) => d * d)), TINY);
    const part = Math.min(Math.max(-sum(a.map((from, j) => from * way[j])) / length, 0), 1);
    const nearest = norm(...a.map((from, j) => from + part * way[j]));
    deepest = Math.max(deepest, (outside ? 1 : mount) - nearest);
    a = b;
  }
  return deepest;
}

// A force of the ground that no legs of the animal's size bear.
function pushed(facts) {
  const { words, limits } = facts.live;
  const whole = facts.weight;
  if (!facts.forces || !whole) return [];
  const [force, time] = facts.peaks.all;
  const most = limits.borne * (limits.bearer / facts.mass) ** (1 / 3);
  if (!(force > most * whole)) return [];
  return [filled(words.pushed, { force, time, weights: force / whole, most })];
}

// Segments that are bent by clearly more than half a turn.
function bent(facts) {
  const { live, rows } = facts;
  const { words, limits } = live;
  const bend = (k, m) => {
    const [first, second] = [facts.angle(k, 2 * m), facts.angle(k, 2 * m + 1)].map(Math.abs);
    if (live.kinds[m] === "articulated") return live.joints[m] * Math.max(first, second);
    return live.polar ? second : norm(first, second);
  };
  return live.kinds.flatMap((_, m) => {
    const [most, k] = largest(rows, (row) => bend(row, m));
    if (!(most > limits.bend)) return [];
    const remedy = words[most > limits.degrees ? "degrees" : "damp"];
    const numbers = { bend: most, time: facts.t[k], most: limits.bend };
    return [filled(words.bent, { segment: m + 1, remedy, ...numbers })];
  });
}

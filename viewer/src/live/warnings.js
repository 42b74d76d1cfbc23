// Doubts about a computed run, in the words of Python: its books, touches, stops, and what no
// animal can do.
import { nameIn } from "./chains.js";
import { largest, norm, of, range, sum, three } from "./facts.js";
import { filled } from "./words.js";

const WIDE = "tail_stop_width";
const TINY = 2.2250738585072014e-308;
const [LEG, KNEES] = [6, 3]; // joints; hip, D and knee come first, and are no contacts

export function warningsOf(facts) {
  const books = facts.status ? [] : [...booked(facts), ...touched(facts), ...stopped(facts)];
  return [...books, ...buried(facts), ...sunk(facts), ...pushed(facts), ...bent(facts)];
}

// What of energy and momentum works and impulses do not explain, relative to what was moved.
function booked(facts) {
  const { live, rows, kinetic, potential, linear, t, works, mass, weight } = facts;
  const { allowed, remedy } = live;
  const last = rows - 1;
  const worked = sum(Object.values(works));
  const effort = sum(Object.values(works).map(Math.abs));
  const impulses = Object.values(facts.impulses);
  const energy = kinetic[last] + potential[last] - kinetic[0] - potential[0] - worked;
  const [before, after] = [three(linear, 0), three(linear, last)];
  const pull = [0, 0, weight * (t[last] - t[0])];
  const moved = pull.map(
    (fallen, i) => !live.fixed && after[i] - before[i] + fallen - sum(impulses.map((x) => x[i])),
  );
  const flies = !live.fixed && impulses.every((each) => each.every((x) => x === 0));
  const inner = (k) => Math.max(kinetic[k] - norm(...three(linear, k)) ** 2 / (2 * mass), 0);
  const share = (samples) => {
    const top = (f) => largest(samples.length, (i) => f(samples[i]))[0];
    const most = (f) => top(f) + top((k) => facts.stored(k));
    const lifted = weight * facts.number("tail_length");
    if (!flies) return Math.abs(energy) / Math.max(most((k) => kinetic[k]) + lifted + effort, TINY);
    const change = inner(last) - inner(0) + facts.stored(last) - facts.stored(0) - worked;
    const rounding = live.limits.DIFFERENCE * live.eps * Math.max(kinetic[0], kinetic[last]);
    const least = 0.5 * Math.min(...facts.engine.parameter("torso_inertia"));
    return Math.max(Math.abs(change) - rounding, 0) / Math.max(most(inner) + least + effort, TINY);
  };
  let found = share([0, last]);
  if (found > allowed) found = share(range(rows));
  const momenta = Math.max(norm(...before), norm(...after)) + pull[2];
  const all = momenta + sum(impulses.map((each) => norm(...each)));
  const momentum = norm(...moved);
  const relative = Math.max(found, momentum / Math.max(all, TINY));
  if (relative <= allowed) return [];
  const numbers = { share: 100 * relative, energy, momentum, allowed: 100 * allowed, remedy };
  return [filled(live.words.unbalanced, numbers)];
}

// Touches that may have been missed.
function touched(facts) {
  const { engine, live } = facts;
  if (!facts.points) return [];
  const [count, point] = [engine.member("unfelt"), engine.member("near_point")];
  const [time, height, error] = ["time", "height", "error"].map((x) => engine.member(`near_${x}`));
  const near = { group: facts.groupOf(point), point, time, height: 1e3 * height };
  return [
    ...(count ? [filled(live.words.unfelt, { count })] : []),
    ...(error > 0 ? [filled(live.words.near, { ...near, error: 1e3 * error })] : []),
  ];
}

// The first stop that a coordinate of the tail is behind by more than its width.
function stopped(facts) {
  const { live, rows } = facts;
  for (const [end, stop] of ["tail_stop_lower", "tail_stop_upper"].entries()) {
    const [most, j] = largest(rows * live.nt, (each) => {
      return facts.ways(Math.floor(each / live.nt), each % live.nt)[end];
    });
    if (!(most > 1)) continue;
    const [k, i] = [Math.floor(j / live.nt), j % live.nt];
    const [at, width] = [stop, WIDE].map((name) => facts.passive(name, i));
    const { owner } = live.chains.find((chain) => i < chain.stop);
    const own = { stop: nameIn(owner, stop), wide: nameIn(owner, WIDE) };
    const words = { name: live.names[i], angle: facts.angle(k, i), at, width, ...own };
    return [filled(live.words.ease_stops, { behind: filled(live.words.behind, words) })];
  }
  return [];
}

// Parts that are deep in the ground, because the scene gives them no contact.
function buried(facts) {
  const { live, axes, tail, legs } = facts;
  if (!facts.points) return [];
  const lowest = (array, k, points) => Math.max(...points.map((i) => -of(array, k, 3 * i + 2)));
  const depths = {
    torso: (k) => norm(...facts.up(k).map((x, i) => axes[i] * x)) - facts.place(k)[2],
    ...Object.fromEntries(live.chains.map(({ name, points: [start, stop] }) => {
      return [name, (k) => lowest(tail, k, range(stop - start).map((i) => start + i))];
    })),
    legs: legs && ((k) => lowest(legs, k, range(legs.width / 3).filter((i) => i % LEG < KNEES))),
  };
  const keys = Object.fromEntries(live.chains.map(({ name, owner }) => [name, owner || name]));
  const allowed = live.limits.DEEP * 2 * Math.max(...axes);
  return Object.entries(depths).flatMap(([part, f]) => {
    const [depth, k] = f && !live.groups[part] ? largest(facts.rows, f) : [0];
    if (!(depth > allowed)) return [];
    const words = live.words[part === "legs" ? "knees" : "add"];
    const remedy = filled(words, { part: keys[part] ?? part });
    const lengths = { depth: 1e3 * depth, allowed: 1e3 * allowed, time: facts.t[k] };
    return [filled(live.words.buried, { part, remedy, ...lengths })];
  });
}

// A tail that bends into the torso, or comes back into it.
function sunk(facts) {
  const { axes, live, rows, t } = facts;
  if (!axes.every((axis) => axis > 0)) return [];
  const allowed = live.limits.SUNK;
  const [depth, k] = largest(rows, (row) => {
    return Math.max(...live.chains.map(({ points }) => depthInTorso(facts, row, points)));
  });
  return depth > allowed ? [filled(live.words.sunk, { time: t[k], depth, allowed })] : [];
}

// How far a chain goes into the torso, as the unit ball: 0 not at all, 1 to its centre. Until it
// has left the ball once, it may be as near to the centre as its mount.
function depthInTorso(facts, k, [start, stop]) {
  const { axes, tail } = facts;
  const [columns, base] = [facts.columns(k), facts.place(k)];
  const own = range(stop - start).map((i) => {
    const from = three(tail, k, 3 * (start + i)).map((x, axis) => x - base[axis]);
    return columns.map((column, j) => sum(column.map((x, axis) => x * from[axis])) / axes[j]);
  });
  let [deepest, allowed] = [0, norm(...own[0])];
  for (let i = 0; i + 1 < own.length; i++) {
    const a = own[i];
    if (norm(...a) > 1) allowed = 1;
    const way = own[i + 1].map((x, j) => x - a[j]);
    const part = -sum(way.map((x, j) => x * a[j])) / Math.max(sum(way.map((x) => x * x)), TINY);
    const inside = Math.min(Math.max(part, 0), 1);
    deepest = Math.max(deepest, allowed - norm(...a.map((x, j) => x + inside * way[j])));
  }
  return deepest;
}

// A force of the ground that no legs of the animal's size bear.
function pushed({ live, peaks, mass, weight }) {
  if (!peaks || !weight) return [];
  const [force, time] = peaks.all;
  const most = live.limits.BORNE * (live.limits.BEARER / mass) ** (1 / 3);
  if (!(force > most * weight)) return [];
  return [filled(live.words.pushed, { force, time, weights: force / weight, most })];
}

// Segments that are bent by clearly more than half a turn.
function bent(facts) {
  const { live, rows, t } = facts;
  const { MOST_BEND: most, DEGREES } = live.limits;
  return live.kinds.flatMap((kind, m) => {
    const [bend, k] = largest(rows, (row) => {
      if (kind === "hinge") return 0; // it may turn on and on
      const i = live.firsts[m];
      const [first, second] = [i, i + 1].map((each) => Math.abs(facts.angle(row, each)));
      if (kind === "articulated") return live.joints[i] * Math.max(first, second);
      return live.polar ? second : norm(first, second);
    });
    const remedy = live.words[bend > DEGREES ? "degrees" : "damp"];
    const numbers = { segment: m + 1, bend, time: t[k], most, remedy };
    return bend > most ? [filled(live.words.bent, numbers)] : [];
  });
}

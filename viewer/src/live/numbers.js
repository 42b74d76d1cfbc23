// The numbers of a computed run, by the definitions of docs/simulation.md.
import { largest, norm } from "./facts.js";
import { asWord } from "./words.js";

const DEG = 180 / Math.PI;

export const tilt = ([w, x, y, z]) => 2 * DEG * Math.atan2(norm(x, y), norm(w, z));

// Begin and end of the flight about the apex; undefined where they are not in the run.
function flightOf(facts) {
  const { t, rows } = facts;
  const apex = t[largest(rows, (k) => facts.height(k))[1]];
  const pushed = (group) => {
    const [first, last] = facts.span(group);
    for (let i = first; i < last; i++) if (facts.force(0, [i, i + 1])[2] > 0) return true;
    return false;
  };
  const touching = new Set(facts.groups.filter(pushed));
  let begin = touching.size ? undefined : -Infinity;
  const spans = [];
  const slack = 1e-6 * Math.max(Math.abs(t[0]), Math.abs(t.at(-1)));
  for (const { time, group, kind } of facts.events) {
    if (time < t[0] - slack || time > t.at(-1) + slack) continue;
    if (kind === "take_off") {
      touching.delete(group);
      begin = touching.size ? undefined : time;
    } else {
      touching.add(group);
      if (begin !== undefined) spans.push([begin, time]);
      begin = undefined;
    }
  }
  if (begin !== undefined) spans.push([begin, undefined]);
  const [from, to] = spans.find(([a, b]) => a <= apex && (b === undefined || apex <= b)) ?? [];
  return [from === -Infinity ? undefined : from, to];
}

// How it lands: least upright, turned, and whether it stands at the end.
function landingOf(facts, landing) {
  const { live, rows, t, v } = facts;
  const first = t.findIndex((time) => time >= (landing ?? Infinity));
  if (first < 0) return {};
  let least = Infinity;
  let turned = 0;
  let before;
  for (let k = first; k < rows; k++) {
    const up = facts.up(k);
    least = Math.min(least, up[2]);
    if (before) {
      const [a, b] = [before, up];
      const cross = [0, 1, 2].map((i) => {
        const [j, l] = [(i + 1) % 3, (i + 2) % 3];
        return a[j] * b[l] - a[l] * b[j];
      });
      turned += Math.atan2(norm(...cross), a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
    }
    before = up;
  }
  if (!live.groups.feet) return { least, turned };
  const last = rows - 1;
  const slow = norm(...v.data.subarray(last * v.width, last * v.width + 3)) < live.limits.speed;
  const carried = facts.force(last, facts.span("feet"))[2] > live.limits.share * facts.weight;
  const stands = facts.up(last)[2] > live.limits.upright && slow && carried;
  return { least, turned, landed: stands && least > 0 };
}

export function numbersOf(facts) {
  const { live, rows, t, tau, kinetic, potential } = facts;
  const last = rows - 1;
  const weight = facts.weight;
  const numbers = { duration_s: t[last] - t[0] };
  if (!live.fixed) {
    numbers.apex_m = largest(rows, (k) => facts.height(k))[0];
    numbers.tilt_max_deg = largest(rows, (k) => tilt(facts.quaternion(k)))[0];
    numbers.tilt_end_deg = tilt(facts.quaternion(last));
  }
  const lifted = (k) => potential[k] - facts.stored(k);
  if (weight) numbers.com_rise_m = (largest(rows, lifted)[0] - lifted(0)) / weight;
  numbers.peak_torque_N_m = tau.data.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
  numbers.energy_change_J = kinetic[last] + potential[last] - (kinetic[0] + potential[0]);
  if (!facts.forces) return numbers;
  const [begin, end] = flightOf(facts);
  const { least, turned, landed } = landingOf(facts, end);
  const { all, ...peaks } = facts.peaks;
  Object.assign(numbers, {
    take_off_s: begin,
    recontact_s: end,
    least_upright_landing: least,
    turned_landing_rad: turned,
    landed,
    impulse_N_s: facts.status ? undefined : facts.books().impulses,
    peak_ground_force_N: all[0],
    peak_ground_force_weights: weight ? all[0] / weight : undefined,
    peak_group_force_N: Object.fromEntries(
      Object.entries(peaks).map(([name, [force]]) => [name, force]),
    ),
  });
  return numbers;
}

// Rows of the page's table: labels with units, and values as words.
export function rowsOf(numbers, labels, rows) {
  const table = [];
  for (const [name, [label, unit]] of Object.entries(labels)) {
    const value = numbers[name];
    const parts = value && typeof value === "object" ? value : { "": value };
    for (const [part, number] of Object.entries(parts)) {
      if (number === undefined) continue;
      const whose = part ? `: ${part.replaceAll("_", " ")}` : "";
      const word = Array.isArray(number) ? number.map(asWord).join("  ") : asWord(number);
      table.push([`${label}${whose}${unit}`, word]);
    }
  }
  return [...table, ["samples", String(rows)]];
}


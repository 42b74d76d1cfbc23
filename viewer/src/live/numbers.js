// The numbers of a computed run, by the definitions of docs/simulation.md.
import { largest, norm, of, range, sum, three } from "./facts.js";
import { asWord } from "./words.js";

// Begin and end of the flight about the apex; undefined where they are not in the run.
function flightOf(facts) {
  const { t, rows, groups } = facts;
  const touching = new Set(groups.filter((group) => {
    const [first, last] = facts.span(group);
    return range(last - first).some((i) => of(facts.forces, 0, 3 * (first + i) + 2) > 0);
  }));
  let begin = touching.size ? undefined : -Infinity;
  const spans = [];
  for (const { time, group, kind } of facts.events) {
    if (kind === "touch_down" && begin !== undefined) spans.push([begin, time]);
    touching[kind === "touch_down" ? "add" : "delete"](group);
    begin = touching.size ? undefined : time;
  }
  if (begin !== undefined) spans.push([begin, undefined]);
  const apex = t[largest(rows, (k) => facts.place(k)[2])[1]];
  const [from, to] = spans.find(([a, b]) => a <= apex && (b === undefined || apex <= b)) ?? [];
  return [from === -Infinity ? undefined : from, to];
}

// The torso's rate at the landing, by the cubic through the last samples of the flight, and the
// angular momentum of the flight.
function spinOf({ live, angular, v, t, rows }, [begin, end]) {
  const slack = 1e-12 * Math.abs(t[rows - 1]);
  const flying = range(rows).filter((k) => !(t[k] < begin - slack) && !(t[k] > end + slack));
  if (live.fixed || !flying.length) return {};
  const nodes = flying.slice(-4);
  const weights = nodes.map((k) =>
    nodes.reduce((all, i) => (i === k ? all : (all * (end - t[i])) / (t[k] - t[i])), 1),
  );
  const rates = nodes.map((k) => three(v, k, 3));
  const rate = [0, 1, 2].map((axis) => sum(weights.map((w, i) => w * rates[i][axis])));
  const momentum = three(angular, flying[0]);
  return {
    torso_rate_at_touch_down: end === undefined ? undefined : { "": rate },
    angular_momentum_at_take_off: begin === undefined ? undefined : { "": momentum },
  };
}

// How it lands: the least upright it is, how far it turns, and whether it stands at the end.
function landingOf(facts, landing) {
  const { live, rows, t, v } = facts;
  const first = t.findIndex((time) => time >= landing);
  if (first < 0) return {};
  const ups = t.slice(first).map((_, k) => facts.up(first + k));
  const turned = ups.slice(1).reduce((all, [x, y, z], k) => {
    const [a, b, c] = ups[k];
    const sine = norm(b * z - c * y, c * x - a * z, a * y - b * x);
    return all + Math.atan2(sine, a * x + b * y + c * z);
  }, 0);
  const least = Math.min(...ups.map((up) => up[2]));
  const limbs = live.chains.filter(({ limb }) => limb).map(({ name }) => name);
  const feet = ["feet", ...limbs].filter((name) => live.groups[name]);
  if (!feet.length) return { least, turned };
  const { MIN_UPRIGHT, MAX_SPEED, MIN_SHARE } = live.limits;
  const slow = norm(...three(v, rows - 1)) < MAX_SPEED;
  const forces = feet.map((name) => facts.force(rows - 1, facts.span(name))[2]);
  const carried = sum(forces) > MIN_SHARE * facts.weight;
  return { least, turned, landed: ups.at(-1)[2] > MIN_UPRIGHT && slow && carried && least > 0 };
}

export function numbersOf(facts) {
  const { live, rows, t, tau, kinetic, potential, weight } = facts;
  const last = rows - 1;
  const lifted = (k) => potential[k] - facts.stored(k);
  const numbers = {
    duration_s: t[last] - t[0],
    com_rise_m: weight ? (largest(rows, lifted)[0] - lifted(0)) / weight : undefined,
    peak_torque_N_m: tau.data.reduce((most, x) => Math.max(most, Math.abs(x)), 0),
    energy_change_J: kinetic[last] + potential[last] - (kinetic[0] + potential[0]),
  };
  if (!live.fixed) {
    numbers.apex_m = largest(rows, (k) => facts.place(k)[2])[0];
    numbers.tilt_max_deg = largest(rows, (k) => facts.tilt(k))[0];
    numbers.tilt_end_deg = facts.tilt(last);
  }
  if (!facts.forces) return numbers;
  const [begin, end] = flightOf(facts);
  const { least, turned, landed } = landingOf(facts, end);
  const { all, ...peaks } = facts.peaks;
  const parts = Object.entries(peaks).map(([name, [force]]) => [name, force]);
  return Object.assign(numbers, spinOf(facts, [begin, end]), {
    take_off_s: begin,
    recontact_s: end,
    least_upright_landing: least,
    turned_landing_rad: turned,
    landed,
    impulse_N_s: facts.status ? undefined : facts.impulses,
    peak_ground_force_N: all[0],
    peak_ground_force_weights: weight ? all[0] / weight : undefined,
    peak_group_force_N: Object.fromEntries(parts),
  });
}

// Rows of the page's table: labels with units, and values as words.
export function rowsOf(numbers, labels, rows) {
  const table = Object.entries(labels).flatMap(([name, [label, unit]]) => {
    const value = numbers[name];
    const parts = Object.entries(typeof value === "object" ? value : { "": value });
    return parts
      .filter(([, number]) => number !== undefined)
      .map(([part, number]) => [
        `${label}${part && `: ${part.replaceAll("_", " ")}`}${unit}`,
        [number].flat().map(asWord).join("  "),
      ]);
  });
  return [...table, ["samples", String(rows)]];
}

// A push: an impulse on a point of the torso at the start, which changes the velocities at once.
import { range, sum } from "./facts.js";
import { asPython, filled } from "./words.js";

// The kinetic energies of some velocities at one place.
function energies(engine, q, velocities) {
  const most = engine.live.times.length;
  const found = [];
  for (let first = 0; first < velocities.length; first += most) {
    const some = velocities.slice(first, first + most);
    const [places, rates] = ["q", "v"].map((name) => engine.array(name, some.length));
    some.forEach((v, k) => {
      places.data.set(q, k * places.width);
      rates.data.set(v, k * rates.width);
    });
    engine.call("energy", some.length);
    found.push(...engine.array("energy.kinetic", some.length).data);
  }
  return found;
}

// Units in which each velocity alone has the energy 1/2, and the mass matrix in these units, by
// M_ij = T(e_i + e_j) - T(e_i) - T(e_j).
function massOf(engine, q, count) {
  const all = range(count);
  const unit = (i, size) => all.map((k) => (k === i ? size : 0));
  const alone = energies(engine, q, all.map((i) => unit(i, 1)));
  const units = alone.map((energy) => 1 / Math.sqrt(2 * energy));
  const pairs = all.flatMap((i) => all.slice(i + 1).map((j) => [i, j]));
  const both = pairs.map(([i, j]) => all.map((k) => (k === i || k === j ? units[k] : 0)));
  const mass = all.map((i) => unit(i, 1));
  energies(engine, q, both).forEach((energy, n) => {
    const [i, j] = pairs[n];
    mass[i][j] = mass[j][i] = energy - 1;
  });
  return [units, mass];
}

// Solves M x = b with a positive definite M; changes both.
function solved(matrix, b) {
  const count = b.length;
  for (let i = 0; i < count; i++)
    for (let j = i + 1; j < count; j++) {
      const part = matrix[j][i] / matrix[i][i];
      for (let k = i; k < count; k++) matrix[j][k] -= part * matrix[i][k];
      b[j] -= part * b[i];
    }
  for (let i = count - 1; i >= 0; i--) {
    for (let k = i + 1; k < count; k++) b[i] -= matrix[i][k] * b[k];
    b[i] /= matrix[i][i];
  }
  return b;
}

// Changes the start's velocities: M dv = J' p. An error refuses numbers that are not finite.
// point: in the torso's axes, m; impulse: in the world's, N s
export function pushed(engine, { point, impulse }) {
  const { live } = engine;
  const q = [...engine.reals(engine.member("q"), live.arrays.q[1])];
  const v = engine.reals(engine.member("v"), live.arrays.v[1]);
  const [w, x, y, z] = q.slice(3, 7);
  const columns = [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
  const own = columns.map((column) => sum(column.map((part, i) => part * impulse[i])));
  const turning = [0, 1, 2].map((i) => {
    const [j, k] = [(i + 1) % 3, (i + 2) % 3];
    return point[j] * own[k] - point[k] * own[j];
  });
  const [units, mass] = massOf(engine, q, v.length);
  const forces = units.map((unit, i) => unit * ([...impulse, ...turning][i] ?? 0));
  solved(mass, forces).forEach((change, i) => (v[i] += units[i] * change));
  const at = v.findIndex((rate) => !Number.isFinite(rate));
  if (at >= 0) throw new Error(filled(live.words.rate, { at, value: asPython(v[at]) }));
}

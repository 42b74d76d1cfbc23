// Draws the torques at the bases of the tail's segments: arcs about their axes, which point the way
// that a torque turns the tail. The largest torque of a run has the longest arc.
import { Group, Matrix4, Vector3 } from "three";
import { Heads, Rods } from "./shapes.js";

const STEPS = 14; // rods of an arc
const [LEAST, LONGEST] = [0.02, 1.5 * Math.PI]; // share of the largest that is drawn; rad of that
const [WIDE, THICK] = [0.4, 0.022]; // radii of an arc, over the torso's largest semi-axis
const [from, to, rod] = [new Vector3(), new Vector3(), new Vector3()];
const [axis, out, across] = [new Vector3(), new Vector3(), new Vector3()];
const [attitude, turn] = [new Matrix4(), new Matrix4()];

export class Torques {
  constructor(run, material) {
    Object.assign(this, { run, group: new Group(), size: Math.max(...run.body.semi_axes) });
    this.rods = new Rods(material, STEPS * run.bases.length);
    this.heads = new Heads(material, run.bases.length);
    this.group.visible = false;
    Object.assign(material, { depthTest: false, transparent: true }); // nothing hides them
    this.rods.mesh.renderOrder = this.heads.mesh.renderOrder = 2;
    this.group.add(this.rods.mesh, this.heads.mesh);
    this.renew();
  }

  // Takes other samples: finds their largest torque.
  renew() {
    const { run } = this;
    this.largest = 0;
    for (let row = 0; row < run.rows; row++)
      run.bases.forEach((_, s) => {
        this.largest = Math.max(this.largest, this.torque(row, s).length() || 0);
      });
  }

  // The torque of a segment in its base's axes: pitch about x, yaw about z.
  torque(row, s) {
    const [pitch, yaw] = [0, 1].map((i) => this.run.value("torque", row, 2 * s + i));
    return axis.set(pitch, 0, yaw);
  }

  // Follows the rods of the tail from the torso on. A rod along (sin b, -cos a cos b, -sin a cos b)
  // of the axes before it has turned by a about x, then by b about z.
  show(row, quaternion) {
    const { run, group } = this;
    if (!group.visible) return;
    attitude.makeRotationFromQuaternion(quaternion);
    for (let j = 0; j < run.tip; j++) {
      run.point("tail", row, j, from);
      rod.subVectors(run.point("tail", row, j + 1, to), from).normalize();
      const s = run.bases.indexOf(j);
      if (s >= 0) this.place(s, this.torque(row, s).transformDirection(attitude), row);
      rod.transformDirection(turn.copy(attitude).transpose());
      attitude.multiply(turn.makeRotationX(Math.atan2(-rod.z, -rod.y)));
      attitude.multiply(turn.makeRotationZ(Math.asin(Math.min(Math.max(rod.x, -1), 1))));
    }
    this.rods.placed();
    this.heads.placed();
  }

  // Draws an arc about a direction of length 1, whose middle is where the rod points to.
  place(s, direction, row) {
    const about = direction.clone();
    const share = this.torque(row, s).length() / this.largest;
    if (!(share > LEAST)) {
      for (let i = 0; i < STEPS; i++) this.rods.hide(STEPS * s + i);
      this.heads.hide(s);
      return;
    }
    const [sweep, wide, thick] = [LONGEST * share, WIDE * this.size, THICK * this.size];
    out.copy(rod).addScaledVector(about, -rod.dot(about)).normalize();
    across.crossVectors(about, out);
    const at = (angle, place) =>
      place
        .copy(from)
        .addScaledVector(out, wide * Math.cos(angle))
        .addScaledVector(across, wide * Math.sin(angle));
    for (let i = 0; i < STEPS; i++) {
      at(sweep * (i / STEPS - 0.5), to);
      this.rods.place(STEPS * s + i, at(sweep * ((i + 1) / STEPS - 0.5), axis), to, thick);
    }
    const [sine, cosine] = [Math.sin(sweep / 2), Math.cos(sweep / 2)];
    to.copy(out).multiplyScalar(-sine).addScaledVector(across, cosine);
    this.heads.place(s, axis, to, 3 * thick, 6 * thick);
  }
}

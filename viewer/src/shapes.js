// Draws many rods, balls or arrow heads in one draw call; each frame places them again.
import {
  ConeGeometry,
  CylinderGeometry,
  InstancedMesh,
  Matrix4,
  Quaternion,
  SphereGeometry,
  Vector3,
} from "three";

const ROD = new CylinderGeometry(1, 1, 1, 12);
const HEAD = new ConeGeometry(1, 1, 14);
export const BALL = new SphereGeometry(1, 16, 12);

const UP = new Vector3(0, 1, 0); // the axis of cylinders and cones
const NOWHERE = new Matrix4().makeScale(0, 0, 0);
const matrix = new Matrix4();
const turn = new Quaternion();
const along = new Vector3();
const middle = new Vector3();
const scale = new Vector3();

class Many {
  constructor(shape, material, count) {
    this.mesh = new InstancedMesh(shape, material, Math.max(count, 1));
    this.mesh.frustumCulled = false;
    this.mesh.visible = count > 0;
  }

  hide(k) {
    this.mesh.setMatrixAt(k, NOWHERE);
  }

  placed() {
    this.mesh.instanceMatrix.needsUpdate = true;
  }
}

export class Rods extends Many {
  constructor(material, count) {
    super(ROD, material, count);
  }

  // Place a rod from one point to another.
  place(k, from, to, radius) {
    const length = along.subVectors(to, from).length();
    if (!(length > 0)) return this.hide(k);
    turn.setFromUnitVectors(UP, along.divideScalar(length));
    middle.addVectors(from, to).multiplyScalar(0.5);
    this.mesh.setMatrixAt(k, matrix.compose(middle, turn, scale.set(radius, length, radius)));
  }
}

export class Heads extends Many {
  constructor(material, count) {
    super(HEAD, material, count);
  }

  // Place an arrow head: its base at a point, its axis along a direction of length 1.
  place(k, base, direction, radius, length) {
    turn.setFromUnitVectors(UP, direction);
    middle.copy(base).addScaledVector(direction, length / 2);
    this.mesh.setMatrixAt(k, matrix.compose(middle, turn, scale.set(radius, length, radius)));
  }
}

export class Balls extends Many {
  constructor(material, count) {
    super(BALL, material, count);
  }

  place(k, at, radius) {
    this.mesh.setMatrixAt(k, matrix.compose(at, turn.identity(), scale.setScalar(radius)));
  }
}

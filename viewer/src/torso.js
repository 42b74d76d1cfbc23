// The torso: a pale belly and a head with snout, ears and eyes show which way it faces.
import {
  BufferAttribute,
  Color,
  Group,
  MathUtils,
  Mesh,
  MeshLambertMaterial,
  SphereGeometry,
} from "three";
import { BALL } from "./shapes.js";

const BELLY = [-0.22, -0.08]; // semi-axes; between these heights the coat turns pale

export class Torso {
  constructor([a, b, c], look) {
    this.coat = new MeshLambertMaterial({ ...look, vertexColors: true });
    this.fur = new MeshLambertMaterial(look);
    this.dark = new MeshLambertMaterial(look);
    this.group = new Group();

    this.body = new Mesh(new SphereGeometry(1, 48, 32), this.coat);
    this.body.scale.set(a, b, c);
    this.group.add(this.body);

    // the head, in units of its radius
    const r = 0.72 * Math.min(a, c);
    const head = new Group();
    head.position.set(0, 0.9 * b, 0.42 * c);
    head.scale.setScalar(r);
    this.group.add(head);
    const add = (material, at, size) => {
      const part = new Mesh(BALL, material);
      part.position.set(...at);
      part.scale.set(...size);
      head.add(part);
    };
    add(this.fur, [0, 0.1, 0], [0.85, 1.05, 0.85]);
    add(this.fur, [0, 0.95, -0.22], [0.42, 0.62, 0.4]);
    add(this.dark, [0, 1.5, -0.2], [0.15, 0.13, 0.13]);
    for (const side of [-1, 1]) {
      add(this.fur, [0.52 * side, -0.35, 0.8], [0.34, 0.14, 0.48]);
      add(this.dark, [0.62 * side, 0.6, 0.22], [0.19, 0.19, 0.19]);
    }
  }

  paint(fur, belly, dark) {
    const [back, below, shade] = [new Color(fur), new Color(belly), new Color()];
    const places = this.body.geometry.attributes.position;
    const colours = new Float32Array(3 * places.count);
    for (let i = 0; i < places.count; i++) {
      const part = MathUtils.smoothstep(places.getZ(i), ...BELLY);
      shade.lerpColors(below, back, part).toArray(colours, 3 * i);
    }
    this.body.geometry.setAttribute("color", new BufferAttribute(colours, 3));
    this.fur.color.set(fur);
    this.dark.color.set(dark);
  }
}

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

export class Torso {
  // body: sizes and places in m, as the page's data has them
  constructor(body, look) {
    this.belly = body.belly;
    this.coat = new MeshLambertMaterial({ ...look, vertexColors: true });
    this.materials = { fur: new MeshLambertMaterial(look), eye: new MeshLambertMaterial(look) };
    this.group = new Group();

    this.ball = new Mesh(new SphereGeometry(1, 48, 32), this.coat);
    this.ball.scale.set(...body.semi_axes);
    this.group.add(this.ball);
    for (const { colour, place, semi_axes } of body.head) {
      const part = new Mesh(BALL, this.materials[colour]);
      part.position.set(...place);
      part.scale.set(...semi_axes);
      this.group.add(part);
    }
  }

  paint(fur, belly, eye) {
    const [back, below, shade] = [new Color(fur), new Color(belly), new Color()];
    const places = this.ball.geometry.attributes.position;
    const colours = new Float32Array(3 * places.count);
    for (let i = 0; i < places.count; i++) {
      const part = MathUtils.smoothstep(places.getZ(i), ...this.belly);
      shade.lerpColors(below, back, part).toArray(colours, 3 * i);
    }
    this.ball.geometry.setAttribute("color", new BufferAttribute(colours, 3));
    this.materials.fur.color.set(fur);
    this.materials.eye.color.set(eye);
  }
}

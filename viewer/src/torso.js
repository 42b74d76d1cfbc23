// The torso: a pale belly and a head with snout, ears and eyes show which way it faces; a box has a
// visor for a head.
import {
  BoxGeometry,
  BufferAttribute,
  Color,
  Group,
  MathUtils,
  Mesh,
  MeshLambertMaterial,
  SphereGeometry,
} from "three";
import { BALL } from "./shapes.js";

const BOX = new BoxGeometry(2, 2, 2, 1, 1, 24);
const VISOR = { place: [0, 1, 0.35], size: [0.7, 0.04, 0.22] }; // at a box's front, in half sides

export class Torso {
  // body: sizes and places in m, as the page's data has them
  constructor(body, look) {
    this.belly = body.belly;
    this.coat = new MeshLambertMaterial({ ...look, vertexColors: true });
    this.materials = { fur: new MeshLambertMaterial(look), eye: new MeshLambertMaterial(look) };
    this.group = new Group();

    this.trunk = new Mesh(body.box ? BOX.clone() : new SphereGeometry(1, 48, 32), this.coat);
    this.trunk.scale.set(...body.semi_axes);
    this.group.add(this.trunk);
    if (body.box) {
      const visor = new Mesh(BOX, this.materials.eye);
      visor.position.set(...VISOR.place);
      visor.scale.set(...VISOR.size);
      this.trunk.add(visor);
    }
    for (const { colour, place, semi_axes } of body.head) {
      const part = new Mesh(BALL, this.materials[colour]);
      part.position.set(...place);
      part.scale.set(...semi_axes);
      this.group.add(part);
    }
  }

  paint(fur, belly, eye) {
    const [back, below, shade] = [new Color(fur), new Color(belly), new Color()];
    const places = this.trunk.geometry.attributes.position;
    const colours = new Float32Array(3 * places.count);
    for (let i = 0; i < places.count; i++) {
      const part = MathUtils.smoothstep(places.getZ(i), ...this.belly);
      shade.lerpColors(below, back, part).toArray(colours, 3 * i);
    }
    this.trunk.geometry.setAttribute("color", new BufferAttribute(colours, 3));
    this.materials.fur.color.set(fur);
    this.materials.eye.color.set(eye);
  }
}

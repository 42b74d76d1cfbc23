// Pushes the animal by mouse or finger: a drag from a point of its torso is an impulse on it.
import { Group, MeshBasicMaterial, Plane, Raycaster, Vector2, Vector3 } from "three";
import { Heads, Rods } from "../shapes.js";
import { colour, onChange } from "../theme.js";
import { general } from "./words.js";

const STRENGTH = 10; // 1/s: a drag of 0.1 m gives the animal's mass 1 m/s
const [THICK, HEAD] = [0.015, 0.12]; // radius of the arrow, length of its head, over the animal's

export class Pusher {
  // push: takes point and impulse as arrays; returns why it refuses them
  constructor({ button, clock, stage, player, live, push }) {
    Object.assign(this, { button, clock, stage, player, live, push, on: false });
    this.ray = new Raycaster();
    this.addArrow();
    button.hidden = false;
    button.addEventListener("click", () => this.toggle());
    const { parentElement } = stage.canvas; // hears of it before the camera does
    parentElement.addEventListener("pointerdown", (event) => this.grab(event), true);
    addEventListener("pointermove", (event) => this.drag(event));
    addEventListener("pointerup", () => this.release());
    addEventListener("pointercancel", () => this.drop());
  }

  addArrow() {
    const material = new MeshBasicMaterial({ depthTest: false, transparent: true });
    const paint = () => material.color.set(colour("force"));
    paint();
    onChange(paint);
    Object.assign(this, { rod: new Rods(material, 1), head: new Heads(material, 1) });
    this.arrow = new Group();
    this.arrow.add(this.rod.mesh, this.head.mesh);
    this.rod.mesh.renderOrder = this.head.mesh.renderOrder = 2; // after the ground
    this.arrow.visible = false;
    this.stage.scene.add(this.arrow);
  }

  // A push acts at the start, so the start is shown.
  toggle() {
    this.on = !this.on;
    this.button.ariaPressed = this.on;
    if (this.on) this.toStart();
  }

  toStart() {
    this.player.toggle(false);
    this.player.seek(this.player.begin);
  }

  // The ray under the pointer.
  aim({ clientX, clientY }) {
    const { left, top, width, height } = this.stage.canvas.getBoundingClientRect();
    const [x, y] = [(clientX - left) / width, (clientY - top) / height];
    this.ray.setFromCamera(new Vector2(2 * x - 1, 1 - 2 * y), this.stage.camera);
    return this.ray;
  }

  grab(event) {
    if (!this.on || event.target !== this.stage.canvas) return;
    if (this.player.time !== this.player.begin) this.toStart();
    const { group } = this.stage.animals[0].torso;
    const [hit] = this.aim(event).intersectObject(group);
    if (!hit) return;
    event.stopPropagation();
    this.begin = hit.point;
    const away = this.stage.camera.getWorldDirection(new Vector3());
    this.plane = new Plane().setFromNormalAndCoplanarPoint(away, hit.point);
    this.drag(event);
  }

  drag(event) {
    if (!this.begin) return;
    const end = this.aim(event).ray.intersectPlane(this.plane, new Vector3());
    if (!end) return;
    const way = (this.way = end.clone().sub(this.begin));
    const { length } = this.stage;
    const head = Math.min(HEAD * length, way.length());
    const tip = way.clone().normalize();
    const neck = end.clone().addScaledVector(tip, -head);
    this.rod.place(0, this.begin, neck, THICK * length);
    this.head.place(0, neck, tip, 2.5 * THICK * length, head);
    this.rod.placed();
    this.head.placed();
    this.arrow.visible = way.length() > 0;
    const strength = STRENGTH * this.live.mass * way.length();
    this.clock.textContent = `push of ${general(strength, 3)} N s`;
    this.stage.render();
  }

  release() {
    const { begin, way } = this;
    if (!begin) return;
    this.drop();
    if (!(way.length() > 0)) return;
    const { group } = this.stage.animals[0].torso;
    const point = group.worldToLocal(begin.clone()).toArray();
    const impulse = way.multiplyScalar(STRENGTH * this.live.mass).toArray();
    if (!this.push({ point, impulse })) this.player.toggle(true);
  }

  drop() {
    if (!this.begin) return;
    this.begin = undefined;
    this.arrow.visible = false;
    this.player.seek(this.player.time);
  }
}

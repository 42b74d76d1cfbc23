// The stage: lights, ground, cameras and animals.
import {
  AmbientLight,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  Float32BufferAttribute,
  Group,
  HemisphereLight,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Animal } from "./animal.js";
import { colour, onChange } from "./theme.js";

const VIEWS = {
  oblique: [1, -0.65, 0.5],
  side: [1, 0, 0.04],
  front: [0.04, 1, 0.12],
  top: [0.02, 0, 1],
};
const FIELD = 35; // degrees
const DISTANCE = 2.5; // of the camera, in lengths of the animal
const APART = 1.3; // between runs side by side, in lengths of the animal
const SQUARES = 60; // of the ground, along and across

// Each edge of a square is a line of its own, because a browser may not draw a long line that
// begins behind the camera.
function edges(square) {
  const points = [];
  const half = SQUARES / 2;
  for (let i = -half; i <= half; i++) {
    for (let j = -half; j < half; j++) points.push(i, j, 0, i, j + 1, 0, j, i, 0, j + 1, i, 0);
  }
  return new BufferGeometry().setAttribute(
    "position",
    new Float32BufferAttribute(
      points.map((x) => square * x),
      3,
    ),
  );
}

export class Stage {
  constructor(canvas, runs, meta) {
    this.canvas = canvas;
    this.length = meta.length;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FIELD, 1, 0.01 * this.length, 1000 * this.length);
    this.camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.addEventListener("change", () => this.render());
    this.addLights();
    this.animals = runs.map((run, k) => new Animal(run, k, runs.length === 1, meta.force_scale));
    this.scene.add(...this.animals.map((animal) => animal.group));
    this.ground = new Group();
    this.scene.add(this.ground);
    this.following = true;
    this.at = new Vector3();
    this.grounded = runs.some((run) => run.grounded);
    this.paint();
    onChange(() => this.paint());
  }

  addLights() {
    const sun = new DirectionalLight("#fff", 1.7);
    sun.position.set(1, -0.6, 2);
    this.scene.add(new AmbientLight("#fff", 0.5), new HemisphereLight("#fff", "#998", 1.3), sun);
    this.scene.children.at(-2).position.set(0, 0, 1);
  }

  paint() {
    this.scene.background = this.filmed ? null : new Color(colour("stage"));
    for (const animal of this.animals) animal.paint();
    this.ground.clear();
    if (this.grounded) this.layGround();
    this.render();
  }

  // Lets a film behind the canvas be seen, over which the grid alone is drawn.
  seeThrough(filmed) {
    this.filmed = filmed;
    this.paint();
  }

  // The floor is transparent. Its squares have sides of 1, 2 or 5 times a power of ten, in m.
  layGround() {
    const power = 10 ** Math.floor(Math.log10(this.length / 2));
    const square = (this.square =
      power * [5, 2, 1].find((step) => step * power <= this.length / 2));
    const grid = new LineSegments(edges(square), new LineBasicMaterial({ color: colour("grid") }));
    const look = {
      color: colour("ground"),
      transparent: true,
      opacity: 0.75,
      side: DoubleSide,
      depthWrite: false,
    };
    const floor = new Mesh(
      new PlaneGeometry(SQUARES * square, SQUARES * square),
      new MeshBasicMaterial(look),
    );
    floor.position.z = -1e-3 * this.length;
    floor.renderOrder = 1;
    this.ground.add(grid);
    if (!this.filmed) this.ground.add(floor);
  }

  // Moves the ground by whole squares: it seems endless and at rest.
  moveGround({ x, y }) {
    if (this.grounded)
      this.ground.position.set(
        ...[x, y].map((at) => this.square * Math.round(at / this.square)),
        0,
      );
  }

  // The camera follows the first run that is shown; side by side, the middle of all that are.
  followed() {
    const shown = this.animals.filter((animal) => animal.group.visible);
    const seen = shown.length ? shown : this.animals;
    const sum = new Vector3();
    const few = this.apart ? seen : seen.slice(0, 1);
    for (const { centre, group } of few) sum.add(centre.position).add(group.position);
    return sum.divideScalar(few.length);
  }

  // Side by side, the runs stand in a row from left to right, across the view.
  look(view, apart) {
    this.apart = apart;
    const away = new Vector3(...VIEWS[view]).normalize();
    const across = new Vector3(-away.y, away.x, 0).setLength(apart ? APART * this.length : 0);
    this.animals.forEach((animal, k) => animal.place(across, k, apart));
    const narrow = Math.min(this.camera.aspect, 1);
    this.at.copy(this.followed());
    this.orbit.target.copy(this.at);
    const wide = apart ? 1 + (0.8 * (this.animals.length - 1)) / this.camera.aspect : 1;
    const distance = (wide * DISTANCE * this.length) / narrow;
    this.camera.position.copy(this.at).addScaledVector(away, distance);
    this.orbit.update();
    this.render();
  }

  follow(on) {
    this.following = on;
    this.at.copy(this.followed());
  }

  // Shows or hides a part of all animals: "trail" of the tail's tip, or "torques".
  switchPart(name, on) {
    for (const animal of this.animals) (animal[name].group ?? animal[name]).visible = on;
  }

  // Takes other samples of a run.
  renew(k) {
    this.animals[k].trace();
  }

  switchRun(k, on) {
    this.animals[k].group.visible = on;
    this.at.copy(this.followed());
    this.render();
  }

  show(t) {
    for (const animal of this.animals) animal.show(t);
    const centre = this.followed();
    this.moveGround(centre);
    if (this.following) {
      this.camera.position.add(centre).sub(this.at);
      this.orbit.target.add(centre).sub(this.at);
    }
    this.at.copy(centre);
    this.render();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.render();
  }

  // Passes the view to a function, as a PNG.
  picture(take) {
    this.render();
    this.canvas.toBlob(take);
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }
}

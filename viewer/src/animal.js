// Draws the animal of one run: torso, tail, legs, forces, centre of mass and its path.
import {
  BufferAttribute,
  BufferGeometry,
  CircleGeometry,
  Group,
  Line,
  LineBasicMaterial,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  Vector3,
} from "three";
import { BALL, Balls, Heads, Rods } from "./shapes.js";
import { colour, series } from "./theme.js";
import { Torques } from "./torques.js";
import { Torso } from "./torso.js";

const GHOST = 0.5; // opacity of all runs but the first
const LEG = 6; // joints: hip, D, knee, A, M and T
const from = new Vector3();
const to = new Vector3();
const force = new Vector3();

// Offsets the depth of each run. Where runs overlap, the first one is drawn, not spots of each.
const ghost = (k) => ({
  transparent: true,
  opacity: GHOST,
  polygonOffset: true,
  polygonOffsetFactor: k,
  polygonOffsetUnits: 4 * k,
});

export class Animal {
  constructor(run, k, alone, scale) {
    Object.assign(this, { run, k, alone, scale, group: new Group() });
    const look = k === 0 ? {} : ghost(k);
    const lambert = () => new MeshLambertMaterial(look);
    this.torso = new Torso(run.body, look);
    const names = ["tail", "joint", "leg", "force", "torque"];
    this.materials = Object.fromEntries(names.map((name) => [name, lambert()]));

    const links = Math.max(run.points - 1, 0);
    this.tail = new Rods(this.materials.tail, links);
    this.joints = new Balls(run.body.jointed ? this.materials.joint : this.materials.tail, links);
    this.legs = new Rods(this.materials.leg, run.legs * (LEG - 1));
    this.knees = new Balls(this.materials.leg, run.legs * LEG);
    this.shafts = new Rods(this.materials.force, run.contacts);
    this.tips = new Heads(this.materials.force, run.contacts);
    this.group.add(this.torso.group);
    for (const parts of [this.tail, this.joints, this.legs, this.knees, this.shafts, this.tips])
      this.group.add(parts.mesh);
    this.torques = new Torques(run, this.materials.torque);
    this.group.add(this.torques.group);
    this.addMarkers();
    this.addCentre();
    this.addShadow();
    this.paint();
  }

  // Markers are drawn in front of everything, so that nothing hides them.
  addMarkers() {
    this.materials.marker = new MeshBasicMaterial({ depthTest: false, transparent: true });
    this.markers = new Balls(this.materials.marker, this.run.markers ?? 0);
    this.markers.mesh.renderOrder = 2;
    this.group.add(this.markers.mesh);
  }

  // The centre of mass is drawn in front of the torso, so that the torso does not hide it.
  addCentre() {
    this.centre = new Mesh(BALL, new MeshBasicMaterial({ depthTest: false, transparent: true }));
    this.centre.scale.setScalar(0.065 * Math.max(...this.run.body.semi_axes));
    this.centre.renderOrder = 2;
    const line = () => new Line(new BufferGeometry(), new LineBasicMaterial());
    [this.path, this.trail] = [line(), line()];
    this.path.frustumCulled = this.trail.frustumCulled = this.trail.visible = false;
    this.group.add(this.centre, this.path, this.trail);
    this.trace();
  }

  // Draws the paths of the centre of mass and of the tail's tip.
  trace() {
    const { run } = this;
    this.torques.renew();
    for (const [line, name, point] of [
      [this.path, "com", 0],
      [this.trail, "tail", run.tip],
    ]) {
      const places = new Float32Array(3 * run.rows);
      for (let row = 0; row < run.rows; row++)
        run.point(name, row, point, to).toArray(places, 3 * row);
      line.geometry.dispose();
      line.geometry.setAttribute("position", new BufferAttribute(places, 3));
    }
  }

  // The shadow lies on the ground straight below the torso and shows how high the torso is.
  addShadow() {
    const look = { color: "#000", transparent: true, opacity: 0.22, depthWrite: false };
    this.shadow = new Mesh(new CircleGeometry(1, 40), new MeshBasicMaterial(look));
    this.shadow.visible = this.run.grounded;
    this.group.add(this.shadow);
  }

  paint() {
    const own = series(this.k);
    const coat = colour(this.run.body.box ? "shell" : "fur");
    this.torso.paint(this.alone ? coat : own, colour("belly"), colour("eye"));
    this.materials.tail.color.set(this.alone ? colour("tail") : own);
    this.materials.joint.color.set(colour("eye"));
    this.materials.leg.color.set(this.alone ? colour("leg") : own);
    this.materials.force.color.set(colour("force"));
    this.materials.marker.color.set(colour("marker"));
    this.centre.material.color.set(colour("centre"));
    this.path.material.color.set(this.alone ? colour("path") : own);
    this.trail.material.color.set(this.alone ? colour("trail") : own);
    this.materials.torque.color.set(colour("torque"));
  }

  // Moves all by k steps; a run that stands apart is not seen through.
  place(step, k, apart) {
    this.group.position.copy(step).multiplyScalar(k);
    this.group.traverse(({ material }) => {
      if (material?.polygonOffset) material.opacity = apart ? 1 : GHOST;
    });
  }

  show(t) {
    const { run } = this;
    const row = run.row(t);
    const pose = (i) => run.value("pose", row, i);
    this.torso.group.position.set(pose(0), pose(1), pose(2));
    this.torso.group.quaternion.set(pose(4), pose(5), pose(6), pose(3)).normalize();
    run.point("com", row, 0, this.centre.position);
    const [a, b] = run.body.semi_axes;
    this.shadow.position.set(pose(0), pose(1), 1e-3 * b);
    this.shadow.scale.set(a, b, 1);
    this.showTail(row);
    this.torques.show(row, this.torso.group.quaternion);
    this.showLegs(row);
    this.showForces(row);
    this.showMarkers(row);
  }

  // Markers that were not seen at this sample are hidden.
  showMarkers(row) {
    const radius = 0.05 * Math.max(...this.run.body.semi_axes);
    for (let m = 0; m < (this.run.markers ?? 0); m++) {
      if (Number.isNaN(this.run.value("markers", row, 3 * m))) this.markers.hide(m);
      else this.markers.place(m, this.run.point("markers", row, m, to), radius);
    }
    this.markers.placed();
  }

  showTail(row) {
    const { points, body } = this.run;
    for (let j = 0; j + 1 < points; j++) {
      const radius = body.tail_radii[j];
      this.run.point("tail", row, j, from);
      this.run.point("tail", row, j + 1, to);
      this.tail.place(j, from, to, radius);
      this.joints.place(j, body.jointed ? from : to, body.joint * radius);
    }
    this.tail.placed();
    this.joints.placed();
  }

  showLegs(row) {
    const radius = this.run.body.leg_radius;
    for (let leg = 0; leg < this.run.legs; leg++) {
      for (let j = 0; j < LEG; j++) {
        this.run.point("legs", row, LEG * leg + j, to);
        this.knees.place(LEG * leg + j, to, radius);
        if (j > 0) this.legs.place((LEG - 1) * leg + j - 1, from, to, radius);
        from.copy(to);
      }
    }
    this.legs.placed();
    this.knees.placed();
  }

  // An arrow of a typical force is as long as half the torso; no arrow exceeds three times that.
  showForces(row) {
    const longest = Math.max(...this.run.body.semi_axes);
    for (let c = 0; c < this.run.contacts; c++) {
      const size = this.run.point("forces", row, c, force).length();
      const length = longest * Math.min(size / this.scale, 3);
      if (!(length > 0.02 * longest)) {
        this.shafts.hide(c);
        this.tips.hide(c);
        continue;
      }
      force.divideScalar(size);
      const tip = Math.min(0.3 * longest, 0.5 * length);
      this.run.point("touching", row, c, from);
      to.copy(from).addScaledVector(force, length - tip);
      this.shafts.place(c, from, to, 0.035 * longest);
      this.tips.place(c, to, force, 0.1 * longest, tip);
    }
    this.shafts.placed();
    this.tips.placed();
  }
}

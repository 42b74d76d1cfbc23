// The page of runs: reads its data, assembles stage, plots and numbers, and handles the keyboard.
import { Run } from "./data.js";
import { addNotes, addNumbers, addSwitches, addWarnings } from "./panel.js";
import { Player } from "./player.js";
import { Plots } from "./plots.js";
import { Stage } from "./stage.js";

const find = (id) => document.getElementById(id);
const page = (window.serpentail = { ready: false, seek: null, error: null });

// Without WebGL the page shows everything except the animal.
function stageOf(canvas, runs, meta) {
  try {
    return new Stage(canvas, runs, meta);
  } catch (error) {
    addNotes(find("notes"), [
      `The animal cannot be drawn: this browser has no WebGL (${error.message}).`,
    ]);
    canvas.style.visibility = "hidden";
    return undefined;
  }
}

async function open() {
  const meta = JSON.parse(find("data").textContent);
  const runs = await Promise.all(meta.runs.map((run) => Run.of(run)));
  addNotes(find("notes"), meta.notes);
  addWarnings(find("warnings"), meta.warnings);
  addNumbers(find("numbers"), runs);

  const stage = stageOf(find("view"), runs, meta);
  const player = new Player(find, runs, (t) => parts.forEach((part) => part.show(t)));
  const plots = new Plots(find("plots"), meta.plots, runs, (t) => player.seek(t));
  const parts = stage ? [plots, stage] : [plots];
  const switches = addSwitches(find("runs"), runs, (k, on) =>
    parts.forEach((part) => part.switchRun(k, on)),
  );

  const resize = () => {
    for (const part of parts) part.resize();
    plots.show(player.time);
  };
  new ResizeObserver(resize).observe(document.body);
  new ResizeObserver(resize).observe(find("view"));
  resize();
  player.seek(player.begin);
  const views = find("camera");
  const apart = find("apart");
  const look = () => stage?.look(views.value, apart.checked);
  apart.addEventListener("change", look);
  apart.parentElement.hidden = runs.length === 1;
  views.addEventListener("change", look);
  find("follow").addEventListener("change", () => stage?.follow(find("follow").checked));
  look();
  document.addEventListener("keydown", (event) => obey(event, player, switches, look));
  return player;
}

function obey(event, player, switches, look) {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches("select")) return;
  const own = { f: () => find("follow").click(), s: () => find("apart").click(), r: look };
  const action = player.action(event) ?? own[event.key] ?? switched(switches, event.key);
  if (!action) return;
  event.preventDefault();
  action();
}

// The digit keys show and hide runs.
function switched(switches, key) {
  const box = /^[1-9]$/.test(key) && switches[Number(key) - 1];
  return box ? () => box.click() : undefined;
}

open().then(
  (player) => Object.assign(page, { ready: true, seek: (t) => player.seek(t) }),
  (error) => {
    page.error = String(error.stack ?? error);
    addNotes(find("notes"), [`This page could not be opened: ${error.message ?? error}`]);
  },
);

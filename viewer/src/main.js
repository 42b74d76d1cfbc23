// The page of runs: reads its data, assembles stage, plots and numbers, and handles the keyboard.
import { Backdrop } from "./backdrop.js";
import { Run } from "./data.js";
import { Knobs } from "./live/knobs.js";
import { Pusher } from "./live/pusher.js";
import { LiveRun } from "./live/run.js";
import { addSwitches, tellNotes, tellNumbers, tellWarnings } from "./panel.js";
import { Player } from "./player.js";
import { Plots } from "./plots.js";
import { addSaving } from "./save.js";
import { Stage } from "./stage.js";

const find = (id) => document.getElementById(id);
const page = (window.serpentail = { ready: false, seek: null, error: null });
const notes = []; // that stay, whatever is computed

function addNote(note) {
  if (!notes.includes(note)) notes.push(note);
  tellNotes(find("notes"), notes);
}

// Without WebGL the page shows everything except the animal.
function stageOf(canvas, runs, meta) {
  try {
    return new Stage(canvas, runs, meta);
  } catch (error) {
    addNote(`The animal cannot be drawn: this browser has no WebGL (${error.message}).`);
    canvas.style.visibility = "hidden";
    return undefined;
  }
}

async function open() {
  const meta = JSON.parse(find("data").textContent);
  const runs = await Promise.all(meta.runs.map((run) => Run.of(run)));
  meta.notes.forEach(addNote);
  tellWarnings(find("warnings"), meta.warnings);
  tellNumbers(find("numbers"), runs);

  const stage = stageOf(find("view"), runs, meta);
  const player = new Player(find, runs, (t) => shows.forEach((part) => part.show(t)));
  const plots = new Plots(find("plots"), meta.plots, runs, (t) => player.seek(t));
  const parts = stage ? [plots, stage] : [plots];
  const shows = [...parts];
  if (stage) {
    const seen = (on) => stage.seeThrough(on);
    shows.push(new Backdrop({ holder: find("backdrop"), video: find("film"), player, seen }));
  }
  const switches = addSwitches(find("runs"), runs, (k, on) =>
    parts.forEach((part) => part.switchRun(k, on)),
  );

  const shown = (k) => switches[k].checked;
  addSaving(find("save"), { runs, plots: meta.plots, player, stage, shown, told: addNote });
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
  for (const name of ["trail", "torques"]) {
    const switchPart = ({ target }) => {
      stage?.switchPart(name, target.checked);
      player.seek(player.time);
    };
    find(name).addEventListener("change", switchPart);
  }
  find("torques").parentElement.hidden = runs.every((run) => !run.bases.length);
  document.addEventListener("keydown", (event) => obey(event, player, switches, look));
  if (meta.live) await enliven(meta, runs, player, parts);
  return player;
}

// The first run is computed again when one of its knobs is turned.
async function enliven(meta, runs, player, parts) {
  let live;
  try {
    const prefix = runs.length > 1 ? `${runs[0].name}: ` : "";
    live = await LiveRun.of(meta.live, runs[0], prefix);
  } catch (error) {
    addNote(`This browser cannot compute the run again, and replays it: ${error.message}`);
    return;
  }
  const others = meta.warnings.slice(meta.live.told);
  const compute = (values, push) => {
    try {
      const told = live.compute(values, push);
      tellNotes(find("notes"), [...notes, ...told.notes]);
      tellWarnings(find("warnings"), [...told.warnings, ...others]);
    } catch (error) {
      return error.message;
    }
    tellNumbers(find("numbers"), runs);
    player.renew();
    for (const part of parts) part.renew(0);
    player.seek(player.time);
    return "";
  };
  const knobs = new Knobs(find("knobs"), meta.live.knobs, compute);
  const push = (impulse) => knobs.pushBy(impulse);
  Object.assign(page, { push, change: (values) => knobs.set(values) });
  const stage = parts.find((part) => part instanceof Stage);
  if (stage && !meta.live.fixed) {
    new Pusher({ button: find("push"), clock: find("clock"), stage, player, live, push });
  }
  page.samples = () => ({ t: runs[0].times, q: live.engine.array("q", runs[0].rows).data });
}

function obey(event, player, switches, look) {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.target.matches("select, .knob input")) return;
  const box = find({ f: "follow", s: "apart", t: "trail", m: "torques" }[event.key]);
  const own = event.key === "r" ? look : box && (() => box.click());
  const action = player.action(event) ?? own ?? switched(switches, event.key);
  if (!action) return;
  event.preventDefault();
  action();
}

// In a frame of another page only the animal is shown; it moves unless the reader wants no motion.
function playAlone(player) {
  document.body.className = "alone";
  player.toggle(!matchMedia("(prefers-reduced-motion: reduce)").matches);
}

// The digit keys show and hide runs.
function switched(switches, key) {
  const box = /^[1-9]$/.test(key) && switches[Number(key) - 1];
  return box ? () => box.click() : undefined;
}

open().then(
  (player) => {
    Object.assign(page, { ready: true, seek: (t) => player.seek(t) });
    if (location.hash === "#alone") playAlone(player);
  },
  (error) => {
    page.error = String(error.stack ?? error);
    addNote(`This page could not be opened: ${error.message ?? error}`);
  },
);

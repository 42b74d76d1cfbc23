// Saves what the page shows: samples as a table, the view as a picture or as a video.

const VIDEO = "video/webm";
const NO_VIDEO =
  "This browser cannot record WebM. Open the page in a current Chromium or Firefox, or make a " +
  "film in Python: motion.film(\"run.mp4\").";
const BITS = 1e7; // of a video, in a second
const LAST = 200; // ms for the last picture to be taken
const KEPT = 60000; // ms that a browser has to take over a file
const axes = (name, parts, unit) => parts.map((part) => `${name} ${part} (${unit})`);
const PLACES = {
  pose: [...axes("torso", "xyz".split(""), "m"), ...axes("torso", ["qw", "qx", "qy", "qz"], "1")],
  com: axes("centre of mass", "xyz".split(""), "m"),
};

function download(parts, type, suffix) {
  const name = `${document.title.replace(/[^\w.-]+/g, "_")}.${suffix}`;
  const href = URL.createObjectURL(new Blob(parts, { type }));
  Object.assign(document.createElement("a"), { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), KEPT);
}

// A text as a cell; a spreadsheet computes none.
const cell = (text) => `"${text.replace(/^[=+\-@\t\r]/, "'$&").replaceAll('"', '""')}"`;

// The columns of a table: a header, and for each run that has it an array and its column.
function columnsOf(runs, plots) {
  const columns = new Map();
  const add = (header, run, array, column) => {
    if (!columns.has(header)) columns.set(header, []);
    columns.get(header)[run] = [array, column];
  };
  runs.forEach((_, run) => {
    for (const [array, headers] of Object.entries(PLACES))
      headers.forEach((header, column) => add(header, run, array, column));
  });
  for (const { title, curves } of plots) {
    const [, name, unit] = title.match(/^(.*) \((.*?)\)/);
    for (const { run, array, column, label } of curves) {
      const own = runs.length > 1 ? label.slice(runs[run].name.length).trim() : label;
      add(`${name}${own && `: ${own}`} (${unit})`, run, array, column);
    }
  }
  return columns;
}

// A number with all digits that it has: those of a float have nine.
const digits = (run, array, row, column) => {
  const value = run.value(array, row, column);
  return run.columns[array].data instanceof Float32Array ? Number(value.toPrecision(9)) : value;
};

// The samples of the shown runs as text: comma-separated values.
export function tableOf(runs, plots, shown) {
  const columns = columnsOf(runs, plots);
  const many = runs.length > 1;
  const lines = [[...(many ? ["run"] : []), "t (s)", ...columns.keys()].map(cell)];
  runs.forEach((run, k) => {
    if (!shown(k)) return;
    for (let row = 0; row < run.rows; row++) {
      const found = [...columns.values()].map((of) =>
        of[k] ? digits(run, of[k][0], row, of[k][1]) : "",
      );
      lines.push([...(many ? [cell(run.name)] : []), +run.times[row].toPrecision(12), ...found]);
    }
  });
  return lines.map((line) => `${line.join(",")}\n`).join("");
}

// Plays the run once, as fast as it is played, and saves what the canvas shows meanwhile.
function record(canvas, player, told) {
  const { MediaRecorder } = globalThis;
  if (!canvas.captureStream || !MediaRecorder?.isTypeSupported(VIDEO)) return told(NO_VIDEO);
  const settings = { mimeType: VIDEO, videoBitsPerSecond: BITS };
  const recorder = new MediaRecorder(canvas.captureStream(), settings);
  const parts = [];
  recorder.ondataavailable = ({ data }) => parts.push(data);
  recorder.onstop = () => download(parts, VIDEO, "webm");
  const stop = () => {
    document.body.classList.remove("recording");
    setTimeout(() => recorder.stop(), LAST);
  };
  recorder.onstart = () => player.playOnce(stop);
  document.body.classList.add("recording");
  player.toggle(false);
  recorder.start();
  player.seek(player.begin);
}

// Obeys buttons whose values are "csv", "png" and "webm"; stage may be missing.
// told: takes the reason why something cannot be saved.
export function addSaving(group, { runs, plots, player, stage, shown, told }) {
  const actions = {
    csv: () => download([tableOf(runs, plots, shown)], "text/csv", "csv"),
    png: () => stage.picture((blob) => download([blob], "image/png", "png")),
    webm: () => record(stage.canvas, player, told),
  };
  for (const button of group.querySelectorAll("button")) {
    button.disabled = !stage && button.value !== "csv";
    button.addEventListener("click", actions[button.value]);
  }
  // the frame of a notebook may save nothing
  group.hidden = location.href === "about:srcdoc";
}

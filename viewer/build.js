// Builds the page that serpentail fills with motions; scripts, styles and licences are inside it.
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const read = (path) => readFileSync(new URL(path, import.meta.url), "utf8").trim();
const escaped = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");

const options = {
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  write: false,
  legalComments: "none",
};
const { outputFiles } = await build({
  ...options,
  entryPoints: [fileURLToPath(new URL("src/main.js", import.meta.url))],
});
const script = outputFiles[0].text.trim().replaceAll("</script", "<\\/script");
const style = [
  read("node_modules/uplot/dist/uPlot.min.css"),
  read("src/colours.css"),
  read("src/bar.css"),
  read("src/style.css"),
  read("src/live/knobs.css"),
].join("\n");
const licences = ["three", "uplot"]
  .map((name) => `${name}\n\n${read(`node_modules/${name}/LICENSE`)}`)
  .join("\n\n");

const page = read("src/page.html")
  .replace("/*STYLE*/", () => style)
  .replace("<!--LICENCES-->", () => escaped(licences))
  .replace("/*SCRIPT*/", () => script);
writeFileSync(process.argv[2], `${page}\n`);

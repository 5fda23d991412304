// Builds page.min.js and THIRD_PARTY.txt from the sources beside it; both are committed. `--check`: fails where they are out of date.
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const HEADER = "// Built by `npm run build` from the sources beside this file. Contains three.js and uPlot: licences in THIRD_PARTY.txt.";

const sources = readdirSync(".").filter((name) => /^(?!page\.min).*\.js$|^package.*\.json$|^build\.mjs$/.test(name)).sort();
const digest = createHash("sha256");
for (const name of sources) digest.update(`${name}\n`).update(readFileSync(name));
const { outputFiles } = await build({
  entryPoints: ["main.js"], bundle: true, minify: true, format: "iife", target: "es2021", charset: "utf8", legalComments: "none",
  loader: { ".css": "text" }, write: false,
});
const licences = ["three", "uplot"].map((name) => {
  const { version, license } = JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8"));
  return `${name} ${version}, ${license}\n\n${readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim()}\n`;
});
const built = {
  "page.min.js": `${HEADER} Sources: ${digest.digest("hex")}\n${outputFiles[0].text}`,
  "THIRD_PARTY.txt": licences.join("\n----\n\n"),
};
for (const [name, text] of Object.entries(built)) {
  if (!process.argv.includes("--check")) writeFileSync(name, text);
  else if (readFileSync(name, "utf8") !== text) {
    console.error(`${name} is out of date: npm ci && npm run build, in ${process.cwd()}`);
    process.exitCode = 1;
  }
}
console.log(`page.min.js: ${built["page.min.js"].length} characters`);

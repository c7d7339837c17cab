// Builds the page from src/ and public/ into src/elib/panel/page; with --watch again after each change.
import { context } from "esbuild";
import { mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const HERE = dirname(fileURLToPath(import.meta.url));
const INTO = join(HERE, "../src/elib/panel/page");
const WATCHES = process.argv.includes("--watch");
const LINKS = {
  ".css": (name) => `<link rel="stylesheet" href="/${name}" />`,
  ".woff2": (name) => `<link rel="preload" href="/${name}" as="font" type="font/woff2" crossorigin />`,
};

/** Write what was built; index.html comes last, so that where it is, the page is whole. */
function write({ errors, metafile, outputFiles }) {
  if (errors.length) return;
  const files = Object.fromEntries(outputFiles.map((file) => [basename(file.path), file.contents]));
  const named = (entry) =>
    basename(Object.keys(metafile.outputs).find((name) => metafile.outputs[name].entryPoint === entry));
  // The page that asks for a token knows this one by its name, and the page itself does not need it.
  files["login.css"] = files[named("src/login.css")];
  delete files[named("src/login.css")];
  // The styles of lazy parts too: esbuild loads only their scripts by itself.
  const links = Object.entries(LINKS).flatMap(([end, link]) =>
    Object.keys(files)
      .filter((name) => name.endsWith(end) && name !== "login.css")
      .map(link),
  );
  links.push(`<script type="module" src="/${named("src/main.tsx")}"></script>`);
  files["licences.txt"] = licences(metafile);
  for (const name of readdirSync(join(HERE, "public"))) files[name] = readFileSync(join(HERE, "public", name));
  const index = String(files["index.html"]).replace("<!-- built -->", links.join("\n    "));
  delete files["index.html"];
  rmSync(INTO, { recursive: true, force: true });
  mkdirSync(INTO);
  for (const [name, body] of Object.entries({ ...files, "index.html": index })) writeFileSync(join(INTO, name), body);
  if (WATCHES) console.log("built; restart the program that serves it");
}

/** Return the licences of all packages of which something is in the page; esbuild adds a few lines of its own. */
function licences({ outputs }) {
  const inputs = Object.values(outputs).flatMap((output) => Object.entries(output.inputs));
  const used = inputs
    .filter(([, { bytesInOutput }]) => bytesInOutput)
    .map(([path]) => /^node_modules\/((?:@[^/]+\/)?[^/]+)/.exec(path)?.[1]);
  return [...new Set([...used, "esbuild"])]
    .filter(Boolean)
    .sort()
    .map(licence)
    .join(`\n${"-".repeat(80)}\n\n`);
}

function licence(name) {
  const folder = join(HERE, "node_modules", name);
  const { version, license } = JSON.parse(readFileSync(join(folder, "package.json")));
  const file = readdirSync(folder).find((each) => /^licen[cs]e/i.test(each));
  if (!file) throw new Error(`${name} brings no text of its licence`);
  return `${name} ${version}, ${license}\n\n${String(readFileSync(join(folder, file))).trim()}\n`;
}

const page = await context({
  absWorkingDir: HERE,
  entryPoints: ["src/main.tsx", "src/login.css"],
  outdir: INTO,
  bundle: true,
  splitting: true,
  format: "esm",
  target: "es2022",
  minify: true,
  legalComments: "none", // licences.txt has them
  loader: { ".woff2": "file" },
  entryNames: "[name]-[hash]",
  chunkNames: "[name]-[hash]",
  assetNames: "[name]-[hash]",
  sourcemap: WATCHES && "inline",
  metafile: true,
  write: false,
  logLevel: "warning",
  plugins: [{ name: "write", setup: (build) => build.onEnd(write) }],
});
if (WATCHES) await page.watch();
else {
  await page.rebuild().catch(() => (process.exitCode = 1)); // what was wrong is printed already
  await page.dispose();
}

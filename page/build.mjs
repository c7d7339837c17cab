// Builds the page of the panel from src/ and public/ into src/elib/panel/page; with --watch again after each change.
// With --studio FOLDER it builds the studio into that folder instead, beside the wheels that lie there already.
import { context } from "esbuild";
import { createHash } from "node:crypto";
import { copyFileSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const HERE = dirname(fileURLToPath(import.meta.url));
const STUDIO = process.argv[process.argv.indexOf("--studio") + 1 || Infinity];
const INTO = STUDIO ?? join(HERE, "../src/elib/panel/page");
const WATCHES = process.argv.includes("--watch");
const LINKS = {
  ".css": (name) => `<link rel="stylesheet" href="/${name}" />`,
  ".woff2": (name) => `<link rel="preload" href="/${name}" as="font" type="font/woff2" crossorigin />`,
};
const PYODIDE = ["pyodide.asm.mjs", "pyodide.asm.wasm", "python_stdlib.zip"];
// A program may come from a link: what it may reach is what its own server has.
const POLICY = [
  "default-src 'none'; base-uri 'none'; form-action 'none'; connect-src 'self'; font-src 'self'; worker-src 'self' blob:",
  "script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:",
].join("; ");

/** Write what was built; index.html comes last, so that where it is, the page is whole. */
function write({ errors, metafile, outputFiles }) {
  if (errors.length) return;
  const files = Object.fromEntries(outputFiles.map((file) => [basename(file.path), file.contents]));
  const named = (entry) =>
    basename(Object.keys(metafile.outputs).find((name) => metafile.outputs[name].entryPoint === entry));
  // What others know by its name, and the page itself does not link to.
  const rename = (entry, name) => {
    const built = named(entry);
    files[name] = files[built];
    delete files[built];
  };
  if (STUDIO) rename("src/studio/worker.ts", "worker.js");
  else rename("src/login.css", "login.css");
  // The styles of lazy parts too: esbuild loads only their scripts by itself.
  const links = Object.entries(LINKS).flatMap(([end, link]) =>
    Object.keys(files)
      .filter((name) => name.endsWith(end) && name !== "login.css")
      .map(link),
  );
  const scripts = STUDIO ? ["src/studio/main.tsx", "src/studio/offline.ts"] : ["src/main.tsx"];
  links.push(...scripts.map((entry) => `<script type="module" src="/${named(entry)}"></script>`));
  files["licences.txt"] = licences(metafile);
  for (const name of readdirSync(join(HERE, "public"))) files[name] = readFileSync(join(HERE, "public", name));
  const index = String(files["index.html"]).replace("<!-- built -->", links.join("\n    "));
  delete files["index.html"];
  if (STUDIO) return writeStudio(files, index);
  rmSync(INTO, { recursive: true, force: true });
  mkdirSync(INTO);
  for (const [name, body] of Object.entries({ ...files, "index.html": index })) writeFileSync(join(INTO, name), body);
  if (WATCHES) console.log("built; restart the program that serves it");
}

/** Write the studio: it may lie in any folder of a server, and a service worker keeps all of it. */
function writeStudio(files, index) {
  delete files["login.html"];
  files["index.html"] = index
    .replaceAll('="/', '="')
    .replace("<title>elib</title>", "<title>elib studio</title>")
    .replace("<head>", `<head>\n    <meta http-equiv="Content-Security-Policy" content="${POLICY}" />`);
  for (const [name, body] of Object.entries(files)) writeFileSync(join(INTO, name), body);
  for (const name of PYODIDE) copyFileSync(join(HERE, "node_modules/pyodide", name), join(INTO, name));
  const hash = createHash("sha256"),
    names = readdirSync(INTO).sort();
  for (const name of names) hash.update(name).update(readFileSync(join(INTO, name)));
  const facts = { FILES: names, POLICY, VERSION: hash.digest("hex").slice(0, 16) };
  const written = Object.entries(facts).map(([name, fact]) => `const ${name} = ${JSON.stringify(fact)};\n`);
  writeFileSync(join(INTO, "service.js"), written.join("") + readFileSync(join(HERE, "service.js")));
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
  const { version, license, repository } = JSON.parse(readFileSync(join(folder, "package.json")));
  const file = readdirSync(folder).find((each) => /^licen[cs]e/i.test(each));
  if (!file && !repository) throw new Error(`${name} brings no text of its licence`);
  const text = file ? readFileSync(join(folder, file)) : `Its source and its licence: ${repository.url}`;
  return `${name} ${version}, ${license}\n\n${String(text).trim()}\n`;
}

/** Return what Pyodide wants to know of its packages, without those of its makers' server. */
function lock() {
  const { info } = JSON.parse(readFileSync(join(HERE, "node_modules/pyodide/pyodide-lock.json")));
  return JSON.stringify({ info, packages: {} });
}

const page = await context({
  absWorkingDir: HERE,
  entryPoints: STUDIO
    ? ["src/studio/main.tsx", "src/studio/offline.ts", "src/studio/worker.ts"]
    : ["src/main.tsx", "src/login.css"],
  outdir: INTO,
  bundle: true,
  splitting: true,
  format: "esm",
  target: "es2022",
  minify: true,
  legalComments: "none", // licences.txt has them
  loader: { ".woff2": "file" },
  external: ["node:*"], // Pyodide looks for Node
  define: STUDIO && {
    WHEELS: JSON.stringify(readdirSync(STUDIO).filter((name) => name.endsWith(".whl"))),
    LOCK: lock(),
  },
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

// The studio's service worker: it keeps the files of one version of the studio, and answers with them, so that the
// studio needs no network after the first visit. The build writes FILES, POLICY and VERSION above this.
const OURS = `elib studio ${registration.scope} `;
const CACHE = OURS + VERSION;
const CONFINED = registration.scope + "confined.js";

async function keep() {
  const cache = await caches.open(CACHE);
  // Where the browser has a file already, the server is asked only whether it is the newest.
  await cache.addAll(["./", ...FILES].map((name) => new Request(name, { cache: "no-cache" })));
}

async function forget() {
  for (const name of await caches.keys()) if (name.startsWith(OURS) && name !== CACHE) await caches.delete(name);
}

async function answer(request) {
  const cache = await caches.open(CACHE);
  return (await cache.match(request, { ignoreSearch: request.mode === "navigate" })) ?? fetch(request);
}

// No server has a file of this name. So a worker that asks for it has the policy, or does not start.
async function confined() {
  const { body } = await answer(new Request("worker.js"));
  return new Response(body, { headers: { "Content-Security-Policy": POLICY, "Content-Type": "text/javascript" } });
}

addEventListener("install", (event) => event.waitUntil(keep()));
addEventListener("activate", (event) => event.waitUntil(forget()));
addEventListener("fetch", (event) => {
  const { method, url } = event.request;
  if (method === "GET") event.respondWith(url === CONFINED ? confined() : answer(event.request));
});

/** A worker to which the page's Content-Security-Policy holds. Where the service worker answers this page, it makes
 * `confined.js` of the worker and the policy. Else a blob has the page's policy; a file of a server would have none. */
export function confined() {
  if (navigator.serviceWorker?.controller) return new Worker("confined.js", { type: "module" });
  const text = `import ${JSON.stringify(new URL("worker.js", location.href))};`,
    url = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  return new Worker(url, { type: "module" });
}

/** A worker to which the page's Content-Security-Policy holds: one that comes from an address has none of its own. */
export function confined(script: string) {
  const text = `import ${JSON.stringify(new URL(script, location.href))};`,
    url = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  return new Worker(url, { type: "module" });
}

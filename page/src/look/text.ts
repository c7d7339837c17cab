// Numbers and times, as a person reads them.

/** How many digits after the point make sense for a unit. */
export const DIGITS: Record<string, number> = { "rev/s": 2, g: 2, "rad/s": 2, rad: 2, V: 2, m: 3, T: 7 };

/** A number with `digits` after the point, a true minus, and no minus before nothing. */
export function number(value: number | null | undefined, digits = 0) {
  if (value === null || value === undefined) return "?";
  const text = !Number.isInteger(value) || digits ? value.toFixed(digits) : String(value);
  return text.replace(/^-(?=0(\.0*)?$)/, "").replace("-", "−");
}

export function age(seconds: number | null) {
  if (seconds === null) return "";
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 100) return `${Math.round(seconds)} s`;
  return seconds < 6000 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 3600)} h`;
}

export function bytes(count: number) {
  if (count < 1000) return `${count} B`;
  return count < 1e6 ? `${(count / 1e3).toFixed(0)} kB` : `${(count / 1e6).toFixed(1)} MB`;
}

export const milliseconds = (seconds: number | null) =>
  seconds === null ? "?" : `${number(1000 * seconds, seconds && seconds < 0.01 ? 1 : 0)} ms`;

/** Let the browser save a file. */
export function save(blob: Blob, name: string) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** The name of a world or behaviour as a title: "Red boxes". */
export const title = (name: string) => name.charAt(0).toUpperCase() + name.slice(1).replaceAll("-", " ");

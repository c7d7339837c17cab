// Drawing on a canvas, which knows no style sheet.

const probe = document.createElement("i");
probe.hidden = true;
document.documentElement.append(probe);

/** The colours of the page as they are now, by their names in tokens.css, of either scheme. */
export function inks<Name extends string>(...names: Name[]) {
  const found = names.map((name) => {
    probe.style.color = `var(--${name})`;
    return [name, getComputedStyle(probe).color];
  });
  return Object.fromEntries(found) as Record<Name, string>;
}

/** Make a canvas as sharp as the screen, and clear it; what is drawn is measured in CSS pixels. */
export function prepared(canvas: HTMLCanvasElement) {
  const density = Math.min(3, devicePixelRatio || 1),
    { clientWidth: width, clientHeight: height } = canvas,
    pen = canvas.getContext("2d")!;
  [canvas.width, canvas.height] = [Math.max(1, Math.round(width * density)), Math.max(1, Math.round(height * density))];
  pen.setTransform(density, 0, 0, density, 0, 0);
  return { pen, width, height };
}

const FINEST = 0.01; // m

/** A round number of metres that is at least so many pixels long: 1, 2 or 5 of a power of ten. */
export function stepOf(scale: number, least: number) {
  const wanted = Math.max(FINEST, least / scale),
    power = 10 ** Math.floor(Math.log10(wanted));
  return power * ([1, 2, 5].find((step) => step * power >= wanted) ?? 10);
}

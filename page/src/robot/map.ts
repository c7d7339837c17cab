// What the infrared sensors of a robot have met, as the panel tells it: a picture of one pixel for each square.
import type { MapPart } from "../messages";

export type Place = (x: number, y: number) => [x: number, y: number];

const channels = (colour: string) => colour.match(/[\d.]+/g)!.map(Number);

export class RobotMap {
  private readonly canvas = document.createElement("canvas");
  private readonly squares: Int8Array; // above 0 something is there, below 0 nothing is
  private ink: { wall: string; floor: string } | null = null;

  constructor(private readonly whole: MapPart) {
    const { columns, rows } = whole;
    [this.canvas.width, this.canvas.height] = [columns, rows];
    this.squares = new Int8Array(columns * rows);
  }

  /** Whether a part belongs to this map, not to one that has grown or begun again. */
  has({ x, y, columns, rows }: MapPart) {
    const { whole } = this;
    return x === whole.x && y === whole.y && columns === whole.columns && rows === whole.rows;
  }

  take({ at: [row, column], width, squares }: MapPart) {
    const told = Int8Array.from(atob(squares), (letter) => letter.charCodeAt(0));
    for (let start = 0; start < told.length; start += width)
      this.squares.set(told.subarray(start, start + width), (row + start / width) * this.whole.columns + column);
    this.paint(row, column, told.length / width, width);
  }

  drawOn(pen: CanvasRenderingContext2D, at: Place, scale: number, ink: { wall: string; floor: string }) {
    const { x, y, cell, columns, rows } = this.whole;
    if (this.ink !== ink) {
      this.ink = ink;
      this.paint(0, 0, rows, columns);
    }
    pen.imageSmoothingEnabled = cell * scale < 1; // squares that share a pixel are mixed
    const [left, top] = at(x - cell / 2, y + (rows - 0.5) * cell);
    pen.drawImage(this.canvas, left, top, columns * cell * scale, rows * cell * scale);
  }

  private paint(row: number, column: number, height: number, width: number) {
    if (!this.ink) return; // it is painted whole when it is drawn first
    const { columns, rows } = this.whole,
      [wall, floor] = [channels(this.ink.wall), channels(this.ink.floor)],
      image = new ImageData(width, height);
    for (let up = 0; up < height; up++)
      for (let along = 0; along < width; along++) {
        const odds = this.squares[(row + up) * columns + column + along],
          [red, green, blue] = odds > 0 ? wall : floor,
          alpha = odds > 0 ? 51 + Math.round((204 * odds) / 127) : odds ? 255 : 0;
        image.data.set([red, green, blue, alpha], 4 * ((height - 1 - up) * width + along));
      }
    this.canvas.getContext("2d")!.putImageData(image, column, rows - row - height);
  }
}

/** Points of a stretch as the server sends them, their colours, and the axis of the tunnel. */

import { classColour } from './classes.js';

/** Colour of points without a value. */
export const NO_VALUE = '#68768a';
const TYPES = { float32: Float32Array, uint8: Uint8Array, int16: Int16Array };
const NONE = rgb(NO_VALUE);
const NO_LENGTH = -32768;
const BLUE = [33, 102, 172];
const WHITE = [247, 247, 247];
const RED = [178, 24, 43];

/** Points of a stretch: header of the server, and arrays by name. */
export class Stretch {
  /** @param {ArrayBuffer} buffer - header and arrays, as tunneldb.export.pointcloud.point_buffer describes them. */
  constructor(buffer) {
    const length = new DataView(buffer).getUint32(0, true);
    Object.assign(this, JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length))));
    this.values = Object.fromEntries(this.arrays.map(({ name, type, length: many, at }) => [name, new TYPES[type](buffer, 4 + length + at, many)]));
  }

  /** Return what the points can be coloured by: kind, label and, except for the class, unit, low and high. */
  get kinds() {
    return [{ kind: 'class', label: 'Class' }, ...this.colours];
  }

  /** Return the classes of the points. */
  get classes() {
    return [...new Set(this.values.class)].sort((a, b) => a - b);
  }

  /** Return red, green and blue of each point. */
  colour(kind) {
    const values = this.values[kind];
    const table = kind === 'class' ? classTable(this.classes) : this.table(kind);
    const colours = new Uint8Array(3 * values.length);
    for (let n = 0; n < values.length; n += 1) colours.set(table(values[n]), 3 * n);
    return colours;
  }

  table(kind) {
    const { signed, high } = this.colours.find((other) => other.kind === kind);
    if (!signed) return (grey) => (grey ? [grey, grey, grey] : NONE);
    const limit = 1000 * high;
    return (length) => (length === NO_LENGTH ? NONE : diverging(length / limit));
  }

  /** Return the place of the axis at a chainage; beyond the ends the axis goes on straight. */
  at(chainage) {
    const { axis } = this;
    const after = axis.findIndex((row) => row[0] >= chainage);
    const end = after < 0 ? axis.length - 1 : Math.max(after, 1);
    const [a, b] = [axis[end - 1], axis[end]];
    const share = (chainage - a[0]) / (b[0] - a[0]);
    return [1, 2, 3].map((n) => a[n] + share * (b[n] - a[n]));
  }

  /** Return the chainage of the place of the axis that is nearest to a place; beyond the ends the axis goes on straight. */
  chainageOf([x, y, z]) {
    let best = [Infinity, this.from];
    for (let n = 1; n < this.axis.length; n += 1) {
      const [a, b] = [this.axis[n - 1], this.axis[n]];
      const [dx, dy, dz] = [b[1] - a[1], b[2] - a[2], b[3] - a[3]];
      const share = ((x - a[1]) * dx + (y - a[2]) * dy + (z - a[3]) * dz) / (dx * dx + dy * dy + dz * dz);
      const held = Math.min(Math.max(share, n === 1 ? -Infinity : 0), n === this.axis.length - 1 ? Infinity : 1);
      const away = Math.hypot(x - a[1] - held * dx, y - a[2] - held * dy, z - a[3] - held * dz);
      if (away < best[0]) best = [away, a[0] + held * (b[0] - a[0])];
    }
    return best[1];
  }
}

function classTable(classes) {
  const table = new Map(classes.map((code) => [code, rgb(classColour(code))]));
  return (code) => table.get(code);
}

/** Return red, green and blue of a colour such as #4a5a68. */
export function rgb(colour) {
  return [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
}

function diverging(share) {
  const part = Math.min(Math.abs(share), 1);
  const end = share < 0 ? BLUE : RED;
  return WHITE.map((white, n) => white + part * (end[n] - white));
}

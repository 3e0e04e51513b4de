/** Readout of the map: position, axes of chainage and clock, band of what was inspected. */

import { fitCanvas } from './dom.js';
import { arc, clock, niceStep, percent, station } from './format.js';
import { hatch } from './ribbon.js';

const BAND = 7;
/** Height of the zoom buttons at the upper left, px. */
const CLEAR = matchMedia('(pointer: coarse), (max-width: 820px)').matches ? 125 : 95;

/** Clock positions by arc, from the curve of one section: about right elsewhere in the tunnel. */
export class ClockScale {
  constructor(curve) {
    this.rows = arcsOf(curve).map((place, n) => [place, ((Math.atan2(...curve[n]) * 6) / Math.PI + 12) % 12]);
    this.rows.sort((a, b) => a[0] - b[0]);
  }

  /** Return the clock position at an arc, hours; null outside the section. */
  at(place) {
    const { rows } = this;
    const n = rows.findIndex(([other]) => other >= place);
    if (n < 0 || (n === 0 && rows[0][0] > place + 0.05)) return null;
    const [high, end] = rows[n];
    const [low, begin] = rows[Math.max(n - 1, 0)];
    const turn = ((end - begin + 18) % 12) - 6;
    const share = high > low ? (place - low) / (high - low) : 0;
    return (begin + share * turn + 12) % 12;
  }
}

/** Return the arc of each point of a curve of a section: 0 where it crosses the axis above, positive to the right. */
export function arcsOf(curve) {
  const lengths = [0];
  for (let n = 1; n < curve.length; n += 1) {
    lengths.push(lengths[n - 1] + Math.hypot(curve[n][0] - curve[n - 1][0], curve[n][1] - curve[n - 1][1]));
  }
  let crown = null;
  let highest = -Infinity;
  for (let n = 1; n < curve.length; n += 1) {
    const [[before], [after, height]] = [curve[n - 1], curve[n]];
    if (before * after <= 0 && before !== after && height > highest) {
      highest = height;
      crown = { at: lengths[n - 1] + ((lengths[n] - lengths[n - 1]) * before) / (before - after), sign: after > before ? 1 : -1 };
    }
  }
  return lengths.map((length) => (crown ? crown.sign * (length - crown.at) : NaN));
}

/** Return a position as text. */
export function positionText([x, y], clocks) {
  const hours = clocks?.at(y) ?? null;
  const about = hours === null ? '' : ` · about ${clock(hours)}`;
  return `${station(x, 2)} · arc ${arc(y)}${about}`;
}

/**
 * Draw the axes of a map.
 * @param {HTMLCanvasElement} canvas
 * @param {number[]} extent - in view: chainage from, arc from, chainage to, arc to.
 * @param {Object} survey
 * @param {Object|null} ribbon
 * @param {ClockScale|null} clocks
 */
export function drawAxes(canvas, extent, survey, ribbon, clocks) {
  const { context: c, width, height } = fitCanvas(canvas);
  const [left, bottom, right, top] = extent;
  const x = (at) => ((at - left) / (right - left)) * width;
  const y = (at) => height - ((at - bottom) / (top - bottom)) * height;
  c.font = '11px system-ui, sans-serif';
  band(c, x, width, ribbon, survey);
  chainages(c, x, height, width, left, right);
  arcs(c, y, width, height, bottom, top, survey, clocks);
}

function chainages(c, x, height, width, left, right) {
  const step = niceStep(((right - left) * 100) / width);
  const decimals = step < 0.1 ? 2 : step < 1 ? 1 : 0;
  for (let at = Math.ceil(left / step) * step; at <= right; at += step) {
    const px = x(at);
    if (px < 75 || px > width - 40) continue;
    c.strokeStyle = 'rgba(30,40,50,.75)';
    c.beginPath();
    c.moveTo(px, height);
    c.lineTo(px, height - 6);
    c.stroke();
    text(c, station(at, decimals), px, height - 8, 'center', 'bottom');
  }
}

function arcs(c, y, width, height, bottom, top, survey, clocks) {
  if (y(survey.arc_from) - y(survey.arc_to) < 90) return;
  const step = niceStep(((top - bottom) * 60) / height);
  for (let at = Math.ceil(bottom / step) * step; at <= top; at += step) {
    const py = y(at);
    if (at < survey.arc_from || at > survey.arc_to || py < CLEAR || py > height - 24) continue;
    const hours = clocks?.at(at) ?? null;
    const metres = `${at > 0 ? '+' : at < 0 ? '−' : ''}${Math.abs(at).toFixed(step < 0.1 ? 2 : step < 1 ? 1 : 0)}`;
    c.strokeStyle = 'rgba(30,40,50,.75)';
    c.beginPath();
    c.moveTo(0, py);
    c.lineTo(6, py);
    c.stroke();
    text(c, hours === null ? `${metres} m` : `${metres} m · ${clock(hours)}`, 8, py, 'left', 'middle');
  }
}

/** Draw what was inspected along the upper edge: green, or hatched in part. */
function band(c, x, width, ribbon, survey) {
  if (!ribbon?.inspected) return;
  const first = Math.max(Math.floor(((0 - x(ribbon.from)) / (x(ribbon.from + ribbon.step) - x(ribbon.from)))), 0);
  for (let n = first; n < ribbon.inspected.length; n += 1) {
    const from = x(ribbon.from + n * ribbon.step);
    if (from > width) break;
    const wide = x(Math.min(ribbon.from + (n + 1) * ribbon.step, survey.to)) - from;
    const share = ribbon.inspected[n];
    hatch(c, from, 0, wide, BAND);
    if (share === null) continue;
    c.fillStyle = '#5d8a6a';
    c.fillRect(from, BAND * (1 - share), wide, BAND * share);
    const left = Math.max(from, 70) + 4;
    if (Math.min(from + wide, width) - left > 110 && share < 0.995) text(c, share > 0 ? `${percent(share)} inspected` : 'not inspected', left, BAND + 3, 'left', 'top');
  }
}

function text(c, words, x, y, align, base) {
  c.textAlign = align;
  c.textBaseline = base;
  c.lineWidth = 3;
  c.strokeStyle = 'rgba(255,255,255,.9)';
  c.strokeText(words, x, y);
  c.lineWidth = 1;
  c.fillStyle = '#1d2730';
  c.fillText(words, x, y);
}

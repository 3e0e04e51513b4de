/** Ribbon: the whole survey in one canvas; a click or the arrow keys go there. */

import { debounce, el, fitCanvas } from './dom.js';
import { niceStep, number, percent, station } from './format.js';
import { fromBest, levelColour } from './levels.js';

const COLOURS = { wet: '#005caf', inspected: '#5d8a6a', probability: '#6a4c93', reviewed: '#3c6e91', axis: '#55626e', line: '#d9dfe4' };
const AXIS = 16;
const ROWS = [
  ['wet', 'Wet area', 1.3], ['findings', 'Findings', 1.3], ['rating', 'Rating', 0.7], ['inspected', 'Inspected', 0.8], ['probability', 'Detectability', 1],
  ['deviation', 'Deviation', 1], ['reviewed', 'Reviewed', 0.7],
];

/** Colours of deviations inside and outside the design. */
const INSIDE = '#b3261e';
const OUTSIDE = '#2f6db5';

/** Overview of a survey. */
export class Ribbon {
  /**
   * @param {HTMLElement} root
   * @param {function(number)} go - is called with the chainage to go to.
   */
  constructor(root, go) {
    this.go = go;
    this.data = null;
    this.view = null;
    this.rating = null;
    this.canvas = el('canvas', {
      tabindex: '0', role: 'slider', 'aria-label': 'Chainage in view', 'aria-orientation': 'horizontal', 'aria-valuemin': '0',
      'aria-valuemax': '0', 'aria-valuenow': '0', data: { keys: '' },
    });
    this.labels = el('div', { class: 'labels' });
    this.tip = el('p', { class: 'tip', hidden: true });
    root.replaceChildren(this.labels, el('div', { class: 'strip' }, this.canvas, this.tip));
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  /** Show the data of a survey; null while they are read. */
  show(data, survey) {
    this.data = data;
    this.survey = survey;
    this.arrange();
    this.colours = new Map(survey.finding_kinds.map((kind) => [kind.code, kind]));
    this.canvas.setAttribute('aria-valuemin', survey.from);
    this.canvas.setAttribute('aria-valuemax', survey.to);
    if (!this.tip.hidden) this.tip.textContent = this.describe(this.pointed);
    this.draw();
  }

  /** Show the results of elements as a band; null shows none. */
  setRating(rating) {
    this.rating = rating;
    if (!this.survey) return;
    this.arrange();
    this.draw();
  }

  /** Choose the rows, and label them: a survey without a design has no deviation. */
  arrange() {
    const { data } = this;
    this.rows = ROWS.filter(([name]) => (name !== 'deviation' || data?.deviation) && (name !== 'rating' || this.rating));
    this.labels.replaceChildren(...this.rows.map(([, text, share]) => {
      const label = el('span', { text });
      label.style.flexGrow = share;
      return label;
    }));
  }

  /** Mark the stretch in view. */
  mark(from, to) {
    this.view = [from, to];
    const middle = Math.min(Math.max((from + to) / 2, this.survey?.from ?? from), this.survey?.to ?? to);
    this.canvas.setAttribute('aria-valuenow', middle.toFixed(1));
    this.canvas.setAttribute('aria-valuetext', this.describe(middle));
    this.draw();
  }

  listen() {
    const { canvas } = this;
    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return this.chainage(event.clientX - box.left, box.width);
    };
    let dragging = false;
    canvas.addEventListener('pointerdown', (event) => {
      if (!this.survey) return;
      dragging = true;
      canvas.setPointerCapture(event.pointerId);
      this.go(place(event));
    });
    canvas.addEventListener('pointermove', (event) => {
      if (!this.survey) return;
      if (dragging) this.go(place(event));
      this.hint(place(event), event.offsetX);
    });
    canvas.addEventListener('pointerup', () => { dragging = false; });
    canvas.addEventListener('pointercancel', () => { dragging = false; });
    canvas.addEventListener('pointerleave', () => { this.tip.hidden = true; });
    canvas.addEventListener('keydown', (event) => this.key(event));
  }

  key(event) {
    if (!this.view || event.ctrlKey || event.altKey || event.metaKey) return;
    const [from, to] = this.view;
    const width = Math.min(to - from, this.survey.to - this.survey.from);
    const steps = { ArrowRight: 0.5, ArrowUp: 0.5, ArrowLeft: -0.5, ArrowDown: -0.5, PageUp: 10, PageDown: -10 };
    let goal = null;
    if (event.key in steps) goal = (from + to) / 2 + steps[event.key] * width;
    else if (event.key === 'Home') goal = this.survey.from;
    else if (event.key === 'End') goal = this.survey.to;
    if (goal === null) return;
    event.preventDefault();
    this.go(Math.min(Math.max(goal, this.survey.from), this.survey.to));
  }

  chainage(x, width) {
    const { from, to } = this.survey;
    return from + (Math.min(Math.max(x, 0), width) / width) * (to - from);
  }

  hint(chainage, x) {
    this.pointed = chainage;
    this.tip.textContent = this.describe(chainage);
    this.tip.hidden = false;
    const room = this.canvas.clientWidth - this.tip.offsetWidth;
    this.tip.style.left = `${Math.max(0, Math.min(x + 12, room))}px`;
  }

  /** Return the values at a chainage in words. */
  describe(chainage) {
    const { data } = this;
    const parts = [station(chainage, 0)];
    const rated = this.rating?.elements.filter((one) => one.chainage_from <= chainage && one.chainage_to > chainage) ?? [];
    if (rated.length) parts.push(`rated ${fromBest(rated).at(-1).result_text}`);
    if (!data?.inspected) return parts.join('; ');
    const n = Math.min(Math.max(Math.floor((chainage - data.from) / data.step), 0), data.inspected.length - 1);
    const inspected = data.inspected[n];
    parts.push(inspected === null ? 'inspected: not known' : `inspected ${percent(inspected)}`);
    parts.push(data.wet[n] === null ? 'wet area: not known' : `wet area ${number(data.wet[n], 2, 'm²')}`);
    for (const [kind, counts] of Object.entries(data.findings)) {
      if (counts[n]) parts.push(`${counts[n]} × ${this.colours.get(kind)?.label ?? kind}`);
    }
    const probability = data.probability[n];
    parts.push(probability === null ? 'detection probability: not known' : `detection probability ${percent(probability)}`);
    const { deviation } = data;
    if (deviation) {
      const least = deviation.least[n];
      parts.push(least === null ? 'deviation: not known' : `deviation of the ${deviation.layer} ${millimetres(least)} to ${millimetres(deviation.greatest[n])}`);
    }
    if (data.reviewed[n] !== null) parts.push(`reviewed ${percent(data.reviewed[n])}`);
    return parts.join('; ');
  }

  draw = debounce(() => this.paint(), 8);

  paint() {
    const { context: c, width, height } = fitCanvas(this.canvas);
    c.clearRect(0, 0, width, height);
    if (!this.survey || width < 10) return;
    const { rows } = this;
    const total = rows.reduce((sum, [, , share]) => sum + share, 0);
    const gap = 3;
    const room = height - AXIS - gap * rows.length;
    let y = 0;
    this.maxima = [];
    for (const [name, , share] of rows) {
      const tall = (room * share) / total;
      c.fillStyle = '#f3f5f7';
      c.fillRect(0, y, width, tall);
      if (name === 'rating') this.results(c, y, width, tall);
      else if (this.data && name === 'deviation') this.deviations(c, y, width, tall);
      else if (this.data) this.row(c, name, y, width, tall);
      y += tall + gap;
    }
    this.axis(c, width, height);
    this.box(c, width, height - AXIS);
    this.maxima.forEach(([top, text]) => maximum(c, text, width, top));
  }

  /** Draw a row: bars of values, hatched where a value is not known. */
  row(c, name, top, width, tall) {
    const { data } = this;
    const bars = name === 'findings' ? this.stacks() : null;
    const values = name === 'findings' ? bars.totals : data[name];
    const most = name === 'wet' || name === 'findings' ? Math.max(...values.map((value) => value ?? 0), 1e-9) : 1;
    for (let n = 0; n < values.length; n += 1) {
      const [x, wide] = this.bin(n, width);
      const value = values[n];
      const none = name === 'reviewed' && value === null;
      // No leak is no all-clear where nothing was inspected, or where that is not known.
      const unknown = data.inspected[n] ? value === null && !none : !value;
      if (unknown) {
        hatch(c, x, top, wide, tall);
      } else if (bars) {
        let low = top + tall;
        for (const [colour, counts] of bars.kinds) {
          const part = (counts[n] / most) * tall;
          c.fillStyle = colour;
          c.fillRect(x, low - part, wide, part);
          low -= part;
        }
      } else if (name === 'inspected') {
        c.fillStyle = COLOURS.inspected;
        c.fillRect(x, top + tall * (1 - value), wide, tall * value);
        if (value < 1) hatch(c, x, top, wide, tall * (1 - value));
      } else if (value > 0) {
        // A small wet area beside a large one stays visible.
        const part = Math.max((value / most) * tall, 1);
        c.fillStyle = COLOURS[name];
        c.fillRect(x, top + tall - part, wide, part);
      }
    }
    if (name === 'wet') this.maxima.push([top, `max ${number(most < 1e-6 ? 0 : most, 1, 'm²')}`]);
    if (name === 'findings') this.maxima.push([top, `max ${most < 1 ? 0 : most}`]);
  }

  /** Draw the results of elements; where zones overlap in chainage, the worst is on top. */
  results(c, top, width, tall) {
    const { from, to } = this.survey;
    const { elements, levels } = this.rating;
    const x = (at) => Math.round(((Math.min(Math.max(at, from), to) - from) / (to - from)) * width);
    for (const element of fromBest(elements)) {
      const left = x(element.chainage_from);
      const wide = Math.max(x(element.chainage_to) - left, 1);
      if (element.chainage_to <= from || element.chainage_from >= to) continue;
      if (element.level === null) {
        hatch(c, left, top, wide, tall);
        continue;
      }
      c.fillStyle = levelColour(element, levels);
      c.fillRect(left, top, wide, tall);
      if (!element.complete) stripe(c, left, top, wide, tall);
      if (wide > 3) {
        c.fillStyle = '#fff';
        c.fillRect(left + wide - 1, top, 1, tall);
      }
    }
  }

  /** Draw deviations from the middle of a row: inside the design upwards, outside downwards. */
  deviations(c, top, width, tall) {
    const { data } = this;
    const { least, greatest } = data.deviation;
    const most = Math.max(...least.map((value) => Math.abs(value ?? 0)), ...greatest.map((value) => Math.abs(value ?? 0)), 1e-9);
    const middle = top + tall / 2;
    for (let n = 0; n < least.length; n += 1) {
      const [x, wide] = this.bin(n, width);
      if (least[n] === null) {
        hatch(c, x, top, wide, tall);
      } else {
        c.fillStyle = INSIDE;
        const inside = (Math.max(greatest[n], 0) / most) * (tall / 2);
        c.fillRect(x, middle - inside, wide, inside);
        c.fillStyle = OUTSIDE;
        c.fillRect(x, middle, wide, (Math.max(-least[n], 0) / most) * (tall / 2));
      }
    }
    this.maxima.push([top, `max ${millimetres(most)}`]);
  }

  /** Return left edge and width of a bin, in whole pixels: edges between pixels would show as stripes. */
  bin(n, width) {
    const { data } = this;
    const { from, to } = this.survey;
    const scale = width / (to - from);
    const x = Math.floor((data.from + n * data.step - from) * scale);
    return [x, Math.max(Math.floor((data.from + (n + 1) * data.step - from) * scale) - x, 1)];
  }

  stacks() {
    const kinds = Object.entries(this.data.findings).map(([kind, counts]) => [this.colours.get(kind)?.colour ?? '#777', counts]);
    const totals = this.data.inspected.map((_, n) => kinds.reduce((sum, [, counts]) => sum + (counts[n] ?? 0), 0));
    return { kinds, totals };
  }

  axis(c, width, height) {
    const { from, to } = this.survey;
    const step = niceStep(((to - from) * 90) / width);
    c.font = '11px system-ui, sans-serif';
    c.textBaseline = 'bottom';
    c.strokeStyle = COLOURS.axis;
    c.fillStyle = COLOURS.axis;
    for (let at = Math.ceil(from / step) * step; at <= to; at += step) {
      const x = ((at - from) / (to - from)) * width;
      c.beginPath();
      c.moveTo(x, height - AXIS);
      c.lineTo(x, height - AXIS + 3);
      c.stroke();
      c.textAlign = x < 25 ? 'left' : x > width - 25 ? 'right' : 'center';
      c.fillText(station(at, 0), x, height);
    }
  }

  box(c, width, height) {
    if (!this.view) return;
    const { from, to } = this.survey;
    const x = (at) => ((Math.min(Math.max(at, from), to) - from) / (to - from)) * width;
    const left = x(this.view[0]);
    const wide = Math.max(x(this.view[1]) - left, 3);
    c.fillStyle = 'rgba(20,50,74,.10)';
    c.fillRect(left, 0, wide, height);
    c.strokeStyle = '#b3261e';
    c.lineWidth = 1.5;
    c.strokeRect(left, 0.75, wide, height - 1.5);
  }
}

function millimetres(value) {
  return `${number(1000 * value, 0)} mm`;
}

/** State the largest value of a row at its right end. */
function maximum(c, text, width, top) {
  c.font = '10px system-ui, sans-serif';
  c.textAlign = 'right';
  c.textBaseline = 'top';
  const wide = c.measureText(text).width + 6;
  c.fillStyle = 'rgba(255,255,255,.9)';
  c.fillRect(width - wide, top, wide, 12);
  c.fillStyle = COLOURS.axis;
  c.fillText(text, width - 3, top + 1);
}

/** Draw white stripes over a result that is a lower bound. */
function stripe(c, x, y, width, height) {
  c.save();
  c.beginPath();
  c.rect(x, y, width, height);
  c.clip();
  c.strokeStyle = 'rgba(255,255,255,.85)';
  c.lineWidth = 1.5;
  c.beginPath();
  for (let at = x - height; at < x + width; at += 6) {
    c.moveTo(at, y + height);
    c.lineTo(at + height, y);
  }
  c.stroke();
  c.restore();
}

let pattern = null;

/** Fill a rectangle with the hatch of what is not inspected or not known. */
export function hatch(c, x, y, width, height) {
  if (!pattern) {
    const tile = document.createElement('canvas');
    tile.width = 6;
    tile.height = 6;
    const p = tile.getContext('2d');
    p.fillStyle = '#fbe9d6';
    p.fillRect(0, 0, 6, 6);
    p.strokeStyle = '#b8621b';
    p.beginPath();
    p.moveTo(-1, 7);
    p.lineTo(7, -1);
    p.stroke();
    pattern = tile;
  }
  c.fillStyle = c.createPattern(pattern, 'repeat');
  c.fillRect(x, y, width, height);
}

/** A section: points, curve, finding, and distances between clicks. */

import { get, saveBlob, surveyPath } from './api.js';
import { arcsOf } from './axis.js';
import { classColour, classLabel } from './classes.js';
import { button, el, field, svg } from './dom.js';
import { niceStep, number, parseStation, station } from './format.js';

const LINES = { curve: ['measured section', '#0b5fa5'], design: ['design', '#2e7d32'], gauge: ['gauge', '#8e24aa'] };
const MARGIN = 0.6;
const STEP = 0.05;

/** Panel of a section. */
export class SectionPanel {
  /**
   * @param {function(): number} here - returns the chainage in the middle of the map.
   * @param {function(): Object|null} finding - returns the finding that is shown.
   */
  constructor(here, finding) {
    this.here = here;
    this.finding = finding;
    this.at = el('input', { type: 'text', inputmode: 'decimal', placeholder: '12+345.6', onkeydown: (event) => event.key === 'Enter' && this.read(parseStation(this.at.value)) });
    this.told = el('p', { role: 'status', 'aria-live': 'polite' });
    this.box = el('div', { class: 'section-box' });
    this.key = el('ul', { class: 'key' });
    this.save = button('Download SVG', () => this.download(), { disabled: true });
    this.drawing = el('a', { class: 'button', download: '', hidden: true, text: 'Download DXF' });
    this.root = el('div', { class: 'pad' }, el('h2', { text: 'Section' }),
      el('div', { class: 'row' }, field('Chainage', this.at), button('Show', () => this.read(parseStation(this.at.value))),
        button('Middle of the map', () => this.read(this.here())), button('At the finding', () => this.atFinding())),
      this.told, this.box, this.key,
      el('div', { class: 'row' }, this.save, this.drawing, button('Clear distance', () => this.clear())),
      el('p', { class: 'muted small', text: 'Looking up-chainage. Click two points to measure; with the keyboard: arrow keys move the cross, Enter sets a point.' }));
  }

  setSurvey(survey) {
    this.survey = survey;
    this.section = null;
    this.box.replaceChildren();
    this.key.replaceChildren();
    this.save.disabled = true;
    this.drawing.hidden = true;
    this.told.textContent = '';
  }

  /** Show the section in the middle of the map if none is shown. */
  open() {
    if (!this.section) this.read(this.here());
  }

  atFinding() {
    const finding = this.finding();
    if (finding) this.read((finding.chainage_from + finding.chainage_to) / 2);
    else this.say('No finding is shown.', true);
  }

  async read(chainage) {
    if (!Number.isFinite(chainage)) {
      this.say('Enter a chainage in m or as 12+345.', true);
      return;
    }
    const { survey } = this;
    this.at.value = station(chainage, 2);
    this.say('Reading …');
    try {
      const section = await get(surveyPath(survey.name, `/section?chainage=${chainage.toFixed(3)}`));
      if (survey !== this.survey) return;
      this.section = section;
      this.draw();
      this.say(`${section.label ?? station(section.chainage, 2)}: ${section.points.length ? `${section.points.length} points` : 'no points are stored here'}.`);
    } catch (error) {
      this.say(error.message, true);
    }
  }

  draw() {
    const { points, curve, lines, centre } = this.section;
    const all = [...points, ...curve, ...lines.flatMap((line) => line.places), centre];
    const range = (n, pick) => pick(...chunks(all.map((point) => point[n]), pick));
    const [left, right, low, high] = [range(0, Math.min) - MARGIN, range(0, Math.max) + MARGIN, range(1, Math.min) - MARGIN, range(1, Math.max) + MARGIN];
    const size = Math.max(right - left, high - low);
    const unit = size / 400;
    const root = svg('svg', {
      xmlns: 'http://www.w3.org/2000/svg', viewBox: `${left} ${-high} ${right - left} ${high - low}`, tabindex: '0', role: 'img', class: 'section', 'data-keys': '',
      'aria-label': `Section at ${station(this.section.chainage, 2)}`,
    });
    root.append(svg('rect', { x: left, y: -high, width: right - left, height: high - low, fill: '#fff' }));
    this.grid(root, left, right, low, high, unit);
    const groups = grouped(points);
    for (const [code, group] of groups) {
      const path = group.map(([x, y]) => `M${x.toFixed(3)} ${(-y).toFixed(3)}h0`).join('');
      root.append(svg('path', { d: path, stroke: classColour(code), 'stroke-width': 1.6 * unit, 'stroke-linecap': 'round', fill: 'none' }));
    }
    const drawn = [{ kind: 'curve', name: '', places: curve }, ...lines];
    for (const { kind, name, places } of drawn) {
      const line = svg('polyline', { points: places.map(([x, y]) => `${x},${-y}`).join(' '), fill: 'none', stroke: LINES[kind][1], 'stroke-width': unit, opacity: '.8' });
      line.append(svg('title', {}, name || LINES[kind][0]));
      root.append(line);
    }
    const [x, y] = centre;
    root.append(svg('path', { d: `M${x - 8 * unit} ${-y}h${16 * unit}M${x} ${-y - 8 * unit}v${16 * unit}`, stroke: '#b3261e', 'stroke-width': unit }));
    this.mark(root, curve, unit);
    this.measure = svg('g', {});
    root.append(this.measure);
    Object.assign(this, { unit, picked: [], cursor: [x, y] });
    root.addEventListener('click', (event) => this.click(event, root));
    root.addEventListener('keydown', (event) => this.press(event));
    this.box.replaceChildren(root);
    this.key.replaceChildren(
      ...[...groups.keys()].map((code) => entry(classLabel(code), classColour(code))),
      ...drawn.map(({ kind, name }) => entry(name ? `${LINES[kind][0]} (${name})` : LINES[kind][0], LINES[kind][1])));
    this.save.disabled = false;
    this.drawing.hidden = false;
    this.drawing.href = surveyPath(this.survey.name, `/section.dxf?chainage=${this.section.chainage.toFixed(3)}`);
  }

  grid(root, left, right, low, high, unit) {
    const step = niceStep((right - left) / 8);
    const line = { stroke: '#e3e8ec', 'stroke-width': unit * 0.7 };
    const label = { 'font-size': 10 * unit, fill: '#55626e', 'font-family': 'system-ui, sans-serif' };
    for (let x = Math.ceil(left / step) * step; x < right; x += step) {
      root.append(svg('line', { x1: x, x2: x, y1: -low, y2: -high, ...line }), svg('text', { x: x + 2 * unit, y: -low - 3 * unit, ...label }, `${+x.toFixed(2)}`));
    }
    for (let y = Math.ceil(low / step) * step; y < high - 14 * unit; y += step) {
      root.append(svg('line', { x1: left, x2: right, y1: -y, y2: -y, ...line }), svg('text', { x: left + 2 * unit, y: -y - 2 * unit, ...label }, `${+y.toFixed(2)}`));
    }
  }

  /** Mark the arc of the finding that is shown, if the section crosses it. */
  mark(root, curve, unit) {
    const finding = this.finding();
    const { chainage } = this.section;
    if (!finding || curve.length < 3 || chainage < finding.chainage_from - 0.05 || chainage > finding.chainage_to + 0.05) return;
    const arcs = arcsOf(curve);
    const crossed = curve.filter((_, n) => arcs[n] >= finding.arc_from - 0.05 && arcs[n] <= finding.arc_to + 0.05);
    if (crossed.length) root.append(svg('polyline', { points: crossed.map(([x, y]) => `${x},${-y}`).join(' '), fill: 'none', stroke: '#e67e00', 'stroke-width': 5 * unit, opacity: '.7', 'stroke-linecap': 'round' }));
  }

  click(event, root) {
    const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(root.getScreenCTM().inverse());
    this.add([place.x, -place.y]);
  }

  press(event) {
    const moves = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };
    const move = moves[event.key];
    if (move) this.cursor = [this.cursor[0] + move[0] * (event.shiftKey ? 10 : 1), this.cursor[1] + move[1] * (event.shiftKey ? 10 : 1)];
    else if (event.key === 'Enter') this.add(this.cursor);
    else return;
    event.preventDefault();
    this.showMeasure(true);
  }

  add(place) {
    this.picked = this.picked.length >= 2 ? [place] : [...this.picked, place];
    this.showMeasure();
    const [from, to] = this.picked;
    if (to) this.say(`Distance ${number(distance(from, to), 3, 'm')} (horizontal ${number(to[0] - from[0], 3)}, vertical ${number(to[1] - from[1], 3, 'm')}).`);
    else this.say(`First point: offset ${number(place[0], 3, 'm')}, height ${number(place[1], 3, 'm')}.`);
  }

  clear() {
    this.picked = [];
    if (this.measure) this.showMeasure();
    this.say('');
  }

  showMeasure(cross = false) {
    const { unit, picked } = this;
    const dots = picked.map(([x, y]) => svg('circle', { cx: x, cy: -y, r: 3 * unit, fill: '#b3261e' }));
    if (picked.length === 2) {
      const [[x1, y1], [x2, y2]] = picked;
      dots.push(svg('line', { x1, y1: -y1, x2, y2: -y2, stroke: '#b3261e', 'stroke-width': 1.5 * unit }));
      dots.push(svg('text', { x: (x1 + x2) / 2 + 5 * unit, y: -(y1 + y2) / 2 - 5 * unit, 'font-size': 13 * unit, fill: '#8c1d18', 'font-family': 'system-ui, sans-serif' }, number(distance(...picked), 3, 'm')));
    }
    if (cross) {
      const [x, y] = this.cursor;
      dots.push(svg('path', { d: `M${x - 10 * unit} ${-y}h${20 * unit}M${x} ${-y - 10 * unit}v${20 * unit}`, stroke: '#1d2730', 'stroke-width': unit }));
    }
    this.measure.replaceChildren(...dots);
  }

  download() {
    const text = new XMLSerializer().serializeToString(this.box.firstChild);
    saveBlob(new Blob([text], { type: 'image/svg+xml' }), `section-${this.survey.name}-${station(this.section.chainage, 2)}.svg`);
  }

  say(text, wrong = false) {
    this.told.className = wrong ? 'wrong' : '';
    this.told.textContent = text;
  }
}

function distance([x1, y1], [x2, y2]) {
  return Math.hypot(x2 - x1, y2 - y1);
}

/** Return an entry of the key. */
function entry(text, colour) {
  const mark = el('i');
  mark.style.background = colour;
  return el('li', {}, mark, text);
}

function grouped(points) {
  const groups = new Map();
  for (const point of points) {
    if (!groups.has(point[2])) groups.set(point[2], []);
    groups.get(point[2]).push(point);
  }
  return groups;
}

/** Reduce a long list in chunks: a call with 20,000 arguments may fail. */
function chunks(values, pick) {
  const found = [];
  for (let n = 0; n < values.length; n += 5000) found.push(pick(...values.slice(n, n + 5000)));
  return found;
}

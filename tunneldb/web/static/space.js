/** The lining in 3D, in place of the unrolled one: points of a stretch, and outlines of its findings. */

import { get, getBuffer, surveyPath } from './api.js';
import { classColour, classLabel } from './classes.js';
import { button, choice, el, field } from './dom.js';
import { number, parseStation, station } from './format.js';
import { colourOf, isShown } from './layers.js';
import { NO_VALUE, Stretch } from './space_data.js';

const LENGTHS = [5, 10, 20, 30, 50];
const LENGTH = 20;
const STEP = 1;
const LONG_STEP = 5;
const BEHIND = 2;
const FEW_POINTS = 100000;
const MANY_POINTS = 300000;
const NO_WEBGL = 'This browser shows no 3D: WebGL is off. Switch on hardware acceleration (graphics) in the settings of the browser and start it again, '
  + 'or use another browser. The unrolled lining and the sections work without it.';
const LOST = 'The browser has stopped the 3D graphics. Close this view and open it again.';

/** View of a stretch in 3D. */
export class Space {
  /**
   * @param {HTMLElement} root
   * @param {Object} on - picked(id), closed(), shown(): switches of the findings.
   */
  constructor(root, on) {
    Object.assign(this, { root, on, survey: null, scene: null, stretch: null, findings: [], marked: null, reading: false, turn: 0 });
    this.at = el('input', { type: 'text', inputmode: 'decimal', size: '9', onkeydown: (event) => event.key === 'Enter' && this.go(parseStation(this.at.value)) });
    this.length = choice(LENGTHS.map((value) => [value, `${value} m`]), LENGTH, { onchange: () => this.go(this.middle) });
    this.kind = choice([], null, { onchange: () => this.colour() });
    this.size = el('input', { type: 'range', min: '0.5', max: '3', step: '0.25', value: '1.25', oninput: () => this.resize() });
    this.told = el('p', { class: 'told', role: 'status', 'aria-live': 'polite' });
    this.position = el('output', { class: 'position', 'aria-label': 'Position' });
    this.count = el('span', { class: 'muted' });
    this.legend = el('ul', { class: 'key', 'aria-label': 'Colours' });
    this.box = el('div', { class: 'space-box' });
    this.views = [button('Inside', () => this.view(true)), button('Outside', () => this.view(false))];
    this.build();
  }

  build() {
    const tools = el('div', { class: 'tools', role: 'toolbar', 'aria-label': 'Tools of the 3D view' },
      button('Unrolled lining', () => this.close(), { class: 'main' }),
      field('Chainage', this.at, { class: 'field inline' }), button('Show', () => this.go(parseStation(this.at.value))),
      field('Length', this.length, { class: 'field inline' }), ...this.views,
      button('◀', () => this.walk(-LONG_STEP), { 'aria-label': `Back ${LONG_STEP} m` }), button('▶', () => this.walk(LONG_STEP), { 'aria-label': `Forward ${LONG_STEP} m` }),
      field('Colour', this.kind, { class: 'field inline' }), field('Point size', this.size, { class: 'field inline' }));
    this.root.replaceChildren(tools, el('div', { class: 'space-view' }, this.box, this.told, this.legend), el('div', { class: 'readout' }, this.position, this.count));
  }

  /** Take a survey; the view of another one is closed. */
  setSurvey(survey) {
    if (this.open) this.close(null);
    this.survey = survey;
  }

  /** True if the view is shown. */
  get open() {
    return !this.root.hidden;
  }

  /** Show the stretch around a chainage. */
  async show(chainage) {
    this.root.hidden = false;
    if (!document.createElement('canvas').getContext('webgl2')) {
      this.say(NO_WEBGL, true);
      return;
    }
    this.middle = chainage;
    await this.read();
    this.scene?.canvas.focus({ preventScroll: true });
  }

  /** Go back to the unrolled lining, at a chainage. */
  close(chainage = this.middle) {
    this.turn += 1;
    this.scene?.dispose();
    Object.assign(this, { scene: null, stretch: null, findings: [], reading: false });
    this.root.hidden = true;
    this.on.closed(chainage);
  }

  go(chainage) {
    if (!Number.isFinite(chainage)) {
      this.say('Enter a chainage in m or as 12+345.', true);
      return;
    }
    this.middle = chainage;
    this.read(true);
  }

  /** Read the stretch around the middle; the camera begins anew, or keeps its place in the tunnel. */
  async read(anew = !this.scene) {
    const turn = (this.turn += 1);
    const { survey } = this;
    const half = Number(this.length.value) / 2;
    this.middle = Math.min(Math.max(this.middle, Math.min(survey.from + half, survey.to)), Math.max(survey.to - half, survey.from));
    const query = `from=${(this.middle - half).toFixed(3)}&to=${(this.middle + half).toFixed(3)}`;
    const limit = matchMedia('(pointer: coarse), (max-width: 820px)').matches ? FEW_POINTS : MANY_POINTS;
    this.at.value = station(this.middle, 1);
    this.reading = true;
    this.say('Reading …');
    try {
      const [{ SpaceScene }, buffer, findings] = await Promise.all([
        import('./space_scene.js'), getBuffer(surveyPath(survey.name, `/points?${query}&limit=${limit}`)), get(surveyPath(survey.name, `/outlines?${query}`)),
      ]);
      if (turn !== this.turn) return;
      this.scene ??= this.begin(SpaceScene);
      this.take(new Stretch(buffer), findings, anew);
    } catch (error) {
      if (turn === this.turn) this.say(error.message, true);
    } finally {
      if (turn === this.turn) this.reading = false;
    }
  }

  begin(SpaceScene) {
    const scene = new SpaceScene(this.box, { moved: () => this.moved(), picked: this.on.picked, walked: (metres) => this.walk(metres), lost: () => this.say(LOST, true) });
    Object.assign(scene.canvas, { tabIndex: 0 });
    scene.canvas.setAttribute('role', 'application');
    scene.canvas.setAttribute('aria-label', 'Lining in 3D: arrow keys move along the tunnel, with Shift 5 m');
    scene.canvas.addEventListener('keydown', (event) => this.key(event));
    return scene;
  }

  take(stretch, findings, anew) {
    Object.assign(this, { stretch, findings });
    const kinds = stretch.kinds.map(({ kind, label }) => [kind, label]);
    const kind = kinds.some(([code]) => code === this.kind.value) ? this.kind.value : 'class';
    this.kind.replaceChildren(...kinds.map(([code, text]) => el('option', { value: code, text })));
    this.kind.value = kind;
    this.resize();
    this.scene.show(stretch, kind);
    this.restyle();
    if (anew) this.view(true);
    this.showLegend();
    const { count, total } = stretch;
    this.count.textContent = `${count.toLocaleString('en')}${total > count ? ` of ${total.toLocaleString('en')}` : ''} points`;
    this.say('');
  }

  /** Draw the outlines again after a switch. */
  restyle() {
    if (!this.scene) return;
    const kinds = new Map(this.survey.finding_kinds.map((kind) => [kind.code, kind]));
    const shown = this.findings.filter(({ kind, state }) => isShown(kind, state, this.on.shown()));
    this.scene.setOutlines(shown.map((finding) => ({ ...finding, colour: colourOf(kinds.get(finding.kind), finding.review) })));
    this.scene.mark(this.marked);
  }

  /** Read the findings again. */
  async refresh() {
    const { stretch, survey } = this;
    if (!stretch) return;
    const findings = await get(surveyPath(survey.name, `/outlines?from=${stretch.from}&to=${stretch.to}`));
    if (stretch !== this.stretch) return;
    this.findings = findings;
    this.restyle();
  }

  /** Mark the finding that the panel shows; null marks none. */
  mark(finding) {
    this.marked = finding?.id ?? null;
    this.scene?.mark(this.marked);
  }

  /** Show the stretch of a finding, unless it is shown. */
  follow({ chainage_from: from, chainage_to: to }) {
    const { stretch } = this;
    if (stretch && (from + to) / 2 > stretch.from && (from + to) / 2 < stretch.to) return;
    this.go((from + to) / 2);
  }

  view(inside) {
    if (!this.scene) return;
    this.views.forEach((node, n) => node.setAttribute('aria-pressed', String(inside === (n === 0))));
    if (inside) this.scene.viewInside(this.stretch.from + Math.min(1, (this.stretch.to - this.stretch.from) / 4));
    else this.scene.viewOutside();
  }

  /** Draw the points as large as their mean distance, times the choice. */
  resize() {
    const { stretch, survey } = this;
    const area = stretch ? (stretch.to - stretch.from) * (survey.arc_to - survey.arc_from) : 0;
    if (area) this.scene.setSize(this.size.value * Math.sqrt(area / stretch.count));
  }

  colour() {
    this.scene?.colour(this.kind.value);
    this.showLegend();
  }

  /** Move along the tunnel; beyond the end of the stretch the next one is read. */
  walk(metres) {
    const { scene, stretch, survey } = this;
    if (!scene || this.reading) return;
    const to = Math.min(Math.max(scene.chainage + metres, survey.from), survey.to);
    if (to < stretch.from || to > stretch.to) {
      this.middle = to + Math.sign(metres) * (this.length.value / 2 - BEHIND);
      this.read(false);
    }
    scene.walk(to - scene.chainage);
  }

  key(event) {
    const way = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1 }[event.key];
    if (!way) return;
    event.preventDefault();
    event.stopPropagation();
    this.walk(way * (event.shiftKey ? LONG_STEP : STEP));
  }

  moved() {
    this.position.textContent = station(this.scene.chainage, 1);
  }

  showLegend() {
    const about = this.stretch?.kinds.find(({ kind }) => kind === this.kind.value);
    if (!about) return;
    if (about.kind === 'class') {
      this.legend.replaceChildren(...this.stretch.classes.map((code) => entry(classLabel(code), classColour(code))));
      return;
    }
    const decimals = about.signed ? 2 : 1;
    this.legend.replaceChildren(el('li', { class: 'legend' },
      number(about.low, decimals), el('i', { class: `ramp ${about.signed ? 'ramp-diverging' : 'ramp-grey'}` }), number(about.high, decimals, about.unit)), entry('no value', NO_VALUE));
  }

  say(text, wrong = false) {
    this.told.className = wrong ? 'told wrong' : 'told';
    this.told.textContent = text;
  }
}

/** Return an entry of the legend. */
function entry(text, colour) {
  const mark = el('i');
  mark.style.background = colour;
  return el('li', {}, mark, text);
}

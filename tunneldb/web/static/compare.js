/** Two surveys of a tunnel: one above the other, or with a swipe. */

import { get, surveyPath } from './api.js';
import { el } from './dom.js';
import { findingsLayer, hatchLayer, imageLayer } from './layers.js';

const { ol } = globalThis;

/** Second survey in the map. */
export class Comparison {
  /** @param {Lining} lining */
  constructor(lining) {
    this.lining = lining;
    this.survey = null;
    this.mode = 'swipe';
    this.share = 0.5;
    this.layers = [];
    this.slider = el('input', {
      type: 'range', class: 'swipe', min: '0', max: '1', step: '0.005', value: '0.5', hidden: true, 'aria-label': 'Position of the swipe',
      oninput: (event) => this.slide(Number(event.target.value)),
    });
    this.line = el('div', { class: 'swipe-line', hidden: true });
    this.box = el('div', { class: 'map second', hidden: true, tabindex: '0', role: 'application', 'aria-label': 'Lining of the other survey' });
    this.names = el('div', { class: 'swipe-names', hidden: true }, el('span'), el('span'));
  }

  /** Show a survey by its name in a mode: swipe or stack; an empty name ends the comparison. */
  async show(name, mode) {
    this.mode = mode;
    const asked = (this.asked = (this.asked ?? 0) + 1);
    const survey = name ? await get(surveyPath(name)) : null;
    if (asked !== this.asked) return;
    this.survey = survey;
    this.rebuild();
  }

  /** Build the layers again, after another image or mode. */
  rebuild() {
    const { map, kind, shown, version } = this.lining;
    this.layers.forEach((layer) => map.removeLayer(layer));
    this.layers = [];
    this.second?.setTarget(null);
    this.second = null;
    const swipes = this.survey !== null && this.mode === 'swipe';
    const stacks = this.survey !== null && this.mode === 'stack';
    this.slider.hidden = this.line.hidden = this.names.hidden = !swipes;
    this.box.hidden = !stacks;
    this.box.replaceChildren();
    if (this.survey) {
      const has = this.survey.kinds.some((other) => other.kind === kind);
      this.layers = [hatchLayer(this.survey), ...(has ? [imageLayer(this.survey, kind)] : []), findingsLayer(this.survey, shown, version)];
    }
    if (swipes) this.swipe(map);
    if (stacks) this.stack();
    map.updateSize();
  }

  swipe(map) {
    this.layers.forEach((layer, n) => {
      layer.setZIndex(10 + n);
      layer.on('prerender', (event) => clip(event, map, this.share));
      layer.on('postrender', (event) => event.context.restore());
      map.addLayer(layer);
    });
    const [left, right] = this.names.children;
    left.textContent = this.lining.survey.name;
    right.textContent = this.survey.name;
    this.slide(this.share);
  }

  stack() {
    const label = el('span', { class: 'map-name', text: this.survey.name });
    this.box.append(label);
    this.second = new ol.Map({ target: this.box, view: this.lining.map.getView(), layers: this.layers, controls: [] });
  }

  slide(share) {
    this.share = share;
    this.slider.value = share;
    this.line.style.left = `${100 * share}%`;
    this.lining.map.render();
  }
}

/** Clip a layer to the right of the swipe. */
function clip(event, map, share) {
  const { context } = event;
  const [width, height] = map.getSize();
  const corners = [[width * share, 0], [width, 0], [width, height], [width * share, height]];
  context.save();
  context.beginPath();
  corners.map((corner) => ol.render.getRenderPixel(event, corner)).forEach(([x, y], n) => (n ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.closePath();
  context.clip();
}

/** The unrolled lining as a map. */

import { get, surveyPath } from './api.js';
import { ClockScale, drawAxes, positionText } from './axis.js';
import { Comparison } from './compare.js';
import { debounce, el } from './dom.js';
import { findingsLayer, geometryOf, hatchLayer, highlightLayer, imageLayer, ratingLayer, recordedLayer } from './layers.js';
import { MAX_ZOOM, MIN_ZOOM, projection, resolutionAt, surveyExtent, zoomAt } from './plane.js';

const { ol } = globalThis;

/** Time after which the rest of a page does not wait for the picture, ms. */
const PICTURE_WAIT = 2000;

/** Map of a survey's lining. */
export class Lining {
  /**
   * @param {HTMLElement} root
   * @param {Object} on - moved(view), picked(id), failed(text).
   */
  constructor(root, on) {
    this.on = on;
    this.survey = null;
    this.kind = null;
    this.shown = { findings: true, dry: false, removed: false, waits: new Map() };
    this.version = Date.now();
    this.picking = true;
    this.box = el('div', { id: 'map', class: 'map', tabindex: '0', role: 'application', 'aria-label': 'Lining: arrow keys move, + and - zoom, Enter opens the finding in the middle' });
    this.axes = el('canvas', { class: 'axes', 'aria-hidden': 'true' });
    this.position = el('output', { class: 'position', 'aria-label': 'Position' });
    this.legend = el('span', { class: 'legend' });
    this.scale = el('span', { class: 'scale-box' });
    this.comparison = new Comparison(this);
    this.tools = el('div', { class: 'tools', role: 'toolbar', 'aria-label': 'Tools of the lining' });
    const first = el('div', { class: 'first' }, this.box, this.axes, this.comparison.line, this.comparison.names, this.comparison.slider);
    root.replaceChildren(this.tools, el('div', { class: 'maps' }, first, this.comparison.box), el('div', { class: 'readout' }, this.position, this.legend, this.scale));
    this.highlight = highlightLayer();
    this.recorded = recordedLayer();
    this.rated = ratingLayer();
    this.map = this.build();
  }

  build() {
    const map = new ol.Map({
      target: this.box,
      layers: [this.rated, this.recorded, this.highlight],
      controls: [
        new ol.control.Zoom({ zoomInTipLabel: 'Zoom in', zoomOutTipLabel: 'Zoom out' }),
        new ol.control.ScaleLine({ target: this.scale, units: 'metric', minWidth: 80 }),
      ],
      interactions: ol.interaction.defaults.defaults({ altShiftDragRotate: false, pinchRotate: false }),
      view: new ol.View({ projection, center: [0, 0], zoom: 18, minZoom: MIN_ZOOM, maxZoom: MAX_ZOOM, enableRotation: false }),
    });
    for (const control of this.box.querySelectorAll('.ol-zoom button')) control.setAttribute('aria-label', control.title);
    map.on('moveend', () => this.moved());
    map.on('change:size', () => this.atBeginning && this.showBeginning());
    for (const name of ['pointerdown', 'wheel', 'keydown']) this.box.addEventListener(name, () => { this.atBeginning = false; }, { passive: true });
    map.on('postrender', () => this.paintAxes());
    map.on('pointermove', (event) => {
      this.position.textContent = positionText(event.coordinate, this.clocks);
      if (this.picking && !event.dragging) this.box.style.cursor = this.idAt(event.pixel) === null ? '' : 'pointer';
    });
    map.on('singleclick', (event) => {
      const id = this.picking ? this.idAt(event.pixel) : null;
      if (id !== null) this.on.picked(id);
    });
    this.box.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter' || !this.picking) return;
      const id = this.idAt(map.getPixelFromCoordinate(map.getView().getCenter()), 40);
      if (id === null) this.on.failed('There is no finding in the middle of the map.');
      else this.on.picked(id);
    });
    return map;
  }

  /** Show a survey, at its beginning unless a view is given. */
  setSurvey(survey, kind, view) {
    this.survey = survey;
    this.ribbon = null;
    this.clocks = null;
    this.kind = survey.kinds.some((other) => other.kind === kind) ? kind : this.firstKind();
    const limits = ol.extent.buffer(surveyExtent(survey), Math.max(10, 0.02 * (survey.to - survey.from)));
    const old = this.map.getView();
    this.map.setView(new ol.View({
      projection, center: old.getCenter(), zoom: old.getZoom(), minZoom: MIN_ZOOM, maxZoom: MAX_ZOOM, enableRotation: false,
      extent: limits, constrainOnlyCenter: true, smoothExtentConstraint: false,
    }));
    this.comparison.survey = null;
    this.rebuild();
    if (view) this.goTo(view.x, view.y, view.z);
    else this.showBeginning();
    // What takes longer follows the picture: a session has few connections.
    this.drawn = this.pictured().then(() => this.readClocks(survey));
  }

  /** Show the beginning in full height, again whenever the map changes its size, until the user goes elsewhere. */
  showBeginning() {
    this.fitHeight(this.survey.from);
    this.atBeginning = true;
  }

  /** Wait until the map has its tiles, or for PICTURE_WAIT. */
  pictured() {
    return new Promise((resolve) => {
      this.map.once('loadend', resolve);
      setTimeout(resolve, PICTURE_WAIT);
    });
  }

  /** Show another image. */
  setKind(kind) {
    this.kind = kind;
    this.rebuild();
    this.moved();
  }

  /** Read the findings again. */
  refresh() {
    this.version += 1;
    this.rebuild();
  }

  /** Draw the findings again after a switch. */
  restyle() {
    this.findings?.changed();
    this.comparison.layers.forEach((layer) => layer.changed());
  }

  rebuild() {
    const { map, survey } = this;
    map.getLayers().getArray().filter((layer) => layer.get('own')).forEach((layer) => map.removeLayer(layer));
    this.findings = findingsLayer(survey, this.shown, this.version);
    const image = this.kind ? [imageLayer(survey, this.kind)] : [];
    [hatchLayer(survey), ...image, this.findings].forEach((layer, n) => {
      layer.set('own', true);
      layer.setZIndex(n);
      map.addLayer(layer);
    });
    this.comparison.rebuild();
  }

  /** Return the view: x, y, z. */
  get view() {
    const view = this.map.getView();
    const [x, y] = view.getCenter();
    return { x, y, z: view.getZoom() };
  }

  /** Return the extent in view: chainage from, arc from, chainage to, arc to. */
  get extent() {
    return this.map.getView().calculateExtent(this.map.getSize());
  }

  /** Go to a place, and keep the zoom unless it is given. */
  goTo(x, y = null, z = null) {
    this.atBeginning = false;
    const view = this.map.getView();
    if (z !== null) view.setZoom(z);
    view.setCenter([x, y ?? view.getCenter()[1]]);
  }

  /** Fit the height of the lining, with a chainage at the left edge, or the present middle. */
  fitHeight(from = null) {
    const [width, height] = this.map.getSize() ?? [800, 500];
    const { arc_from: low, arc_to: high } = this.survey;
    const resolution = Math.max(((high - low) * 1.12) / height, resolutionAt(MAX_ZOOM));
    const x = from === null ? this.view.x : from + 0.46 * width * resolution;
    this.goTo(x, (low + high) / 2, zoomAt(resolution));
  }

  /** Fit the whole survey. */
  fitAll() {
    this.atBeginning = false;
    this.map.getView().fit(surveyExtent(this.survey), { padding: [20, 20, 20, 20] });
  }

  /** Go to a finding, and zoom so that it is seen well. */
  fitFinding({ chainage_from: from, chainage_to: to, arc_from: low, arc_to: high }) {
    const [width, height] = this.map.getSize() ?? [800, 500];
    const resolution = Math.max((4 * Math.max(to - from, 0.4)) / width, (3 * Math.max(high - low, 0.4)) / height, resolutionAt(MAX_ZOOM - 0.3));
    const { arc_from: first, arc_to: last } = this.survey;
    const half = Math.min((height * resolution) / 2, (last - first) / 2) - 40 * resolution;
    this.goTo((from + to) / 2, Math.min(Math.max((low + high) / 2, first + half), last - half), zoomAt(resolution));
  }

  /** Show rated elements; null shows none. */
  showRating(rating) {
    const source = this.rated.getSource();
    source.clear();
    if (!rating) return;
    source.addFeatures(rating.elements.flatMap((element) => element.boxes.map((box) => new ol.Feature({
      geometry: ol.geom.Polygon.fromExtent(box), element, levels: rating.levels,
    }))));
  }

  /** Go to an element, fit it, and mark it. */
  showElement({ boxes }) {
    const source = this.highlight.getSource();
    source.clear();
    source.addFeatures(boxes.map((box) => new ol.Feature(ol.geom.Polygon.fromExtent(box))));
    const [from, low, to, high] = boxes.reduce((whole, box) => ol.extent.extend(whole, box), ol.extent.createEmpty());
    const [width, height] = this.map.getSize() ?? [800, 500];
    const resolution = Math.max((1.3 * (to - from)) / width, (1.2 * (high - low)) / height, resolutionAt(MAX_ZOOM - 0.3));
    this.goTo((from + to) / 2, (low + high) / 2, zoomAt(resolution));
  }

  /** Mark the finding that the panel shows; null marks none. */
  mark(finding) {
    const source = this.highlight.getSource();
    source.clear();
    if (!finding) return;
    const middle = [(finding.chainage_from + finding.chainage_to) / 2, (finding.arc_from + finding.arc_to) / 2];
    source.addFeature(new ol.Feature(geometryOf(finding.outline) ?? new ol.geom.Point(middle)));
  }

  /** Show what the database does not have yet: verdicts by finding, and drawn findings. */
  showRecorded(waits, drawn) {
    this.shown.waits = waits;
    const source = this.recorded.getSource();
    source.clear();
    source.addFeatures(drawn.map(({ id, geometry }) => {
      const feature = new ol.Feature(geometryOf(geometry));
      feature.setId(id);
      return feature;
    }));
    this.restyle();
  }

  /** Use the ribbon's data for the band of what was inspected. */
  setRibbon(ribbon) {
    this.ribbon = ribbon;
    this.map.render();
  }

  idAt(pixel, hitTolerance = 5) {
    let found = null;
    this.map.forEachFeatureAtPixel(pixel, (feature, layer) => {
      if ((layer !== this.findings && layer !== this.recorded) || found !== null) return;
      found = feature.get('id') ?? feature.getId() ?? null;
    }, { hitTolerance });
    return found === null ? null : Number(found);
  }

  moved = debounce(() => {
    if (!this.survey || !this.map.getSize()) return;
    if (!this.box.matches(':hover') || !matchMedia('(hover: hover)').matches) this.position.textContent = positionText([this.view.x, this.view.y], this.clocks);
    this.on.moved(this.view, this.extent);
  }, 60);

  paintAxes() {
    if (this.survey && this.map.getSize()) drawAxes(this.axes, this.extent, this.survey, this.ribbon, this.clocks);
  }

  firstKind() {
    const kinds = this.survey.kinds.map((other) => other.kind);
    return ['corrected', 'raw'].find((kind) => kinds.includes(kind)) ?? kinds[0] ?? null;
  }

  /** Read one section for the clock positions; without it, positions are stated by arc only. */
  async readClocks(survey) {
    try {
      const section = await get(surveyPath(survey.name, `/section?chainage=${(survey.from + survey.to) / 2}`));
      if (this.survey !== survey || section.curve.length < 3) return;
      this.clocks = new ClockScale(section.curve);
      this.map.render();
    } catch {
      this.clocks = null;
    }
  }
}

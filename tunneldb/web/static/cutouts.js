/** Pictures around a finding: corrected, colour, raw and offset, side by side. */

import { el, fitCanvas } from './dom.js';
import { colourOf } from './layers.js';
import { imageAddress, MAX_TILE_ZOOM, MIN_ZOOM, ORIGIN, resolutionAt, surveyExtent, TILE, zoomAt } from './plane.js';

const WANTED = ['corrected', 'rgb', 'raw', 'offset'];
const KEPT = 300;
const MARGIN = 0.6;
const MIN_SIZE = 1.6;
const ZOOMS = [0.1, 8];

const cache = new Map();

/** Row of pictures. */
export class Cutouts {
  constructor() {
    this.zoom = 1;
    this.outlined = true;
    this.views = [];
    this.root = el('div', { class: 'cutouts' });
    this.observer = new ResizeObserver(() => this.draw());
  }

  /** Use the images of a survey. */
  setSurvey(survey) {
    this.survey = survey;
    this.kinds = new Map(survey.finding_kinds.map((kind) => [kind.code, kind]));
    const named = WANTED.map((name) => survey.kinds.find((kind) => kind.kind === name)).filter(Boolean);
    this.observer.disconnect();
    this.views = named.map((kind) => ({ kind, canvas: el('canvas', { role: 'img' }) }));
    this.root.replaceChildren(...this.views.map(({ kind, canvas }) => el('figure', {}, canvas, el('figcaption', { text: kind.label }))));
    if (!named.length) this.root.append(el('p', { class: 'muted', text: 'This survey has no image.' }));
    this.views.forEach(({ canvas }) => this.observer.observe(canvas));
  }

  /** Show a finding; null shows none. */
  show(finding) {
    this.finding = finding;
    this.root.hidden = !finding;
    this.draw();
  }

  /** Show more or less of the surroundings. */
  zoomBy(factor) {
    this.zoom = Math.min(Math.max(this.zoom * factor, ZOOMS[0]), ZOOMS[1]);
    this.draw();
  }

  /** Draw the outlines, or not. */
  showOutlines(on) {
    this.outlined = on;
    this.draw();
  }

  /** Load the images of findings that come next. */
  prepare(findings) {
    for (const finding of findings) {
      for (const { kind, canvas } of this.views) {
        if (canvas.clientWidth > 1) tilesOf(this.survey, kind.kind, this.frame(finding, canvas)).forEach(({ address }) => load(address));
      }
    }
  }

  draw() {
    if (!this.finding || !this.survey) return;
    for (const { kind, canvas } of this.views) {
      if (canvas.clientWidth > 1) this.paint(kind, canvas, this.finding);
    }
  }

  paint(kind, canvas, finding) {
    canvas.setAttribute('aria-label', `${kind.label} around finding ${finding.id}`);
    const { context, width, height } = fitCanvas(canvas);
    const frame = this.frame(finding, canvas);
    const tiles = tilesOf(this.survey, kind.kind, frame);
    const paint = () => {
      if (this.finding !== finding) return;
      context.fillStyle = '#e9edf0';
      context.fillRect(0, 0, width, height);
      context.imageSmoothingEnabled = false;
      for (const tile of tiles) {
        const image = cache.get(tile.address);
        if (!image?.ready) continue;
        const scale = width / (frame.right - frame.left);
        const size = TILE * resolutionAt(tile.z) * scale;
        context.drawImage(image, (tile.left - frame.left) * scale, (frame.top - tile.top) * scale, size, size);
      }
      if (this.outlined) this.outline(context, frame, width, finding);
    };
    paint();
    const loads = tiles.map(({ address }) => load(address)?.then(paint));
    Promise.all(loads).then(() => {
      if (this.finding !== finding || tiles.some(({ address }) => cache.get(address)?.ready)) return;
      context.fillStyle = '#55626e';
      context.font = '12px system-ui, sans-serif';
      context.fillText('no image here', 8, 18);
    });
  }

  outline(context, frame, width, finding) {
    const scale = width / (frame.right - frame.left);
    const place = ([x, y]) => [(x - frame.left) * scale, (frame.top - y) * scale];
    const path = new Path2D();
    for (const { points, closed } of linesOf(finding.outline)) {
      if (points.length === 1) {
        const [x, y] = place(points[0]);
        path.moveTo(x + 9, y);
        path.arc(x, y, 9, 0, 2 * Math.PI);
      }
      points.map(place).forEach(([x, y], n) => (n ? path.lineTo(x, y) : path.moveTo(x, y)));
      if (closed) path.closePath();
    }
    context.lineJoin = 'round';
    for (const [colour, thick] of [['rgba(255,255,255,.85)', 4], [colourOf(this.kinds.get(finding.kind), finding.review), 2]]) {
      context.strokeStyle = colour;
      context.lineWidth = thick;
      context.stroke(path);
    }
  }

  /** Return the extent of a picture, with the finding in its middle. */
  frame(finding, canvas) {
    const aspect = canvas.clientWidth / Math.max(canvas.clientHeight, 1);
    let width = finding.chainage_to - finding.chainage_from;
    let height = finding.arc_to - finding.arc_from;
    const margin = (MARGIN * Math.max(width, height, MIN_SIZE)) / this.zoom;
    width = Math.max(width + margin, MIN_SIZE / this.zoom);
    height = Math.max(height + margin, MIN_SIZE / this.zoom);
    [width, height] = [Math.max(width, height * aspect), Math.max(height, width / aspect)];
    const x = (finding.chainage_from + finding.chainage_to) / 2;
    const y = (finding.arc_from + finding.arc_to) / 2;
    return { left: x - width / 2, right: x + width / 2, bottom: y - height / 2, top: y + height / 2, pixels: canvas.clientWidth };
  }
}

/** Return the tiles of a frame, of the level whose pixels are just finer than those of the display. */
function tilesOf(survey, kind, frame) {
  const wanted = Math.ceil(zoomAt((frame.right - frame.left) / frame.pixels) - 0.3);
  const z = Math.min(Math.max(wanted, MIN_ZOOM), MAX_TILE_ZOOM);
  const size = TILE * resolutionAt(z);
  const [from, low, to, high] = surveyExtent(survey);
  const column = (x) => Math.floor((Math.min(Math.max(x, from), to) + ORIGIN) / size);
  const row = (y) => Math.floor((ORIGIN - Math.min(Math.max(y, low), high)) / size);
  const tiles = [];
  for (let x = column(frame.left); x <= column(frame.right); x += 1) {
    for (let y = row(frame.top); y <= row(frame.bottom); y += 1) {
      tiles.push({ z, left: x * size - ORIGIN, top: ORIGIN - y * size, address: imageAddress(survey.name, kind, z, x, y) });
    }
  }
  return tiles;
}

/** Load an image once; return a promise of it, or null if it is there. */
function load(address) {
  const known = cache.get(address);
  if (known) return known.ready ? null : known.done;
  const image = new Image();
  cache.set(address, image);
  image.done = new Promise((resolve) => {
    image.onload = () => {
      image.ready = true;
      resolve();
    };
    // Removed, so that the next picture asks the server again.
    image.onerror = () => {
      cache.delete(address);
      resolve();
    };
  });
  image.src = address;
  if (cache.size > KEPT) cache.delete(cache.keys().next().value);
  return image.done;
}

/** Return the lines of a GeoJSON geometry. */
function linesOf(geometry) {
  if (!geometry) return [];
  const { type, coordinates } = geometry;
  const ring = (points) => ({ points, closed: true });
  const line = (points) => ({ points, closed: false });
  const parts = {
    Point: () => [line([coordinates])], MultiPoint: () => coordinates.map((point) => line([point])),
    LineString: () => [line(coordinates)], MultiLineString: () => coordinates.map(line),
    Polygon: () => coordinates.map(ring), MultiPolygon: () => coordinates.flat().map(ring),
    GeometryCollection: () => geometry.geometries.flatMap(linesOf),
  };
  return parts[type]?.() ?? [];
}

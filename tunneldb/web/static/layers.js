/** Layers of the lining: image, findings, and a hatch where there is no image. */

import { levelColour } from './levels.js';
import { hatch } from './ribbon.js';
import { findingsAddress, imageAddress, MAX_TILE_ZOOM, MIN_ZOOM, projection, resolutionAt, surveyExtent, tileGridOf } from './plane.js';

const { ol } = globalThis;

export const REVIEW_COLOURS = { open: '#e67e00', confirmed: '#005caf', rejected: '#6e6e6e' };
export const DETECTED_DRY = ['joint', 'dark'];
const COUNTED = ['open', 'confirmed'];
const TALL = 4 * resolutionAt(MIN_ZOOM);
/** Height of an element on the screen from which it has a label, pixels. */
const LABEL_HEIGHT = 40;
const WHITE = 'rgba(255,255,255,.8)';

/** Return the layer of an image of a survey. */
export function imageLayer(survey, kind) {
  const source = new ol.source.XYZ({
    projection, tileGrid: tileGridOf(surveyExtent(survey)), url: imageAddress(survey.name, kind), wrapX: false, transition: 0, interpolate: false,
  });
  return new ol.layer.Tile({ source, extent: surveyExtent(survey), preload: 2, properties: { kind } });
}

/** Return the layer that shows where a survey has no image. */
export function hatchLayer(survey) {
  const tile = document.createElement('canvas');
  tile.width = 6;
  tile.height = 6;
  const context = tile.getContext('2d');
  hatch(context, 0, 0, 6, 6);
  const style = new ol.style.Style({ fill: new ol.style.Fill({ color: context.createPattern(tile, 'repeat') }), stroke: stroke('#8a6a3f', 1) });
  const feature = new ol.Feature(ol.geom.Polygon.fromExtent(surveyExtent(survey)));
  return new ol.layer.Vector({ source: new ol.source.Vector({ features: [feature] }), style });
}

/**
 * Return the layer of the findings of a survey.
 * @param {Object} survey
 * @param {Object} shown - switches: findings, dry, removed; and waits, verdicts that the database does not have yet.
 * @param {number} version - another one reads the tiles again.
 */
export function findingsLayer(survey, shown, version) {
  const kinds = new Map(survey.finding_kinds.map((kind) => [kind.code, kind]));
  // Of the tunnel alone, less than a pixel high from afar, OpenLayers would load no tile and cut the circles.
  const [from, low, to, high] = surveyExtent(survey);
  const source = new ol.source.VectorTile({
    format: new ol.format.MVT(), projection, tileGrid: tileGridOf([from, low - TALL, to, high + TALL]), wrapX: false,
    url: findingsAddress(survey.name, version), maxZoom: MAX_TILE_ZOOM,
  });
  return new ol.layer.VectorTile({ source, style: styler(kinds, shown), renderBuffer: 40 });
}

/** Return the colour of a finding: of its review if it is wet, of its kind otherwise. */
export function colourOf(kind, review) {
  if (review === 'rejected') return REVIEW_COLOURS.rejected;
  return kind?.wet ? REVIEW_COLOURS[review] ?? REVIEW_COLOURS.open : kind?.colour ?? '#e66ab1';
}

/** Return True if a finding is shown by the switches: findings, dry, removed. */
export function isShown(kind, state, shown) {
  return shown.findings && (COUNTED.includes(state) || shown.removed) && (!DETECTED_DRY.includes(kind) || shown.dry);
}

function styler(kinds, shown) {
  const styles = new Map();
  return (feature) => {
    // A verdict that the database does not have yet is shown as it will be.
    const waits = shown.waits.get(Number(feature.get('id') ?? feature.getId()));
    const kind = waits?.kind ?? feature.get('kind');
    const review = waits?.review ?? feature.get('review');
    const state = waits?.review ?? feature.get('state') ?? review;
    if (!isShown(kind, state, shown)) return null;
    const counted = COUNTED.includes(state);
    const many = Math.min(Math.ceil(Math.log2(feature.get('count') ?? 1)), 8);
    const type = feature.getType();
    const key = `${kind}|${review}|${counted}|${many}|${type}`;
    if (!styles.has(key)) styles.set(key, looks(colourOf(kinds.get(kind), review), counted, many, type));
    return styles.get(key);
  };
}

function looks(colour, counted, many, type) {
  const line = counted ? undefined : [4, 4];
  if (type.endsWith('Point')) {
    const image = new ol.style.Circle({ radius: 4 + 1.5 * many, fill: new ol.style.Fill({ color: counted ? colour : '#b9c0c7' }), stroke: stroke('#fff', 1.5) });
    return [new ol.style.Style({ image })];
  }
  const halo = new ol.style.Style({ stroke: stroke(WHITE, 4) });
  const main = new ol.style.Style({ stroke: stroke(colour, counted ? 2 : 1.2, line), fill: new ol.style.Fill({ color: `${colour}18` }) });
  return [halo, main];
}

function stroke(color, width, lineDash = undefined) {
  return new ol.style.Stroke({ color, width, lineDash, lineJoin: 'round' });
}

/** Return the layer of drawn findings that the database does not have yet. */
export function recordedLayer() {
  const style = [
    new ol.style.Style({ stroke: stroke('#fff', 4), image: new ol.style.Circle({ radius: 7, stroke: stroke('#fff', 4) }) }),
    new ol.style.Style({ stroke: stroke('#8e24aa', 2, [7, 5]), image: new ol.style.Circle({ radius: 7, stroke: stroke('#8e24aa', 2, [4, 3]) }) }),
  ];
  return new ol.layer.Vector({ source: new ol.source.Vector(), style, zIndex: 15 });
}

/** Return the layer of the finding that is shown in the panel. */
export function highlightLayer() {
  const style = [
    new ol.style.Style({
      stroke: stroke('#fff', 6),
      image: new ol.style.Circle({ radius: 11, stroke: stroke('#fff', 5) }),
    }),
    new ol.style.Style({
      stroke: stroke('#d0021b', 3),
      image: new ol.style.Circle({ radius: 11, stroke: stroke('#d0021b', 3) }),
    }),
  ];
  return new ol.layer.Vector({ source: new ol.source.Vector(), style, zIndex: 20 });
}

/** Return the layer of rated elements: features with element and levels. */
export function ratingLayer() {
  const styles = new Map();
  const style = (feature, resolution) => {
    const { element, levels } = feature.getProperties();
    const labelled = ol.extent.getHeight(feature.getGeometry().getExtent()) > LABEL_HEIGHT * resolution;
    const key = `${element.level}|${element.complete}|${levels}|${labelled && `${element.name}|${element.result_text}`}`;
    if (!styles.has(key)) styles.set(key, elementStyle(element, levels, labelled));
    return styles.get(key);
  };
  return new ol.layer.Vector({ source: new ol.source.Vector(), style, zIndex: 1.5, declutter: true });
}

function elementStyle(element, levels, labelled) {
  const colour = levelColour(element, levels) ?? '#8a6a3f';
  const plain = element.level !== null && element.complete;
  const fill = new ol.style.Fill({ color: plain ? levelColour(element, levels, 0.22) : stripes(levelColour(element, levels, 0.3)) });
  const text = labelled ? new ol.style.Text({
    text: `${element.name}: ${element.result_text}`, font: '600 12px system-ui, sans-serif', fill: new ol.style.Fill({ color: '#1d2730' }),
    backgroundFill: new ol.style.Fill({ color: 'rgba(255,255,255,.85)' }), padding: [2, 4, 1, 4],
  }) : undefined;
  return [new ol.style.Style({ stroke: stroke(WHITE, 4) }), new ol.style.Style({ fill, stroke: stroke(colour, 2), text })];
}

/** Return the pattern of a result that is a lower bound; without a colour, of what is not rated. */
function stripes(colour) {
  const tile = document.createElement('canvas');
  tile.width = 12;
  tile.height = 12;
  const c = tile.getContext('2d');
  c.fillStyle = colour ?? 'rgba(251,233,214,.35)';
  c.fillRect(0, 0, 12, 12);
  c.strokeStyle = colour ? 'rgba(255,255,255,.4)' : 'rgba(184,98,27,.6)';
  c.lineWidth = 1.5;
  c.beginPath();
  for (const shift of [-12, 0, 12]) {
    c.moveTo(shift - 2, 14);
    c.lineTo(shift + 14, -2);
  }
  c.stroke();
  return c.createPattern(tile, 'repeat');
}

/** Return the geometry of a finding's outline. */
export function geometryOf(outline) {
  return outline ? new ol.format.GeoJSON().readGeometry(outline) : null;
}

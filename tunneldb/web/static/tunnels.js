/** Map of all tunnels: their given axes, without a background. */

import { get } from './api.js';
import { button, el } from './dom.js';

const { ol } = globalThis;

/** Return the box of the map, which stays empty if no tunnel has a place on it; a tunnel is picked by a click. */
export function tunnelMap(picked) {
  const box = el('div', { class: 'tunnel-map', role: 'region', 'aria-label': 'Map of the tunnels', hidden: true });
  const note = el('p', { class: 'muted small', hidden: true });
  read(box, note, picked);
  return el('div', {}, box, note);
}

async function read(box, note, picked) {
  let tunnels;
  try {
    tunnels = await get('/api/tunnels');
  } catch (error) {
    note.hidden = false;
    note.textContent = `Map: ${error.message}`;
    return;
  }
  const placed = tunnels.filter(({ axis }) => axis);
  const local = tunnels.filter(({ axis }) => !axis).map(({ name }) => name);
  note.hidden = !local.length;
  note.textContent = `In local coordinates, not on the map: ${local.join(', ')}.`;
  if (!placed.length) return;
  box.hidden = false;
  draw(box, placed, picked);
}

function draw(box, tunnels, picked) {
  const format = new ol.format.GeoJSON({ featureProjection: 'EPSG:3857' });
  const features = tunnels.map(({ name, axis }) => {
    const feature = format.readFeature({ type: 'Feature', geometry: axis, properties: {} });
    feature.set('name', name);
    return feature;
  });
  const source = new ol.source.Vector({ features });
  const map = new ol.Map({
    target: box,
    layers: [
      new ol.layer.Graticule({ showLabels: true, wrapX: false, lonLabelPosition: 0.04, latLabelPosition: 0.94, strokeStyle: new ol.style.Stroke({ color: '#d9dfe4', width: 1 }), lonLabelStyle: label('#55626e'), latLabelStyle: label('#55626e') }),
      new ol.layer.Vector({ source, style, declutter: true }),
    ],
    controls: [new ol.control.Zoom({ zoomInTipLabel: 'Zoom in', zoomOutTipLabel: 'Zoom out' }), new ol.control.ScaleLine({ units: 'metric' })],
    view: new ol.View({ center: [0, 0], zoom: 2, maxZoom: 18 }),
  });
  for (const control of box.querySelectorAll('.ol-zoom button')) control.setAttribute('aria-label', control.title);
  const whole = () => map.getView().fit(source.getExtent(), { padding: [30, 60, 30, 60], maxZoom: 15 });
  box.append(el('div', { class: 'map-all' }, button('All tunnels', () => {
    picked('');
    whole();
  })));
  whole();
  map.on('singleclick', ({ pixel }) => {
    const name = map.forEachFeatureAtPixel(pixel, (feature) => feature.get('name'), { hitTolerance: 8 });
    if (name) picked(name);
  });
  map.on('pointermove', ({ pixel, dragging }) => {
    if (!dragging) box.style.cursor = map.hasFeatureAtPixel(pixel, { hitTolerance: 8 }) ? 'pointer' : '';
  });
}

/** A line, and a dot in its middle: from far away a tunnel is too short to be seen. */
function style(feature) {
  const middle = feature.getGeometry().getType() === 'LineString' ? new ol.geom.Point(feature.getGeometry().getCoordinateAt(0.5)) : undefined;
  return [
    new ol.style.Style({ stroke: new ol.style.Stroke({ color: '#14324a', width: 3 }) }),
    new ol.style.Style({
      geometry: middle,
      image: new ol.style.Circle({ radius: 5, fill: new ol.style.Fill({ color: '#e67e00' }), stroke: new ol.style.Stroke({ color: '#fff', width: 1.5 }) }),
      text: label('#1d2730', feature.get('name'), -14),
    }),
  ];
}

function label(colour, text = undefined, offsetY = 0) {
  return new ol.style.Text({ text, offsetY, font: '12px system-ui, sans-serif', fill: new ol.style.Fill({ color: colour }), stroke: new ol.style.Stroke({ color: '#fff', width: 3 }) });
}

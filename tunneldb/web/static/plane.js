/** The unrolled plane: x is the chainage, y the arc from the crown, both in m. */

import { station } from './format.js';

const { ol } = globalThis;

export const ORIGIN = 20037508.342789244;
export const TILE = 256;
export const MIN_ZOOM = 10;
export const MAX_TILE_ZOOM = 23;
export const MAX_ZOOM = 24;
const FIRST = (2 * ORIGIN) / TILE;

/** Return the size of a pixel at a zoom level, m. */
export const resolutionAt = (zoom) => FIRST / 2 ** zoom;

/** Return the zoom level of a pixel size, m. */
export const zoomAt = (resolution) => Math.log2(FIRST / resolution);

export const projection = new ol.proj.Projection({
  code: 'UNROLLED', units: 'm', extent: [-ORIGIN, -ORIGIN, ORIGIN, ORIGIN], global: false,
  getPointResolution: (resolution) => resolution,
});
ol.proj.addProjection(projection);

/** Return the grid of the tiles of an extent. */
export function tileGridOf(extent) {
  return new ol.tilegrid.TileGrid({
    extent, origin: [-ORIGIN, ORIGIN], tileSize: TILE, minZoom: MIN_ZOOM,
    resolutions: Array.from({ length: MAX_TILE_ZOOM + 1 }, (_, zoom) => resolutionAt(zoom)),
  });
}

/** Return the address of image tiles, or of one tile. */
export function imageAddress(survey, kind, z = '{z}', x = '{x}', y = '{y}') {
  return `/tiles/${encodeURIComponent(survey)}/${encodeURIComponent(kind)}/${z}/${x}/${y}.png`;
}

/** Return the address of tiles of findings; a new version is read again. */
export function findingsAddress(survey, version) {
  return `/tiles/${encodeURIComponent(survey)}/findings/{z}/{x}/{y}.mvt?v=${version}`;
}

/** Return the extent of a survey's lining, m. */
export function surveyExtent(survey) {
  return [survey.from, survey.arc_from, survey.to, survey.arc_to];
}

/** Return a place as text. */
export function placeText([x, y]) {
  const side = Math.abs(y) < 0.005 ? 'at the crown' : `${Math.abs(y).toFixed(2)} m ${y > 0 ? 'right' : 'left'} of the crown`;
  return `${station(x, 2)}, ${side}`;
}

/** Return the extent of a GeoJSON geometry. */
export function geometryExtent(geometry) {
  return new ol.format.GeoJSON().readGeometry(geometry).getExtent();
}

/** Sketch on the map: draw or change a geometry, with pointer or keyboard. */

import { geometryOf, highlightLayer } from './layers.js';

const { ol } = globalThis;
const TYPES = { polygon: 'Polygon', line: 'LineString', point: 'Point' };

/** Drawing in the map of a lining; one geometry at a time. */
export class Sketch {
  /**
   * @param {Lining} lining
   * @param {function} changed - is called when the geometry is complete or has changed.
   */
  constructor(lining, changed) {
    this.lining = lining;
    this.changed = changed;
    this.layer = highlightLayer();
    this.source = this.layer.getSource();
    this.interactions = [];
    lining.map.addLayer(this.layer);
  }

  /** Begin to draw a polygon, a line or a point. */
  draw(shape) {
    this.stop();
    this.shape = shape;
    const map = this.begin();
    this.pen = new ol.interaction.Draw({ source: this.source, type: TYPES[shape], stopClick: true });
    this.pen.on('drawstart', () => this.source.clear());
    this.pen.on('drawend', () => setTimeout(() => {
      this.stopDrawing();
      this.modify();
      this.changed();
    }));
    map.addInteraction(this.pen);
    this.interactions.push(this.pen);
  }

  /** Change an outline. */
  edit(outline) {
    this.stop();
    this.begin();
    this.source.addFeature(new ol.Feature(geometryOf(outline)));
    this.modify();
    this.changed();
  }

  /** Add a point in the middle of the map: drawing by keyboard. */
  addMiddle() {
    const place = this.lining.map.getView().getCenter();
    if (!this.pen) return;
    if (this.shape === 'point') {
      this.source.clear();
      this.source.addFeature(new ol.Feature(new ol.geom.Point(place)));
      this.stopDrawing();
      this.modify();
      this.changed();
      return;
    }
    this.pen.appendCoordinates([place]);
  }

  /** Complete what is being drawn. */
  finish() {
    this.pen?.finishDrawing();
  }

  /** Return the geometry as GeoJSON, or null. */
  get geometry() {
    const feature = this.source.getFeatures()[0];
    return feature ? new ol.format.GeoJSON().writeGeometryObject(feature.getGeometry(), { decimals: 4 }) : null;
  }

  /** Remove the sketch, and give clicks back to the map. */
  stop() {
    this.stopDrawing();
    this.source.clear();
    this.lining.picking = true;
  }

  begin() {
    this.lining.picking = false;
    return this.lining.map;
  }

  modify() {
    const { map } = this.lining;
    const modify = new ol.interaction.Modify({ source: this.source, pixelTolerance: 14 });
    const snap = new ol.interaction.Snap({ source: this.source });
    modify.on('modifyend', () => this.changed());
    for (const interaction of [modify, snap]) {
      map.addInteraction(interaction);
      this.interactions.push(interaction);
    }
  }

  stopDrawing() {
    this.interactions.forEach((interaction) => this.lining.map.removeInteraction(interaction));
    this.interactions = [];
    this.pen = null;
  }
}

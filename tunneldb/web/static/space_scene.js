/** Points and findings in space, drawn by three.js; loaded only when the 3D view opens. */

import * as three from './vendor/three/three.js';

const BACK = '#222d36';
const CLEAR = 3;
const FOG = 1.5;
const ANGLE = 65;
const WIDEST = 100;
const MARKED = '#d0021b';
const WIDTH = 3;
const MARKED_WIDTH = 6;
const LOOK = 0.6;
const CROSS = 0.06;
const CLICK = 5;
const REACH = 8;
const TOUCH_REACH = 18;

three.ColorManagement.enabled = false;

/** Canvas with the points of a stretch. */
export class SpaceScene {
  /**
   * @param {HTMLElement} box
   * @param {Object} on - moved(), picked(id), walked(metres), lost().
   */
  constructor(box, on) {
    this.box = box;
    this.on = on;
    this.stretch = null;
    this.inside = true;
    this.renderer = new three.WebGLRenderer({ antialias: true });
    this.renderer.outputColorSpace = three.LinearSRGBColorSpace;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new three.Scene();
    // Distance darkens: without it a lining of one colour has no shape.
    this.scene.fog = new three.Fog(BACK, CLEAR, CLEAR + 1);
    this.renderer.setClearColor(BACK);
    this.camera = new three.PerspectiveCamera(ANGLE, 1, 0.05, 500);
    this.camera.up.set(0, 0, 1);
    this.controls = new three.OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener('change', () => this.moved());
    this.points = null;
    this.outlines = [];
    this.size = 0.1;
    this.listen();
    box.append(this.canvas);
    this.watch = new ResizeObserver(() => this.fit());
    this.watch.observe(box);
  }

  get canvas() {
    return this.renderer.domElement;
  }

  listen() {
    const { canvas } = this;
    let down = null;
    canvas.addEventListener('pointerdown', (event) => { down = event; });
    canvas.addEventListener('click', (event) => {
      if (!down || Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) > CLICK) return;
      const id = this.idAt(event.offsetX, event.offsetY, down.pointerType === 'mouse' ? REACH : TOUCH_REACH);
      if (id !== null) this.on.picked(id);
    });
    canvas.addEventListener('wheel', (event) => this.inside && this.on.walked(event.deltaY < 0 ? 1 : -1), { passive: true });
    canvas.addEventListener('webglcontextlost', () => this.on.lost());
  }

  /** Show the points of a stretch; the camera stays where it is in the tunnel if a stretch was shown. */
  show(stretch, kind) {
    const former = this.stretch;
    this.stretch = stretch;
    if (former) this.shift(former.origin);
    this.drop(this.points);
    const geometry = new three.BufferGeometry();
    geometry.setAttribute('position', new three.BufferAttribute(stretch.values.xyz, 3));
    this.points = new three.Points(geometry, new three.PointsMaterial({ size: this.size, vertexColors: true }));
    this.scene.add(this.points);
    this.colour(kind);
  }

  /** Keep the place of the camera, whose coordinates were seen from another origin. */
  shift(origin) {
    const way = new three.Vector3(...origin.map((value, n) => value - this.stretch.origin[n]));
    this.camera.position.add(way);
    this.controls.target.add(way);
    this.controls.update();
  }

  /** Colour the points. */
  colour(kind) {
    this.points.geometry.setAttribute('color', new three.BufferAttribute(this.stretch.colour(kind), 3, true));
    this.render();
  }

  /** Change the size of the points, m. */
  setSize(size) {
    this.size = size;
    if (!this.points) return;
    this.points.material.size = size;
    this.render();
  }

  /**
   * Show outlines of findings.
   * @param {Object[]} findings - id, lines (m, as in the database) and colour.
   */
  setOutlines(findings) {
    this.outlines.forEach(({ mesh }) => this.drop(mesh));
    const { origin } = this.stretch;
    this.outlines = findings.map(({ id, lines, colour }) => {
      const local = lines.map((line) => line.map((place) => place.map((value, n) => value - origin[n])));
      const segments = local.flatMap((line) => (line.length > 1 ? pairs(line) : cross(line[0])));
      const geometry = new three.LineSegmentsGeometry();
      geometry.setPositions(segments.flat(2));
      const mesh = new three.LineSegments2(geometry, new three.LineMaterial({ color: colour, linewidth: WIDTH, depthTest: false }));
      mesh.renderOrder = 1;
      this.scene.add(mesh);
      return { id, colour, segments, mesh };
    });
    this.mark(this.marked);
  }

  /** Mark the finding that the panel shows. */
  mark(id) {
    this.marked = id;
    for (const { id: other, colour, mesh } of this.outlines) {
      mesh.material.color.set(other === id ? MARKED : colour);
      mesh.material.linewidth = other === id ? MARKED_WIDTH : WIDTH;
      mesh.renderOrder = other === id ? 2 : 1;
    }
    this.render();
  }

  /** Return the finding whose outline is drawn at a place of the canvas, or around it; the nearest to the eye if there are several. */
  idAt(x, y, reach) {
    let best = [Infinity, null];
    for (const { id, segments } of this.outlines) {
      const drawn = segments.map(([a, b]) => [this.project(a), this.project(b)]).filter(([a, b]) => a.depth > 0 && b.depth > 0);
      if (!drawn.some(([a, b]) => distance(x, y, a, b) <= reach) && !surrounds(x, y, drawn)) continue;
      const depth = drawn.reduce((sum, [a]) => sum + a.depth, 0) / drawn.length;
      if (depth < best[0]) best = [depth, id];
    }
    return best[1];
  }

  /** Return where a place is drawn: x and y in the canvas, and its distance before the eye, m. */
  project(place) {
    const seen = new three.Vector3(...place).applyMatrix4(this.camera.matrixWorldInverse);
    const depth = -seen.z;
    seen.applyMatrix4(this.camera.projectionMatrix);
    return { x: ((seen.x + 1) / 2) * this.canvas.clientWidth, y: ((1 - seen.y) / 2) * this.canvas.clientHeight, depth };
  }

  /** Look along the tunnel from a chainage. */
  viewInside(chainage) {
    this.look(true, this.stretch.at(chainage), this.stretch.at(chainage + LOOK));
  }

  /** Look at the stretch from beside it. */
  viewOutside() {
    const { from, to } = this.stretch;
    const [first, middle, last] = [from, (from + to) / 2, to].map((chainage) => new three.Vector3(...this.stretch.at(chainage)));
    const along = last.clone().sub(first);
    const side = new three.Vector3(along.y, -along.x, 0).normalize();
    const eye = middle.clone().addScaledVector(side, 6 + 0.55 * along.length());
    eye.z += 4 + 0.2 * along.length();
    this.look(false, eye.toArray(), middle.toArray());
  }

  look(inside, eye, target) {
    this.inside = inside;
    const away = this.controls.target.set(...target).distanceTo(this.camera.position.set(...eye));
    this.scene.fog.near = inside ? CLEAR : away;
    this.scene.fog.far = this.scene.fog.near + FOG * (this.stretch.to - this.stretch.from);
    this.controls.enableZoom = !inside;
    this.controls.rotateSpeed = inside ? -0.4 : 1;
    this.controls.minDistance = inside ? 0 : 1;
    this.controls.update();
    this.moved();
  }

  /** Return the chainage where the camera is, or of what it looks at from outside. */
  get chainage() {
    return this.stretch.chainageOf((this.inside ? this.camera.position : this.controls.target).toArray());
  }

  /** Move along the tunnel, and turn with it. */
  walk(metres) {
    const here = this.chainage;
    const [from, ahead, to, further] = [here, here + LOOK, here + metres, here + metres + LOOK].map((chainage) => new three.Vector3(...this.stretch.at(chainage)));
    const turn = heading(to, further) - heading(from, ahead);
    const axis = new three.Vector3(0, 0, 1);
    for (const place of [this.camera.position, this.controls.target]) place.sub(from).applyAxisAngle(axis, turn).add(to);
    this.controls.update();
    this.moved();
  }

  moved() {
    this.render();
    if (this.stretch) this.on.moved();
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    // A narrow screen shows as many degrees from left to right as a wide one from top to bottom, up to a limit.
    const half = Math.tan((ANGLE * Math.PI) / 360) / Math.min(this.camera.aspect, 1);
    this.camera.fov = Math.min((Math.atan(half) * 360) / Math.PI, WIDEST);
    this.camera.updateProjectionMatrix();
    this.render();
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }

  drop(object) {
    if (!object) return;
    this.scene.remove(object);
    object.geometry.dispose();
    object.material.dispose();
  }

  /** Give back the memory of the graphics. */
  dispose() {
    this.watch.disconnect();
    this.controls.dispose();
    this.drop(this.points);
    this.outlines.forEach(({ mesh }) => this.drop(mesh));
    this.on.lost = () => {};
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.canvas.remove();
  }
}

function pairs(line) {
  return line.slice(1).map((place, n) => [line[n], place]);
}

function cross(place) {
  return [0, 1, 2].map((axis) => [-CROSS, CROSS].map((way) => place.map((value, n) => value + (n === axis ? way : 0))));
}

function heading(from, to) {
  return Math.atan2(to.y - from.y, to.x - from.x);
}

function distance(x, y, a, b) {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const share = Math.min(Math.max(((x - a.x) * dx + (y - a.y) * dy) / (dx * dx + dy * dy || 1), 0), 1);
  return Math.hypot(x - a.x - share * dx, y - a.y - share * dy);
}

/** Return True if a place is within the outline that some segments make. */
function surrounds(x, y, segments) {
  const crossed = segments.filter(([a, b]) => a.y > y !== b.y > y && x < a.x + ((y - a.y) / (b.y - a.y)) * (b.x - a.x));
  return crossed.length % 2 === 1;
}

/** Take a stretch offline: what has to be read, and reading it. */

import { ApiError, findingPath, surveyPath } from './api.js';
import { shellName, stretchName, writeFacts } from './held.js';
import { imageAddress, MAX_TILE_ZOOM, MIN_ZOOM, ORIGIN, resolutionAt, TILE, zoomAt } from './plane.js';

/** Longest stretch, m. */
export const MAX_LENGTH = 500;

/** Width of the narrowest screen: from the zoom that shows the whole stretch on it, px. */
const SCREEN = 390;
const READERS = 3;
const SAMPLES = 3;
const SMALL = 2000;
const LIMIT = 60000;
const LAZY = ['offline.js', 'take.js'];

/** Return the tiles of a stretch, from the whole of it to single pixels. */
export function tilesOf(survey, from, to) {
  const first = Math.min(Math.max(Math.floor(zoomAt((to - from) / SCREEN)), MIN_ZOOM), MAX_TILE_ZOOM);
  const tiles = [];
  for (let z = first; z <= MAX_TILE_ZOOM; z += 1) {
    const size = TILE * resolutionAt(z);
    const [left, right] = [from, to].map((x) => Math.floor((x + ORIGIN) / size));
    const [top, bottom] = [survey.arc_to, survey.arc_from].map((y) => Math.floor((ORIGIN - y) / size));
    for (let x = left; x <= right; x += 1) for (let y = top; y <= bottom; y += 1) tiles.push([z, x, y]);
  }
  return tiles;
}

/** Return the addresses that a stretch needs before its findings are known. */
function addressesOf(survey, { from, to, kinds }) {
  const tiles = tilesOf(survey, from, to);
  const of = (rest) => surveyPath(survey.name, rest);
  const section = (x) => of(`/section?chainage=${x}`);
  return [
    of(''), '/api/surveys', '/api/tunnels', of('/summary'), of('/ribbon'), ...kinds.map((kind) => of(`/colours/${kind}`)),
    section((survey.from + survey.to) / 2), section(((from + to) / 2).toFixed(3)),
    ...tiles.map(([z, x, y]) => `/tiles/${encodeURIComponent(survey.name)}/findings/${z}/${x}/${y}.mvt`),
    ...kinds.flatMap((kind) => tiles.map((tile) => imageAddress(survey.name, kind, ...tile))),
  ];
}

/** Return the number of tiles of a stretch, and about how many bytes they have, from a few of them. */
export async function estimate(survey, stretch) {
  const tiles = tilesOf(survey, stretch.from, stretch.to);
  const near = tiles.filter(([z]) => z === MAX_TILE_ZOOM);
  let bytes = 0;
  for (const kind of stretch.kinds) {
    const sample = Array.from({ length: SAMPLES }, (_, n) => near[Math.floor(((n + 0.5) / SAMPLES) * near.length)]);
    const sizes = await Promise.all(sample.map(async (tile) => (await read(imageAddress(survey.name, kind, ...tile))).size));
    bytes += (sizes.reduce((sum, size) => sum + size, 0) / SAMPLES) * tiles.length;
  }
  return { tiles: tiles.length * stretch.kinds.length, bytes: bytes + SMALL * tiles.length };
}

/** Reading of a stretch; what is there already is not read again. */
export class Take {
  /**
   * @param {string} user
   * @param {Object} survey
   * @param {Object} facts - of the stretch: survey, from, to, kinds, at (when it was begun, ms).
   * @param {function(Object)} onProgress - is called with the facts.
   */
  constructor(user, survey, facts, onProgress) {
    Object.assign(this, { user, survey, onProgress });
    this.facts = { done: 0, total: 0, bytes: 0, ...facts, complete: false };
    this.stopper = new AbortController();
  }

  /** Stop; what was read stays. */
  cancel() {
    this.stopper.abort();
  }

  /**
   * Read everything.
   * @throws {ApiError|DOMException} The server or the device refuses.
   */
  async run() {
    const { user, survey, facts } = this;
    this.cache = await caches.open(stretchName(user, facts.at));
    this.there = new Set((await this.cache.keys()).map(({ url }) => url));
    this.left = [...addressesOf(survey, facts), this.list];
    facts.total = this.left.length;
    try {
      await writeFacts(user, facts);
      const findings = await this.listed();
      this.left.push(...findings);
      facts.total += findings.length;
      facts.done = facts.total - this.left.filter((path) => !this.has(path)).length;
      const photos = findings.filter((path) => this.has(path));
      await Promise.all(Array.from({ length: READERS }, () => this.reader()));
      for (const path of photos) await this.photosOf(await (await this.cache.match(path)).json());
      await this.reader();
      facts.complete = true;
    } finally {
      await writeFacts(user, facts).catch(() => {});
      this.onProgress(facts);
    }
  }

  /** Address of the list of the findings of the stretch, without its query: the worker selects from it. */
  get list() {
    return surveyPath(this.survey.name, '/worklist');
  }

  has(path) {
    return this.there.has(new URL(path, location.href).href);
  }

  async listed() {
    const { from, to } = this.facts;
    const body = await read(`${this.list}?${new URLSearchParams({ from, to })}`, this.stopper.signal);
    await this.put(this.list, body);
    return JSON.parse(await body.text()).map(({ id }) => findingPath(id));
  }

  async reader() {
    for (let path; (path = this.left.shift()) !== undefined;) {
      if (!this.has(path)) await this.take(path);
    }
  }

  async take(path) {
    const { facts } = this;
    let body;
    try {
      body = await read(path, this.stopper.signal);
    } catch (error) {
      // A finding may have been merged in the meantime, and no section may be near.
      if (error.status !== 404) throw this.stop(error);
    }
    if (body) {
      await this.put(path, body);
      if (path.startsWith('/api/findings/')) await this.photosOf(JSON.parse(await body.text()));
    }
    facts.done += 1;
    if (facts.done % 20 === 0) this.onProgress(facts);
  }

  /** Add the small pictures of a finding's photos to what is read. */
  photosOf({ photos }) {
    const paths = photos.filter(({ stored }) => stored).map(({ id }) => `/photos/${id}?size=small`).filter((path) => !this.has(path));
    this.left.push(...paths);
    this.facts.total += paths.length;
  }

  async put(path, body) {
    const headers = { 'Content-Type': body.type, 'X-Held-At': new Date().toISOString(), ...(body.tag ? { ETag: body.tag } : {}) };
    try {
      await this.cache.put(path, new Response(body.size ? body : null, { status: body.size ? 200 : 204, headers }));
    } catch (error) {
      throw this.stop(error);
    }
    this.there.add(new URL(path, location.href).href);
    this.facts.bytes += body.size;
  }

  stop(error) {
    this.cancel();
    return error;
  }
}

/** Read an answer of the server itself, not a copy of it. */
async function read(path, signal = null) {
  const limit = AbortSignal.timeout(LIMIT);
  let response;
  try {
    response = await fetch(path, { signal: signal ? AbortSignal.any([signal, limit]) : limit });
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new ApiError(0, 'The server cannot be reached.');
  }
  if (response.headers.has('X-Held-At')) throw new ApiError(0, 'The server cannot be reached.');
  if (response.status === 401) throw new ApiError(401, 'The session has ended: sign in again.');
  if (!response.ok) throw new ApiError(response.status, (await response.json().catch(() => null))?.error ?? `The server answered with status ${response.status}.`);
  const body = await response.blob();
  body.tag = response.headers.get('ETag');
  return body;
}

/** Read what has changed of findings into the copies of stretches: the findings, their list, and the tiles about them. */
export async function refresh(user, stretches, ids) {
  for (const facts of stretches) {
    const take = new Take(user, { name: facts.survey }, facts, () => {});
    take.cache = await caches.open(stretchName(user, facts.at));
    take.there = new Set();
    const paths = (await take.listed()).filter((path) => ids.some((id) => path === findingPath(id)));
    for (const path of paths) {
      const body = await read(path);
      await take.put(path, body);
      await refreshTiles(take, JSON.parse(await body.text()));
    }
  }
}

async function refreshTiles(take, finding) {
  const about = { arc_from: finding.arc_from, arc_to: finding.arc_to };
  for (const [z, x, y] of tilesOf(about, finding.chainage_from, finding.chainage_to)) {
    const path = `/tiles/${encodeURIComponent(finding.survey)}/findings/${z}/${x}/${y}.mvt`;
    if (await take.cache.match(path)) await take.put(path, await read(path));
  }
}

/** Keep the page for when there is no network: without the token against forged requests, and with the time. */
export async function keepShell(user) {
  const response = await fetch('/', { cache: 'no-store' });
  const text = await response.text();
  const page = new DOMParser().parseFromString(text, 'text/html');
  if (page.querySelector('meta[name=user]')?.content !== user) throw new ApiError(401, 'The session has ended: sign in again.');
  const held = text.replace(/(<meta name="csrf" content=")[^"]*/, '$1').replace('<head>', `<head>\n<meta name="held" content="${new Date().toISOString()}">`);
  const here = (name) => new URL(name, import.meta.url).pathname;
  const files = new Set([...page.querySelectorAll('[src], [href^="/static/"]')].map((node) => node.getAttribute('src') ?? node.getAttribute('href')));
  LAZY.forEach((name) => files.add(here(name)));
  const cache = await caches.open(shellName(user));
  const there = await Promise.all([...files].map((path) => cache.match(path)));
  await cache.addAll([...files].filter((_, n) => !there[n]));
  const headers = new Headers(response.headers);
  headers.delete('Content-Encoding');
  await cache.put('/', new Response(held, { headers }));
  const wanted = new Set([...files, '/'].map((path) => new URL(path, location.href).href));
  await Promise.all((await cache.keys()).filter(({ url }) => !wanted.has(url)).map((request) => cache.delete(request)));
}

/**
 * Service worker: asks the server first, and answers with what was taken offline while the network is away.
 *
 * It stores nothing but fresh copies of what was taken already (held.js); all else passes through.
 */

const SHELL = 'tunneldb.shell.';
const STRETCH = 'tunneldb.stretch.';

/** Time after which what was taken offline is removed, ms. */
const MAX_AGE = 24 * 3600 * 1000;

/** Longest wait for the server where there is a copy, and time for which the copies are then used at once, ms. */
const PATIENCE = 4000;
const PAUSE = 5000;

const ORDERS = {
  likely: (a, b) => b.probability - a.probability, unlikely: (a, b) => a.probability - b.probability,
  doubtful: (a, b) => Math.abs(a.probability - 0.5) - Math.abs(b.probability - 0.5), large: (a, b) => b.area - a.area, chainage: () => 0,
  images: (a, b) => (b.other_contrast ?? -1) - (a.other_contrast ?? -1),
};

let awayUntil = 0;

/** True from the sign-in page on until the server has given the page: it may be that of another user. */
let signingIn = false;

self.addEventListener('install', () => self.skipWaiting());
self.addEventListener('activate', (event) => event.waitUntil(self.clients.claim()));
self.addEventListener('message', ({ data }) => {
  if (data === 'online') awayUntil = 0;
});
self.addEventListener('fetch', (event) => {
  const { request } = event;
  const url = new URL(request.url);
  if (request.method !== 'GET' || url.origin !== self.location.origin) return;
  if (request.mode === 'navigate') {
    if (url.pathname === '/login') signingIn = true;
    if (url.pathname === '/') event.respondWith(page(request));
  } else if (url.pathname.startsWith('/static/')) event.respondWith(file(request));
  else if (/^\/(api|tiles|photos)\//.test(url.pathname)) event.respondWith(data(event, url));
});

/** Return the page; without the server, the copy of it. */
async function page(request) {
  const [copy] = await matches(SHELL, '/');
  if (!copy || signingIn) {
    const response = await fetch(request);
    signingIn = false;
    return response;
  }
  try {
    return await answer(request);
  } catch {
    return copy;
  }
}

/** Return a file of the page; its path changes with its content. */
async function file(request) {
  const [copy] = await matches(SHELL, new URL(request.url).pathname);
  return copy ?? fetch(request);
}

/** Return an answer of the server; without it, the copy, and tell the page from when that is. */
async function data(event, url) {
  const { request } = event;
  const found = await copyOf(url);
  if (found && Date.now() < awayUntil) return old(event, found.response);
  try {
    const response = await (found ? answer(request) : fetch(request));
    if (found?.cache && response.ok) event.waitUntil(renew(found, response.clone()));
    return response;
  } catch (error) {
    if (request.signal.aborted) throw error;
    awayUntil = Date.now() + PAUSE;
    return found ? old(event, found.response) : missing(event, url);
  }
}

/** Return the answer of the server within PATIENCE. */
async function answer(request) {
  const late = new Promise((_, reject) => { setTimeout(() => reject(new Error('late')), PATIENCE); });
  const response = await Promise.race([fetch(request), late]);
  if (response.status === 502) throw new Error('no server behind the proxy');
  return response;
}

/** Return the copy for an address, and where it is. */
async function copyOf(url) {
  const parts = url.pathname.split('/');
  if (parts[1] === 'api' && parts[4] === 'worklist') return worklist(url);
  const key = url.pathname.endsWith('.mvt') ? url.pathname : url.pathname + url.search;
  for (const cache of await cachesOf(STRETCH)) {
    const response = await cache.match(key, { ignoreVary: true });
    if (response) return { response, cache, key };
  }
  // Of a photo the small picture is there.
  return parts[1] === 'photos' && !url.search ? copyOf(new URL('?size=small', url)) : null;
}

/** Return the list of the findings that are there, selected and in order as the server does. */
async function worklist(url) {
  const lists = await matches(STRETCH, url.pathname);
  if (!lists.length) return null;
  const held = lists.map((list) => list.headers.get('X-Held-At')).sort()[0];
  const all = (await Promise.all(lists.map((list) => list.json()))).flat();
  const { searchParams: query } = url;
  const number = (name, other) => Number(query.get(name) ?? other);
  const kinds = query.getAll('kind');
  const rows = [...new Map(all.map((row) => [row.id, row])).values()].filter((row) => row.chainage_to > number('from', -Infinity)
    && row.chainage_from < number('to', Infinity) && row.area >= number('min_area', 0) && (!kinds.length || kinds.includes(row.kind)));
  const order = ORDERS[query.get('order')] ?? ORDERS.likely;
  rows.sort((a, b) => order(a, b) || a.chainage_from - b.chainage_from || a.id - b.id);
  return { response: new Response(JSON.stringify(rows), { headers: { 'Content-Type': 'application/json', 'X-Held-At': held } }) };
}

/** Replace a copy by what the server answered, unless it is the same. */
async function renew({ response: former, cache, key }, response) {
  const tag = response.headers.get('ETag');
  if (tag && tag === former.headers.get('ETag')) return;
  const headers = new Headers(response.headers);
  headers.delete('Content-Encoding');
  headers.set('X-Held-At', new Date().toISOString());
  const body = response.status === 204 ? null : await response.blob();
  try {
    await cache.put(key, new Response(body, { status: response.status, headers }));
  } catch {
    // Without space the older copy stays.
  }
}

async function old(event, response) {
  await tell(event, { held: response.headers.get('X-Held-At') });
  return response;
}

/** Return what stands for an answer that was not taken offline: no tile, or a line. */
async function missing(event, url) {
  await tell(event, { held: null });
  if (url.pathname.startsWith('/tiles/') || url.pathname.startsWith('/photos/')) return new Response(null, { status: 204 });
  return new Response(JSON.stringify({ error: 'The server cannot be reached, and this was not taken offline.' }), { status: 503, headers: { 'Content-Type': 'application/json' } });
}

async function tell(event, message) {
  (await self.clients.get(event.clientId))?.postMessage(message);
}

async function matches(prefix, key) {
  const found = await Promise.all((await cachesOf(prefix)).map((cache) => cache.match(key, { ignoreVary: true })));
  return found.filter(Boolean);
}

/** Return the caches of a kind; what is older than MAX_AGE is removed. */
async function cachesOf(prefix) {
  const names = (await caches.keys()).filter((name) => name.startsWith(prefix));
  const present = names.filter((name) => prefix === SHELL || Date.now() - Number(name.split('.').at(-1)) < MAX_AGE);
  await Promise.all(names.filter((name) => !present.includes(name)).map((name) => caches.delete(name)));
  return Promise.all(present.map((name) => caches.open(name)));
}

/** What this device holds of the database, for one user: the page, and the stretches that were taken offline. */

const FACTS = '/held.json';
const SHELL = 'tunneldb.shell.';
const STRETCH = 'tunneldb.stretch.';

/** Time after which what was taken offline is removed, ms; also in worker.js. */
const MAX_AGE = 24 * 3600 * 1000;

/** True where a browser lets a page work without a network. */
export const possible = () => window.isSecureContext && 'serviceWorker' in navigator && 'caches' in window;

/** Return the name of the cache of a user's page. */
export const shellName = (user) => `${SHELL}${encodeURIComponent(user)}`;

/** Return the name of the cache of a stretch that a user took at a time, ms. */
export const stretchName = (user, at) => `${STRETCH}${encodeURIComponent(user)}.${at}`;

/** Return the time, ms, at which a user took the stretch of a cache; NaN if it is of another one: names of users may have full stops. */
function takenAt(name, user) {
  const at = Number(name.split('.').at(-1));
  return name === stretchName(user, at) ? at : NaN;
}

/** Return the facts of the stretches of a user: survey, from, to, kinds, at, done, total, bytes, complete. */
export async function heldStretches(user) {
  if (!possible()) return [];
  const names = (await caches.keys()).filter((name) => Date.now() - takenAt(name, user) < MAX_AGE);
  const found = await Promise.all(names.map(async (name) => (await (await caches.open(name)).match(FACTS))?.json()));
  return found.filter(Boolean);
}

/** Write the facts of a stretch. */
export async function writeFacts(user, facts) {
  const cache = await caches.open(stretchName(user, facts.at));
  await cache.put(FACTS, new Response(JSON.stringify(facts), { headers: { 'Content-Type': 'application/json' } }));
}

/** Remove a stretch from this device. */
export const removeStretch = (user, at) => caches.delete(stretchName(user, at));

/** Remove what the device holds of other users: it may be shared. */
export async function removeOthers(user) {
  if (!possible()) return;
  const own = (name) => name === shellName(user) || takenAt(name, user) >= 0;
  await removeCaches((name) => !own(name));
}

/** Remove all that the device holds, and the worker. */
export async function removeAll() {
  sessionStorage.clear();
  if (!possible()) return;
  await removeCaches(() => true);
  const workers = await navigator.serviceWorker.getRegistrations();
  await Promise.all(workers.map((worker) => worker.unregister()));
}

async function removeCaches(wanted) {
  const names = (await caches.keys()).filter((name) => [SHELL, STRETCH].some((start) => name.startsWith(start)) && wanted(name));
  await Promise.all(names.map((name) => caches.delete(name)));
}

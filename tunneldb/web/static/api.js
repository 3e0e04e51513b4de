/** Requests to the server. */

const meta = (page, name) => page.querySelector(`meta[name=${name}]`)?.content ?? '';
const user = meta(document, 'user');
let csrf = meta(document, 'csrf');
let leaving = false;

/** Refusal of the server, or a server that is away (status 0). */
export class ApiError extends Error {
  constructor(status, message, data = null) {
    super(message);
    this.status = status;
    this.data = data;
  }

  /** True if the same request may succeed later. */
  get away() {
    return this.status === 0 || [502, 503, 504].includes(this.status);
  }
}

const AWAY = 'The server cannot be reached.';
const OUT_OF_DATE = 'the page is out of date';
const LIMIT = 20000;
const UPLOAD_LIMIT = 300000;

/**
 * Send a request, a file as it is or else JSON; return the JSON of the answer, or null.
 * @throws {ApiError}
 */
export async function request(method, path, body = undefined, { signal = null, limit = LIMIT } = {}) {
  const response = await answer(method, path, body, signal, limit);
  if (response.status === 204) return null;
  try {
    return await response.json();
  } catch (error) {
    if (error.name === 'AbortError') throw error;
    // A cut connection leaves half an answer: whether the server has written is then unknown.
    throw new ApiError(0, AWAY);
  }
}

/** Return the bytes of an answer. */
export async function getBuffer(path) {
  return (await answer('GET', path, undefined, null, 60000)).arrayBuffer();
}

/** Download a file of the server to the user's folder; return its name. */
export async function download(path) {
  const response = await answer('GET', path, undefined, null, 600000);
  const header = response.headers.get('Content-Disposition') ?? '';
  const coded = /filename\*=utf-8''([^;]+)/.exec(header)?.[1];
  const name = coded ? decodeURIComponent(coded) : /filename="([^"]+)"/.exec(header)?.[1] ?? 'tunneldb';
  saveBlob(await response.blob(), name);
  return name;
}

/** Hand a blob to the user as a file. */
export function saveBlob(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

export const get = (path, options) => request('GET', path, undefined, options);
export const post = (path, body) => request('POST', path, body ?? {});
export const put = (path, body) => request('PUT', path, body);
export const patch = (path, body) => request('PATCH', path, body);
export const upload = (path, file) => request('POST', path, file, { limit: UPLOAD_LIMIT });
export const remove = (path) => request('DELETE', path);

/** Return the path of a survey's resource. */
export function surveyPath(name, rest = '') {
  return `/api/surveys/${encodeURIComponent(name)}${rest}`;
}

/** Return the path of a finding's resource. */
export function findingPath(id, rest = '') {
  return `/api/findings/${encodeURIComponent(id)}${rest}`;
}

async function answer(method, path, body, signal, limit = LIMIT) {
  const writes = method !== 'GET';
  if (writes && !csrf) await readToken();
  let response = await send(method, path, body, signal, limit);
  let data = await refusal(response);
  if (writes && response.status === 403 && data?.error?.startsWith(OUT_OF_DATE)) {
    await readToken();
    response = await send(method, path, body, signal, limit);
    data = await refusal(response);
  }
  if (response.status === 401) signIn();
  if (!response.ok) throw new ApiError(response.status, data?.error ?? `The server answered with status ${response.status}.`, data);
  return response;
}

async function refusal(response) {
  return response.ok || response.status === 401 ? null : response.json().catch(() => null);
}

async function send(method, path, body, signal, limit) {
  const headers = { Accept: 'application/json' };
  if (method !== 'GET') headers['X-CSRF-Token'] = csrf;
  const file = body instanceof Blob;
  if (body !== undefined) headers['Content-Type'] = file ? body.type || 'application/octet-stream' : 'application/json';
  const own = new AbortController();
  const timer = setTimeout(() => own.abort(), limit);
  signal?.addEventListener('abort', () => own.abort());
  try {
    return await fetch(path, {
      method, headers, signal: own.signal, credentials: 'same-origin', body: file || body === undefined ? body : JSON.stringify(body),
    });
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new ApiError(0, AWAY);
  } finally {
    clearTimeout(timer);
  }
}

/** Read the token against forged requests from the page: a copy of the page has none, and each session has its own. */
async function readToken() {
  const response = await send('GET', '/', undefined, null, LIMIT);
  const page = new DOMParser().parseFromString(await response.text().catch(() => ''), 'text/html');
  if (!response.ok) throw new ApiError(response.status, AWAY);
  if (!meta(page, 'csrf')) signIn();
  if (meta(page, 'user') !== user) {
    location.reload(); // Another person has signed in: this page must not write in their name.
    throw new ApiError(401, 'Another person has signed in.');
  }
  csrf = meta(page, 'csrf');
}

/** Run an action of a person who leaves: if the session has ended, the action fails with status 401, but does not lead to the sign-in. */
export async function withoutSignIn(act) {
  leaving = true;
  try {
    await act();
  } finally {
    leaving = false;
  }
}

function signIn() {
  // The part of the address after # comes back after the sign-in (login.js).
  if (!leaving) location.assign(`/login${location.hash}`);
  throw new ApiError(401, 'Sign in again.');
}

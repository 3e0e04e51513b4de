/** State in the address: `#/SURVEY?x=…&y=…&z=…&kind=…`, `#/SURVEY/finding/ID`. */

/** Return the parts of an address: survey, finding and values. */
export function parse(hash = location.hash) {
  const [path, query] = hash.replace(/^#\/?/, '').split('?');
  const parts = path.split('/').filter(Boolean).map(decodeURIComponent);
  const values = new URLSearchParams(query ?? '');
  const value = (name) => (values.has(name) && Number.isFinite(Number(values.get(name))) ? Number(values.get(name)) : null);
  return {
    survey: parts[0] ?? null,
    finding: parts[1] === 'finding' && /^\d+$/.test(parts[2] ?? '') ? Number(parts[2]) : null,
    x: value('x'), y: value('y'), z: value('z'), kind: values.get('kind'), tab: values.get('tab'),
  };
}

/** Return the address of a state. */
export function format({ survey, finding = null, x = null, y = null, z = null, kind = null, tab = null }) {
  if (!survey) return '#/';
  const path = `#/${encodeURIComponent(survey)}${finding === null ? '' : `/finding/${finding}`}`;
  const values = new URLSearchParams();
  if (x !== null) {
    values.set('x', x.toFixed(2));
    values.set('y', y.toFixed(2));
    values.set('z', z.toFixed(2));
  }
  if (kind) values.set('kind', kind);
  if (tab) values.set('tab', tab);
  const query = values.toString();
  return query ? `${path}?${query}` : path;
}

/** Write a state to the address without a new entry of the history. */
export function replace(state) {
  const hash = format(state);
  if (hash !== location.hash) history.replaceState(null, '', hash);
}

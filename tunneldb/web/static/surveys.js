/** Table of the surveys. */

import { get, surveyPath } from './api.js';
import { debounce, el } from './dom.js';
import { number, percent, station } from './format.js';
import { format } from './router.js';

const COLUMNS = [
  ['Survey', (s) => el('a', { href: format({ survey: s.name }), text: s.name }), 'name'],
  ['Tunnel', (s) => s.tunnel, 'tunnel'],
  ['Date', (s) => s.date ?? '–', 'date'],
  ['Stretch', (s) => `${station(s.from, 0)} to ${station(s.to, 0)}`, 'from'],
  ['Inspected', (s) => known(s, () => share(s.inspected_share, 'not known', 'warn')), 'inspected_share'],
  ['Class', (s) => known(s, () => s.class ?? '–'), 'class'],
  ['Leaks', (s) => known(s, () => count(s.leaks)), 'leaks', 'right'],
  ['Wet area', (s) => known(s, () => number(s.wet_area, 1, 'm²')), 'wet_area', 'right'],
  ['Findings', (s) => count(s.findings), 'findings', 'right'],
  ['Reviewed', (s) => review(s), 'open'],
];

/** Number of surveys whose statistics are read at once. */
const READERS = 2;

/** Show the surveys in an element, with a map above; return a function that filters by a text. */
export function showSurveys(root, surveys, map) {
  let sorted = { name: 'date', down: true };
  const filter = el('input', { type: 'search', placeholder: 'Tunnel or survey', oninput: () => fill() });
  const body = el('tbody');
  const heads = COLUMNS.map(([title, , name, side]) => {
    const sort = el('button', { type: 'button', class: 'sort', onclick: () => order(name) }, title);
    return el('th', { scope: 'col', class: side ?? null, data: { name } }, sort);
  });
  const found = el('p', { class: 'muted', role: 'status' });
  root.replaceChildren(
    el('div', { class: 'head' }, el('h1', { id: 'surveys-title', text: 'Surveys' }), el('label', { class: 'field' }, el('span', { text: 'Filter' }), filter), found),
    map,
    el('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': 'Table of surveys' }, el('table', {}, el('thead', {}, el('tr', {}, ...heads)), body)),
  );

  function order(name) {
    sorted = { name, down: sorted.name === name ? !sorted.down : false };
    fill();
  }

  function fill() {
    const words = filter.value.toLowerCase();
    const rows = surveys.filter((s) => `${s.name} ${s.tunnel}`.toLowerCase().includes(words));
    rows.sort((a, b) => compare(a[sorted.name], b[sorted.name]) * (sorted.down ? -1 : 1));
    for (const head of heads) {
      if (head.dataset.name === sorted.name) head.setAttribute('aria-sort', sorted.down ? 'descending' : 'ascending');
      else head.removeAttribute('aria-sort');
    }
    body.replaceChildren(...rows.map(row));
    found.textContent = surveys.length ? `${rows.length} of ${surveys.length} surveys` : 'The database has no survey of a tunnel, or your login may read none.';
  }

  fill();
  readStatistics(surveys, () => root.contains(body), debounce(fill, 100));
  return (text) => {
    filter.value = text;
    fill();
  };
}

/** Read the statistics of surveys, a few at a time, as long as they are wanted. */
function readStatistics(surveys, wanted, shown) {
  const left = surveys.filter((survey) => survey.from !== null && !survey.summary);
  const reader = async () => {
    while (left.length && wanted()) {
      const survey = left.shift();
      try {
        survey.summary = await get(surveyPath(survey.name, '/summary'));
        Object.assign(survey, survey.summary);
      } catch {
        survey.summary = {};
      }
      shown();
    }
  };
  for (let n = 0; n < READERS; n += 1) reader();
}

/** Return what a survey's statistics show, once they are read. */
function known(survey, show) {
  return survey.from !== null && !survey.summary ? el('span', { class: 'muted', text: '…' }) : show();
}

function row(survey) {
  const cells = COLUMNS.map(([title, show, , side]) => el('td', { class: side ?? null, data: { title } }, show(survey)));
  return el('tr', {}, ...cells);
}

function compare(a, b) {
  if (a === b) return 0;
  if (a === null || a === undefined) return -1;
  if (b === null || b === undefined) return 1;
  return a < b ? -1 : 1;
}

function count(value) {
  return value === null || value === undefined ? '–' : String(value);
}

/** Return a bar of a share, with its number. */
function share(value, missing, part = '') {
  if (value === null || value === undefined) return el('span', { class: 'warn-text', text: missing });
  const bar = el('span', { class: `bar-share ${value < 0.9 ? part : ''}` }, el('span', {}));
  bar.firstChild.style.width = `${Math.min(100, 100 * value)}%`;
  return el('span', { class: 'share' }, bar, el('span', { text: percent(value) }));
}

function review(survey) {
  const total = survey.findings ?? 0;
  if (!total) return el('span', { class: 'muted', text: 'no findings' });
  const node = share((total - survey.open) / total, '–');
  node.append(el('span', { class: 'muted', text: ` ${survey.open} open` }));
  return node;
}

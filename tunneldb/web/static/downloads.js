/** Report, spreadsheet and GeoPackage of a stretch. */

import { download, surveyPath } from './api.js';
import { button, el, field } from './dom.js';
import { parseStation } from './format.js';

const FILES = [
  ['report', 'Report', 'report of the stretch'], ['xlsx', 'Spreadsheet', 'findings and tables, xlsx'],
  ['gpkg', 'GeoPackage', 'findings with their outlines'],
];

/** Return the panel of downloads; who may not download sees why. */
export function downloadsPanel(survey, extent, permitted) {
  const from = el('input', { type: 'text', inputmode: 'decimal' });
  const to = el('input', { type: 'text', inputmode: 'decimal' });
  const told = el('p', { role: 'status', 'aria-live': 'polite' });
  const say = (text, wrong = false) => {
    told.className = wrong ? 'wrong' : '';
    told.textContent = text;
  };
  const set = (low, high) => {
    from.value = Math.max(low, survey.from).toFixed(1);
    to.value = Math.min(high, survey.to).toFixed(1);
  };
  async function fetchFile(what, control) {
    const [low, high] = [parseStation(from.value), parseStation(to.value)];
    if (!(low < high)) {
      say('Enter two chainages in m or as 12+345, the smaller one first.', true);
      return;
    }
    control.disabled = true;
    say('The server is writing the file …');
    try {
      say(`${await download(surveyPath(survey.name, `/export?${new URLSearchParams({ what, from: low, to: high })}`))}: downloaded.`);
    } catch (error) {
      say(error.message, true);
    }
    control.disabled = false;
  }
  set(...extent());
  const rows = FILES.map(([what, name, text]) => el('li', {}, button(name, (event) => fetchFile(what, event.target), { disabled: !permitted }), el('span', { class: 'muted', text })));
  return el('div', { class: 'pad' }, el('h2', { text: 'Downloads' }),
    permitted ? null : el('p', { class: 'warn-text', text: 'Downloads need the role tunnel_operator.' }),
    el('div', { class: 'row' }, field('From', from), field('To', to)),
    el('div', { class: 'row' }, button('Stretch in view', () => set(...extent())), button('Whole survey', () => set(survey.from, survey.to))),
    el('ul', { class: 'downloads' }, ...rows), told);
}

/** What was not inspected or could have been missed: always in view. */

import { el } from './dom.js';
import { percent } from './format.js';

/** Show the limits of a survey in one line that unfolds. */
export function showLimits(root, survey, summary) {
  const share = summary?.inspected_share;
  const inspected = share === null || share === undefined ? 'Inspected share: not known.' : `Inspected: ${percent(share, 1)} of the lining.`;
  const missed = survey.statement ?? 'Where leaks could be missed is not known: detectability was not computed.';
  const remarks = survey.remarks ?? [];
  const text = el('p', {}, el('strong', { text: inspected }), ` ${missed}`);
  const more = remarks.length ? el('details', { class: 'fold' }, el('summary', { text: `${remarks.length} ${remarks.length === 1 ? 'remark' : 'remarks'}` }), list(remarks)) : null;
  const key = el('span', { class: 'hatch-key' }, el('i', {}), 'not inspected or not known');
  root.replaceChildren(text, ...(more ? [more] : []), key);
  root.classList.toggle('warn', share === null || share === undefined || share < 0.98 || Boolean(survey.statement));
}

/** Return the panel of notes of a survey. */
export function notesPanel(survey, summary) {
  const share = summary?.inspected_share;
  return el('div', { class: 'pad' }, el('h2', { text: 'Notes and limitations' }),
    el('p', { text: share === null || share === undefined ? 'Inspected share: not known.' : `Inspected: ${percent(share, 1)} of the lining. What was not inspected is not dry.` }),
    el('p', { text: survey.statement ?? 'Detectability was not computed: it is not known where leaks could be missed.' }),
    survey.remarks?.length ? list(survey.remarks) : el('p', { class: 'muted', text: 'No remarks.' }));
}

function list(texts) {
  return el('ul', { class: 'plain' }, ...texts.map((text) => el('li', { text })));
}

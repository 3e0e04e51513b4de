/** What was not inspected or could have been missed: always in view. */

import { el } from './dom.js';
import { percent } from './format.js';

/** Show the limits of a survey in one line; its remarks unfold. Without a summary they are not known yet, or an error says why. */
export function showLimits(root, summary, error = '') {
  const remarks = summary?.remarks ?? [];
  const text = el('p', {}, el('strong', { text: error ? `Inspected share: not known. ${error}` : inspected(summary) }), summary?.statement ? ` ${summary.statement}` : null);
  const more = remarks.length ? el('details', { class: 'fold remarks' }, el('summary', { text: `${remarks.length} ${remarks.length === 1 ? 'remark' : 'remarks'}` }), list(remarks)) : null;
  const key = el('span', { class: 'hatch-key' }, el('i', {}), 'not inspected or not known');
  root.replaceChildren(text, ...(more ? [more] : []), key);
  const share = summary?.inspected_share ?? 0;
  root.classList.toggle('warn', share < 0.98 || Boolean(summary?.statement) || remarks.length > 0);
}

/** Return the panel of notes of a survey. */
export function notesPanel(summary) {
  return el('div', { class: 'pad' }, el('h2', { text: 'Notes and limitations' }),
    el('p', { text: `${inspected(summary)} What was not inspected is not dry.` }),
    summary?.statement ? el('p', { text: summary.statement }) : null,
    summary?.remarks.length ? list(summary.remarks) : el('p', { class: 'muted', text: summary ? 'No remarks.' : '' }));
}

function inspected(summary) {
  if (!summary) return 'Inspected share: being read …';
  const share = summary.inspected_share;
  return share === null ? 'Inspected share: not known.' : `Inspected: ${percent(share)} of the lining.`;
}

function list(texts) {
  return el('ul', { class: 'plain' }, ...texts.map((text) => el('li', { text })));
}

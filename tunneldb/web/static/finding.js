/** What is known of a finding: values, evidence, history. */

import { button, el } from './dom.js';
import { arc, clock, number, percent, station, time } from './format.js';
import { format } from './router.js';

const STATES = { merged: 'merged into another finding', same: 'same as another finding', dry: 'in an area marked as dry', gone: 'no longer detected' };

/** Return the head of a finding: place, number and review. */
export function headOf(finding) {
  return el('div', { class: 'finding-head' },
    el('h2', { text: `${finding.label ?? station((finding.chainage_from + finding.chainage_to) / 2)}${finding.clock === null ? '' : `, ${clock(finding.clock)} o’clock`}` }),
    el('p', {}, el('span', { class: `badge ${finding.review}`, text: finding.review }), ` ${finding.kind_label ?? finding.kind}${finding.id > 0 ? `, no. ${finding.id}` : ''}`),
    finding.recorded ? el('p', { class: 'warn-text', text: 'Recorded on this device, not in the database yet.' }) : null,
    STATES[finding.state] ? el('p', { class: 'warn-text', text: `Not included in the totals: ${STATES[finding.state]}.` }) : null);
}

/** Return the photos, values, actions, evidence and history of a finding. */
export function factsOf(finding, survey, severities, photos, demanded, say) {
  return el('div', { class: 'finding-facts' },
    photos, valuesOf(finding, severities), demanded, evidenceOf(finding), historyOf(finding), finding.id > 0 ? linkOf(finding, survey, say) : null);
}

function valuesOf(finding, severities) {
  const severity = severities.find(({ id }) => id === finding.severity)?.label;
  const rows = [
    ['Detected as', finding.kind_detected ? `${finding.kind_detected}, confidence ${number(finding.confidence, 2)}` : null],
    ['Origin', finding.drawn_by ? `${finding.origin} by ${finding.drawn_by}` : finding.origin],
    ['Area', finding.area ? number(finding.area, 2, 'm²') : null], ['Length', finding.length ? number(finding.length, 2, 'm') : null],
    ['Direction', finding.orientation_class ? `${finding.orientation_class}, ${number(finding.orientation, 0)}° to the axis` : null],
    ['Width', finding.width_mm !== null ? number(finding.width_mm, 1, 'mm') : null],
    ['Severity', finding.severity !== null && finding.severity !== undefined ? `${finding.severity}${severity ? `, ${severity}` : ''}` : null],
    ['Chainage', `${station(finding.chainage_from, 2)} to ${station(finding.chainage_to, 2)}`],
    ['Arc', `${arc(finding.arc_from)} to ${arc(finding.arc_to)}`],
    ['Darkening', finding.darkening_mean !== null ? `${number(finding.darkening_mean, 1)}\u00a0dB mean, ${number(finding.darkening_max, 1)}\u00a0dB maximum` : null],
    ['Contrast', finding.contrast !== null ? number(finding.contrast, 1) : null],
    ['Other images', finding.other_images ?? null],
    ['Lining in the image', finding.image_share !== null && finding.image_share !== undefined ? percent(finding.image_share) : null],
    ['Reviewed', finding.reviewed_by ? `${finding.reviewed_by}, ${time(finding.reviewed_at)}` : 'not reviewed'],
  ].filter(([, value]) => value !== null && value !== undefined);
  return el('dl', { class: 'values' }, ...rows.flatMap(([name, value]) => [el('dt', { text: name }), el('dd', { text: value })]));
}

/** Show the evidence as bars: to the right for a leak, to the left against. */
function evidenceOf(finding) {
  const evidence = finding.evidence ?? [];
  if (!evidence.length) return null;
  const most = Math.max(...evidence.map(({ log_odds: odds }) => Math.abs(odds)), 1);
  const rows = evidence.map(({ words, log_odds: odds }) => {
    const bar = el('i', { class: odds < 0 ? 'against' : 'for' });
    bar.style.width = `${(50 * Math.abs(odds)) / most}%`;
    const sign = odds < 0 ? '−' : '+';
    return el('li', {}, el('span', { text: words }), el('span', { class: 'odds', 'aria-hidden': 'true' }, bar), el('span', { class: 'num', text: `${sign}${Math.abs(odds).toFixed(1)}` }));
  });
  return el('section', {},
    el('h3', { text: 'Evidence' }),
    el('ul', { class: 'evidence' }, ...rows),
    el('p', { class: 'muted small', text: 'Log odds: right and + for a leak, left and − against.' }));
}

function historyOf(finding) {
  const history = finding.history ?? [];
  const rows = history.map((entry) => el('li', {},
    el('span', { class: 'muted', text: `${time(entry.at)} ${entry.by ?? ''}` }), ` ${entry.action}${changeText(entry.before, entry.after)}`));
  return el('details', { class: 'fold' }, el('summary', { text: `History (${history.length})` }),
    rows.length ? el('ul', { class: 'plain' }, ...rows) : el('p', { class: 'muted', text: 'No change since detection.' }));
}

/** Return what an entry of the audit changed. */
function changeText(before, after) {
  const text = (value) => (value === null || value === undefined || value === '' ? 'none' : typeof value === 'object' ? JSON.stringify(value) : String(value));
  if (typeof (after ?? before) !== 'object' || (after ?? before) === null) {
    return before === undefined && after === undefined ? '' : `: ${text(before)} → ${text(after)}`;
  }
  const names = Object.keys({ ...before, ...after }).filter((name) => text(before?.[name]) !== text(after?.[name]));
  return names.length ? `: ${names.map((name) => `${name} ${text(before?.[name])} → ${text(after?.[name])}`).join(', ')}` : '';
}

function linkOf(finding, survey, say) {
  const address = `${location.origin}${location.pathname}${format({ survey: survey.name, finding: finding.id })}`;
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(address);
      say('Link copied.');
    } catch {
      say('The browser does not allow copying: copy the link from its context menu.', true);
    }
  };
  return el('p', { class: 'link' }, el('a', { href: format({ survey: survey.name, finding: finding.id }), text: 'Permanent link' }), ' ', button('Copy', copy, { class: 'quiet' }));
}

/** Tools of the lining: image, layers, comparison, zoom. */

import { get, surveyPath } from './api.js';
import { button, check, choice, el, field } from './dom.js';
import { number } from './format.js';

/** Fill the toolbar of a lining for its survey. */
export function fillToolbar(lining, onError) {
  const { survey } = lining;
  const kinds = choice(survey.kinds.map(({ kind, label }) => [kind, label]), lining.kind, {
    onchange: (event) => {
      lining.setKind(event.target.value);
      showLegend(lining, onError);
    },
  });
  const image = survey.kinds.length ? field('Image', kinds, { class: 'field inline' }) : el('span', { class: 'warn-text', text: 'This survey has no image.' });
  lining.tools.replaceChildren(
    image, menu('Layers', layers(lining)), ...(survey.neighbours.length ? [menu('Compare', compare(lining, onError))] : []),
    button('Fit height', () => lining.fitHeight()), button('Whole survey', () => lining.fitAll()),
  );
  showLegend(lining, onError);
}

/** Return a button that unfolds a box. */
function menu(title, content) {
  const node = el('details', { class: 'menu' }, el('summary', { text: title }), el('div', { class: 'menu-box' }, ...content));
  node.addEventListener('keydown', (event) => {
    if (event.key !== 'Escape') return;
    node.open = false;
    node.firstChild.focus();
  });
  document.addEventListener('pointerdown', (event) => {
    if (!node.contains(event.target)) node.open = false;
  });
  return node;
}

function layers(lining) {
  const set = (name) => (value) => {
    lining.shown[name] = value;
    lining.restyle();
  };
  const key = el('ul', { class: 'key' }, ...[['Leak, open', '#e67e00'], ['Leak, confirmed', '#005caf']].map(keyRow));
  key.append(...lining.survey.finding_kinds.filter((kind) => !kind.wet).map((kind) => keyRow([kind.label, kind.colour])));
  return [
    check('Findings (H)', lining.shown.findings, set('findings'), { id: 'show-findings' }),
    check('Joints and dry dark areas', lining.shown.dry, set('dry')),
    check('Rejected, merged and removed', lining.shown.removed, set('removed')),
    key,
    el('p', { class: 'muted small' }, 'Hatched: no image. Green band at the upper edge: share of the lining that was inspected.'),
  ];
}

function keyRow([text, colour]) {
  const mark = el('i');
  mark.style.background = colour;
  return el('li', {}, mark, text);
}

function compare(lining, onError) {
  const { comparison, survey } = lining;
  const modes = choice([['swipe', 'Swipe'], ['stack', 'One above the other']], comparison.mode, { onchange: show });
  const other = choice([['', 'None'], ...survey.neighbours.map((name) => [name, name])], '', { onchange: show });
  function show() {
    comparison.show(other.value, modes.value).catch((error) => onError(error.message));
  }
  return [field('Other survey', other), field('Show', modes)];
}

async function showLegend(lining, onError) {
  const { survey } = lining;
  const kind = survey.kinds.find((other) => other.kind === lining.kind);
  lining.legend.replaceChildren();
  if (!kind?.ramp.length) return;
  try {
    const { low, high } = await get(surveyPath(survey.name, `/colours/${kind.kind}`));
    if (survey !== lining.survey || kind.kind !== lining.kind) return;
    const decimals = high - low < 5 ? Math.min(Math.max(Math.ceil(1 - Math.log10(high - low)), 2), 6) : 0;
    const ramp = el('i', { class: 'ramp' });
    ramp.style.background = `linear-gradient(90deg, ${kind.ramp.join(', ')})`;
    lining.legend.replaceChildren(el('span', { text: number(low, decimals) }), ramp, el('span', { text: number(high, decimals, kind.unit) }));
  } catch (error) {
    onError(`Colours: ${error.message}`);
  }
}

/** Rating of the elements of a survey by a scheme: results, what decided, and the change since the earlier inspection. */

import { get, surveyPath } from './api.js';
import { button, check, choice, el, field } from './dom.js';
import { clock, percent, station } from './format.js';
import { counts, fromBest, swatch } from './levels.js';
import { format } from './router.js';

/** Number of rows that are shown at once. */
const ROWS = 300;

const COLUMNS = ['Element', 'Result', 'Inspected', 'Findings', 'Change', 'Why'];

/** Panel of the rating. */
export class RatingPanel {
  /** @param {Object} app - shown(rating), on(boolean), go(element). */
  constructor(app) {
    this.app = app;
    this.turn = 0;
    this.survey = null;
    this.rating = null;
    this.sets = el('select', { onchange: () => this.read() });
    this.schemes = el('select', { onchange: () => this.read() });
    this.order = choice([['worst', 'Worst first'], ['chainage', 'By chainage']], 'worst', { onchange: () => this.fill() });
    this.colours = check('Colour the lining', true, (on) => this.app.on(on));
    this.source = el('p', { class: 'muted small' });
    this.told = el('p', { role: 'status' });
    this.totals = el('ul', { class: 'key totals', 'aria-label': 'Results' });
    this.since = el('p', {});
    this.body = el('tbody', {});
    this.more = button('Show more', () => this.fill(this.shownRows + ROWS));
    this.table = el('table', { class: 'rating-table' },
      el('thead', {}, el('tr', {}, ...COLUMNS.map((title) => el('th', { scope: 'col', text: title })))), this.body);
    this.content = el('div', {}, this.totals, this.since, this.table, this.more);
    this.root = el('div', { class: 'pad rating' }, el('h2', { text: 'Rating' }),
      el('div', { class: 'row' }, field('Elements', this.sets), field('Scheme', this.schemes), field('Order', this.order), this.colours),
      this.source, this.told, this.content);
  }

  /** True if the lining shows the results while the panel is open. */
  get coloured() {
    return this.colours.firstChild.checked;
  }

  /** Use a survey; nothing is read until the panel is opened. */
  setSurvey(survey) {
    this.turn += 1;
    this.survey = survey;
    this.choices = null;
    this.rating = null;
    this.app.shown(null);
    this.fill();
  }

  /** Read what can be chosen, once, and the rating anew: a review changes it. */
  async open() {
    if (this.choices) {
      await this.read();
      return;
    }
    await this.load(async (latest) => {
      const choices = await get(surveyPath(this.survey.name, '/rating/choices'));
      if (!latest()) return;
      this.choices = choices;
      this.sets.replaceChildren(...choices.element_sets.map(({ name, elements }) => el('option', { value: name, text: `${name} (${elements})` })));
      this.schemes.replaceChildren(...choices.schemes.map(({ name, version }, n) => el('option', { value: n, text: `${name} ${version}` })));
    });
    if (this.choices) await this.read();
  }

  /** Read the rating that is chosen, then its change. */
  read() {
    const set = this.sets.value;
    const scheme = this.choices?.schemes[Number(this.schemes.value)];
    if (!set || !scheme) {
      const lacks = [this.sets.options.length ? null : 'the tunnel has no elements: tunneldb elements add', this.schemes.options.length ? null : 'the database has no rating scheme: tunneldb rating add'];
      this.say(`Nothing can be rated: ${lacks.filter(Boolean).join('; ')}.`, true);
      return null;
    }
    const query = new URLSearchParams({ elements: set, scheme: scheme.name, version: scheme.version });
    this.source.textContent = `${scheme.name} ${scheme.version}: ${scheme.source}${scheme.valid_from ? `, valid from ${scheme.valid_from}` : ''}. `
      + `A result of an element that was inspected to less than ${percent(scheme.min_inspected)} is a lower bound: “at least”.`;
    const { name } = this.survey;
    return this.load(async (latest) => {
      const rating = await get(surveyPath(name, `/rating?${query}`), { limit: 60000 });
      if (!latest()) return;
      this.rating = { ...rating, levels: rating.scheme.results.length, changes: new Map(), earlier: undefined };
      this.app.shown(this.rating);
      this.fill();
      const change = await get(surveyPath(name, `/rating/change?${query}`), { limit: 60000 });
      if (!latest()) return;
      this.rating.earlier = change.earlier;
      this.rating.changes = new Map(change.elements.map((one) => [one.id, one]));
      this.fill(this.shownRows);
    });
  }

  /** Read something; what comes after the next request is dropped. */
  async load(act) {
    const turn = (this.turn += 1);
    const latest = () => turn === this.turn;
    this.say('Reading …');
    try {
      await act(latest);
      if (latest()) this.say('');
    } catch (error) {
      if (latest()) this.say(error.message, true);
    }
  }

  say(text, wrong = false) {
    this.told.className = wrong ? 'wrong' : 'muted';
    this.told.textContent = text;
  }

  fill(rows = ROWS) {
    const { rating } = this;
    this.content.hidden = !rating;
    this.shownRows = rows;
    if (!rating) return;
    this.totals.replaceChildren(...counts(rating.elements).map(({ text, element, count }) => el('li', {}, swatch(element, rating.levels), `${text}: ${count}`)));
    this.since.textContent = sinceText(rating);
    const ordered = this.order.value === 'worst' ? fromBest(rating.elements).reverse() : rating.elements;
    this.body.replaceChildren(...ordered.slice(0, rows).map((element) => this.row(element)));
    this.more.hidden = ordered.length <= rows;
    this.more.textContent = `Show more (${ordered.length - rows} left)`;
  }

  row(element) {
    const { rating } = this;
    const place = `${station(element.chainage_from, 0)} to ${station(element.chainage_to, 0)}`;
    const zone = element.clock_from === null ? '' : `, ${clock(element.clock_from)} to ${clock(element.clock_to)} o’clock`;
    const seen = element.inspected_share;
    const cells = [
      [button(element.name, () => this.app.go(element), { class: 'quiet', disabled: !element.boxes.length }), el('span', { class: 'muted small', text: `${place}${zone}` })],
      [swatch(element, rating.levels), el('span', { text: element.result_text })],
      [el('span', { class: seen < rating.scheme.min_inspected ? 'warn-text' : null, text: seen === 0 ? 'not inspected' : percent(seen) })],
      [String(element.findings)],
      [changeText(rating, rating.changes.get(element.id))],
      whyOf(element, this.survey),
    ];
    return el('tr', {}, ...cells.map((content, n) => el('td', { class: `c${n}`, data: { title: COLUMNS[n] } }, ...content)));
  }
}

/** Return what decided, with a link to the finding, and what was not inspected or not known. */
function whyOf({ why, remark, finding_id: id }, survey) {
  const link = id === null ? null : el('a', { href: format({ survey: survey.name, finding: id }), text: `finding ${id}` });
  return [why, link ? ' ' : null, link, remark ? el('span', { class: 'warn-text remark', text: remark }) : null].filter(Boolean);
}

/** Return the change of one result in words. */
function changeText({ earlier }, change) {
  if (earlier === undefined) return '…';
  if (earlier === null || !change) return '–';
  const was = `was ${change.earlier_result ?? 'not rated'}`;
  if (change.change === null) return `not known; ${was}`;
  if (!change.known) return `uncertain; ${was}`;
  if (change.change === 0) return 'same';
  return `${change.change > 0 ? 'worse' : 'better'} by ${Math.abs(change.change)}; ${was}`;
}

/** Return the changes of all results in one sentence. */
function sinceText({ earlier, changes }) {
  if (earlier === undefined) return 'Change since the earlier inspection: being read …';
  if (earlier === null) return 'There is no earlier inspection of the tunnel.';
  const all = [...changes.values()];
  const number = (fits) => all.filter(fits).length;
  const sure = ({ known, change }) => known && change !== null;
  return `Since ${earlier.survey} (${earlier.date}): ${number((one) => sure(one) && one.change > 0)} worse, ${number((one) => sure(one) && one.change < 0)} better, `
    + `${number((one) => sure(one) && one.change === 0)} same, ${number((one) => !sure(one))} uncertain or not known.`;
}

/** Selection of findings to review. */

import { button, check, choice, el, field } from './dom.js';
import { parseStation } from './format.js';
import { ORDERS } from './worklist.js';

/** Form of the selection. */
export class Filter {
  /** @param {function} changed - is called with every valid change. */
  constructor(changed) {
    this.changed = changed;
    this.root = el('details', { class: 'fold filter' });
  }

  /** Build the form for a survey. */
  setSurvey(survey, here) {
    const input = (props) => el('input', { type: 'text', inputmode: 'decimal', ...props, onchange: () => this.ask() });
    this.order = choice(ORDERS, this.order?.value ?? 'likely', { onchange: () => this.ask() });
    this.from = input({ placeholder: '12+300' });
    this.to = input({ placeholder: '12+800' });
    this.area = input({ placeholder: '0' });
    this.open = check('Not reviewed only', true, () => this.ask());
    this.kinds = survey.finding_kinds.filter(({ active }) => active).map(({ code, label }) => check(label, false, () => this.ask(), { value: code }));
    this.wrong = el('p', { class: 'wrong', role: 'alert' });
    this.summary = el('summary', { text: 'Selection' });
    const view = button('Stretch in view', () => {
      const [from, to] = here();
      this.from.value = Math.max(from, survey.from).toFixed(1);
      this.to.value = Math.min(to, survey.to).toFixed(1);
      this.ask();
    });
    this.root.replaceChildren(this.summary,
      field('Order', this.order), this.open,
      el('div', { class: 'row' }, field('From', this.from), field('To', this.to), field('Area from, m²', this.area)), view,
      el('fieldset', {}, el('legend', { text: 'Kinds (none: all)' }), ...this.kinds), this.wrong);
    this.describe();
  }

  /** Return the selection, or null if an entry is not valid. */
  get value() {
    const entry = (box) => (box.value.trim() ? parseStation(box.value) : null);
    const [from, to, area] = [this.from, this.to, this.area].map(entry);
    const bad = [from, to, area].some(Number.isNaN) || (from !== null && to !== null && from > to);
    this.wrong.textContent = bad ? 'Enter chainages in m or as 12+345, the smaller one first, and an area in m².' : '';
    if (bad) return null;
    return {
      order: this.order.value, kinds: this.kinds.map((label) => label.firstChild).filter((box) => box.checked).map((box) => box.value),
      from, to, min_area: area, openOnly: this.open.firstChild.checked,
    };
  }

  ask() {
    const { value } = this;
    if (!value) return;
    this.describe();
    this.changed(value);
  }

  describe() {
    const title = ORDERS.find(([code]) => code === this.order.value)[1].toLowerCase();
    const limits = this.from.value || this.to.value ? `, ${this.from.value || 'start'} to ${this.to.value || 'end'}` : '';
    const kinds = this.kinds.filter((label) => label.firstChild.checked).map((label) => label.textContent).join(', ');
    this.summary.textContent = `Selection: ${title}${limits}${kinds ? `, ${kinds}` : ''}${this.open.firstChild.checked ? ', not reviewed' : ''}`;
  }
}

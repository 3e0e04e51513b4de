/** Box above the survey: what was recorded on this device and is not in the database yet, and what needs a decision. */

import { button, el } from './dom.js';
import { time } from './format.js';
import { findingOf, textOf } from './outbox.js';
import { format } from './router.js';

/** List of the records that wait. */
export class OutboxBox {
  /**
   * @param {HTMLElement} root
   * @param {Outbox} outbox
   */
  constructor(root, outbox) {
    this.root = root;
    this.outbox = outbox;
    this.list = el('ul', { class: 'plain' });
    this.summary = el('summary', {});
    this.details = el('details', { class: 'fold' }, this.summary, this.list);
    this.box = el('div', { class: 'alert outbox', role: 'alert' }, this.details, button('Send now', () => this.outbox.send()));
  }

  /** Show what waits. */
  refresh() {
    const { waiting } = this.outbox;
    this.root.replaceChildren(...(waiting.length ? [this.box] : []));
    const stopped = waiting.filter(({ stopped: one }) => one).length;
    const ask = stopped ? ` Your decision is needed: ${stopped}.` : '';
    const text = `Recorded on this device, not in the database yet: ${waiting.length}.${ask}`;
    if (this.summary.textContent !== text) this.summary.textContent = text;
    this.list.replaceChildren(...waiting.map((record) => el('li', {}, ...this.row(record))));
  }

  row(record) {
    const { outbox } = this;
    const finding = findingOf(record);
    const name = finding > 0 ? el('a', { href: format({ survey: record.survey, finding }), text: textOf(record) }) : el('span', { text: textOf(record) });
    const head = [name, el('span', { class: 'muted', text: ` ${record.file ? `${record.file.name}, ` : ''}${record.survey}, ${time(record.at)} ` })];
    const discard = button('Discard', () => outbox.discard(record));
    if (!record.stopped) return [...head, discard];
    const theirs = record.stopped.finding;
    if (!theirs) return [...head, el('span', { text: `Not saved: ${record.stopped.text} ` }), button('Try again', () => outbox.retry(record)), ' ', discard];
    return [...head, el('span', { text: `In the database: ${valuesOf(theirs)}. Yours: ${mine(record)}. ` }),
      button('Write mine', () => outbox.decide(record, true)), ' ', button('Keep theirs', () => outbox.decide(record, false))];
  }
}

function valuesOf({ review, kind_label: label, kind, remark, reviewed_by: by }) {
  return `${review}, ${label ?? kind}, ${remark ? `remark “${remark}”` : 'no remark'}${by ? `, by ${by}` : ''}`;
}

function mine({ values }) {
  return Object.entries(values).map(([name, value]) => `${name}: ${value ?? 'none'}`).join(', ');
}

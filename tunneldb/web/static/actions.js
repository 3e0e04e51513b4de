/** Actions of a tunnel: list, form, and those of the finding that is shown. */

import { ApiError, get, patch, post, remove, surveyPath } from './api.js';
import { button, check, choice, el, field } from './dom.js';
import { station } from './format.js';
import { format } from './router.js';

const URGENCIES = [['immediate', 'immediate'], ['urgent', 'urgent'], ['planned', 'planned'], ['monitor', 'monitor (observe only)']];
const STATES = [['open', 'open'], ['ordered', 'ordered'], ['done', 'done'], ['verified', 'verified']];
const FILTERS = [['left', 'Open and ordered'], ['all', 'All'], ...STATES];
const LEFT = ['open', 'ordered'];

/** Panel of the actions. */
export class ActionsPanel {
  /** @param {Object} app - canWrite, say(text, wrong), current() the finding that is shown, changed(actions). */
  constructor(app) {
    this.app = app;
    this.turn = 0;
    this.actions = [];
    this.chosen = null;
    this.filter = choice(FILTERS, 'left', { onchange: () => this.fill() });
    this.late = check('Overdue only', false, () => this.fill());
    this.told = el('p', { role: 'status' });
    this.addition = el('div', {});
    this.list = el('ul', { class: 'actions' });
    this.root = el('div', { class: 'pad' }, el('h2', { text: 'Actions of the tunnel' }), this.addition,
      el('div', { class: 'row' }, field('State', this.filter), this.late), this.told, this.list);
  }

  /** Use a survey; nothing is read until the panel is opened. */
  setSurvey(survey) {
    this.survey = survey;
    this.actions = [];
    this.chosen = null;
    this.forming = null;
    this.fill();
  }

  /** Read the actions; show one of them, or the form of a new one. */
  async open({ id = null, adds = false } = {}) {
    this.forming = null;
    this.chosen = id;
    if (id !== null) {
      this.filter.value = 'all';
      this.late.firstChild.checked = false;
    }
    this.offer(adds);
    await this.read();
    this.list.querySelector('.chosen')?.scrollIntoView({ block: 'nearest' });
  }

  async read() {
    const { survey } = this;
    const turn = (this.turn += 1);
    if (!this.actions.length) this.say('Reading …');
    try {
      const actions = await get(surveyPath(survey.name, '/actions'));
      if (turn !== this.turn) return;
      this.actions = actions;
      this.app.changed(actions);
      this.fill();
    } catch (error) {
      if (turn === this.turn) this.say(error.message, true);
    }
  }

  say(text, wrong = false) {
    this.told.className = wrong ? 'wrong' : 'muted';
    this.told.textContent = text;
  }

  /** Offer a new action for the finding that is shown. */
  offer(formed = false) {
    if (!this.app.canWrite) {
      this.addition.replaceChildren();
      return;
    }
    const finding = this.app.current();
    if (!finding || finding.id < 0) {
      this.addition.replaceChildren(el('p', { class: 'muted', text: 'To add an action, choose a finding on the lining first.' }));
    } else if (formed) {
      this.addition.replaceChildren(this.form(null, finding));
      this.addition.querySelector('input').focus({ preventScroll: true });
    } else {
      this.addition.replaceChildren(button(`Add action for finding ${finding.id}`, () => this.offer(true), { class: 'main' }));
    }
  }

  fill() {
    const wanted = { all: STATES.map(([code]) => code), left: LEFT }[this.filter.value] ?? [this.filter.value];
    const shown = this.actions.filter(({ state, overdue }) => wanted.includes(state) && (overdue || !this.late.firstChild.checked));
    const late = this.actions.filter(({ overdue }) => overdue).length;
    this.say(this.actions.length ? `${shown.length} of ${this.actions.length} actions; overdue: ${late}` : 'The tunnel has no action.');
    this.list.replaceChildren(...shown.map((action) => this.item(action)));
  }

  item(action) {
    if (this.forming === action.id) return el('li', {}, this.form(action));
    const sure = el('div', { class: 'row', hidden: true }, el('span', { text: 'Delete this action?' }),
      button('Delete', () => this.delete(action), { class: 'danger' }), button('Cancel', () => { sure.hidden = true; }));
    const tools = el('div', { class: 'row' },
      button('Change', () => {
        this.forming = action.id;
        this.fill();
        this.list.querySelector('form input')?.focus({ preventScroll: true });
      }, { 'aria-label': `Change action ${action.id}` }),
      button('Delete', () => { sure.hidden = false; }, { class: 'danger', 'aria-label': `Delete action ${action.id}` }));
    return el('li', { class: `action${action.overdue ? ' overdue' : ''}${action.id === this.chosen ? ' chosen' : ''}` },
      headOf(action),
      el('p', {}, ...subjectOf(action)),
      el('p', { text: factsOf(action) }),
      action.follow_up ? el('p', {}, el('strong', { text: 'Since then: ' }), action.follow_up) : null,
      action.remark ? el('p', { class: 'text', text: action.remark }) : null,
      el('p', { class: 'muted small', text: writtenBy(action) }),
      this.app.canWrite ? tools : null, this.app.canWrite ? sure : null);
  }

  /** Return the form of an action, or of a new one for a finding. */
  form(action, finding = null) {
    const was = action ?? { measure: '', urgency: 'planned', state: 'open', responsible: null, due: null, cost: null, currency: 'EUR', remark: null };
    const text = (value, props = {}) => el('input', { type: 'text', value: value ?? '', autocomplete: 'off', ...props });
    const inputs = {
      measure: text(was.measure, { maxlength: '2000', required: true }), urgency: choice(URGENCIES, was.urgency), state: choice(STATES, was.state),
      responsible: text(was.responsible, { maxlength: '200' }), due: el('input', { type: 'date', value: was.due ?? '' }),
      cost: text(was.cost, { inputmode: 'decimal' }), currency: text(was.currency ?? 'EUR', { maxlength: '3', size: '4' }), remark: text(was.remark, { maxlength: '10000' }),
    };
    const wrong = el('p', { class: 'wrong', role: 'alert' });
    const close = () => {
      this.forming = null;
      if (action) this.fill();
      else this.offer();
    };
    const save = button('Save', null, { class: 'main' });
    save.type = 'submit';
    const submit = async (event) => {
      event.preventDefault();
      save.disabled = true;
      wrong.textContent = '';
      try {
        const values = valuesOf(inputs);
        if (action) await this.change(action, values);
        else await this.add(finding, values);
      } catch (error) {
        if (!(error instanceof ApiError || error instanceof RangeError)) throw error;
        wrong.textContent = `Not saved. ${error.message}`;
        if (error.data?.action) {
          // The next attempt is one of a person who has seen the other values; what this person has not touched becomes as it is now.
          const now = error.data.action;
          for (const name of untouched(inputs, action)) inputs[name].value = now[name] ?? (name === 'currency' ? 'EUR' : '');
          action = now;
          wrong.textContent += `. In the database: ${nowText(now)}. Save again to write yours, or cancel.`;
        }
      }
      save.disabled = false;
    };
    return el('form', { class: 'action-form', novalidate: true, 'aria-label': action ? `Action ${action.id}` : 'New action', onsubmit: submit },
      el('h3', { text: action ? `Action ${action.id}` : `New action for finding ${finding.id}` }),
      field('Measure', inputs.measure),
      el('div', { class: 'form' }, field('Urgency', inputs.urgency), field('State', inputs.state),
        field('Responsible', inputs.responsible), field('Due', inputs.due), field('Cost', inputs.cost), field('Currency', inputs.currency)),
      field('Remark', inputs.remark), wrong, el('div', { class: 'row' }, save, button('Cancel', close)));
  }

  async add(finding, values) {
    const action = await post(surveyPath(finding.survey, '/actions'), { ...values, finding_id: finding.id });
    this.chosen = action.id;
    if (!LEFT.includes(action.state)) this.filter.value = 'all';
    this.app.say(`Saved. Action ${action.id}: ${action.measure}.`);
    this.offer();
    await this.read();
  }

  async change(action, values) {
    const wanted = Object.fromEntries(Object.entries(values).filter(([name, value]) => value !== action[name]));
    if (Object.keys(wanted).length) {
      const seen = Object.fromEntries(Object.keys(wanted).map((name) => [name, action[name]]));
      await patch(`/api/actions/${action.id}`, { seen, values: wanted });
      this.app.say(`Saved. Action ${action.id}.`);
    }
    this.forming = null;
    this.chosen = action.id;
    await this.read();
  }

  async delete({ id }) {
    try {
      await remove(`/api/actions/${id}`);
      this.app.say(`Action ${id} deleted.`);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      this.app.say(`Not deleted. ${error.message}`, true);
    }
    await this.read();
  }
}

/** Return the actions of a finding for its panel; open(choice) leads to the list or to the form. */
export function actionsOf({ id, actions = [] }, canWrite, open) {
  if (!actions.length && !canWrite) return null;
  const rows = actions.map((action) => el('li', { class: action.overdue ? 'overdue' : null },
    button(action.measure, () => open({ id: action.id }), { class: 'quiet' }), ' ', ...badges(action), action.due ? ` due ${action.due}` : '',
    action.follow_up ? el('span', { class: 'muted', text: ` ${action.follow_up}` }) : null));
  return el('section', { class: 'finding-actions' }, el('h3', { text: actions.length ? `Actions (${actions.length})` : 'Actions' }),
    el('ul', { class: 'plain' }, ...rows), canWrite ? button('Add action', () => open({ adds: true }), { data: { finding: id } }) : null);
}

function badges({ urgency, state, overdue }) {
  return [overdue ? el('span', { class: 'tag late', text: 'overdue' }) : null, el('span', { class: `tag ${urgency}`, text: urgency }), ' ', el('span', { class: 'tag', text: state })].filter(Boolean);
}

function headOf(action) {
  return el('div', { class: 'action-head' }, el('strong', { text: action.measure }), el('span', { class: 'tags' }, ...badges(action)));
}

/** Return where and what the action is about. */
function subjectOf(action) {
  const kind = action.finding_kind ?? 'finding';
  const link = action.finding_id === null ? null : el('a', { href: format({ survey: action.survey, finding: action.finding_id }), text: `${kind}, finding ${action.finding_id}` });
  const stretch = link || action.chainage_from === action.chainage_to ? null : `${station(action.chainage_from)} to ${station(action.chainage_to)}`;
  const parts = [action.label, action.element, stretch].filter(Boolean).join(', ');
  return [`${parts}${link ? ', ' : ''}`, link, ` (${action.survey})`].filter(Boolean);
}

function factsOf({ due, responsible, cost, currency }) {
  const money = cost === null ? null : `${cost.toFixed(2).replace(/\B(?=(\d{3})+(?!\d))/g, '\u202f')} ${currency}`;
  return [due ? `Due ${due}` : 'No due date', responsible ?? 'nobody responsible', money].filter(Boolean).join('; ');
}

function writtenBy({ id, added_by: by, added_at: at, changed_by: last, changed_at: then }) {
  return `No. ${id}, added by ${by}, ${at}${last ? `; changed by ${last}, ${then}` : ''}`;
}

function nowText({ state, urgency, responsible, due, cost, currency, remark }) {
  return [state, urgency, responsible, due ? `due ${due}` : null, cost === null ? null : `${cost} ${currency}`, remark].filter(Boolean).join(', ');
}

/** Return the names of the inputs that are as the action was. */
function untouched(inputs, action) {
  const values = valuesOf(inputs);
  return Object.keys(values).filter((name) => values[name] === action[name]);
}

/** Return the values of a form; throw RangeError with a sentence if one is not valid. */
function valuesOf(inputs) {
  const text = (name) => inputs[name].value.trim() || null;
  if (!text('measure')) throw new RangeError('Enter the measure: what is to be done.');
  if (inputs.due.validity.badInput) throw new RangeError('Enter the due date in full.');
  const typed = text('cost');
  const cost = typed === null ? null : Number(typed.replace(/[\s\u202f']/g, '').replace(',', '.'));
  if (cost !== null && !(cost >= 0)) throw new RangeError('Enter the cost as a number, such as 1200.50.');
  const currency = cost === null ? null : (text('currency') ?? '').toUpperCase();
  if (cost !== null && !/^[A-Z]{3}$/.test(currency)) throw new RangeError('Enter the currency in three letters, such as EUR.');
  return {
    measure: text('measure'), urgency: inputs.urgency.value, state: inputs.state.value, responsible: text('responsible'), due: text('due'),
    cost, currency, remark: text('remark'),
  };
}

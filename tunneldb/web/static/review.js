/** Review by keys, and the finding that is shown. */

import { actionsOf } from './actions.js';
import { ApiError } from './api.js';
import { Cutouts } from './cutouts.js';
import { button, check, choice, el, field, takesKeys } from './dom.js';
import { Filter } from './filter.js';
import { factsOf, headOf } from './finding.js';
import { Photos } from './photos.js';
import { ConflictError, LIST_LIMIT } from './session.js';
import { kindKeys, OPEN, progressText } from './worklist.js';

const ZOOM = 1.5;
const AHEAD = 2;

/** Panel of the review. */
export class Review {
  /**
   * @param {Session} session
   * @param {Object} app - canWrite, say(text, wrong), shown(finding, fit), changed(), extent(), outlined(), outlines(on), actions(wanted), outbox.
   */
  constructor(session, app) {
    this.session = session;
    this.app = app;
    this.busy = false;
    this.waiting = null;
    this.written = new Map();
    this.keysOn = true;
    this.reviewing = false;
    this.typed = false;
    this.keys = new Map();
    this.cutouts = new Cutouts();
    this.photos = new Photos({ canWrite: app.canWrite, say: app.say, outbox: app.outbox, changed: (finding) => this.takePhotos(finding) });
    this.filter = new Filter((value) => this.load(value));
    this.build();
    document.addEventListener('keydown', (event) => this.key(event));
  }

  build() {
    this.progress = el('progress', { max: '1', value: 0, 'aria-label': 'Reviewed' });
    this.pace = el('p', { class: 'pace', role: 'status' });
    this.goOn = check('Next finding after a verdict', true, () => {});
    this.single = check('Single-key commands', true, (on) => { this.keysOn = on; });
    this.head = el('div', { class: 'review-head' }, this.filter.root, this.progress, this.pace, el('div', { class: 'row' }, this.goOn, this.single));
    this.conflict = el('div', { class: 'conflict', role: 'alertdialog', 'aria-label': 'Conflict', hidden: true, tabindex: '-1' });
    this.name = el('div', {});
    this.facts = el('div', {});
    this.demanded = el('div', {});
    this.kind = el('select', { onchange: (event) => this.setKind(event.target.value) });
    this.remark = el('input', {
      type: 'text', maxlength: '2000', placeholder: 'Remark (M); Enter saves', autocomplete: 'off', enterkeyhint: 'done',
      oninput: () => this.keep(), onkeydown: (event) => this.remarkKey(event),
    });
    const act = (text, name, props = {}) => button(text, () => this[name](), { ...props, data: { act: name } });
    this.verdicts = el('div', { class: 'verdicts', role: 'group', 'aria-label': 'Review' },
      act('Confirm', 'confirm', { class: 'confirm', 'aria-keyshortcuts': 'c' }), act('Reject', 'reject', { class: 'reject', 'aria-keyshortcuts': 'r' }),
      act('Open', 'reopen', { 'aria-keyshortcuts': 'o', title: 'Remove the verdict' }), act('Undo', 'undo', { 'aria-keyshortcuts': 'z' }),
      act('◀', 'previous', { 'aria-label': 'Previous', 'aria-keyshortcuts': 'p' }), act('▶', 'next', { 'aria-label': 'Next', 'aria-keyshortcuts': 'n' }));
    this.inputs = el('div', { class: 'row inputs' }, field('Kind', this.kind), field('Remark', this.remark, { class: 'field grow' }));
    this.body = el('div', { class: 'finding', hidden: true }, this.name, this.verdicts, this.inputs, this.conflict, this.cutouts.root, this.facts);
    this.none = el('p', { class: 'muted pad' });
    this.help = keysHelp();
    this.root = el('div', { class: 'review' }, this.head, this.none, this.body, this.help);
  }

  /** Use a survey; nothing is read until it is asked for. */
  setSurvey(survey) {
    this.survey = survey;
    this.session.clear();
    this.session.labels = new Map(survey.finding_kinds.map(({ code, label }) => [code, label]));
    const active = survey.finding_kinds.filter(({ active: offered }) => offered);
    this.keys = kindKeys(active);
    const keyOf = new Map([...this.keys].map(([key, code]) => [code, key.toUpperCase()]));
    this.kind.replaceChildren(...active.map(({ code, label }) => el('option', { value: code, text: keyOf.has(code) ? `${label} (${keyOf.get(code)})` : label })));
    this.cutouts.setSurvey(survey);
    this.filter.setSurvey(survey, () => this.app.extent());
    this.typed = false;
    this.waiting = null;
    this.refresh();
  }

  /** Show the list and its keys, or one finding only. */
  setReviewing(on) {
    this.reviewing = on;
    this.head.hidden = this.help.hidden = !on;
    if (on && !this.session.listed && this.survey) this.load(this.filter.value);
    else this.refresh();
  }

  /** Show a finding by its number. */
  open(id, fit = true) {
    return this.act(async () => {
      await this.session.open(id);
      this.shown(fit);
    });
  }

  /** Read a finding again, if it is shown, now that the database has what waited for it; its number then may be another one. */
  renew(shown, id) {
    if (this.busy) this.written.set(shown, id);
    else if (this.session.facts?.id === shown) this.open(id, false);
  }

  /** Read the list of a selection; if a finding is being read, after it. */
  load(filter) {
    if (!filter) return;
    if (this.busy) {
      this.waiting = filter;
      this.refresh();
      return;
    }
    this.act(async () => {
      await this.session.load(this.survey.name, filter);
      if (!this.session.work.current && (await this.session.step(1))) this.shown(true);
      else if (!this.session.work.current) this.app.say('No finding to review in this selection.');
    });
  }

  confirm() { return this.judge('confirmed'); }

  reject() { return this.judge('rejected'); }

  /** Remove the verdict, and stay. */
  reopen() {
    return this.act(async () => {
      await this.write({ review: OPEN });
    });
  }

  setKind(code) {
    return this.act(async () => {
      await this.write({ kind: code });
    });
  }

  next() { return this.move(1, 'That was the last finding of this selection.'); }

  previous() { return this.move(-1, 'There is no previous finding.'); }

  /** Undo the last step; a remark that was typed is written first if that was elsewhere. */
  undo() {
    return this.act(async () => {
      const { session } = this;
      if (this.typed && !session.undoesShown && session.steps.length) {
        const step = session.steps.at(-1);
        if (await session.write(this.begun())) session.steps.splice(-2, 2, session.facts.id, step);
        this.typed = false;
      }
      const kept = this.typed ? this.remark.value : null;
      const text = await session.undo();
      this.app.say(text);
      this.shown(true);
      if (kept !== null) {
        this.remark.value = kept;
        this.keep();
      }
      this.app.changed();
    });
  }

  judge(review) {
    return this.act(async () => {
      await this.write({ review, ...this.begun() });
      this.typed = false;
      if (!this.reviewing || !this.goOn.firstChild.checked) return;
      if (await this.session.step(1)) this.shown(true);
      else this.app.say(`${this.session.facts.recorded ? 'Recorded on this device.' : 'Saved.'} That was the last finding of this selection.`);
    });
  }

  move(direction, end) {
    return this.act(async () => {
      if (this.typed) await this.write(this.begun());
      this.typed = false;
      if (await this.session.step(direction)) this.shown(true);
      else this.app.say(end);
    });
  }

  async write(values) {
    if (!this.session.facts) return;
    const wrote = await this.session.write(values);
    if ('remark' in values) this.typed = false;
    if (wrote) this.app.changed();
    else this.app.say('Nothing to save: the finding is already so.');
  }

  /** Do something once at a time; show its error in one line. */
  async act(what) {
    if (this.busy) {
      this.session.outbox.send();
      return;
    }
    this.busy = true;
    this.conflict.hidden = true;
    this.root.setAttribute('aria-busy', 'true');
    try {
      await what();
    } catch (error) {
      if (error instanceof ConflictError) this.showConflict(error);
      else if (error instanceof ApiError) this.app.say(error.message, true);
      else throw error;
    } finally {
      this.busy = false;
      this.root.removeAttribute('aria-busy');
      this.refresh();
    }
    // The finding may have been read before the database had what waited for it.
    const stale = this.written.get(this.session.facts?.id);
    this.written.clear();
    if (stale !== undefined) {
      this.open(stale, false);
      return;
    }
    const { waiting } = this;
    this.waiting = null;
    this.load(waiting);
  }

  showConflict({ message, wanted, record }) {
    const mine = Object.entries(wanted).map(([name, value]) => `${name}: ${value ?? 'none'}`).join(', ');
    this.conflict.hidden = false;
    this.conflict.replaceChildren(
      el('p', {}, el('strong', { text: 'Not saved. ' }), message), el('p', { text: `Yours: ${mine}.` }),
      el('div', { class: 'row' },
        button('Write mine', () => this.act(async () => { await this.write(wanted); })),
        button('Keep theirs', () => {
          this.session.outbox.discard(record);
          this.conflict.hidden = true;
          this.typed = false;
          this.refresh();
        })));
    this.conflict.focus();
    this.app.say('Not saved: somebody else changed this finding.', true);
  }

  shown(fit) {
    this.typed = false;
    const draft = sessionStorage.getItem(this.draftKey);
    this.refresh();
    if (draft !== null && draft !== (this.session.facts?.remark ?? '')) {
      this.remark.value = draft;
      this.typed = true;
    }
    this.app.shown(this.session.facts, fit);
    this.cutouts.prepare(this.session.work.ahead(AHEAD));
  }

  refresh() {
    const { session, survey } = this;
    const { facts, work } = session;
    this.body.hidden = !facts;
    this.none.hidden = Boolean(facts);
    this.none.textContent = this.noneText;
    this.progress.max = Math.max(work.findings.length, 1);
    this.progress.value = work.reviewed;
    const capped = work.findings.length >= LIST_LIMIT ? ` The list ends after ${LIST_LIMIT} findings: choose a stretch.` : '';
    this.pace.textContent = session.listed ? `${progressText(work, session.pace)}.${capped}` : '';
    for (const control of this.verdicts.querySelectorAll('button')) {
      const moves = ['next', 'previous'].includes(control.dataset.act);
      control.disabled = moves ? !session.listed : !this.app.canWrite;
      control.hidden = moves && !this.reviewing;
    }
    this.kind.disabled = this.remark.disabled = !this.app.canWrite;
    if (!facts) return;
    this.name.replaceChildren(headOf(facts));
    if (![...this.kind.options].some((option) => option.value === facts.kind)) this.kind.append(el('option', { value: facts.kind, text: facts.kind_label ?? facts.kind }));
    this.kind.value = facts.kind;
    if (!this.typed) this.remark.value = facts.remark ?? '';
    if (this.drawn !== facts) {
      this.drawn = facts;
      this.cutouts.show(facts);
      this.photos.show(facts);
      this.showActions();
      this.facts.replaceChildren(factsOf(facts, survey, survey.severities, this.photos.root, this.demanded, this.app.say));
      this.app.marked(facts);
    }
  }

  get noneText() {
    if (!this.reviewing) return 'Click a finding on the lining, or open Review to step through them.';
    if (!this.session.listed) return 'The list of findings has not been read.';
    return 'No finding is left in this selection. See above the map what was not inspected.';
  }

  /** Show the photos of a finding as they are now; the review that is in progress stays as it is. */
  takePhotos({ id, photos }) {
    const { facts } = this.session;
    if (facts?.id !== id) return;
    facts.photos = photos;
    this.photos.show(facts);
  }

  /** Show the actions of the finding as they are now, given those of the tunnel. */
  takeActions(actions) {
    const { facts } = this.session;
    if (!facts || facts.id < 0) return;
    facts.actions = actions.filter(({ finding_id: id }) => id === facts.id);
    this.showActions();
  }

  showActions() {
    const { facts } = this.session;
    this.demanded.replaceChildren(...[facts.id > 0 ? actionsOf(facts, this.app.canWrite, this.app.actions) : null].filter(Boolean));
  }

  get draftKey() {
    return `tunneldb.remark.${this.session.facts?.id}`;
  }

  /** Keep a remark that was typed over a reload of the page. */
  keep() {
    this.typed = true;
    sessionStorage.setItem(this.draftKey, this.remark.value);
  }

  begun() {
    if (!this.typed) return {};
    sessionStorage.removeItem(this.draftKey);
    return { remark: this.remark.value.trim() || null };
  }

  remarkKey(event) {
    if (event.key === 'Escape') {
      this.typed = false;
      sessionStorage.removeItem(this.draftKey);
      this.refresh();
      this.takeKeys();
    } else if (event.key === 'Enter') {
      event.preventDefault();
      this.act(async () => {
        await this.write({ remark: this.remark.value.trim() || null });
        sessionStorage.removeItem(this.draftKey);
        this.takeKeys();
      });
    }
  }

  showOutlines(on) {
    this.cutouts.showOutlines(on);
    this.app.outlines(on);
  }

  takeKeys() {
    document.activeElement?.blur();
  }

  key(event) {
    const inMap = event.target.closest?.('.map');
    if (this.root.closest('[hidden]') || !this.keysOn || takesKeys(event.target) || event.altKey || event.metaKey) return;
    const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (event.ctrlKey && name !== 'z') return;
    if (inMap && (name.startsWith('Arrow') || name === '+' || name === '-')) return;
    if (event.target.closest?.('[role=tablist]') && name.startsWith('Arrow')) return;
    const does = this.command(name);
    if (!does) return;
    event.preventDefault();
    // A held key must not judge findings that nobody has looked at.
    if (!event.repeat) does();
  }

  command(name) {
    const steps = { n: 'next', ArrowRight: 'next', p: 'previous', ArrowLeft: 'previous' };
    const writes = { c: 'confirm', r: 'reject', o: 'reopen', z: 'undo' };
    if (name in steps) return this.reviewing ? () => this[steps[name]]() : null;
    if (name === 'h') return () => this.showOutlines(!this.app.outlined());
    if (name === '+') return () => this.cutouts.zoomBy(ZOOM);
    if (name === '-') return () => this.cutouts.zoomBy(1 / ZOOM);
    if (!this.app.canWrite) return name in writes || name === 'm' || this.keys.has(name) ? () => this.app.say('A viewer cannot review.', true) : null;
    if (name in writes) return () => this[writes[name]]();
    if (name === 'm' && this.session.facts) {
      return () => {
        this.remark.focus();
        this.remark.select();
      };
    }
    return this.keys.has(name) && this.session.facts ? () => this.setKind(this.keys.get(name)) : null;
  }
}

function keysHelp() {
  const rows = [
    ['N →, P ←', 'next, previous'], ['C, R', 'confirm, reject, and next'], ['O', 'remove the verdict'],
    ['1–9, J, D', 'set the kind; J joint, D dry dark area'], ['M', 'remark; Enter saves, Esc cancels'], ['Z', 'undo'],
    ['H', 'outlines off and on'], ['+ −', 'larger, smaller'],
  ];
  return el('details', { class: 'fold' }, el('summary', { text: 'Keys' }),
    el('dl', { class: 'values' }, ...rows.flatMap(([key, text]) => [el('dt', {}, el('kbd', { text: key })), el('dd', { text })])));
}

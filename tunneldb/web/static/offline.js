/** Panel to take a stretch offline, and the list of those that are held. */

import { button, check, el, field } from './dom.js';
import { parseStation, station, time } from './format.js';
import { heldStretches, possible, removeStretch, shellName } from './held.js';
import { estimate, keepShell, MAX_LENGTH, refresh, Take } from './take.js';

const megabytes = (bytes) => (bytes < 1e6 ? 'less than 1 MB' : `about ${Math.round(bytes / 1e6)} MB`);
const TEXTS = { AbortError: 'Stopped.', QuotaExceededError: 'This device has no space left: remove another stretch, or take a shorter one.' };
const text = (error) => TEXTS[error.name] ?? error.message;

/** Panel of what is taken offline. */
export class OfflinePanel {
  /**
   * @param {string} user
   * @param {Object} app - extent(), kind(), changed().
   */
  constructor(user, app) {
    this.user = user;
    this.app = app;
    this.take = null;
    this.root = el('div', { class: 'pad offline' });
  }

  /** Show the form for a survey, with the stretch in view, and the list. */
  open(survey) {
    if (this.take) return;
    this.survey = survey;
    if (!possible()) {
      this.root.replaceChildren(el('h2', { text: 'Take offline' }), el('p', { class: 'warn-text', text: reason() }));
      return;
    }
    this.build();
    this.setView();
    this.list();
  }

  build() {
    const { survey } = this;
    const input = () => el('input', { type: 'text', inputmode: 'decimal', onchange: () => this.forget() });
    this.from = input();
    this.to = input();
    this.kinds = survey.kinds.map(({ kind, label }) => check(label, kind === this.app.kind(), () => this.forget(), { value: kind }));
    this.told = el('p', { role: 'status', 'aria-live': 'polite' });
    this.bar = el('progress', { max: '1', value: 0, 'aria-label': 'Taken offline', hidden: true });
    this.size = button('State size', () => this.measure());
    this.start = button('Take offline', () => this.begin(), { class: 'main', disabled: true });
    this.stop = button('Cancel', () => this.take?.cancel(), { hidden: true });
    this.held = el('ul', { class: 'plain' });
    this.root.replaceChildren(
      el('h2', { text: 'Take offline' }),
      el('p', { text: `Keep a stretch of at most ${MAX_LENGTH} m on this device for 24 hours: images, findings with their values and photos, ribbon and summary. It is removed when you sign out.` }),
      el('div', { class: 'row' }, field('From', this.from), field('To', this.to), button('Stretch in view', () => this.setView())),
      el('fieldset', {}, el('legend', { text: 'Images' }), ...this.kinds),
      el('div', { class: 'row' }, this.size, this.start, this.stop), this.bar, this.told,
      el('h3', { text: 'Held on this device' }), this.held);
  }

  setView() {
    const { survey } = this;
    const [low, high] = this.app.extent();
    this.from.value = Math.max(low, survey.from).toFixed(1);
    this.to.value = Math.min(high, survey.to, Number(this.from.value) + MAX_LENGTH).toFixed(1);
    this.forget();
  }

  /** Forget the size: the entries have changed. */
  forget() {
    this.start.disabled = true;
    this.say('');
  }

  /** Return the stretch of the form, or null if an entry is not valid. */
  get stretch() {
    const [from, to] = [this.from, this.to].map((box) => parseStation(box.value));
    const { survey } = this;
    const kinds = this.kinds.map((label) => label.firstChild).filter((box) => box.checked).map((box) => box.value);
    if (!(from < to)) this.say('Enter two chainages in m or as 12+345, the smaller one first.', true);
    else if (to - from > MAX_LENGTH + 1e-6) this.say(`The stretch is ${(to - from).toFixed(1)} m long: at most ${MAX_LENGTH} m.`, true);
    else if (from >= survey.to || to <= survey.from) this.say(`The survey reaches from ${station(survey.from)} to ${station(survey.to)}.`, true);
    else return { survey: survey.name, from: Math.max(from, survey.from), to: Math.min(to, survey.to), kinds };
    return null;
  }

  /** State size and number of tiles, and whether they fit. */
  async measure() {
    const { stretch } = this;
    if (!stretch) return;
    this.size.disabled = true;
    this.say('Reading a few tiles …');
    try {
      const { tiles, bytes } = await estimate(this.survey, stretch);
      const { quota = Infinity, usage = 0 } = await navigator.storage.estimate();
      const free = quota - usage;
      if (bytes > free) this.say(`Size: ${megabytes(bytes)}, ${tiles} tiles of images. This device has ${megabytes(free)} of space left. Take a shorter stretch.`, true);
      else this.say(`Size: ${megabytes(bytes)}, ${tiles} tiles of images.`);
      this.start.disabled = bytes > free;
    } catch (error) {
      this.say(text(error), true);
    }
    this.size.disabled = false;
  }

  begin() {
    const { stretch } = this;
    if (stretch) this.run({ ...stretch, at: Date.now() });
  }

  async run(facts) {
    this.take = new Take(this.user, { ...this.survey, name: facts.survey }, facts, (now) => this.progress(now));
    this.busy(true);
    try {
      await navigator.storage.persist();
      await navigator.serviceWorker.register('/worker.js');
      await keepShell(this.user);
      await this.take.run();
      this.say(`Taken offline: ${place(facts)}.`);
    } catch (error) {
      const { done, total } = this.take.facts;
      const more = total ? ` ${done} of ${total} parts are held.` : '';
      this.say(`${text(error)}${more}`, true);
    }
    this.take = null;
    this.busy(false);
    this.list();
    this.app.changed();
  }

  progress({ done, total }) {
    this.bar.max = Math.max(total, 1);
    this.bar.value = done;
    this.say(`${done} of ${total} parts …`);
  }

  busy(on) {
    this.bar.hidden = this.stop.hidden = !on;
    this.size.disabled = on;
    this.start.disabled = true;
    this.held.querySelectorAll('button').forEach((control) => { control.disabled = on; });
  }

  /** List what is held. */
  async list() {
    const stretches = await heldStretches(this.user);
    const rows = stretches.map((facts) => el('li', {},
      el('span', { text: `${place(facts)}: ${megabytes(facts.bytes)}, as of ${time(facts.at)}${facts.complete ? '' : `, ${facts.done} of ${facts.total} parts`}` }), ' ',
      facts.complete || facts.survey !== this.survey.name ? null : button('Resume', () => this.run(facts)), ' ',
      button('Remove', () => this.remove(facts), { 'aria-label': `Remove ${place(facts)}` })));
    this.held.replaceChildren(...(rows.length ? rows : [el('li', { class: 'muted', text: 'Nothing is held.' })]));
  }

  async remove(facts) {
    await removeStretch(this.user, facts.at);
    this.say(`Removed: ${place(facts)}.`);
    this.list();
    this.app.changed();
  }

  say(words, wrong = false) {
    this.told.className = wrong ? 'wrong' : '';
    this.told.textContent = words;
  }
}

/** Return a stretch in words. */
export function place({ survey, from, to }) {
  return `${survey}, ${station(from)} to ${station(to)}`;
}

function reason() {
  if (!window.isSecureContext) return `A browser works without a network only at an address with https, or at localhost. This page is at ${location.origin}.`;
  return 'This browser cannot keep data to work without a network.';
}

/** Renew the copy of the page after another version of the desk was installed. */
export async function renewShell(user) {
  const cache = await caches.open(shellName(user));
  if (!(await cache.match(new URL('main.js', import.meta.url).pathname))) await keepShell(user);
}

/** Read what has changed of findings into what is held. */
export async function renewFindings(user, ids) {
  await refresh(user, await heldStretches(user), ids);
}

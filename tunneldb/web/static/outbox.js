/**
 * What a person recorded and the database does not have yet: verdicts, drawn findings and photos, kept on this device.
 *
 * Each record is kept before it is sent, and until the server has answered or the person has decided. Records of a finding are
 * sent in their order. What is sent twice, because an answer was lost, is written once.
 */

import { ApiError, findingPath, patch, post, surveyPath, upload } from './api.js';
import { geometryExtent } from './plane.js';
import { openDB } from './vendor/idb/idb.js';

const STORE = 'records';
const WAITS = [1, 2, 4, 8, 15];

/** Longest time for which a person waits for an answer before the record is left to itself, ms. */
const PATIENCE = 4000;

const SENDERS = {
  review: ({ finding, seen, values }) => patch(findingPath(finding), { seen, values }),
  draw: ({ survey, body, tried }) => post(surveyPath(survey, '/findings'), { ...body, again: tried > 1 }),
  photo: ({ finding, file }) => upload(findingPath(finding, '/photos'), file),
};

/** Return the number of the finding of a record; a drawn one that the database does not have has a negative number. */
export const findingOf = (record) => (record.type === 'draw' ? -record.key : record.finding);

/** Return a record in words. */
export function textOf(record) {
  const finding = findingOf(record);
  const name = finding > 0 ? `finding ${finding}` : 'a drawn finding';
  if (record.type === 'draw') return `Drawn: ${record.body.kind}${record.body.remark ? `, ${record.body.remark}` : ''}`;
  if (record.type === 'photo') return `Photo of ${name}`;
  return `${name[0].toUpperCase()}${name.slice(1)}: ${Object.values(record.values).map((value) => value ?? 'no remark').join(', ')}`;
}

/** Records of a user, in order. */
export class Outbox {
  /**
   * @param {string} user
   * @param {Object} on - changed(), state({state, record, text}), sent(record, answer) for a record nobody waits for.
   */
  constructor(user, on) {
    Object.assign(this, { user, on, records: [], db: null, away: false, failures: 0, waiters: new Map(), lanes: {}, sending: new Set(), gone: new Set(), fresh: new Set(), last: 0 });
    this.name = `tunneldb.${user}`;
    window.addEventListener('online', () => this.send());
    window.addEventListener('beforeunload', (event) => {
      if (!this.db && this.records.length) event.preventDefault();
    });
    this.ready = this.open();
  }

  async open() {
    await null; // The page is built first.
    try {
      this.db = await openDB(this.name, 1, { upgrade: (db) => db.createObjectStore(STORE, { keyPath: 'key' }) });
      await this.load();
    } catch {
      this.db = null; // A browser that keeps nothing: records last as long as the page.
    }
    this.last = Math.max(0, ...this.records.map(({ key }) => key));
    this.on.changed();
    if (this.records.length) this.send();
  }

  /** Records that wait for the network, or for the person. */
  get waiting() {
    return this.records.filter((record) => record.stopped || this.away || !this.fresh.has(record.key));
  }

  /** Keep a record; return it. It fails if the device has no space. */
  async add(fields) {
    await this.ready;
    this.last = Math.max(this.last + 1, Date.now());
    const record = { ...fields, key: this.last, at: new Date().toISOString(), tried: 0, stopped: null };
    this.fresh.add(record.key);
    try {
      await this.db?.add(STORE, record);
    } catch (error) {
      if (error.name !== 'QuotaExceededError') throw error;
      throw new ApiError(507, 'This device has no space left: remove a stretch that was taken offline.');
    }
    const known = this.records.find(({ key }) => key === record.key);
    if (!known) this.records.push(record);
    this.on.changed();
    return known ?? record;
  }

  /**
   * Keep a record, and send it; return the answer of the server, or null if the record waits.
   * @throws {ApiError} The server refuses: the record waits for the person.
   */
  async save(fields) {
    return this.submit(await this.add(fields));
  }

  /** Send a verdict that met another one again, now that the person has seen that. */
  async again(record, seen, values) {
    await this.change(record, { stopped: null, seen, values });
    return this.submit(record);
  }

  /** Send a record that is kept; see save. */
  async submit(record) {
    this.on.state({ state: 'saving', record });
    const settled = new Promise((resolve, reject) => { this.waiters.set(record.key, { resolve, reject }); });
    const late = new Promise((resolve) => { setTimeout(() => resolve(null), this.away ? 0 : PATIENCE); });
    this.send();
    try {
      const answer = await Promise.race([settled, late]);
      if (answer === null) {
        this.fresh.delete(record.key);
        this.on.changed();
        this.on.state({ state: 'waiting', record });
      }
      return answer;
    } catch (error) {
      error.record = record;
      throw error;
    } finally {
      this.waiters.delete(record.key);
      settled.catch(() => {});
    }
  }

  /** Send what waits; photos do not hold up the rest. */
  send() {
    clearTimeout(this.timer);
    return Promise.all([this.lane('photo', ({ type }) => type === 'photo'), this.lane('rest', ({ type }) => type !== 'photo')]);
  }

  lane(name, wanted) {
    const work = async () => {
      try {
        do {
          this.lanes[name].again = false;
          await this.sendAll(wanted);
        } while (this.lanes[name].again);
      } finally {
        this.lanes[name] = null;
      }
    };
    if (this.lanes[name]) {
      this.lanes[name].again = true;
    } else {
      this.lanes[name] = { again: false };
      // Another tab of the same user sends the same records.
      this.lanes[name].done = navigator.locks ? navigator.locks.request(`${this.name}.${name}`, work) : work();
    }
    return this.lanes[name].done;
  }

  async sendAll(wanted) {
    await this.load();
    // A photo depends on no other record than its drawn finding.
    const blocked = new Set(this.records.filter(({ stopped, type }) => stopped && type !== 'photo').map(findingOf));
    for (let record; (record = this.records.find((one) => wanted(one) && !one.stopped && (one.type === 'photo' || !blocked.has(findingOf(one))) && !(one.finding < 0)));) {
      if (!(await this.sendOne(record))) return;
      if (record.stopped) blocked.add(findingOf(record));
    }
  }

  /** Send a record; return false if the server is away. */
  async sendOne(record) {
    let answer;
    try {
      this.sending.add(record);
      await this.change(record, { tried: record.tried + 1 }, false);
      answer = await SENDERS[record.type](record);
    } catch (error) {
      if (error.status === undefined) throw error;
      if (error.away || error.status === 401) return this.postpone(record, error);
      await this.change(record, { stopped: { text: error.message, finding: error.data?.finding ?? null } });
      this.on.state({ state: 'failed', record, text: error.message });
      this.waiters.get(record.key)?.reject(error);
      return true;
    } finally {
      this.sending.delete(record);
    }
    this.away = false;
    this.failures = 0;
    await this.remove(record, record.type === 'draw' ? answer.id : null);
    this.on.state({ state: 'saved', record });
    if (this.waiters.has(record.key)) this.waiters.get(record.key).resolve(answer);
    else this.on.sent(record, answer);
    return true;
  }

  postpone(record, error) {
    this.away = true;
    const seconds = WAITS[Math.min(this.failures, WAITS.length - 1)];
    this.failures += 1;
    this.timer = setTimeout(() => this.send(), seconds * 1000);
    this.waiters.get(record.key)?.resolve(null);
    this.on.changed();
    return false;
  }

  /** Write over what another person has written (mine), or drop the own values. */
  async decide(record, mine) {
    if (!mine) {
      await this.remove(record);
      return;
    }
    const { review, remark, kind } = record.stopped.finding ?? record.seen;
    await this.change(record, { stopped: null, seen: { review, remark, kind } });
    await this.send();
  }

  /** Send a record that was refused again. */
  async retry(record) {
    await this.change(record, { stopped: null });
    await this.send();
  }

  /** Drop a record that is not being sent, as the person asked; return false if it is. A drawn finding takes what belongs to it along. */
  async discard(record) {
    if (this.sending.has(record)) return false;
    if (record.type === 'draw') for (const other of this.records.filter(({ finding }) => finding === -record.key)) await this.remove(other);
    await this.remove(record);
    return true;
  }

  /** Return the verdict on a finding that met another one, if all its values are given anew. */
  conflict(id, values) {
    return this.records.find(({ type, finding, stopped, values: own }) => type === 'review' && finding === id && stopped && Object.keys(own).every((name) => name in values));
  }

  /** Return the last verdict on a finding that waits. */
  lastReview(id) {
    return this.records.filter(({ type, finding, stopped }) => type === 'review' && finding === id && !stopped).at(-1) ?? null;
  }

  /** Return a finding with the values that wait for it. */
  overlay(finding) {
    const waits = this.records.filter(({ type, finding: id, stopped }) => type === 'review' && id === finding.id && !stopped);
    const kind = waits.some(({ values }) => values.kind) ? { kind_label: null } : {};
    return waits.length ? Object.assign({}, finding, ...waits.map(({ values }) => values), kind, { recorded: true }) : finding;
  }

  /** Return a drawn finding that waits as the server would; null if it does not wait. */
  drawn(id) {
    const record = this.records.find(({ type, key }) => type === 'draw' && key === -id);
    if (!record) return null;
    const { geometry, kind, severity, width_mm, remark } = record.body;
    const [from, low, to, high] = geometryExtent(geometry);
    return this.overlay({
      id, survey: record.survey, outline: geometry, kind, kind_label: null, severity, width_mm, remark, label: null, clock: null,
      chainage_from: from, chainage_to: to, arc_from: low, arc_to: high, review: 'confirmed', state: 'confirmed', origin: 'drawn',
      drawn_by: this.user, reviewed_by: this.user, reviewed_at: record.at, area: null, length: null, kind_detected: null, confidence: null,
      darkening_mean: null, darkening_max: null, contrast: null, evidence: [], photos: [], history: [], recorded: true,
    });
  }

  /** Drop all records of the user. */
  async clear() {
    this.records = [];
    await this.db?.clear(STORE);
  }

  async load() {
    if (!this.db) return;
    const stored = (await this.db.getAll(STORE)).filter(({ key }) => !this.gone.has(key));
    const known = new Map(this.records.map((record) => [record.key, record]));
    this.records = stored.map((record) => known.get(record.key) ?? record);
  }

  async change(record, values, told = true) {
    Object.assign(record, values);
    await this.db?.put(STORE, record);
    if (told) this.on.changed();
  }

  /** Remove a record; what belongs to a drawn finding then belongs to the one that the database has. */
  async remove(record, id = null) {
    const own = id === null ? [] : this.records.filter(({ finding }) => finding === -record.key);
    own.forEach((other) => { other.finding = id; });
    this.gone.add(record.key);
    this.records = this.records.filter((other) => other !== record);
    if (this.db) {
      const work = this.db.transaction(STORE, 'readwrite');
      await Promise.all([work.store.delete(record.key), ...own.map((other) => work.store.put(other)), work.done]);
    }
    this.on.changed();
    if (own.length) this.send();
  }
}

/** Writing of verdicts: tries again while the server is away, and loses nothing. */

import { findingPath, patch } from './api.js';

const WAITS = [1, 2, 4, 8, 15];

/** The user gave up a write that had not been saved. */
export class DiscardedError extends Error {}

/**
 * Writer of verdicts; one at a time.
 *
 * A write is kept in the browser's storage until the server has answered, so that a closed page does not lose it.
 */
export class Saver {
  /**
   * @param {string} user
   * @param {function(Object)} onState - is called with {state: 'saving'|'waiting'|'saved'|'failed', job, seconds, text}.
   */
  constructor(user, onState) {
    this.key = `tunneldb.unsaved.${user}`;
    this.onState = onState;
    this.job = null;
    this.wake = null;
    window.addEventListener('online', () => this.retry());
    window.addEventListener('beforeunload', (event) => {
      if (this.job) event.preventDefault();
    });
  }

  get busy() {
    return this.job !== null;
  }

  get waiting() {
    return this.wake !== null;
  }

  /** Return a write of an earlier visit that was not saved, or null. */
  left() {
    try {
      return JSON.parse(localStorage.getItem(this.key));
    } catch {
      return null;
    }
  }

  /** Keep a write of an earlier visit that could not be saved. */
  keep(job) {
    localStorage.setItem(this.key, JSON.stringify(job));
  }

  /** Forget the write of an earlier visit. */
  forget() {
    localStorage.removeItem(this.key);
  }

  /**
   * Write values of a finding; return the server's answer.
   * @throws {ApiError} The server refuses.
   * @throws {DiscardedError} The user discarded it.
   */
  async save(id, seen, values) {
    this.job = { id, seen, values };
    localStorage.setItem(this.key, JSON.stringify(this.job));
    try {
      const answer = await this.attempts();
      this.onState({ state: 'saved', job: this.job });
      return answer;
    } catch (error) {
      this.onState({ state: 'failed', job: this.job, text: error.message });
      // After a sign-out the write is offered again on the next visit.
      if (error.status === 401) this.job = null;
      throw error;
    } finally {
      if (this.job) this.forget();
      this.job = null;
    }
  }

  /** Try again now; return true if a write was waiting. */
  retry() {
    this.wake?.(true);
    return this.waiting;
  }

  /** Give up the write that waits. */
  discard() {
    this.wake?.(false);
  }

  async attempts() {
    const { id, seen, values } = this.job;
    for (let n = 0; ; n += 1) {
      this.onState({ state: 'saving', job: this.job });
      try {
        return await patch(findingPath(id), { seen, values });
      } catch (error) {
        if (!error.away) throw error;
        const seconds = WAITS[Math.min(n, WAITS.length - 1)];
        this.onState({ state: 'waiting', job: this.job, seconds, text: error.message });
        if (!(await this.pause(seconds))) throw new DiscardedError('Discarded: not saved.');
      }
    }
  }

  pause(seconds) {
    return new Promise((resolve) => {
      const end = (again) => {
        clearTimeout(timer);
        this.wake = null;
        resolve(again);
      };
      const timer = setTimeout(() => end(true), seconds * 1000);
      this.wake = end;
    });
  }
}

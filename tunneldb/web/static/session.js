/** A review in progress: its rules, without the page. */

import { findingPath, get, post, surveyPath } from './api.js';
import { OPEN, Pace, WorkList } from './worklist.js';

/** Findings in one answer of the server. */
export const LIST_LIMIT = 5000;

/** Somebody else has changed the finding; nothing was written. */
export class ConflictError extends Error {
  constructor(finding, wanted) {
    const remark = finding.remark ? `, remark “${finding.remark}”` : '';
    super(`${finding.reviewed_by ?? 'Somebody'} has changed finding ${finding.id} in the meantime: it is ${finding.review}, `
      + `${finding.kind_label ?? finding.kind}${remark}. Your review was not written.`);
    this.finding = finding;
    this.wanted = wanted;
  }
}

/** Steps through the findings of a survey, and writes verdicts. */
export class Session {
  /**
   * @param {string} user
   * @param {Saver} saver
   */
  constructor(user, saver) {
    this.user = user;
    this.saver = saver;
    this.clear();
  }

  /** Forget the survey. */
  clear() {
    this.work = new WorkList();
    this.pace = new Pace();
    this.steps = [];
    this.facts = null;
    this.listed = false;
  }

  /** Read the list of a survey; stay at the current finding if it is in it. */
  async load(survey, filter) {
    const query = new URLSearchParams({ order: filter.order });
    for (const kind of filter.kinds) query.append('kind', kind);
    for (const name of ['from', 'to', 'min_area']) if (filter[name] !== null) query.set(name, filter[name]);
    const findings = await get(surveyPath(survey, `/worklist?${query}`));
    this.work = new WorkList(findings, filter.openOnly);
    this.listed = true;
    if (this.facts) this.work.go(this.facts.id);
  }

  /** Read a finding, and make it the current one. */
  async open(id) {
    await this.read(id);
    this.work.go(id);
    return this.facts;
  }

  /**
   * Go to the next (1) or the previous (-1); return false if there is none. If reading fails, nothing changes.
   *
   * What is gone leaves the list; what others have reviewed is skipped if only open findings are shown.
   */
  async step(direction) {
    const was = this.work.current;
    const kept = this.facts;
    try {
      while (this.work.step(direction)) {
        const { id } = this.work.current;
        if (!(await this.exists(id))) {
          this.stay(was);
          this.work.drop(id);
        } else if (!this.work.openOnly || this.facts.review === OPEN) {
          return true;
        }
      }
    } catch (error) {
      this.stay(was);
      this.facts = kept;
      throw error;
    }
    this.stay(was);
    this.facts = kept;
    return false;
  }

  /**
   * Write review, kind or remark of the current finding; return false if it is already so.
   * @throws {ConflictError}
   */
  async write(values) {
    const { facts } = this;
    const wanted = Object.fromEntries(Object.entries(values).filter(([name, value]) => facts[name] !== value));
    if (!Object.keys(wanted).length) return false;
    const seen = { review: facts.review, remark: facts.remark, kind: facts.kind };
    let answer;
    try {
      answer = await this.saver.save(facts.id, seen, wanted);
    } catch (error) {
      if (error.status !== 409 || !error.data?.finding) throw error;
      this.take(error.data.finding);
      throw new ConflictError(error.data.finding, wanted);
    }
    this.take(answer.finding);
    // An answer may have been lost with the connection: what this person wrote is a step of theirs.
    if (!answer.written && answer.finding.reviewed_by !== this.user) return false;
    this.steps.push(facts.id);
    if ((wanted.review ?? OPEN) !== OPEN) this.pace.count(performance.now());
    return true;
  }

  /** Undo the last step of this session, and go to its finding; return a sentence. */
  async undo() {
    const id = this.steps.at(-1);
    if (id === undefined) return 'There is no review to undo.';
    let answer;
    try {
      answer = await post(findingPath(id, '/undo'));
    } catch (error) {
      // The database never takes this step back: it would refuse it each time.
      if (error.status === 409 || error.status === 404) this.steps.pop();
      throw error;
    }
    this.steps.pop();
    if (answer.finding) this.take(answer.finding);
    const listed = this.work.go(id);
    return `Finding ${id}: undone: ${answer.undone}${listed || !this.listed ? '.' : '; it is not in the current selection.'}`;
  }

  /** True if the last step was one of the current finding. */
  get undoesShown() {
    return this.facts !== null && this.steps.at(-1) === this.facts.id;
  }

  /** Take the present values of a finding. */
  take(finding) {
    this.facts = finding;
    this.work.change(finding.id, { review: finding.review, kind: finding.kind });
  }

  async read(id) {
    this.take(await get(findingPath(id)));
  }

  async exists(id) {
    try {
      await this.read(id);
      return true;
    } catch (error) {
      if (error.status === 404) return false;
      throw error;
    }
  }

  stay(finding) {
    if (!finding || !this.work.go(finding.id)) this.work.at = -1;
  }
}

/** A review in progress: its rules, without the page. */

import { ApiError, findingPath, get, post, surveyPath } from './api.js';
import { OPEN, Pace, WorkList } from './worklist.js';

/** Findings in one answer of the server. */
export const LIST_LIMIT = 5000;

/** Somebody else has changed the finding; nothing was written. */
export class ConflictError extends Error {
  constructor(finding, wanted, record) {
    const remark = finding.remark ? `, remark “${finding.remark}”` : '';
    super(`${finding.reviewed_by ?? 'Somebody'} has changed finding ${finding.id} in the meantime: it is ${finding.review}, `
      + `${finding.kind_label ?? finding.kind}${remark}. Your review was not written.`);
    this.finding = finding;
    this.wanted = wanted;
    this.record = record;
  }
}

/** Steps through the findings of a survey, and writes verdicts. */
export class Session {
  /**
   * @param {string} user
   * @param {Outbox} outbox
   */
  constructor(user, outbox) {
    this.user = user;
    this.outbox = outbox;
    this.labels = new Map();
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
    this.work = new WorkList(findings.map((finding) => this.outbox.overlay(finding)), filter.openOnly);
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
      const former = this.outbox.conflict(facts.id, wanted);
      answer = await (former ? this.outbox.again(former, seen, wanted) : this.outbox.save({ type: 'review', survey: facts.survey, finding: facts.id, seen, values: wanted }));
    } catch (error) {
      if (error.status !== 409 || !error.data?.finding) throw error;
      this.take(error.data.finding);
      throw new ConflictError(error.data.finding, wanted, error.record);
    }
    if (answer) this.take(answer.finding);
    else this.takeRecorded({ ...facts, ...wanted, reviewed_by: this.user, reviewed_at: new Date().toISOString(), recorded: true });
    // An answer may have been lost with the connection: what this person wrote is a step of theirs.
    if (answer && !answer.written && answer.finding.reviewed_by !== this.user) return false;
    this.steps.push(facts.id);
    if ((wanted.review ?? OPEN) !== OPEN) this.pace.count(performance.now());
    return true;
  }

  /** Undo the last step of this session, and go to its finding; return a sentence. */
  async undo() {
    const id = this.steps.at(-1);
    if (id === undefined) return 'There is no review to undo.';
    const waits = this.outbox.lastReview(id);
    if (waits) return this.takeBack(waits);
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

  /** Drop a verdict that the database does not have yet. */
  async takeBack(record) {
    const { finding: id, seen } = record;
    if (!(await this.outbox.discard(record))) throw new ApiError(0, 'This verdict is being sent: try again.');
    this.steps.pop();
    if (this.facts?.id === id) this.takeRecorded({ ...this.facts, ...seen, recorded: this.outbox.lastReview(id) !== null });
    else await this.read(id);
    this.work.go(id);
    return `Finding ${id}: undone; the database did not have it yet.`;
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

  /** Take a finding with values that the database does not have yet. */
  takeRecorded(finding) {
    this.take({ ...finding, kind_label: this.labels.get(finding.kind) ?? finding.kind });
  }

  async read(id) {
    const finding = id < 0 ? this.outbox.drawn(id) : this.outbox.overlay(await get(findingPath(id)));
    if (!finding) throw new ApiError(404, 'This drawing is in the database now: choose it on the lining.');
    if (finding.recorded) this.takeRecorded(finding);
    else this.take(finding);
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

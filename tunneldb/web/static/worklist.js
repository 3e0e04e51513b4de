/** List of findings to review: order, position and speed, with the rules of the QGIS plugin. */

export const OPEN = 'open';
export const ORDERS = [
  ['likely', 'Most probable leak first'], ['unlikely', 'Least probable leak first'], ['doubtful', 'Most doubtful first'],
  ['large', 'Largest first'], ['chainage', 'By chainage'], ['images', 'Greatest contrast in photos and thermography first'],
];

/** Time between two reviews that counts as a pause, ms. */
const PAUSE = 300000;

/** Findings in order, and the position in them. */
export class WorkList {
  constructor(findings = [], openOnly = true) {
    this.findings = findings;
    this.openOnly = openOnly;
    this.at = -1;
  }

  get current() {
    return this.findings[this.at] ?? null;
  }

  get reviewed() {
    return this.findings.filter((finding) => finding.review !== OPEN).length;
  }

  /** Return the next findings without going there. */
  ahead(count) {
    return this.places(1).slice(0, count).map((place) => this.findings[place]);
  }

  /** Go to the next (1) or the previous (-1); return false, and stay, if there is none. */
  step(direction) {
    const [place] = this.places(direction);
    if (place === undefined) return false;
    this.at = place;
    return true;
  }

  /** Go to a finding by its number; return false, and stay, if it is not in the list. */
  go(id) {
    const place = this.findings.findIndex((finding) => finding.id === id);
    if (place >= 0) this.at = place;
    return place >= 0;
  }

  /** Remove a finding that no longer exists, and keep the position. */
  drop(id) {
    const here = this.current;
    this.findings = this.findings.filter((finding) => finding.id !== id);
    this.at = here ? this.findings.findIndex((finding) => finding.id === here.id) : -1;
  }

  /** Record the present values of a finding. */
  change(id, values) {
    const place = this.findings.findIndex((finding) => finding.id === id);
    if (place >= 0) this.findings[place] = { ...this.findings[place], ...values };
  }

  places(direction) {
    const found = [];
    for (let n = this.at + direction; n >= 0 && n < this.findings.length; n += direction) {
      if (!this.openOnly || this.findings[n].review === OPEN) found.push(n);
    }
    return found;
  }
}

/** Speed of review without pauses. */
export class Pace {
  last = null;
  spent = 0;
  intervals = 0;

  /** Count a review at a time, ms. */
  count(now) {
    if (this.last !== null && now - this.last <= PAUSE) {
      this.spent += now - this.last;
      this.intervals += 1;
    }
    this.last = now;
  }

  /** Reviews per hour; null without two reviews shortly after each other. */
  get perHour() {
    return this.intervals && this.spent > 0 ? (3600000 * this.intervals) / this.spent : null;
  }
}

/** Return the progress as text: "12 of 500 reviewed; 240 per hour, 2.0 h left". */
export function progressText(work, pace) {
  const total = work.findings.length;
  const done = work.reviewed;
  const speed = pace.perHour;
  let text = `${done} of ${total} reviewed`;
  if (speed === null) return text;
  text += `; ${speed.toFixed(0)} per hour`;
  if (total > done) {
    const minutes = (60 * (total - done)) / speed;
    text += `, ${minutes < 90 ? `${minutes.toFixed(0)} min` : `${(minutes / 60).toFixed(1)} h`} left`;
  }
  return text;
}

/** Return the keys of kinds: numbers of the first nine, J and D of those that detection finds besides leaks. */
export function kindKeys(kinds) {
  const letters = { joint: 'j', dark: 'd' };
  const keys = new Map();
  let count = 0;
  for (const { code } of kinds) {
    if (letters[code]) keys.set(letters[code], code);
    else if (count < 9) keys.set(String(++count), code);
  }
  return keys;
}

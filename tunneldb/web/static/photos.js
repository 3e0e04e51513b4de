/** Photos of a finding: small ones in the panel, a large one in a dialog, and uploads. */

import { ApiError, findingPath, patch, remove, upload } from './api.js';
import { button, el, field } from './dom.js';
import { time } from './format.js';

const TYPES = 'image/jpeg,image/png,image/webp';
const MAX_MEGABYTES = 25;

/** Photos of the finding that is shown, and those that are being uploaded, also to other findings. */
export class Photos {
  /**
   * @param {Object} app - canWrite, say(text, wrong), changed(finding).
   */
  constructor(app) {
    this.app = app;
    this.finding = null;
    this.jobs = [];
    this.sending = false;
    this.title = el('h3');
    this.list = el('ul', { class: 'thumbs' });
    this.paths = el('ul', { class: 'plain' });
    this.waiting = el('ul', { class: 'plain', 'aria-live': 'polite' });
    this.tools = el('div', { class: 'row' },
      this.chooser('Add photos', { multiple: true }), this.chooser('Take photo', { capture: 'environment' }, 'camera'));
    this.tools.hidden = !app.canWrite;
    this.root = el('section', { class: 'photos' }, this.title, this.list, this.paths, this.waiting, this.tools);
    window.addEventListener('online', () => this.jobs.filter(({ away }) => away).forEach((job) => this.again(job)));
    window.addEventListener('beforeunload', (event) => {
      if (this.jobs.length) event.preventDefault();
    });
  }

  /** Return a button that opens the file chooser, or the camera of a phone. */
  chooser(text, props, className = null) {
    const input = el('input', {
      type: 'file', accept: TYPES, hidden: true, tabindex: '-1', 'aria-hidden': 'true', ...props,
      onchange: () => {
        this.add([...input.files]);
        input.value = '';
      },
    });
    return el('span', { class: className }, button(text, () => input.click()), input);
  }

  /** Show the photos of a finding. */
  show(finding) {
    this.finding = finding;
    const stored = finding.photos.filter((photo) => photo.stored);
    const others = finding.photos.filter((photo) => !photo.stored);
    this.title.textContent = finding.photos.length ? `Photos (${finding.photos.length})` : 'Photos';
    this.list.replaceChildren(...stored.map((photo) => el('li', {}, this.thumbnail(photo))));
    this.paths.replaceChildren(...others.map(({ path, caption }) => el('li', {}, el('code', { text: path }), caption ? ` ${caption}` : '')));
    this.refresh();
  }

  thumbnail(photo) {
    const name = photo.caption ?? `Photo of finding ${this.finding.id}`;
    const image = el('img', { src: `/photos/${photo.id}?size=small`, alt: name, loading: 'lazy' });
    const open = button('', () => this.open(photo), { class: 'thumb', 'aria-label': `${name}: enlarge` });
    image.addEventListener('error', () => image.replaceWith(el('span', { class: 'muted small', text: 'Photo is not available here' })));
    open.append(image, el('span', { class: 'caption', text: photo.caption ?? '' }));
    return open;
  }

  /** Show a photo large, with its caption, and what can be done with it. */
  open(photo) {
    const { finding } = this;
    const line = el('p', { role: 'alert', class: 'warn-text' });
    const caption = el('input', { type: 'text', maxlength: '1000', value: photo.caption ?? '', autocomplete: 'off' });
    const dialog = el('dialog', { class: 'photo', 'aria-label': photo.caption ?? `Photo of finding ${finding.id}` },
      el('img', { src: `/photos/${photo.id}`, alt: photo.caption ?? `Photo of finding ${finding.id}` }),
      el('p', { class: 'muted', text: `${photo.added_by}, ${time(photo.added_at)}` }));
    const path = findingPath(finding.id, `/photos/${photo.id}`);
    const act = async (send, text) => {
      try {
        this.take(await send());
        this.app.say(text);
        dialog.close();
      } catch (error) {
        if (!(error instanceof ApiError)) throw error;
        line.textContent = `Not saved. ${error.message}`;
      }
    };
    const sure = el('div', { class: 'row', hidden: true }, el('span', { text: 'Delete this photo?' }),
      button('Delete', () => act(() => remove(path), `Photo of finding ${finding.id} deleted.`), { class: 'danger' }),
      button('Keep', () => { sure.hidden = true; }));
    const close = button('Close', () => dialog.close());
    if (this.app.canWrite) {
      dialog.append(field('Caption', caption, { class: 'field grow' }), line,
        el('div', { class: 'row' }, button('Save caption', () => act(() => patch(path, { caption: caption.value }), 'Saved. Caption of the photo.')),
          button('Delete photo', () => { sure.hidden = false; }, { class: 'danger' }), close), sure);
    } else {
      dialog.append(...(photo.caption ? [el('p', { text: photo.caption })] : []), el('div', { class: 'row' }, close));
    }
    dialog.addEventListener('close', () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
    close.focus();
  }

  /** Upload files, one after the other. */
  add(files) {
    const { id } = this.finding;
    for (const file of files) {
      const job = { id, file, text: null, away: false };
      if (file.size > MAX_MEGABYTES * 1e6) job.text = `it has ${(file.size / 1e6).toFixed(0)} MB; a photo has at most ${MAX_MEGABYTES} MB`;
      this.jobs.push(job);
    }
    this.refresh();
    this.send();
  }

  async send() {
    if (this.sending) return;
    this.sending = true;
    try {
      for (let job; (job = this.jobs.find(({ text }) => text === null));) await this.sendOne(job);
    } finally {
      this.sending = false;
    }
  }

  /** Upload a photo; it is shown as saved when the server has said so. */
  async sendOne(job) {
    try {
      this.take(await upload(findingPath(job.id, '/photos'), job.file));
      this.drop(job);
      this.app.say(`Saved. Photo of finding ${job.id}.`);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      job.text = error.message;
      job.away = error.away;
      this.app.say(`Not saved: photo of finding ${job.id}.`, true);
      this.refresh();
    }
  }

  again(job) {
    job.text = null;
    this.refresh();
    this.send();
  }

  discard(job) {
    this.drop(job);
    this.app.say(`Discarded: ${job.file.name}.`);
  }

  drop(job) {
    this.jobs = this.jobs.filter((other) => other !== job);
    this.refresh();
  }

  /** Take the photos of a finding from an answer of the server. */
  take(finding) {
    this.app.changed(finding);
  }

  refresh() {
    this.waiting.replaceChildren(...this.jobs.map((job) => el('li', { class: 'upload' }, this.stateOf(job))));
    this.root.hidden = !this.app.canWrite && !this.finding?.photos.length;
  }

  stateOf(job) {
    const name = `${job.file.name}${job.id === this.finding?.id ? '' : ` (finding ${job.id})`}`;
    if (job.text === null) return el('span', {}, el('progress', { 'aria-label': `Saving ${name}` }), ` ${name}: not saved yet`);
    return el('span', {}, el('span', { class: 'warn-text', text: `${name}: not saved: ${job.text}` }), ' ',
      button('Try again', () => this.again(job)), ' ', button('Discard', () => this.discard(job)));
  }
}

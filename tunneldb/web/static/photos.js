/** Photos of a finding: small ones in the panel, a large one in a dialog, and uploads. */

import { ApiError, findingPath, patch, remove } from './api.js';
import { button, el, field } from './dom.js';
import { time } from './format.js';

const TYPES = 'image/jpeg,image/png,image/webp';
const MAX_MEGABYTES = 25;

/** Photos of the finding that is shown, and those that the database does not have yet, also of other findings. */
export class Photos {
  /**
   * @param {Object} app - canWrite, say(text, wrong), changed(finding), outbox.
   */
  constructor(app) {
    this.app = app;
    this.finding = null;
    this.refused = [];
    this.title = el('h3');
    this.list = el('ul', { class: 'thumbs' });
    this.paths = el('ul', { class: 'plain' });
    this.waiting = el('ul', { class: 'plain', 'aria-live': 'polite' });
    this.tools = el('div', { class: 'row' },
      this.chooser('Add photos', { multiple: true }), this.chooser('Take photo', { capture: 'environment' }, 'camera'));
    this.tools.hidden = !app.canWrite;
    this.root = el('section', { class: 'photos' }, this.title, this.list, this.paths, this.waiting, this.tools);
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

  /** Keep files on this device, and upload them one after the other. */
  async add(files) {
    const { id, survey } = this.finding;
    await Promise.all(files.map((file) => this.addOne(id, survey, file)));
  }

  /** Upload a photo; it is shown as saved when the server has said so. */
  async addOne(finding, survey, file) {
    if (file.size > MAX_MEGABYTES * 1e6) {
      this.refuse(finding, file, `it has ${(file.size / 1e6).toFixed(0)} MB; a photo has at most ${MAX_MEGABYTES} MB`);
      return;
    }
    let record;
    try {
      record = await this.app.outbox.add({ type: 'photo', survey, finding, file });
      const answer = finding > 0 ? await this.app.outbox.submit(record) : null;
      if (answer) this.take(answer);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (!record) this.refuse(finding, file, error.message);
      this.app.say(`Not saved: photo of finding ${finding}.`, true);
    }
    this.refresh();
  }

  /** List a photo that was not kept. */
  refuse(finding, file, text) {
    this.refused.push({ finding, file, stopped: { text } });
    this.refresh();
  }

  async discard(record) {
    const { outbox } = this.app;
    if (this.refused.includes(record)) this.refused = this.refused.filter((other) => other !== record);
    else if (!(await outbox.discard(record))) return;
    this.app.say(`Discarded: ${record.file.name}.`);
    this.refresh();
  }

  /** Take the photos of a finding from an answer of the server. */
  take(finding) {
    this.app.changed(finding);
  }

  /** List the photos that the database does not have yet. */
  refresh() {
    const records = [...this.app.outbox.records.filter(({ type }) => type === 'photo'), ...this.refused];
    this.waiting.replaceChildren(...records.map((record) => el('li', { class: 'upload' }, this.stateOf(record))));
    this.root.hidden = !this.app.canWrite && !this.finding?.photos.length;
  }

  stateOf(record) {
    const { outbox } = this.app;
    const name = `${record.file.name}${record.finding === this.finding?.id ? '' : ` (${record.finding > 0 ? `finding ${record.finding}` : 'a drawn finding'})`}`;
    const discard = button('Discard', () => this.discard(record));
    if (record.stopped) {
      const again = record.key ? button('Try again', () => outbox.retry(record)) : null;
      return el('span', {}, el('span', { class: 'warn-text', text: `${name}: not saved: ${record.stopped.text}` }), ' ', again, ' ', discard);
    }
    if (outbox.waiting.includes(record) || record.finding < 0) return el('span', {}, this.preview(record), ` ${name}: recorded on this device, not in the database yet `, discard);
    return el('span', {}, el('progress', { 'aria-label': `Saving ${name}` }), ` ${name}: not saved yet`);
  }

  /** Return a small picture of a photo that waits. */
  preview({ file }) {
    const address = URL.createObjectURL(file);
    const image = el('img', { src: address, alt: '', class: 'waiting-photo' });
    for (const name of ['load', 'error']) image.addEventListener(name, () => URL.revokeObjectURL(address));
    return image;
  }
}

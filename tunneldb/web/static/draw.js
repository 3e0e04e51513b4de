/** Panel to draw and change findings. */

import { ApiError, findingPath, post, put, remove } from './api.js';
import { button, el, field } from './dom.js';
import { number } from './format.js';
import { Sketch } from './sketch.js';

const SHAPES = { polygon: 'Polygon', line: 'Line', point: 'Point' };

/** Tools that write outlines. */
export class DrawPanel {
  /**
   * @param {Lining} lining
   * @param {Object} app - canWrite, say(text, wrong), current(), open(id), closed(), changed(), outbox.
   */
  constructor(lining, app) {
    this.lining = lining;
    this.app = app;
    this.sketch = new Sketch(lining, () => this.refresh());
    this.task = null;
    this.merging = [];
    this.root = el('div', { class: 'pad draw' });
    this.build();
  }

  build() {
    const { app } = this;
    const start = (shape) => button(SHAPES[shape], () => this.start(shape), { 'aria-pressed': 'false', data: { shape } });
    this.shapes = el('div', { class: 'row', role: 'group', 'aria-label': 'Draw a new finding' }, ...Object.keys(SHAPES).map(start));
    this.changes = el('div', { class: 'row', role: 'group', 'aria-label': 'Change the finding that is shown' },
      button('Redraw', () => this.redraw()), button('Split', () => this.split()), button('Merge', () => this.merge()),
      button('Delete', () => this.ask(), { class: 'danger' }));
    this.hint = el('p', { role: 'status' });
    this.byKeys = el('div', { class: 'row' }, button('Add point in the middle', () => this.sketch.addMiddle()), button('Finish', () => this.sketch.finish()));
    this.kind = el('select', {});
    this.severity = el('select', {});
    this.width = el('input', { type: 'number', min: '0', step: '0.1', inputmode: 'decimal' });
    this.remark = el('input', { type: 'text', maxlength: '2000', autocomplete: 'off' });
    this.form = el('div', { class: 'form' }, field('Kind', this.kind), field('Severity', this.severity), field('Width, mm', this.width), field('Remark', this.remark));
    this.saveButton = button('Save', () => this.save(), { class: 'main' });
    this.ends = el('div', { class: 'row' }, this.saveButton, button('Cancel', () => this.cancel()));
    const parts = [
      el('h2', { text: 'Draw' }),
      app.canWrite ? null : el('p', { class: 'warn-text', text: 'A viewer cannot draw: an operator must grant the role tunnel_inspector.' }),
      el('h3', { text: 'New finding' }), this.shapes, el('h3', { text: 'Finding that is shown' }), this.changes, this.hint, this.byKeys, this.form, this.ends];
    this.root.replaceChildren(...parts.filter(Boolean));
    this.refresh();
  }

  setSurvey(survey) {
    this.survey = survey;
    this.cancel();
  }

  start(shape) {
    this.task = { name: 'new', shape };
    this.offer(shape);
    this.sketch.draw(shape);
    this.refresh();
  }

  redraw() {
    const finding = this.app.current();
    this.task = { name: 'outline', id: finding.id };
    this.sketch.edit(finding.outline);
    this.refresh();
  }

  split() {
    this.task = { name: 'split', id: this.app.current().id };
    this.sketch.draw('line');
    this.refresh();
  }

  merge() {
    this.task = { name: 'merge' };
    this.merging = [this.app.current().id];
    this.sketch.stop();
    this.refresh();
  }

  /** Add a finding to those that are merged, or take it out; return false if none are chosen now. */
  pick(id) {
    if (this.task?.name !== 'merge') return false;
    this.merging = this.merging.includes(id) ? this.merging.filter((other) => other !== id) : [...this.merging, id];
    this.refresh();
    return true;
  }

  /** Ask before a finding is deleted. */
  ask() {
    const { id } = this.app.current();
    const dialog = el('dialog', { 'aria-labelledby': 'delete-title' },
      el('h2', { id: 'delete-title', text: id > 0 ? `Delete finding ${id}?` : 'Delete this drawing?' }),
      el('p', { text: 'Only drawn findings can be deleted. Reject a detected one instead.' }),
      el('div', { class: 'row' }, button('Delete', () => {
        dialog.close();
        this.delete(id);
      }, { class: 'danger' }), button('Keep', () => dialog.close(), { autofocus: true })));
    dialog.addEventListener('close', () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
  }

  delete(id) {
    return this.send(async () => {
      if (id > 0) await remove(findingPath(id));
      else await this.discard(id);
      this.app.say(id > 0 ? `Finding ${id} deleted.` : 'Drawing deleted.');
      this.app.closed();
    });
  }

  /** Drop a drawing that the database does not have yet. */
  async discard(id) {
    const { outbox } = this.app;
    const record = outbox.records.find(({ type, key }) => type === 'draw' && key === -id);
    if (!record || !(await outbox.discard(record))) throw new ApiError(0, 'it is being sent: try again');
  }

  save() {
    const { task, survey, sketch } = this;
    const { geometry } = sketch;
    const text = (box) => box.value.trim() || null;
    const act = {
      new: () => this.record(survey.name, {
        geometry, kind: this.kind.value, severity: this.severity.value ? Number(this.severity.value) : null,
        width_mm: this.width.value ? Number(this.width.value) : null, remark: text(this.remark),
      }),
      outline: async () => (await put(findingPath(task.id, '/outline'), { geometry })).id,
      split: async () => (await post(findingPath(task.id, '/split'), { line: geometry })).ids[0],
      merge: async () => (await post('/api/findings/merge', { ids: this.merging })).id,
    }[task.name];
    return this.send(async () => {
      const id = await act();
      this.app.say(id > 0 ? `Saved: finding ${id}.` : 'Recorded on this device, not in the database yet.');
      this.cancel();
      this.width.value = this.remark.value = '';
      this.app.open(id);
    });
  }

  /** Record a new finding; return its number. If the server refuses it, the sketch stays in its place. */
  async record(survey, body) {
    const { outbox } = this.app;
    const record = await outbox.add({ type: 'draw', survey, body });
    try {
      return (await outbox.submit(record))?.id ?? -record.key;
    } catch (error) {
      await outbox.discard(record);
      throw error;
    }
  }

  /** Send; if the server refuses or is away, the sketch and the entries stay. */
  async send(act) {
    this.saveButton.disabled = true;
    try {
      await act();
      this.app.changed();
    } catch (error) {
      this.app.say(`Not saved: ${error.message}`, true);
    }
    this.refresh();
  }

  cancel() {
    this.task = null;
    this.merging = [];
    this.sketch.stop();
    this.refresh();
  }

  /** Offer the kinds that may have a shape. */
  offer(shape) {
    const kinds = this.survey.finding_kinds.filter(({ active, geometries }) => active && geometries.includes(shape));
    const was = this.kind.value;
    this.kind.replaceChildren(...kinds.map(({ code, label }) => el('option', { value: code, text: label })));
    if (kinds.some(({ code }) => code === was)) this.kind.value = was;
    const severities = this.survey.severities.map(({ id, label }) => el('option', { value: id, text: `${id}, ${label}` }));
    this.severity.replaceChildren(el('option', { value: '', text: 'none' }), ...severities);
  }

  refresh() {
    const { task, sketch, app } = this;
    const finding = app.current();
    const name = task?.name ?? null;
    for (const control of this.shapes.children) {
      control.disabled = !app.canWrite;
      control.setAttribute('aria-pressed', String(name === 'new' && control.dataset.shape === task.shape));
    }
    for (const control of this.changes.children) control.disabled = !app.canWrite || !finding || (finding.id < 0 && !control.classList.contains('danger'));
    this.form.hidden = name !== 'new';
    this.byKeys.hidden = !sketch.pen;
    this.ends.hidden = !task;
    this.saveButton.disabled = name === 'merge' ? this.merging.length < 2 : !sketch.geometry || Boolean(sketch.pen);
    this.hint.textContent = this.advice(name, finding);
  }

  advice(name, finding) {
    const { sketch } = this;
    if (name === null) return finding ? (finding.id > 0 ? `Shown: finding ${finding.id}.` : 'Shown: a drawing that is not in the database yet.') : 'Click a finding on the lining to change it.';
    if (name === 'merge') return `Click the findings to merge: ${this.merging.join(', ')}.`;
    if (sketch.pen) {
      return { point: 'Click the place.', line: 'Click the points of the line; a double click or Finish ends it.', polygon: 'Click the corners; a double click or Finish ends the polygon.' }[sketch.shape];
    }
    const length = measure(sketch.geometry);
    return `Drag corners to change it${length ? ` (${length})` : ''}, then save.`;
  }
}

function measure(geometry) {
  const { ol } = globalThis;
  if (!geometry || geometry.type === 'Point') return '';
  const shape = new ol.format.GeoJSON().readGeometry(geometry);
  return shape.getArea && geometry.type !== 'LineString' ? number(shape.getArea(), 2, 'm²') : number(shape.getLength(), 2, 'm');
}

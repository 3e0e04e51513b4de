/** Tabs of the panel; a sheet from below on a narrow screen. */

import { el } from './dom.js';

const TABS = [['finding', 'Finding'], ['review', 'Review'], ['draw', 'Draw'], ['section', 'Section'], ['rating', 'Rating'], ['actions', 'Actions'], ['downloads', 'Download'], ['offline', 'Offline'], ['notes', 'Notes']];

/** Panel with tabs. */
export class Panel {
  /**
   * @param {HTMLElement} root
   * @param {function(string)} chosen - is called with the tab.
   */
  constructor(root, chosen) {
    this.root = root;
    this.chosen = chosen;
    this.tab = null;
    this.grip = el('button', { type: 'button', class: 'grip', 'aria-expanded': 'true', onclick: () => this.fold(!this.root.classList.contains('folded')) }, 'Hide');
    this.tabs = TABS.map(([name, text]) => el('button', {
      type: 'button', role: 'tab', id: `tab-${name}`, 'aria-controls': 'panel-body', 'aria-selected': 'false', tabindex: '-1', data: { name }, text,
      onclick: (event) => {
        this.choose(name);
        // After a click the keys belong to the content; with the keyboard, arrow keys go on to the next tab.
        if (event.detail) this.body.focus({ preventScroll: true });
      },
    }));
    const list = el('div', { class: 'tabs', role: 'tablist', 'aria-label': 'Panel', onkeydown: (event) => this.key(event) }, ...this.tabs);
    this.body = el('div', { id: 'panel-body', class: 'panel-body', role: 'tabpanel', tabindex: '0' });
    root.replaceChildren(el('div', { class: 'panel-head' }, list, this.grip), this.body);
  }

  /** Show a tab. */
  choose(name, quiet = false) {
    this.tab = name;
    this.fold(false);
    for (const tab of this.tabs) {
      const on = tab.dataset.name === name;
      tab.setAttribute('aria-selected', String(on));
      tab.tabIndex = on ? 0 : -1;
      if (on) tab.scrollIntoView({ block: 'nearest', inline: 'nearest' });
    }
    this.body.setAttribute('aria-labelledby', `tab-${name}`);
    this.root.classList.toggle('wide', ['review', 'rating'].includes(name));
    if (!quiet) this.chosen(name);
  }

  /** Show the content of a tab. */
  fill(node) {
    if (this.body.firstChild === node) return;
    this.body.replaceChildren(node);
    this.body.scrollTop = 0;
  }

  /** Fold the sheet to its tabs, or unfold it. */
  fold(folded) {
    this.root.classList.toggle('folded', folded);
    this.grip.textContent = folded ? 'Show' : 'Hide';
    this.grip.setAttribute('aria-expanded', String(!folded));
  }

  key(event) {
    const moves = { ArrowRight: 1, ArrowLeft: -1 };
    if (!(event.key in moves)) return;
    event.preventDefault();
    event.stopPropagation();
    const here = this.tabs.findIndex((tab) => tab.dataset.name === this.tab);
    const tab = this.tabs[(here + moves[event.key] + this.tabs.length) % this.tabs.length];
    this.choose(tab.dataset.name);
    tab.focus();
  }
}

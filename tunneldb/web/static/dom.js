/** Small helpers to build elements; texts are always text nodes. */

/**
 * Create an element.
 * @param {string} tag
 * @param {Object} props - attributes; `on…` are listeners, `class` and `data` as usual, `text` the text.
 * @param {...(Node|string|null)} children
 */
export function el(tag, props = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (value === null || value === undefined || value === false) continue;
    if (name === 'text') node.textContent = value;
    else if (name === 'data') Object.assign(node.dataset, value);
    else if (name.startsWith('on')) node.addEventListener(name.slice(2), value);
    else if (name === 'value' || name === 'checked' || name === 'disabled') node[name] = value;
    else node.setAttribute(name, value === true ? '' : value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

const SVG = 'http://www.w3.org/2000/svg';

/** Create an SVG element with attributes and a text. */
export function svg(tag, attributes = {}, text = null) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== null) node.textContent = text;
  return node;
}

/** Return a button. */
export function button(text, act, props = {}) {
  return el('button', { type: 'button', onclick: act, ...props }, text);
}

/** Return a label with its control. */
export function field(text, control, props = {}) {
  return el('label', { class: 'field', ...props }, el('span', { text }), control);
}

/** Return a list of choices from pairs of value and text. */
export function choice(pairs, value, props = {}) {
  const node = el('select', props, ...pairs.map(([code, text]) => el('option', { value: code, text })));
  if (value !== null && value !== undefined) node.value = value;
  return node;
}

/** Return a labelled checkbox. */
export function check(text, checked, act, props = {}) {
  const box = el('input', { type: 'checkbox', checked, ...props, onchange: (event) => act(event.target.checked) });
  return el('label', { class: 'check' }, box, el('span', { text }));
}

/** Return a function that acts once calls have ended for some ms. */
export function debounce(act, wait) {
  let timer = 0;
  return (...values) => {
    clearTimeout(timer);
    timer = setTimeout(() => act(...values), wait);
  };
}

/** Return True if typed keys belong to an element. */
export function takesKeys(node) {
  return Boolean(node?.closest?.('input:not([type=checkbox]):not([type=range]):not([type=radio]), select, textarea, dialog, [data-keys]'));
}

/** Fit a canvas to its element and the display; return its context in CSS pixels, and its size. */
export function fitCanvas(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = Math.max(1, Math.round(width * ratio));
  canvas.height = Math.max(1, Math.round(height * ratio));
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { context, width, height };
}

/** Colours of results: from green, the best, to red; never plain green for what was not inspected in full. */

const STOPS = [[47, 125, 66], [163, 185, 30], [240, 196, 25], [232, 121, 28], [179, 23, 29]];

/** Colour below the stripes of a best result that is only a lower bound. */
const DOUBTFUL = [214, 208, 178];

const NOT_RATED = 'not rated';

/** Return red, green and blue of a level, from 1, the best, to the number of levels. */
function rgb(level, levels, complete) {
  if (level === 1 && !complete) return DOUBTFUL;
  const place = levels > 1 ? ((level - 1) / (levels - 1)) * (STOPS.length - 1) : 0;
  const low = Math.min(Math.floor(place), STOPS.length - 2);
  return STOPS[low].map((value, n) => Math.round(value + (STOPS[low + 1][n] - value) * (place - low)));
}

/** Return the colour of an element's result; null if it is not rated. */
export function levelColour({ level, complete }, levels, alpha = 1) {
  return level === null ? null : `rgba(${rgb(level, levels, complete).join(',')},${alpha})`;
}

/** Return a small square in the colour of a result: striped for a lower bound, hatched if not rated. */
export function swatch(element, levels) {
  const node = document.createElement('i');
  node.className = `swatch${element.level === null ? ' none' : element.complete ? '' : ' bound'}`;
  node.setAttribute('aria-hidden', 'true');
  if (element.level !== null) node.style.backgroundColor = levelColour(element, levels);
  return node;
}

/** Return the elements from the best to the worst; what is not rated comes after the best result, which it does not have. */
export function fromBest(elements) {
  const place = ({ level, complete }) => (level ?? 1.5) + (complete || level === null ? 0 : 0.25);
  return [...elements].sort((a, b) => place(a) - place(b) || b.number - a.number);
}

/** Return each result with its number of elements, the worst first, and how many are not rated last, also if none is. */
export function counts(elements) {
  const found = new Map();
  for (const element of fromBest(elements.filter(({ level }) => level !== null)).reverse()) {
    const known = found.get(element.result_text);
    if (known) known.count += 1;
    else found.set(element.result_text, { text: element.result_text, element, count: 1 });
  }
  const none = elements.filter(({ level }) => level === null).length;
  return [...found.values(), { text: NOT_RATED, element: { level: null, complete: false }, count: none }];
}

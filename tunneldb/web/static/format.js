/** Numbers and places as text. */

const NONE = '–';

/** Format a chainage as a station: 12+345.6. */
export function station(chainage, decimals = 1) {
  if (chainage === null || chainage === undefined || Number.isNaN(chainage)) return NONE;
  const sign = chainage < 0 ? '-' : '';
  const unit = 10 ** decimals;
  const rounded = Math.round(Math.abs(chainage) * unit) / unit;
  const metres = (rounded % 1000).toFixed(decimals).padStart(decimals ? 4 + decimals : 3, '0');
  return `${sign}${Math.floor(rounded / 1000)}+${metres}`;
}

/** Parse a chainage in m, or a station such as 12+345; return NaN if it is neither. */
export function parseStation(text) {
  const found = /^\s*(-?)(\d+)\+(\d+(?:[.,]\d*)?)\s*$/.exec(text);
  if (found) return (found[1] ? -1 : 1) * (Number(found[2]) * 1000 + Number(found[3].replace(',', '.')));
  return text.trim() ? Number(text.trim().replace(',', '.')) : NaN;
}

/** Format a clock position, hours: 2:30. */
export function clock(hours) {
  if (hours === null || hours === undefined) return NONE;
  const minutes = ((Math.round(hours * 60) % 720) + 720) % 720;
  return `${Math.floor(minutes / 60) || 12}:${String(minutes % 60).padStart(2, '0')}`;
}

/** Format a number with a unit. */
export function number(value, decimals = 2, unit = '') {
  if (value === null || value === undefined) return NONE;
  return value.toFixed(decimals) + (unit ? `\u00a0${unit}` : '');
}

/** Format a share as percent, as all documents do: 100 % only for all, 0 % only for nothing. */
export function percent(share) {
  if (share === null || share === undefined) return NONE;
  const value = 100 * share;
  if (value > 0 && value < 0.1) return '< 0.1\u00a0%';
  if (value >= 99.95 && value < 100) return '> 99.9\u00a0%';
  return `${value === 0 || value >= 100 ? Math.min(value, 100) : value.toFixed(1)}\u00a0%`;
}

/** Format a signed arc, m. */
export function arc(value) {
  if (value === null || value === undefined) return NONE;
  return `${value < 0 ? '−' : '+'}${Math.abs(value).toFixed(2)}\u00a0m`;
}

/** Format a time of the server for a person. */
export function time(text) {
  if (!text) return NONE;
  const date = new Date(text);
  if (Number.isNaN(date.getTime())) return String(text);
  const two = (value) => String(value).padStart(2, '0');
  return `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())} ${two(date.getHours())}:${two(date.getMinutes())}`;
}

/** Return a step of 1, 2 or 5 times a power of ten that is not smaller than a value. */
export function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= least * 0.999);
}

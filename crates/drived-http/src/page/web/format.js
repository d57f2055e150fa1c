// Numbers, times and ages as a person of the chosen language writes them.

import { language, t } from './texts.js';

const made = new Map();

function numbers(digits) {
  const key = `${language()} ${digits}`;
  if (!made.has(key)) {
    made.set(key, new Intl.NumberFormat(language(), { minimumFractionDigits: digits, maximumFractionDigits: digits }));
  }
  return made.get(key);
}

function times(options) {
  const key = `${language()} ${JSON.stringify(options)}`;
  if (!made.has(key)) made.set(key, new Intl.DateTimeFormat(language(), options));
  return made.get(key);
}

/** What stands where nothing is known. */
export const MISSING = '—';

/** A number with its unit, or `—`. */
export function quantity(value, digits, unit) {
  if (typeof value !== 'number' || !Number.isFinite(value)) return MISSING;
  const text = numbers(digits).format(value);
  return unit ? `${text}\u00a0${unit}` : text;
}

/** A length of time in one unit that a person takes in at a glance. */
export function duration(ms) {
  if (typeof ms !== 'number') return MISSING;
  if (ms < 1000) return quantity(ms, 0, 'ms');
  if (ms < 9950) return quantity(ms / 1000, 1, 's');
  if (ms < 120_000) return quantity(Math.round(ms / 1000), 0, 's');
  if (ms < 7_200_000) return quantity(Math.round(ms / 60_000), 0, 'min');
  return quantity(Math.round(ms / 3_600_000), 0, 'h');
}

/** "12 s old". */
export function old(ms) {
  return t('old', { age: duration(ms) });
}

/** The time of the day, with seconds; with the date where it is not today. */
export function clock(unixMs) {
  if (!unixMs) return MISSING;
  const date = new Date(unixMs);
  const today = date.toDateString() === new Date().toDateString();
  return times(today ? { hour: '2-digit', minute: '2-digit', second: '2-digit', hourCycle: 'h23' }
    : { dateStyle: 'short', timeStyle: 'medium' }).format(date);
}

/** Texts in the order in which a person sorts them: "pump 2" before "pump 10". */
export const byName = new Intl.Collator(undefined, { numeric: true }).compare;

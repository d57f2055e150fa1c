// Numbers, times and ages as a person of the chosen language writes them.

import { language, t } from './texts.js';

const made = new Map();
const TIME = { hour: '2-digit', minute: '2-digit', second: '2-digit', hourCycle: 'h23' };

function numbers(digits) {
  const key = `${language()} ${digits}`;
  if (!made.has(key)) {
    made.set(key, new Intl.NumberFormat(language(), { minimumFractionDigits: digits, maximumFractionDigits: digits }));
  }
  return made.get(key);
}

/** Dates of English are those of Britain: a day stands before its month. */
function times(options) {
  const key = `${language()} ${JSON.stringify(options)}`;
  if (!made.has(key)) made.set(key, new Intl.DateTimeFormat(language() === 'fr' ? 'fr' : 'en-GB', { ...options, timeZone: zone }));
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
  // Two clocks are never quite together: nothing lasts less than no time.
  ms = Math.max(ms, 0);
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

/** The zone of the daemon's clock, by which every time is told. */
let zone;

/** Takes the zone that the daemon is in, such as `Europe/Paris` or `+01:00`; one that the browser does not know is not used. */
export function useZone(name) {
  try {
    if (name) new Intl.DateTimeFormat('en', { timeZone: name });
    zone = name;
  } catch {
    zone = undefined;
  }
  made.clear();
}

/** The time of the day by the daemon's clock with its zone; with the date where it is not today, and thousandths where they are wanted. */
export function clock(unixMs, { thousandths = false } = {}) {
  if (!unixMs) return MISSING;
  const date = new Date(unixMs);
  const day = { day: 'numeric', month: 'short', year: 'numeric' };
  const isToday = times(day).format(date) === times(day).format(new Date());
  const format = times({ ...isToday ? {} : day, ...TIME, ...thousandths ? { fractionalSecondDigits: 3 } : {} });
  return `${format.format(date)}\u00a0${zoneAt(date)}`;
}

/** The time of the day without its zone: where that stands beside it. */
export function plainTime(unixMs) {
  return times(TIME).format(new Date(unixMs));
}

/** The zone of the times at this moment, such as "UTC+1". */
export function zoneAt(date = new Date()) {
  const parts = times({ timeZoneName: 'shortOffset' }).formatToParts(date);
  return parts.find(part => part.type === 'timeZoneName')?.value.replace('GMT', 'UTC') ?? '';
}

/** Texts in the order in which a person sorts them: "pump 2" before "pump 10". */
export const byName = new Intl.Collator(undefined, { numeric: true }).compare;

/** How much of a line is used; of one whose port is away nothing is, whatever was asked in vain. */
export function load(line) {
  return quantity(line.link === 'away' ? undefined : line.utilisation_percent, 0, '%');
}

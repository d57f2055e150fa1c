// Moments of the past as the daemon's clock told them. In autumn an hour comes twice: each of the two has its own offset.

import { zoneAt } from './format.js';

const MINUTE = 60_000;
const DAY = 86_400_000;

/** How far the daemon's wall clock was before universal time at a moment. */
export function offsetAt(unixMs) {
  const [, sign, hours, minutes] = zoneAt(new Date(unixMs)).match(/([+\-−])(\d+)(?::(\d+))?/) ?? [];
  return hours ? (sign === '+' ? 1 : -1) * (Number(hours) * 60 + Number(minutes ?? 0)) * MINUTE : 0;
}

/** The time on the daemon's wall, as fields for times take it: `2026-11-21T03:12`. */
export function wallText(unixMs) {
  return new Date(unixMs + offsetAt(unixMs)).toISOString().slice(0, 16);
}

/** The moments that have this time on the wall: one, two in the doubled hour, none in that which was left out. With an offset behind it one. */
export function momentsOf(text) {
  const [, wall, offset] = text.match(/^(\d{4}-\d\d-\d\dT\d\d:\d\d(?::\d\d)?)(Z|[+-]\d\d:\d\d)?$/) ?? [];
  const plain = wall ? Date.parse(`${wall}Z`) : NaN;
  if (!Number.isFinite(plain)) return [];
  if (offset) return [Date.parse(`${wall}${offset}`)];
  const offsets = new Set([offsetAt(plain - DAY), offsetAt(plain + DAY)]);
  return [...offsets].map(one => plain - one).filter(at => offsetAt(at) === plain - at).sort((one, other) => one - other);
}

/** A moment for an address: its time on the wall, with its offset where that alone tells which of two it is. */
export function addressOf(unixMs) {
  const wall = wallText(unixMs);
  return momentsOf(wall).length === 1 ? wall : `${wall}${offsetText(unixMs)}`;
}

/** When the daemon's clock was put forward or back between two moments, if it was, once. */
export function clockChange(from, to) {
  if (offsetAt(from) === offsetAt(to)) return undefined;
  let [before, after] = [from, to];
  while (after - before > MINUTE) {
    const middle = (before + after) / 2;
    if (offsetAt(middle) === offsetAt(from)) before = middle;
    else after = middle;
  }
  return Math.floor(after / MINUTE) * MINUTE;
}

function offsetText(unixMs) {
  const minutes = Math.round(offsetAt(unixMs) / MINUTE);
  const two = number => String(Math.floor(Math.abs(number))).padStart(2, '0');
  return `${minutes < 0 ? '-' : '+'}${two(minutes / 60)}:${two(minutes % 60)}`;
}

// The order of the drives in the overview: trouble first, or by any value.

import { byName } from './format.js';
import { age } from './plant.js';
import { isTrouble, trouble } from './trouble.js';
import { word } from './vocabulary.js';
import { deviationOf, stateWord } from './words.js';

/** By what a column is sorted; what is not known comes last, whichever way. */
const VALUES = {
  drive: drive => drive.name,
  state: stateWord,
  frequency: drive => drive.status?.output_frequency_hz,
  deviation: drive => (deviationOf(drive) === undefined ? undefined : Math.abs(deviationOf(drive))),
  current: drive => drive.status?.current_a ?? drive.status?.current_percent,
  note: drive => (Number.isFinite(trouble(drive).rank) ? trouble(drive).rank : undefined),
  control: drive => word(drive.status?.control) || undefined,
  age: drive => age(drive.status, drive),
};
/** Values change all the time: nobody's row is pulled from under his finger for that. */
const AGAIN_MS = 3_000;

let last = { sort: '', at: 0, names: new Map() };

/** How early a drive comes where nobody sorts: a note is no trouble, and moves no row. */
function urgency(drive) {
  const worst = trouble(drive);
  return isTrouble(worst) ? worst.rank : Infinity;
}

/** Whether drives are sorted by this column. */
export function isSortable(column) {
  return column in VALUES;
}

/** These drives in order: `sort` is a column, with `-` before it downwards, or nothing. `isFree` where rows may move. */
export function sorted(drives, sort, isFree) {
  const column = sort.replace('-', '');
  // The order of the configuration among equals: a row moves only when its trouble begins or ends.
  if (!isSortable(column)) return [...drives].sort((one, other) => (urgency(one) - urgency(other)) || 0);
  const isDue = isFree && performance.now() - last.at > AGAIN_MS;
  if (sort !== last.sort || isDue || drives.some(drive => !last.names.has(drive.name))) {
    const values = new Map(drives.map(drive => [drive, VALUES[column](drive)]));
    const sign = sort.startsWith('-') ? -1 : 1;
    const ordered = [...drives].sort((one, other) => compared(values.get(one), values.get(other), sign) || byName(one.name, other.name));
    last = { sort, at: performance.now(), names: new Map(ordered.map((drive, index) => [drive.name, index])) };
    return ordered;
  }
  return [...drives].sort((one, other) => last.names.get(one.name) - last.names.get(other.name));
}

function compared(one, other, sign) {
  if (one === undefined || other === undefined) return (one === undefined) - (other === undefined);
  return sign * (typeof one === 'number' ? one - other : byName(one, other));
}

// The alarms of the daemon in words of both languages, and who may do something about one.

import { plant } from './plant.js';
import { named, t } from './texts.js';
import { told } from './told.js';
import { word } from './vocabulary.js';

/** The states that wait for somebody, as the daemon names them. */
const WAITING = new Set(['unacknowledged', 'returned', 'gone']);

/** Whether an alarm waits for somebody to take note of it. */
export function waits(alarm) {
  return WAITING.has(alarm.state);
}

/** Whether it is so now. */
export function isActive(alarm) {
  return !alarm.returned_unix_ms && !alarm.gone;
}

/** What an alarm is of. */
export function ofWhat(alarm) {
  return alarm.drive ?? (alarm.line ? t('alarm_of_line', { line: alarm.line }) : t('alarm_of_program'));
}

/** An alarm in a sentence. */
export function alarmText({ kind, detail }) {
  const what = t(`alarm_${kind}`) === `alarm_${kind}` ? t(`concern_${kind}`) : t(`alarm_${kind}`);
  const more = kind === 'control_taken' ? word(detail) : told(detail);
  return more ? named(what, more) : what;
}

/** Whether the asker may acknowledge or shelve it: whoever may operate its drive; of lines and the program whoever may operate all. */
export function mayAct(alarm) {
  const { rights, scope } = plant.daemon;
  return Boolean(rights.operate) && (!scope || (alarm.drive !== undefined && scope.includes(alarm.drive)));
}

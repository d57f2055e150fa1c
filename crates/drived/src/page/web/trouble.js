// What is wrong with a drive, the worst first, in words.

import { faultMeaning } from './fault_texts.js';
import { quality } from './plant.js';
import { t } from './texts.js';
import { told } from './told.js';
import { word } from './words.js';

const STOP_IS_LATE_MS = 5_000;
/** Ranks up to this one: the drive has tripped, is lost, or does not confirm a stop. */
export const SEVERE = 2;
/** The rank of a drive that has not been seen yet. */
export const CONNECTING = 6;
/** The rank of a drive that nothing is wrong with. */
export const FINE = 9;

/** `{rank, text}`: 0 is the worst; `FINE` with a remark or none. */
export function trouble(drive) {
  const state = drive.status?.state;
  if (drive.stop?.since_ms > STOP_IS_LATE_MS) return { rank: 0, text: t('stop_late', { count: drive.stop.attempts }) };
  if (state === 'fault' || state === 'fault_reaction') return { rank: 1, text: faultText(drive) };
  if (drive.link === 'lost') return { rank: 2, text: lostText(drive) };
  if (drive.identity?.check === 'changed') return { rank: 3, text: t('identity_changed') };
  if (drive.watchdog?.check === 'broken') return { rank: 3, text: t('watchdog_broken', { why: told(drive.watchdog.why) }) };
  if (drive.status?.warning) return { rank: 4, text: t('warning_present') };
  if (quality(drive.status) === 'stale') return { rank: 5, text: t('values_old') };
  if (drive.link === 'connecting') return { rank: CONNECTING, text: told(drive.error) };
  if (drive.stop) return { rank: FINE, text: t('stop_waits', { count: drive.stop.attempts }) };
  if (drive.control === false) return { rank: FINE, text: t('only_read') };
  return { rank: FINE, text: '' };
}

function lostText({ error }) {
  return told(error) || t('lost_now');
}

/** Code, mnemonic and meaning of the present fault. */
export function faultText(drive) {
  const { fault, status } = drive;
  if (!fault) return status?.fault_code ? t('fault_number', { code: status.fault_code }) : word('fault');
  return [fault.mnemonic ?? (fault.code && t('fault_number', { code: fault.code })), faultMeaning(fault)].filter(Boolean).join(' ') || t('fault_unexplained');
}

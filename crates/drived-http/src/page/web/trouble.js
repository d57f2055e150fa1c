// What troubles a drive, as the daemon tells it: the worst, and its words in the language of the page.

import { named, t } from './texts.js';
import { faultMeaning, told } from './told.js';
import { word } from './vocabulary.js';

/** How a drive stands that nothing troubles. */
const NOTHING = { rank: Infinity, severity: 'none', text: '', alike: '', remedy: '' };

/** `{rank, severity, text, alike, remedy}`: 0 is the worst; the severity is `alarm`, `warning`, `note` or `none`; `alike` is the text without what is each drive's own. */
export function trouble(drive) {
  const [worst] = drive.concerns ?? [];
  if (!worst) return drive.control === false ? { ...NOTHING, text: t('only_read') } : NOTHING;
  const what = t(`concern_${worst.kind}`);
  // Who has taken control is told by one word of the API, and everything else by a sentence.
  const detail = worst.kind === 'control_taken' ? word(worst.detail) : told(worst.detail);
  const text = detail ? named(what, detail) : what;
  // The same fault has the same detail; why a drive does not answer is told of each in other words.
  return { rank: worst.rank, severity: worst.severity, text, alike: worst.kind === 'tripped' ? text : what, remedy: told(worst.remedy) };
}

/** Whether somebody should see to it; a note is none. */
export function isTrouble({ severity }) {
  return severity === 'alarm' || severity === 'warning';
}

/** Code, mnemonic and meaning of the present fault. */
export function faultText(drive) {
  const { fault, status } = drive;
  if (!fault) return status?.fault_code ? t('fault_number', { code: status.fault_code }) : word('fault');
  return [fault.mnemonic ?? (fault.code && t('fault_number', { code: fault.code })), faultMeaning(fault)].filter(Boolean).join(' ') || t('fault_unexplained');
}

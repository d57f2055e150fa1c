// What the daemon says in words, in the language of the page.

import { language } from './texts.js';
import { word } from './vocabulary.js';

/** The French of the daemon's sentences and of the manuals' meanings: asked for when somebody reads French. */
let french;

/** Ends when everything can be told in the language of the page. */
export async function knowLanguage() {
  if (language() !== 'fr' || french) return;
  const [sentences, faults, findings] = await Promise.all([import('./sentences_fr.js'), import('./faults_fr.js'), import('./findings_fr.js')]);
  sentences.useWords(word);
  french = { sentence: sentences.french, faults: faults.FAULTS_FR, finding: findings.findingFr };
}

/** A sentence of the daemon. */
export function told(text) {
  return text && language() === 'fr' && french ? french.sentence(text) : text ?? '';
}

/** Its language, as an attribute, where that is not the page's. */
export function langOf(text) {
  return language() !== 'en' && told(text) === text ? { lang: 'en' } : {};
}

/** What a line has found wrong: its sentence, from what it cannot be told, and what to do next; in the language `lang`. */
export function foundWords(finding) {
  const known = language() === 'fr' && french?.finding(finding);
  if (known) return { ...known, lang: 'fr' };
  const other = finding.cannot_be_told_from;
  return { text: finding.text ?? '', alike: other ? `a master cannot tell it from ${other}` : '', next: finding.next ?? [], lang: 'en' };
}

/** What a fault means. */
export function faultMeaning(fault) {
  return ofFault(fault.meaning);
}

/** What to do first. */
export function faultRemedy(fault) {
  return ofFault(fault.remedy);
}

function ofFault(text) {
  return (language() === 'fr' && french?.faults[text]) || text || '';
}

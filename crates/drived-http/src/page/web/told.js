// What the daemon says in words, in the language of the page.

import { language } from './texts.js';
import { word } from './vocabulary.js';

/** The French of the daemon's sentences and of the manuals' meanings: asked for when somebody reads French. */
let french;

/** Ends when everything can be told in the language of the page. */
export async function knowLanguage() {
  if (language() !== 'fr' || french) return;
  const [sentences, faults] = await Promise.all([import('./sentences_fr.js'), import('./faults_fr.js')]);
  sentences.useWords(word);
  french = { sentence: sentences.french, faults: faults.FAULTS_FR };
}

/** A sentence of the daemon. */
export function told(text) {
  return text && language() === 'fr' && french ? french.sentence(text) : text ?? '';
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

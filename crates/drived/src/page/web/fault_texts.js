// What a fault means and what to do, in the language of the page.

import { FAULTS_FR } from './faults_fr.js';
import { language } from './texts.js';

/** What a fault means. */
export function faultMeaning(fault) {
  return inLanguage(fault.meaning);
}

/** What to do first. */
export function faultRemedy(fault) {
  return inLanguage(fault.remedy);
}

function inLanguage(text) {
  return language() === 'fr' ? FAULTS_FR[text] ?? text ?? '' : text ?? '';
}

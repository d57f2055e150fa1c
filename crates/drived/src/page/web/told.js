// What the daemon says in words, in the language of the page.

import { french } from './sentences_fr.js';
import { language } from './texts.js';

/** A sentence of the daemon. */
export function told(text) {
  return text && language() === 'fr' ? french(text) : text ?? '';
}

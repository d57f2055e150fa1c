// A number as a person writes it: with a point or a comma before its decimals. A browser's own field for numbers drops the comma of
// another language than its own, and gives no point back that it has not read to the end: 2,5 became 25, and 0.5 became 50.

import { el } from './dom.js';
import { language, t } from './texts.js';

const WRITTEN = /^\d*[.,]?\d+$/;

/** The field. `says(text)` tells what is wrong with what stands in it, if anything is: no form with it is sent then. */
export function decimalField(attributes, says = () => '') {
  const field = el('input', { type: 'text', inputmode: 'decimal', autocomplete: 'off', ...attributes });
  field.addEventListener('input', () => field.setCustomValidity(read(field) === undefined ? t('no_number') : says(read(field))));
  return field;
}

/** The number in a field; `undefined` where there is none, or anything else beside it. */
export function read(field) {
  const text = field.value.trim();
  return WRITTEN.test(text) ? Number(text.replace(',', '.')) : undefined;
}

/** Puts a number into a field, or nothing. */
export function write(field, number) {
  const text = String(number ?? '');
  field.value = language() === 'fr' ? text.replace('.', ',') : text;
  // What was wrong with what stood there before does not hold the form back.
  field.setCustomValidity('');
}

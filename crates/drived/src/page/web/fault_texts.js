// What a fault means and what to do, in the language of the page. The daemon tells it in English, from the manuals.

/** What a fault means. */
export function faultMeaning(family, fault) {
  return fault.meaning ?? '';
}

/** What to do first. */
export function faultRemedy(family, fault) {
  return fault.remedy ?? '';
}

// Finding by words: in any order, whatever their case, accents, apostrophes and script; numbers as whole numbers.

const CYRILLIC = { а: 'a', б: 'b', в: 'v', г: 'g', д: 'd', е: 'e', ж: 'zh', з: 'z', и: 'i', к: 'k', л: 'l', м: 'm', н: 'n', о: 'o', п: 'p', р: 'r', с: 's', т: 't', у: 'u', ф: 'f', х: 'kh', ц: 'ts', ч: 'ch', ш: 'sh', щ: 'shch', ъ: '', ы: 'y', ь: '', э: 'e', ю: 'yu', я: 'ya', і: 'i', є: 'ye' };
const GREEK = { α: 'a', β: 'v', γ: 'g', δ: 'd', ε: 'e', ζ: 'z', η: 'i', θ: 'th', ι: 'i', κ: 'k', λ: 'l', μ: 'm', ν: 'n', ξ: 'x', ο: 'o', π: 'p', ρ: 'r', σ: 's', ς: 's', τ: 't', υ: 'y', φ: 'f', χ: 'ch', ψ: 'ps', ω: 'o' };
const LETTERS = { ...CYRILLIC, ...GREEK, ß: 'ss', æ: 'ae', œ: 'oe', ø: 'o', ł: 'l', đ: 'd', ı: 'i' };

/** A text as it is compared: small letters of one script, without accents. */
export function folded(text) {
  const plain = text.normalize('NFKD').replace(/\p{M}/gu, '').toLowerCase();
  return plain.replace(/[^\x00-\x7f]/g, letter => LETTERS[letter] ?? letter);
}

/** The words and numbers of a text, as they are compared. */
export function wordsOf(text) {
  const words = folded(text).match(/\p{L}+|\p{N}+/gu) ?? [];
  return words.map(word => (/^\d/.test(word) ? String(Number(word)) : word));
}

/**
 * Those of `all` that fit what is asked, each told by `text(one)`: every word begins a word of it, a number is a whole one, and a single
 * letter, too, where it is a word of somebody. Where nobody fits so, what is asked may stand anywhere in a word.
 */
export function found(all, asked, text) {
  const words = wordsOf(asked);
  if (!words.length) return all;
  const told = all.map(one => wordsOf(text(one)));
  const isWhole = word => /^\d/.test(word) || (word.length === 1 && words.length > 1 && told.some(those => those.includes(word)));
  const whole = new Set(words.filter(isWhole));
  const fits = (those, word) => those.some(one => (whole.has(word) ? one === word : one.startsWith(word)));
  const strict = all.filter((_, index) => words.every(word => fits(told[index], word)));
  if (strict.length) return strict;
  return all.filter((_, index) => words.every(word => told[index].some(one => one.includes(word))));
}

// Where somebody is on the page: the view, what it is of, and what is asked there. All of it stands in the address, so that Back,
// a reload and a link that is sent to somebody else find the same.

const FIRST = '';
/** Where the overview was left. */
let overviewHash = '#/';

/** `{ name, argument, asked }`: the view, what it is of, and what is asked there. */
export function here() {
  const text = location.hash.replace(/^#\/?/, '');
  const end = text.indexOf('?');
  const [name, ...argument] = (end < 0 ? text : text.slice(0, end)).split('/');
  return { name, argument: decoded(argument.join('/')), asked: new URLSearchParams(end < 0 ? '' : text.slice(end + 1)) };
}

/** The address of a drive's view. */
export function ofDrive(name) {
  return `#/drive/${encodeURIComponent(name)}`;
}

/** Writes into the address what is asked in this view; what is as usual is left out. No step of Back is made of it. */
export function keepAsked(asked) {
  const { name } = here();
  const said = new URLSearchParams(Object.entries(asked).filter(([, value]) => value));
  const hash = `#/${name}${said.size ? `?${said}` : ''}`;
  if (name === FIRST) overviewHash = hash;
  if (hash !== location.hash && (said.size || location.hash.includes('?'))) history.replaceState(history.state, '', hash);
}

/** The address of the overview as it was left. */
export function overviewAddress() {
  return overviewHash;
}

/** Notes how far down somebody is, and which row he looks at or opens, for when he comes back. */
export function keepScroll(row) {
  const kept = { y: scrollY, row: row?.dataset.name, offset: row?.getBoundingClientRect().top };
  history.replaceState(kept, '');
}

/** Where somebody was in this step of the history; `undefined` where he has not been. */
export function leftAt() {
  return history.state ?? undefined;
}

/** Goes down to where somebody was: to the row if it is there, else so far down. */
export function scrollBack(root, { y, row, offset }) {
  scrollTo(0, y);
  const found = row && root.querySelector(`[data-name="${CSS.escape(row)}"]`);
  if (!found) return;
  // What is out of sight gets its true height when it comes near.
  for (let times = 0; times < 3; times++) scrollBy(0, found.getBoundingClientRect().top - offset);
  found.querySelector('a')?.focus({ preventScroll: true });
}

/** What cannot be decoded, such as a lone `%`, stands for itself. */
function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

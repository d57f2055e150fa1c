// Elements, and their texts by textContent alone.

/** An element: `el('p.note', {title: 'x'}, 'text', child, …)`. Attributes that begin with `on` are listeners. */
export function el(name, attributes = {}, ...children) {
  const [tag, ...classes] = name.split('.');
  const element = document.createElement(tag);
  if (classes.length) element.className = classes.join(' ');
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
    else if (value === true) element.setAttribute(key, '');
    else if (value !== false && value !== undefined) element.setAttribute(key, value);
  }
  element.append(...children.filter(child => child !== undefined && child !== null));
  return element;
}

/** Sets the text of an element where it has changed, so that selection and screen readers are left alone. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Sets or removes an attribute where it has changed. */
export function setAttribute(element, name, value) {
  if (value === undefined || value === null || value === false) element.removeAttribute(name);
  else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
}

/** A class that is there or not. */
export function setClass(element, name, present) {
  element.classList.toggle(name, Boolean(present));
}

/** Puts `rows` into `parent` in this order with as few moves as possible; the focus stays where it is. */
export function arrange(parent, rows) {
  const focused = document.activeElement;
  let place = parent.firstElementChild;
  for (const row of rows) {
    if (row === place) place = place.nextElementSibling;
    else parent.insertBefore(row, place);
  }
  while (place) {
    const next = place.nextElementSibling;
    place.remove();
    place = next;
  }
  if (focused !== document.activeElement && parent.contains(focused)) focused.focus({ preventScroll: true });
}

/** The members of a list by their key, in the order in which the keys come first. */
export function grouped(list, keyOf) {
  const groups = new Map();
  for (const one of list) {
    const key = keyOf(one);
    if (groups.has(key)) groups.get(key).push(one);
    else groups.set(key, [one]);
  }
  return groups;
}

/** A table with a header row; `columns` are texts, or `[text, class]`. */
export function table(caption, columns, rows, name = 'table') {
  return el(name, {},
    caption ? el('caption', {}, caption) : null,
    el('thead', {}, el('tr', {}, ...columns.map(column =>
      Array.isArray(column) ? el(`th.${column[1]}`, { scope: 'col' }, column[0]) : el('th', { scope: 'col' }, column)))),
    el('tbody', {}, ...rows));
}

/** Offers a text as a file. */
export function download(name, type, parts) {
  const url = URL.createObjectURL(new Blob(parts, { type }));
  const link = el('a', { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

// Requests to the daemon that this page came from.

const ROOT = 'api/v1/';

/** What the daemon answered instead of doing it, or that it could not be reached (`status` 0). */
export class Problem extends Error {
  constructor(status, document) {
    super(document.detail ?? document.title ?? `HTTP ${status}`);
    this.status = status;
    this.document = document;
  }

  /** Whether a token with more rights would help. */
  get lacksRight() {
    return this.status === 401 || this.status === 403;
  }
}

/** A path below `/api/v1/`, its parts encoded. */
export function path(...parts) {
  return parts.map(encodeURIComponent).join('/');
}

/** Reads a document. */
export function read(where) {
  return send(where, { method: 'GET' });
}

/** Sends a document: `POST`, or `PUT` where it is said. */
export function post(where, body = {}, method = 'POST') {
  return send(where, { method, headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) });
}

/** The address of a document, for links. */
export function address(where) {
  return ROOT + where;
}

async function send(where, options) {
  let response;
  try {
    response = await fetch(ROOT + where, { credentials: 'same-origin', ...options });
  } catch (error) {
    throw new Problem(0, { detail: String(error.message ?? error) });
  }
  const text = await response.text().catch(() => '');
  let document = {};
  try {
    document = text ? JSON.parse(text) : {};
  } catch {
    document = { detail: text.slice(0, 200) };
  }
  if (!response.ok) throw new Problem(response.status, document);
  return document;
}

/** An id for a command, so that one that is sent twice is carried out once. */
export function commandId() {
  const bytes = crypto.getRandomValues(new Uint8Array(9));
  return `page-${Array.from(bytes, byte => byte.toString(16).padStart(2, '0')).join('')}`;
}

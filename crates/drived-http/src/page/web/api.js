// Requests to the daemon that this page came from.

const ROOT = 'api/v1/';
const WITHIN_MS = 10_000;

/** What the daemon answered instead of doing it, or that nobody knows what it did. */
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

  /** Whether it was not the daemon that answered, but somebody between or nobody: what it did with the request is not known. */
  get isUnheard() {
    return this.status === 0;
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

/** Sends a document: `POST`, or `PUT` where it is said; for so long at most. */
export function post(where, body = {}, method = 'POST', withinMs = WITHIN_MS) {
  return send(where, { method, headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) }, withinMs);
}

/** The address of a document, for links. */
export function address(where) {
  return ROOT + where;
}

async function send(where, options, withinMs = WITHIN_MS) {
  const limit = new AbortController();
  const timer = setTimeout(() => limit.abort(), withinMs);
  try {
    const response = await fetch(ROOT + where, { credentials: 'same-origin', signal: limit.signal, ...options });
    const text = await response.text();
    if (response.status === 204) return {};
    // What does not say that it is JSON is a proxy's, and nobody's word about the motors.
    if (!/json/.test(response.headers.get('content-type') ?? '')) throw new Problem(0, { detail: `HTTP ${response.status}` });
    const document = JSON.parse(text);
    if (!response.ok) throw new Problem(response.status, document);
    return document;
  } catch (error) {
    throw error instanceof Problem ? error : new Problem(0, { detail: String(error.message ?? error) });
  } finally {
    clearTimeout(timer);
  }
}

/** An id for a command, so that one that is sent twice is carried out once. */
export function commandId() {
  const bytes = crypto.getRandomValues(new Uint8Array(9));
  return `page-${Array.from(bytes, byte => byte.toString(16).padStart(2, '0')).join('')}`;
}

// The daemon's events, resumed by their revision after every interruption, and the silence that makes everything old.

const SILENT_AFTER_MS = 12_000;
const AGAIN_MS = 1_000;
const KINDS = ['drive', 'line', 'command', 'event', 'alarm', 'tick'];

/**
 * Follows the events after `revision`. `handlers`: `news(kind, data)`, `reset()` when the state must be read again,
 * `interrupted()` when the connection has broken, and `silence(isSilent)` when nothing at all has come for 12 s, and when
 * something comes again.
 */
export function follow(revision, handlers) {
  let source;
  let last = revision;
  let heard = performance.now();
  let silent = false;
  let again;

  function hear(event) {
    heard = performance.now();
    if (event.lastEventId && Number(event.lastEventId) >= last) last = Number(event.lastEventId);
    if (silent) {
      silent = false;
      handlers.silence(false);
    }
  }

  function connect() {
    source?.close();
    source = new EventSource(`api/v1/events?since=${last}`);
    for (const kind of KINDS) {
      source.addEventListener(kind, event => {
        hear(event);
        handlers.news(kind, JSON.parse(event.data));
      });
    }
    source.addEventListener('reset', event => {
      hear(event);
      end();
      handlers.reset();
    });
    // The browser would ask for the first revision again, and gives up altogether after a refusal.
    source.addEventListener('error', () => {
      source.close();
      handlers.interrupted();
      clearTimeout(again);
      again = setTimeout(connect, AGAIN_MS);
    });
  }

  // A connection that is open and says nothing is no better than none.
  const watch = setInterval(() => {
    const quiet = performance.now() - heard;
    if (quiet > SILENT_AFTER_MS && !silent) {
      silent = true;
      handlers.silence(true);
    }
    if (silent && quiet % SILENT_AFTER_MS < AGAIN_MS) connect();
  }, AGAIN_MS);

  function end() {
    source?.close();
    clearTimeout(again);
    clearInterval(watch);
  }

  connect();
  return end;
}

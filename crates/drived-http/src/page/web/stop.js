
// STOP ALL: sent at once, without a question, and followed until every drive is accounted for. It stands in the first bytes
// of the document and needs nothing else of the page; what comes later may hand it `window.stopAll.later`: how to close the
// page's stream and its questions, who lacks a right, the daemon's sentences and words in the page's language, whose stop the fleet alarms.
(() => {
  'use strict';
  const ATTEMPT_MS = 2_000;
  const AGAIN_MS = 500;
  const GIVE_UP_MS = 60_000;
  const LOOK_MS = 400;
  const NAMED = 12;
  const COUNTS = ['confirmed', 'pending', 'not_reachable', 'refused', 'failed'];
  const TABLE = {
  stop_all: ['STOP ALL', 'ARRÊT GÉNÉRAL'],
  stop_key: ['Ctrl+Shift+S', 'Ctrl+Maj+S'],
  stop_note: ['No emergency stop: that one is wired.', 'N’est pas un arrêt d’urgence : celui-ci est câblé.'],
  stop_account: ['Account of the stop', 'Bilan de l’arrêt'],
  stop_sending: ['Sending the stop to all drives…', 'Envoi de l’arrêt à tous les variateurs…'],
  stop_unheard: ['NOT KNOWN WHETHER THE STOP ARRIVED: no answer from the daemon for {seconds} s.', 'ON IGNORE SI L’ARRÊT EST ARRIVÉ : pas de réponse du service depuis {seconds} s.'],
  stop_unheard_via: ['NOT KNOWN WHETHER THE STOP ARRIVED: what stands between here and the daemon answered {status}.', 'ON IGNORE SI L’ARRÊT EST ARRIVÉ : un intermédiaire entre ici et le service a répondu {status}.'],
  stop_busy: ['NOT TAKEN YET: {why}.', 'PAS ENCORE PRIS : {why}.'],
  stop_refused: ['STOP REFUSED: {why}.', 'ARRÊT REFUSÉ : {why}.'],
  stop_taken: ['Taken by the daemon at {time} for {count} drives', 'Pris par le service à {time} pour {count} variateurs'],
  stop_taken_one: ['Taken by the daemon at {time} for one drive', 'Pris par le service à {time} pour un variateur'],
  stop_done: ['Taken by the daemon at {time}: all {count} drives have confirmed the stop', 'Pris par le service à {time} : les {count} variateurs ont confirmé l’arrêt'],
  stop_done_one: ['Taken by the daemon at {time}: the one drive has confirmed the stop', 'Pris par le service à {time} : le variateur a confirmé l’arrêt'],
  stop_alarm: ['STOP NOT CONFIRMED by {count} drives: their motors may turn', 'ARRÊT NON CONFIRMÉ par {count} variateurs : leurs moteurs peuvent tourner'],
  stop_alarm_one: ['STOP NOT CONFIRMED by one drive: its motor may turn', 'ARRÊT NON CONFIRMÉ par un variateur : son moteur peut tourner'],
  stop_lost_sight: ['Its account cannot be read now: look at the drives.', 'Son bilan est illisible pour l’instant : regardez les variateurs.'],
  stop_account_gone: ['The daemon has no account of it any more, it may have been restarted: look at the drives.', 'Le service n’en a plus le bilan, il a peut-être redémarré : regardez les variateurs.'],
  stop_next_emergency: ['Use the emergency stop.', 'Utilisez l’arrêt d’urgence.'],
  stop_next_again: ['Use the emergency stop. It is sent again, attempt {tries}.', 'Utilisez l’arrêt d’urgence. Nouvel envoi, tentative {tries}.'],
  stop_next_press: ['Use the emergency stop. Given up after {seconds} s: press again.', 'Utilisez l’arrêt d’urgence. Abandon après {seconds} s : appuyez de nouveau.'],
  stop_next_right: ['Use the emergency stop, or log in with a token that may stop.', 'Utilisez l’arrêt d’urgence, ou identifiez-vous avec un jeton qui peut arrêter.'],
  stop_confirmed: ['confirmed', 'confirmés'],
  stop_pending: ['pending', 'en attente'],
  stop_not_reachable: ['not reachable', 'injoignables'],
  stop_refused_count: ['only read, not stopped', 'lecture seule, non arrêtés'],
  stop_failed: ['not confirmed', 'non confirmés'],
  stop_named: ['{kind}: {names}', '{kind} : {names}'],
  stop_others: ['and {count} more', 'et {count} de plus'],
  stop_close: ['Close', 'Fermer'],
  };

  const root = document.documentElement;
  const button = document.getElementById('stop');
  const place = document.getElementById('stop-account');
  const later = {};
  const account = { phase: 'none' };
  // Each press counts: what an earlier one still does is over.
  let presses = 0;
  let wake = () => {};
  let written;

  root.lang = language();
  window.stopAll = { later, write, news, language };
  write();
  // By a pointer at once, by keys when they are pressed; the click that follows a pointer is no second stop.
  button.addEventListener('pointerdown', event => event.button === 0 && press());
  button.addEventListener('click', event => event.detail === 0 && press());
  addEventListener('keydown', event => {
    if (!event.ctrlKey || !event.shiftKey || event.code !== 'KeyS') return;
    event.preventDefault();
    if (!event.repeat) press();
  });

  /** Where a stop is under way that nobody has answered, a press sends it once more; else it is another one. */
  function press() {
    later.withdraw?.();
    if (account.phase === 'sending' || account.phase === 'unheard') return void wake();
    send(++presses);
  }

  async function send(mine) {
    const began = Date.now();
    const id = `page-${Array.from(crypto.getRandomValues(new Uint8Array(9)), byte => byte.toString(16).padStart(2, '0')).join('')}`;
    for (const key of Object.keys(account)) delete account[key];
    show({ phase: 'sending', id, tries: 1 });
    // A browser has six connections to one place, and each page's stream keeps one: this page's makes room.
    later.closeStream?.();
    while (mine === presses) {
      const answer = await attempt('stop?wait=0', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ id }) });
      if (mine !== presses) return;
      if (answer.document?.drives) {
        take(answer.document);
        return void followUp(answer.document, mine);
      }
      const isOver = Date.now() - began > GIVE_UP_MS;
      const said = { seconds: Math.round((Date.now() - began) / 1_000), tries: account.tries + 1, status: answer.status, why: answer.document?.detail };
      if (answer.document && answer.status < 500 && answer.status !== 429) {
        if (answer.status === 401 || answer.status === 403) later.lacksRight?.();
        show({ ...said, phase: 'refused' });
        return void later.openStream?.();
      }
      show({ ...said, phase: isOver ? 'over' : 'unheard' });
      if (isOver) return void later.openStream?.();
      if (answer.status !== undefined || answer.failed) await new Promise(over => {
        wake = over;
        setTimeout(over, AGAIN_MS);
      });
    }
  }

  /** One request, for two seconds at most: the daemon's document, or the status of somebody between, or nothing. */
  async function attempt(where, options) {
    const limit = new AbortController();
    const timer = setTimeout(() => limit.abort(), ATTEMPT_MS);
    wake = () => limit.abort();
    try {
      const response = await fetch(`api/v1/${where}`, { credentials: 'same-origin', signal: limit.signal, ...options });
      const text = await response.text();
      let document;
      // What says that it is JSON is the daemon's; a proxy's page is nobody's word about the motors.
      if (/json/.test(response.headers.get('content-type') ?? '')) document = JSON.parse(text);
      return { status: response.status, document };
    } catch (error) {
      return { failed: error.name !== 'AbortError' };
    } finally {
      clearTimeout(timer);
    }
  }

  /** Reads the account for as long as something may become of it; what it said last stays when it cannot be read. */
  async function followUp(last, mine) {
    const open = () => setTimeout(() => later.openStream?.(), ATTEMPT_MS);
    let opening = open();
    while (mine === presses && account.open) {
      await new Promise(over => setTimeout(over, LOOK_MS));
      if (mine !== presses || !account.open) break;
      const answer = await attempt(`commands/${encodeURIComponent(last.id)}?wait=0`, {});
      if (mine !== presses) break;
      if (answer.document?.drives) {
        take(answer.document);
        opening ??= open();
      } else if (answer.document && answer.status === 404) show({ open: false, sight: 'stop_account_gone' });
      else if (account.open) {
        // The stream may hold the last connection: the account is read first, and the events are followed when it can be.
        clearTimeout(opening);
        opening = undefined;
        later.closeStream?.();
        show({ sight: 'stop_lost_sight' });
      }
    }
    clearTimeout(opening);
    if (mine === presses) later.openStream?.();
  }

  /** What the page's stream tells of a command. */
  function news(command) {
    if (command.id === account.id && command.drives) take(command);
    if (command.action === 'stop') later.withdraw?.(command);
    // Above a motor that turns again nobody reads that all have stopped.
    const isOver = account.phase === 'taken' && !account.open && !left().length;
    const isLater = command.time_unix_ms > account.answer?.time_unix_ms;
    if (command.action === 'start' && command.outcome === 'confirmed' && isOver && isLater) end();
  }

  function take(answer) {
    show({ phase: 'taken', answer, open: answer.open, sight: undefined });
  }

  function show(changes) {
    Object.assign(account, changes);
    write();
  }

  /** Writes everything again, in the language of now. */
  function write() {
    button.querySelector('strong').textContent = t('stop_all');
    button.querySelector('kbd').textContent = t('stop_key');
    document.getElementById('stop-note').textContent = t('stop_note');
    document.getElementById('stop-place').setAttribute('aria-label', t('stop_all'));
    place.setAttribute('aria-label', t('stop_account'));
    place.hidden = account.phase === 'none';
    if (place.hidden) return;
    const alarmed = alarms();
    const now = JSON.stringify([root.lang, account, alarmed.length]);
    if (now === written) return;
    written = now;
    const isAlarm = ['unheard', 'over', 'refused'].includes(account.phase) || alarmed.length > 0 || Boolean(account.sight);
    place.className = `stop-account ${account.phase}${isAlarm ? ' alarm' : left().length ? ' bad' : ''}`;
    const head = headline(alarmed);
    // A screen reader is told again only what has changed.
    const said = place.querySelector('.head') ?? make('p', 'head');
    said.setAttribute('role', 'alert');
    if (said.textContent !== head) said.textContent = head;
    const close = make('button', '', t('stop_close'));
    close.type = 'button';
    close.addEventListener('click', end);
    place.replaceChildren(said, ...[next(alarmed), counts(), names()].filter(Boolean), close);
  }

  function headline(alarmed) {
    const { phase, seconds, status, why, answer } = account;
    const told = { seconds, status, why: later.told?.(why) ?? why };
    if (phase === 'sending') return t('stop_sending');
    if (phase === 'refused') return t('stop_refused', told);
    if (phase !== 'taken') return why ? t('stop_busy', told) : status ? t('stop_unheard_via', told) : t('stop_unheard', told);
    // To those that are only read nothing was sent: they are named below.
    const sent = answer.drives.filter(one => one.counted !== 'refused');
    const head = { count: sent.length, time: (later.clock ?? clock)(answer.time_unix_ms) };
    if (account.sight) return `${many('stop_taken', head)}. ${t(account.sight)}`;
    if (alarmed.length) return `${many('stop_alarm', { count: alarmed.length })}. ${many('stop_taken', head)}`;
    return many(left().length ? 'stop_taken' : 'stop_done', head);
  }

  /** What to do now. */
  function next(alarmed) {
    const { phase, status } = account;
    const text = phase === 'unheard' ? t('stop_next_again', account)
      : phase === 'over' ? t('stop_next_press', { seconds: GIVE_UP_MS / 1_000 })
        : phase === 'refused' ? t(status === 401 || status === 403 ? 'stop_next_right' : 'stop_next_emergency')
          : alarmed.length || account.sight ? t('stop_next_emergency') : '';
    return text && make('p', 'next', text);
  }

  function counts() {
    if (!account.answer) return null;
    const list = make('dl', 'counts');
    for (const name of COUNTS) {
      const count = account.answer[name] ?? 0;
      if (!count && (name === 'refused' || name === 'failed')) continue;
      const row = make('div');
      const number = make('dd', count ? name : '', String(count));
      number.dataset.count = name;
      row.append(make('dt', '', t(name === 'refused' ? 'stop_refused_count' : `stop_${name}`)), number);
      list.append(row);
    }
    return list;
  }

  /** Who is not accounted for, by name, as they were counted. */
  function names() {
    const kinds = [...new Set(left().map(one => one.counted))];
    const texts = kinds.map(kind => {
      const those = left().filter(one => one.counted === kind).map(one => one.drive);
      const rest = those.length > NAMED ? ` ${t('stop_others', { count: those.length - NAMED })}` : '';
      return t('stop_named', { kind: t(kind === 'refused' ? 'stop_refused_count' : `stop_${kind}`), names: those.slice(0, NAMED).join(', ') + rest });
    });
    return texts.length ? make('p', 'left', texts.join(' · ')) : null;
  }

  function left() {
    return (account.answer?.drives ?? []).filter(one => one.counted !== 'confirmed');
  }

  function alarms() {
    return left().filter(one => one.counted !== 'refused' && later.isAlarmed?.(one.drive));
  }

  function end() {
    presses++;
    account.phase = 'none';
    write();
    later.openStream?.();
  }

  function make(tag, name = '', text = '') {
    const element = document.createElement(tag);
    if (name) element.className = name;
    element.textContent = text;
    return element;
  }

  function t(name, values = {}) {
    return TABLE[name][root.lang === 'fr' ? 1 : 0].replace(/\{(\w+)\}/g, (whole, key) => values[key] ?? whole);
  }

  /** A text about so many drives. */
  function many(name, values) {
    return t(values.count === 1 ? `${name}_one` : name, values);
  }

  function clock(unixMs) {
    return new Intl.DateTimeFormat(root.lang === 'fr' ? 'fr' : 'en-GB', { hour: '2-digit', minute: '2-digit', second: '2-digit', hourCycle: 'h23', timeZoneName: 'shortOffset' }).format(new Date(unixMs));
  }

  /** The language that was chosen here, else the first that the browser asks for and the page has. */
  function language() {
    let kept;
    try {
      kept = localStorage.getItem('drived.language');
    } catch {
      kept = null;
    }
    const asked = [kept, ...(navigator.languages ?? [navigator.language])].map(tag => (tag ?? '').slice(0, 2));
    return asked.find(tag => tag === 'en' || tag === 'fr') ?? 'en';
  }
})();

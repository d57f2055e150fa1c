// Who gave a drive what it follows, and when: from the commands that the daemon has told.

import { clock } from './format.js';
import { plant } from './plant.js';
import { t } from './texts.js';

/** The newest command by which a drive got a setpoint, if one is known. */
export function lastSetpoint(name) {
  const groups = plant.groups.filter(group => group.drives.includes(name)).map(group => group.name);
  return plant.events.find(({ kind, action, outcome, drive, group, selected, command }) =>
    kind === 'command' && outcome === 'confirmed' && (action === 'setpoint' || / at /.test(command ?? ''))
    && (drive === name || groups.includes(group) || selected?.includes(name)));
}

/** "by anna, 14:03:22 UTC+1"; briefly the name alone, and nothing where it was the asker himself. */
export function givenBy(name, isBrief = false) {
  const given = plant.drives.get(name)?.setpoint && lastSetpoint(name);
  if (!given) return '';
  if (isBrief) return given.caller === plant.daemon.caller ? '' : given.caller;
  return t('given_by', { who: given.caller, time: clock(given.time_unix_ms) });
}

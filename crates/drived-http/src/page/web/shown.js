// What a question shows of its drives: it goes with the command, and the question is withdrawn when it is so no more.

import { plant } from './plant.js';
import { t } from './texts.js';
import { setpointOf, setpointText } from './words.js';

/** A reference that was given elsewhere trembles; as the daemon has it. */
const TREMBLES_HZ = 0.5;
/** What a stop says of is short enough to be read by everybody between. */
const STOPS_SAY = 100;

/** What is shown of these drives now, as a command says it. */
export function shown(names) {
  return { drives: drivesOf(names).map(({ name, place }) => ({ name, place })) };
}

/** The same for a start: also their setpoints, and which motors are driven. */
export function shownToStart(names) {
  return { drives: drivesOf(names).map(drive => {
    const { name, place } = drive;
    return { name, place, setpoint: setpointOf(drive) ?? undefined, driven: drivenOf(drive) };
  }) };
}

/** The same for a stop, which needs none of it. */
export function shownToStop(names) {
  return names.length > STOPS_SAY ? {} : { expects: shown(names) };
}

/** The drives with the setpoints at which they would start. */
export function withSetpoints({ drives }) {
  return drives.map(({ name, setpoint }) => (setpoint ? t('at_setpoint', { drive: name, setpoint: setpointText(setpoint) }) : name));
}

/** What is otherwise now, in words; nothing while all is as it was shown. */
export function otherwise({ drives }) {
  for (const { name, place, setpoint, driven } of drives) {
    const now = plant.drives.get(name);
    if (now?.place !== place) {
      const other = [...plant.drives.values()].find(drive => drive.place === place);
      if (other) return t('now_called', { was: name, now: other.name });
      return t(now ? 'now_another' : 'now_gone', { drive: name });
    }
    const drivenNow = drivenOf(now);
    if (driven && drivenNow && drivenNow !== driven) return t(`now_driven_${drivenNow}`, { drive: name });
    if (setpoint && !isStill(setpoint, now)) return t('now_setpoint', { drive: name, setpoint: setpointText(setpointOf(now)) });
  }
  return '';
}

function drivesOf(names) {
  return names.map(name => plant.drives.get(name)).filter(Boolean);
}

/** Which way its motor is driven, or that it is not; nothing where its words do not tell. */
function drivenOf({ status }) {
  if (!status?.motion || status.motion === 'not_known') return undefined;
  return status.motion === 'driven' ? status.direction ?? undefined : 'not';
}

function isStill(setpoint, drive) {
  const now = setpointOf(drive) ?? {};
  const isTheirs = !drive.setpoint && 'frequency_hz' in now && 'frequency_hz' in setpoint;
  if (isTheirs) return Math.abs(now.frequency_hz - setpoint.frequency_hz) <= TREMBLES_HZ;
  return ['frequency_hz', 'speed_rpm', 'share_percent'].every(unit => now[unit] === setpoint[unit]);
}

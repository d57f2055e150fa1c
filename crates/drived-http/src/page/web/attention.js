// What calls somebody who looks elsewhere: the title, the icon, and a sound where he has asked for it.

import { alarmText, ofWhat, waits } from './alarm_words.js';
import { plant } from './plant.js';
import { named } from './texts.js';

const KEPT = 'drived.sound';
const TONES_HZ = [880, 660, 880];
const TONE_S = 0.18;
const LOUDNESS = 0.15;

let isOn = kept();
let context;
/** The alarms that have called already, by their numbers: how often each had come. */
let called;

/** Whether a new alarm makes a sound here. */
export function isLoud() {
  return isOn;
}

/** Switches the sound on or off, and lets it be heard; gives whether it is on. */
export function switchSound() {
  isOn = !isOn;
  try {
    localStorage.setItem(KEPT, isOn ? 'on' : 'off');
  } catch {
    // A browser that keeps nothing asks again the next time.
  }
  if (isOn) sound();
  return isOn;
}

/** Writes title and icon for this view; calls for what is new. Gives how many alarms wait, and what is new in words. */
export function callAttention(title) {
  const waiting = [...plant.alarms.values()].filter(waits);
  document.title = `${waiting.length ? `(${waiting.length}) ` : ''}${title}`;
  const icon = document.querySelector('link[rel=icon]');
  const wanted = waiting.length ? 'icon_alarm.svg' : 'icon.svg';
  if (icon.getAttribute('href') !== wanted) icon.setAttribute('href', wanted);
  const isNew = alarm => alarm.state === 'unacknowledged' && (called?.get(alarm.id) ?? 0) < alarm.count;
  // What stood when the page was opened is told by the list, and calls nobody.
  const news = called ? waiting.filter(isNew) : [];
  if (plant.connection === 'live') called = new Map([...plant.alarms.values()].map(alarm => [alarm.id, alarm.count]));
  if (news.length && isOn) sound();
  return { count: waiting.length, news: news.map(alarm => named(ofWhat(alarm), alarmText(alarm))) };
}

/** Three short tones. A browser lets a page sound only after somebody has touched it. */
function sound() {
  context ??= new AudioContext();
  context.resume();
  TONES_HZ.forEach((hertz, index) => {
    const [tone, volume] = [context.createOscillator(), context.createGain()];
    const begin = context.currentTime + index * TONE_S * 1.4;
    tone.frequency.value = hertz;
    volume.gain.setValueAtTime(LOUDNESS, begin);
    volume.gain.exponentialRampToValueAtTime(0.001, begin + TONE_S);
    tone.connect(volume).connect(context.destination);
    tone.start(begin);
    tone.stop(begin + TONE_S);
  });
}

function kept() {
  try {
    return localStorage.getItem(KEPT) === 'on';
  } catch {
    return false;
  }
}

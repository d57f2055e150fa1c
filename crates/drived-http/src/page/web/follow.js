// Following a command, in the states and words of the program's own follower: how it stands, out of sight, gone.

import { path, read } from './api.js';

const LOOK_MS = 400;
// As long as the daemon remembers a command.
const SETTLES_FOR_MS = 600_000;

/**
 * Calls `tell` with `{ told }`, `{ outOfSight }` (it goes on, and cannot be read now) or `{ gone }` (nobody will ever know), for
 * as long as something may become of a command of which `last` is known and it is wanted.
 */
export async function follow(last, tell, isWanted = () => true) {
  const until = Date.now() + SETTLES_FOR_MS;
  const address = `${path('commands', last.id)}?wait=0`;
  let isOutOfSight = false;
  while (last.open && Date.now() < until) {
    await new Promise(over => setTimeout(over, LOOK_MS));
    if (!isWanted()) return;
    let news;
    try {
      last = await read(address);
      isOutOfSight = false;
      news = { told: last };
    } catch (problem) {
      if (!problem.isUnheard && problem.status < 500) last = { open: false };
      else if (isOutOfSight) continue;
      isOutOfSight = true;
      news = last.open ? { outOfSight: problem.message } : { gone: problem.message };
    }
    if (!isWanted()) return;
    tell(news);
  }
}

// SPDX-License-Identifier: Apache-2.0
// What is shown, and how the parts of the page hear of it: who changes `app` tells, and who shows
// something of it listens. Everything on the screen follows from `app`.
import {takeToken} from './address.js';
import {Camera} from './camera.js';
import {Questions} from './questions.js';
import {Client} from './rpc.js';
import {Show} from './show.js';

export const app = {
  client: new Client(takeToken()),
  show: new Show(),
  camera: new Camera(),
  /** The map and the revision that were asked for; null is the newest. */
  map: '',
  revision: null,
  /** Whether new revisions are followed. */
  isLive: false,
  /** Whether time runs. */
  isPlaying: false,
  query: '',
  /** The revision to compare with; 0 is none. */
  diff: 0,
  /** What comes next while the scene is loading. */
  loading: '',
  /** @type {import('./scene.js').Scene | null} */
  scene: null,
  /** Of the map that is shown. */
  revisions: [],
  tags: [],
  /** Ends what runs for the scene that is shown. */
  running: new AbortController(),
};

/** Asks about the scene that is shown; the answers that come after it has gone are errors. */
export const ask = () => new Questions(app.client, app.scene, app.running.signal);

const listeners = new Map();

/**
 * Runs a function whenever something is told:
 * "changed": the scene, the time or how they are shown; texts and the address follow.
 * "redraw": the picture is to be made again, with true its buffers too.
 * "loading": what is being loaded.
 * "time": somebody went to another time.
 * "positions": the server has said where everybody is at the time that is shown.
 * "open": a map (first argument) is to be opened at a revision (second; null is the newest).
 */
export function listen(event, run) {
  if (!listeners.has(event)) listeners.set(event, []);
  listeners.get(event).push(run);
}

export function tell(event, ...about) {
  for (const run of listeners.get(event) ?? []) run(...about);
}

/** The picture, its texts and the address are made again; `isStale`: so are buffers. */
export function changed(isStale = true) {
  tell('redraw', isStale);
  tell('changed');
}

// SPDX-License-Identifier: Apache-2.0
// What the keys do, and the buttons that do the same.
import {compare, forget} from './answers.js';
import {setPlaying, setTime} from './clock.js';
import {element} from './dom.js';
import {listenToKeys} from './input.js';
import {setLive, showLayers, stepRevision, stepTag} from './opening.js';
import {explode, frameAll} from './picture.js';
import {GROUPS} from './scene.js';
import {app, tell} from './state.js';
import {explain} from './trouble.js';

const {show} = app;

const KEYS = {
  ' ': () => setPlaying(!app.isPlaying),
  ',': () => setTime(show.time - 1),
  '.': () => setTime(show.time + 1),
  '[': () => stepRevision(-1),
  ']': () => stepRevision(1),
  '{': () => stepTag(-1),
  '}': () => stepTag(1),
  x: toggleLayersApart,
  d: () => compare(app.diff ? 0 : Math.max(1, app.scene.revision - 1)).catch(explain),
  f: frameAll,
  '/': () => element('query').focus(),
  l: () => setLive(!app.isLive),
  t: toggleTable,
  '?': showHelp,
  ...Object.fromEntries(GROUPS.map(({name}, i) => [
    String(i + 1), () => document.getElementById(`layer-${name}`)?.click(),
  ])),
  Escape: forget,
};

/** Layers apart, or in place again. */
function toggleLayersApart() {
  explode(show.explode > 0 ? 0 : 1);
  showLayers();
}

function toggleTable() {
  element('table').hidden = !element('table').hidden;
  tell('changed');
}

function showHelp() {
  element('help').showModal();
}

/** Listens to keys, which do nothing before there is a scene. */
export function startKeys() {
  listenToKeys(KEYS, () => app.scene !== null);
  element('table-button').onclick = toggleTable;
  element('help-button').onclick = showHelp;
}

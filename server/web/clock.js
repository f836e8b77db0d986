// SPDX-License-Identifier: Apache-2.0
// The world time that is shown: its slider, play, and where everybody is at a time that stands
// still.
import {loadBodies} from './bodies.js';
import {debounced, element, setText} from './dom.js';
import {app, ask, changed, listen, tell} from './state.js';
import {textOf} from './time.js';
import {isSaid} from './trouble.js';

/** Steps of the slider. */
const TIME_STEPS = 10000;

const {show} = app;
let lastFrame = 0;

/** Goes to a time, seconds; to the nearest one that there is. */
export function setTime(seconds) {
  const {scene} = app;
  const before = show.time;
  show.time = Math.min(Math.max(seconds, scene.begin), scene.end);
  tell('time');
  changed(scene.changesBetween(before, show.time));
}

export function setPlaying(isPlaying) {
  app.isPlaying = isPlaying;
  element('play').setAttribute('aria-pressed', String(isPlaying));
  if (isPlaying && app.scene && show.time >= app.scene.end - 0.01) setTime(app.scene.begin);
  lastFrame = 0;
  if (!isPlaying) settleTime();
}

/** Lets time run; `now` is when a picture is made, milliseconds. */
export function advance(now) {
  if (!app.isPlaying || !app.scene) return;
  const elapsed = lastFrame ? (now - lastFrame) / 1000 : 0;
  lastFrame = now;
  setTime(show.time + elapsed * Number(element('speed').value));
  if (show.time >= app.scene.end) setPlaying(false);
}

/** Asks the server where everybody is at the time that is shown; tracks are samples of that. */
const settleTime = debounced(async () => {
  const {scene} = app;
  if (!scene || app.isPlaying) return;
  const {time} = show;
  const agents = scene.of('agents').map((node) => node.id);
  if (!agents.length || scene.exact.time === time) return;
  try {
    const positions = await ask().positions(agents, time);
    if (app.scene !== scene || show.time !== time) return;
    scene.exact = {time, positions};
    changed();
    tell('positions');
    await showBodies(scene, positions, time);
  } catch (error) {
    // Without an answer the picture is that of the samples, as the sentence says.
    isSaid(error);
  }
}, 150);

/** People that stand still are drawn with their bodies, where the map has those. */
async function showBodies(asked, positions, time) {
  const people = asked.of('agents').filter((node) => node.kind === 'human' &&
                                                     positions.get(node.id));
  if (!people.length || app.isPlaying || show.hidden.has('agents')) return;
  const meshes = await loadBodies(app.client, asked, people.map((node) => node.id), time,
                                  app.running.signal);
  if (app.scene !== asked || show.time !== time) return;
  asked.bodies = {time, meshes};
  document.body.dataset.bodies = String(meshes.size);
  tell('redraw', false);
}

function refresh() {
  const {scene} = app;
  if (!scene) return;
  setText(element('time-text'), textOf(show.time, scene.map));
  const span = scene.end - scene.begin;
  element('time').value = String(
      span > 0 ? Math.round((show.time - scene.begin) / span * TIME_STEPS) : 0);
  settleTime();
}

/** Connects the slider and the button. */
export function startClock() {
  listen('changed', refresh);
  element('play').onclick = () => setPlaying(!app.isPlaying);
  element('time').oninput = () => {
    const {scene} = app;
    if (!scene) return;
    setPlaying(false);
    setTime(scene.begin + Number(element('time').value) / TIME_STEPS * (scene.end - scene.begin));
  };
}

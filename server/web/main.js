// SPDX-License-Identifier: Apache-2.0
// The viewer: one picture of a map at one revision and one time. Starts the parts of the page, and
// shows what the address asks for.
import {readAddress, writeAddress} from './address.js';
import {goTo, select, startAnswers} from './answers.js';
import {advance, startClock} from './clock.js';
import {debounced, element, setText} from './dom.js';
import {listenToPointer} from './input.js';
import {startKeys} from './keys.js';
import {fillLegend} from './legend.js';
import {mapsOf, open, startOpening} from './opening.js';
import {drawHistogram, fillHelp, fillTable, sentenceOf} from './panels.js';
import {pick} from './pick.js';
import {startPicture} from './picture.js';
import {app, changed, listen} from './state.js';
import {nsOf} from './time.js';
import {addStanding, explain} from './trouble.js';

const {show, camera} = app;

const saveAddress = debounced(() => {
  const {scene} = app;
  if (!scene) return;
  writeAddress({
    map: app.map, revision: app.isLive ? null : scene.revision, isLive: app.isLive,
    atNs: nsOf(show.time, scene.epoch), selected: show.selected, hidden: [...show.hidden],
    explode: show.explode, query: app.query, diff: app.diff,
    camera: [...camera.target, camera.distance, camera.yaw, camera.pitch],
  });
}, 200);

function saySentence() {
  if (!app.scene) return;
  setText(element('sentence'), sentenceOf(app.scene, show, app.loading));
}

function refresh() {
  saySentence();
  saveAddress();
  if (app.scene && !element('table').hidden) fillTable(app.scene, show, select);
}

/** Takes from the address what needs no map. */
function takeLook(wanted) {
  if (wanted.hidden) show.hidden = new Set(wanted.hidden);
  show.explode = wanted.explode;
  if (wanted.camera) {
    camera.target = wanted.camera.slice(0, 3);
    [camera.distance, camera.yaw, camera.pitch] = wanted.camera.slice(3);
  }
  app.isLive = wanted.isLive;
  element('live').setAttribute('aria-pressed', String(wanted.isLive));
}

function startParts() {
  listen('changed', refresh);
  listen('loading', saySentence);
  startPicture(advance);
  startClock();
  startAnswers();
  startOpening();
  startKeys();
  fillHelp();
  fillLegend();
  listenToPointer(element('scene'), camera, {
    moved: () => changed(false),
    clicked: (at) => app.scene && select(pick(app.scene, show, camera, at)),
    goTo,
  });
  // An address that was pasted into this tab; what the page itself writes does not come here.
  window.addEventListener('hashchange', () => location.reload());
  window.addEventListener('resize', () => app.scene && drawHistogram(app.scene));
}

async function begin() {
  const wanted = readAddress();
  takeLook(wanted);
  for (const name of wanted.refused) {
    addStanding(`The address has a "${name}=" that cannot be shown: it is left out.`);
  }
  startParts();
  try {
    const names = await mapsOf(app.running.signal);
    const map = wanted.map || names[0];
    element('map').value = map;
    await open(map, wanted.isLive ? null : wanted.revision, wanted);
  } catch (error) {
    explain(error);
  }
}

begin();

// SPDX-License-Identifier: Apache-2.0
// The viewer: one picture of a map at one revision and one time. Everything that is shown follows
// from `state` and `show`; answers that come too late are dropped.
import {readAddress, takeToken, writeAddress} from './address.js';
import {loadBodies} from './bodies.js';
import {Camera} from './camera.js';
import {debounced, element, link, make, shortened} from './dom.js';
import {drawLabels} from './labels.js';
import {
  drawHistogram, fillHelp, fillInspector, fillLayers, fillTable, sentenceOf,
} from './panels.js';
import {listenToKeys, listenToPointer} from './input.js';
import {follow, persistently} from './live.js';
import {loadMesh, loadRevisions, loadScene, loadTags} from './load.js';
import {pick} from './pick.js';
import {Plan} from './plan.js';
import {Questions} from './questions.js';
import {Renderer, Show, stepOf} from './renderer.js';
import {CallError, Client} from './rpc.js';
import {GROUPS} from './scene.js';
import {nsOf, secondsOf, textOf} from './time.js';

const REVISIONS_MAX = 5000;
const TIME_STEPS = 10000;
/** How often a store without maps is asked again. */
const MAPS_MS = 2000;

const client = new Client(takeToken());
const show = new Show();
const camera = new Camera();
const canvas = element('scene');

const state = {
  map: '', revision: null, isLive: false, query: '', diff: 0, isPlaying: false,
  /** What comes next while the scene is loading. */
  loading: '',
};
let scene = null;
/** Of the selected node. */
let neighbors = [];
let revisions = [];
let tags = [];
let painter = null;
/** Why there is no third dimension; empty if there is. */
let webglNote = '';
/** Ends what runs for the scene that is shown. */
let running = new AbortController();
let watching = null;
let isDirty = true;
let isStale = true;

function setState(name) {
  document.body.dataset.state = name;
}

/** Says something over the picture; `buttons` are offered with it. */
function banner(text, kind = 'error', buttons = []) {
  const shown = element('banner');
  shown.hidden = !text;
  shown.dataset.kind = kind;
  shown.replaceChildren(text, ...buttons);
}

/** The picture is made again with the next frame; `stale`: so are its buffers. */
function redraw(stale = false) {
  isDirty = true;
  isStale ||= stale;
}

/** Asks the server where everybody is at the time that is shown; tracks are samples of that. */
const settleTime = debounced(async () => {
  if (!scene) return;
  const [asked, time] = [scene, show.time];
  const agents = scene.of('agents').map((node) => node.id);
  if (!agents.length || scene.exact.time === time) return;
  try {
    const positions = await ask().positions(agents, time);
    if (scene !== asked || show.time !== time) return;
    scene.exact = {time, positions};
    redraw(true);
    refresh();
    if (show.selected) fillInspector(scene, show, neighbors, actions);
    if (scene.nodes.get(show.selected)?.group === 'agents') locate();
    await showBodies(asked, positions, time);
  } catch (error) {
    // Without an answer the picture is that of the samples, as the sentence says.
    isSaid(error);
  }
}, 150);

/** People that stand still are drawn with their bodies, where the map has those. */
async function showBodies(asked, positions, time) {
  const people = asked.of('agents').filter((node) => node.kind === 'human' &&
                                                     positions.get(node.id));
  if (!people.length || state.isPlaying || show.hidden.has('agents')) return;
  const meshes = await loadBodies(client, asked, people.map((node) => node.id), time,
                                  running.signal);
  if (scene !== asked || show.time !== time) return;
  asked.bodies = {time, meshes};
  document.body.dataset.bodies = String(meshes.size);
  redraw();
}

/** A search is of a time: it is made again for another one. */
const searchAgain = debounced(() => state.query && search(state.query), 300);

const saveAddress = debounced(() => {
  if (!scene) return;
  writeAddress({
    map: state.map, revision: state.isLive ? null : scene.revision, isLive: state.isLive,
    atNs: nsOf(show.time, scene.epoch), selected: show.selected, hidden: [...show.hidden],
    explode: show.explode, query: state.query, diff: state.diff,
    camera: [...camera.target, camera.distance, camera.yaw, camera.pitch],
  });
}, 200);

function changed(stale = true) {
  redraw(stale);
  saveAddress();
  refresh();
}

/** Says what is being loaded. */
function say(loading) {
  state.loading = loading;
  element('sentence').textContent = sentenceOf(scene, show, loading);
}

/** All text that follows from the scene and the time. */
function refresh() {
  if (!scene) return;
  element('sentence').textContent = sentenceOf(scene, show, state.loading);
  element('time-text').textContent = textOf(show.time, scene.map);
  const span = scene.end - scene.begin;
  element('time').value = String(
      span > 0 ? Math.round((show.time - scene.begin) / span * TIME_STEPS) : 0);
  element('revision-text').textContent = revisionText();
  settleTime();
  if (!element('table').hidden) fillTable(scene, show, select);
}

function revisionText() {
  const at = revisions.find((one) => one.number === scene.revision);
  const named = tags.filter((tag) => Number(tag.revision) === scene.revision);
  const names = named.length ? ` (${named.map((tag) => tag.name).join(', ')})` : '';
  return shortened(`${scene.revision} of ${scene.head}${names} ${at?.message ?? ''}`, 60);
}

// ---- what went wrong ----

/** Says why a call failed, and what can be done. */
function explain(error) {
  if (error.name === 'AbortError') return;
  if (!(error instanceof CallError)) {
    setState('error');
    banner(`The viewer failed: ${error.message}`);
    throw error;
  }
  if (error.code === 'unauthenticated') {
    setState('token');
    banner('The server wants a token. Open the address that dsg-server printed when it started, ' +
           'with #token=... at its end.');
  } else if (error.mayPass) {
    setState('away');
    banner(`${error.message}\nTrying again; the picture is as it was.`);
  } else {
    setState('error');
    const oldest = Number(error.metadata.oldest);
    // Only of a revision that is gone; the newest is what is meant by one that is still to come.
    const gone = state.revision < oldest && make(
        'button', {onclick: () => open(state.map, oldest)}, `open revision ${oldest}`);
    const newest = make('button', {onclick: () => open(state.map, null)}, 'open the newest');
    const choices = error.reason === 'MAP_UNKNOWN' ? [] : [...(gone ? [gone] : []), newest];
    banner(error.message, 'error', choices);
  }
}

/** Whether the error of a question needs no more words: it was ended, or concerns all questions. */
function isSaid(error) {
  if (error.reason === 'MAP_REPLACED') explain(error);
  return error.name === 'AbortError' || error.reason === 'MAP_REPLACED';
}

// ---- loading ----

/** Takes a scene, or more of it, into the picture. */
function take(next, loading, wanted) {
  const isNew = scene !== next;
  const before = scene;
  scene = next;
  state.loading = loading;
  if (isNew) {
    banner(webglNote, 'note');
    element('revision').max = String(next.head);
    element('revision').value = String(next.revision);
    // What differed from another revision is asked anew for this one.
    [show.diff, show.ghosts] = [null, []];
    const isSameMap = before?.stats.header.incarnation === next.stats.header.incarnation;
    // Ids of a map that was replaced mean nothing in the other one.
    if (before && !isSameMap) [show.selected, show.path, show.predictions] = ['', [], []];
    const at = wanted.atNs !== undefined ? secondsOf(wanted.atNs, next.epoch)
        : isSameMap ? show.time : next.end;
    if (next.end > next.begin && (at < next.begin || at > next.end)) {
      next.notes.push(`${textOf(at, next.map)} is outside of the tracks: the nearest time is shown`);
    }
    show.time = next.end > next.begin ? Math.min(Math.max(at, next.begin), next.end)
        : Number.isFinite(at) ? at : 0;
  }
  document.body.dataset.revision = String(next.revision);
  changed();
}

/**
 * Opens a map at a revision, null for the newest.
 * @param {object} wanted more of the address
 */
async function open(map, revision, wanted = {}) {
  running.abort();
  running = new AbortController();
  const {signal} = running;
  const isOther = map !== state.map;
  const isFirst = isOther || scene === null;
  if (isOther) watching?.abort();
  Object.assign(state, {map, revision});
  setState('loading');
  if (isOther) {
    [show.selected, state.query, state.diff] = ['', '', 0];
    show.path = [];
    show.predictions = [];
  }
  try {
    // Of another map each part is shown at once; of the same, the old picture stays until the new
    // one is whole.
    const progress = (next, loading) => {
      if (signal.aborted) return;
      if (isFirst) take(next, loading, wanted);
      else say(loading);
    };
    const loaded = await persistently(() => loadScene(client, map, revision, signal, progress),
                                      signal, explain);
    if (signal.aborted) return;
    take(loaded, '', wanted);
    // Where there is the most to see; at the end of a log nearly everybody is gone.
    if (isFirst && wanted.atNs === undefined && !state.isLive) show.time = loaded.busiest;
    if (isFirst && !wanted.camera) frameAll();
    await settle(loaded, wanted, signal);
  } catch (error) {
    if (signal.aborted) return;
    explain(error);
    // Who follows a map that was dropped waits for the next one of its name.
    if (state.isLive && error.reason === 'MAP_UNKNOWN') {
      setTimeout(() => signal.aborted || open(map, null), MAPS_MS);
    }
  }
}

/** What is loaded once the scene is there. */
async function settle(loaded, wanted, signal) {
  [revisions, tags] = await Promise.all([
    loadRevisions(client, state.map, REVISIONS_MAX, signal), loadTags(client, state.map, signal),
  ]);
  if (signal.aborted) return;
  fillLayers(loaded, show, layersChanged);
  drawHistogram(loaded);
  fillDiffs();
  // What was asked of another revision is asked of this one.
  await select(wanted.selected || show.selected);
  await search(wanted.query || state.query);
  await compare(wanted.diff || state.diff);
  if (state.isLive && !isWatching()) watch();
  await meshIfShown();
  setState(loaded.nodes.size ? 'ready' : 'empty');
  performance.mark('ready');
  if (!loaded.nodes.size) {
    banner(`The map "${state.map}" has no nodes yet. dsg-ingest puts a log into it: ` +
           `dsg-ingest --map ${state.map} LOG`, 'note');
  }
  changed();
}

function layersChanged() {
  meshIfShown().catch(explain);
  changed();
}

async function meshIfShown() {
  if (!scene || show.hidden.has('mesh') || scene.meshAsked) return;
  scene.meshAsked = true;
  const of = scene;
  await loadMesh(client, of, running.signal, () => {
    if (scene !== of) return;
    document.body.dataset.mesh = String(of.mesh.length);
    redraw(true);
  });
  if (scene === of) fillLayers(of, show, layersChanged);
}

function frameAll() {
  const {min, max} = scene.bounds;
  const top = show.hidden.has('building') ? 2 : 3;
  camera.frame(min, [max[0], max[1], max[2] + top * stepOf(scene, show.explode)]);
  changed(false);
}

// ---- questions ----

const ask = () => new Questions(client, scene, running.signal);

async function select(id) {
  show.selected = id;
  neighbors = [];
  fillInspector(scene, show, neighbors, actions);
  changed();
  if (!id) return;
  const asked = scene;
  locate();
  try {
    const found = await ask().neighbors(id);
    if (show.selected !== id || scene !== asked) return;
    neighbors = found;
    fillInspector(scene, show, neighbors, actions);
    locate();
    refresh();
  } catch (error) {
    sayAnswer(error);
  }
}

/** Says where the selected agent is at the time that is shown: its room, place and building. */
const locate = debounced(async () => {
  const [asked, agent, time] = [scene, show.selected, show.time];
  if (asked?.nodes.get(agent)?.group !== 'agents') return;
  let answer = ['no room is known'];
  try {
    const ids = await ask().where(agent, time);
    const links = ids.map((id) => link(asked.titleOf(id), () => select(id)));
    if (ids.length) answer = links.flatMap((one, i) => (i ? [', ', one] : [one]));
  } catch (error) {
    if (isSaid(error)) return;
    answer = [error.message];
  }
  if (scene !== asked || show.selected !== agent || show.time !== time) return;
  // The inspector may have been filled anew meanwhile.
  document.getElementById('where')?.replaceChildren(...answer);
}, 150);

/** An answer (a text, or texts and links), or why there is none, below the inspector's buttons. */
function sayAnswer(what) {
  if (what instanceof Error && isSaid(what)) return;
  const answer = document.getElementById('answer');
  answer?.replaceChildren(...(what instanceof Error ? [what.message] : [what].flat()));
}

const actions = {
  select,
  async path() {
    try {
      const path = await ask().path(camera.target, show.selected, show.time);
      show.path = path.corners;
      sayAnswer(`path of ${path.length.toFixed(1)} m from the middle of the picture, clearance ` +
                `at least ${path.clearance.toFixed(2)} m`);
      redraw();
    } catch (error) {
      sayAnswer(error);
    }
  },
  async history() {
    try {
      const versions = await ask().versions(show.selected);
      sayAnswer(['believed since ', ...versions.flatMap(({from, name, className}, i) => [
        i ? ', ' : '', link(`revision ${from}`, () => open(state.map, from)),
        ` (${[name, className].filter(Boolean).join(', ') || 'without a name'})`,
      ])]);
    } catch (error) {
      sayAnswer(error);
    }
  },
  async predict() {
    try {
      show.predictions = await ask().predict(show.selected, show.time);
      sayAnswer(show.predictions.map(
          ({probability, goal}) =>
              `${Math.round(probability * 100)} % ${goal ? `to ${scene.titleOf(goal)}` : 'on'}`)
          .join('; '));
      redraw();
    } catch (error) {
      sayAnswer(error);
    }
  },
};

async function search(query) {
  if (!scene) return;
  state.query = query;
  element('query').value = query;
  show.hits.clear();
  const found = element('found');
  found.textContent = '';
  try {
    if (query) {
      const {ids, hasMore} = await ask().search(query, show.time);
      show.hits = new Set(ids);
      found.textContent = `${ids.length}${hasMore ? ' and more' : ''} found, ` +
                          `true at ${textOf(show.time, scene.map)}`;
      if (ids.length === 1) await select(ids[0]);
    }
  } catch (error) {
    if (isSaid(error)) return;
    found.textContent = error.message;
  }
  changed();
}

/** Colours what differs from another revision; 0 ends it. */
async function compare(revision) {
  // A revision does not differ from itself.
  state.diff = revision === scene.revision ? 0 : revision;
  show.diff = null;
  show.ghosts = [];
  element('diff').value = state.diff ? String(state.diff) : '';
  if (state.diff) {
    const {states, removed} = await ask().diff(revision);
    show.diff = states;
    show.ghosts = removed;
    const count = (name) => [...states.values()].filter((one) => one === name).length;
    element('found').textContent = `+${count('added')} -${count('removed')} ~${count('changed')} ` +
                                   `since revision ${revision}`;
  }
  changed();
}

function fillDiffs() {
  const options = [make('option', {value: ''}, 'nothing')];
  for (const tag of tags) {
    options.push(make('option', {value: String(tag.revision)}, `${tag.name} (${tag.revision})`));
  }
  for (const {number} of revisions.slice(-50).reverse()) {
    options.push(make('option', {value: String(number)}, `revision ${number}`));
  }
  element('diff').replaceChildren(...options);
  element('diff').value = state.diff ? String(state.diff) : '';
}

// ---- live ----

const isWatching = () => watching !== null && !watching.signal.aborted;

/** Follows the map while the tab is seen: a browser has few connections to a server. */
function watch() {
  watching?.abort();
  if (document.hidden) return;
  const mine = watching = new AbortController();
  follow(client, scene, mine.signal, {
    heard: () => {
      if (document.body.dataset.state !== 'away') return;
      setState('ready');
      banner(webglNote, 'note');
    },
    revision: async () => {
      const isAtEnd = show.time >= scene.end - 0.001;
      await open(state.map, null);
      if (isAtEnd) show.time = scene.end;
      changed();
    },
    failed: (error) => {
      // The map was dropped and made again: the new one is followed.
      if (['MAP_REPLACED', 'MAP_UNKNOWN'].includes(error.reason)) open(state.map, null);
      else explain(error);
    },
  }).catch(explain).finally(() => mine.abort());
}

function setLive(isLive) {
  state.isLive = isLive;
  element('live').setAttribute('aria-pressed', String(isLive));
  watching?.abort();
  if (isLive && scene) open(state.map, null);
  saveAddress();
}

document.addEventListener('visibilitychange', () => {
  if (!state.isLive || !scene) return;
  if (document.hidden) watching?.abort();
  else watch();
});

// ---- time ----

let lastFrame = 0;

function setTime(seconds) {
  const before = show.time;
  show.time = Math.min(Math.max(seconds, scene.begin), scene.end);
  show.predictions = [];
  changed(scene.changesBetween(before, show.time));
  if (state.query) searchAgain();
}

function setPlaying(isPlaying) {
  state.isPlaying = isPlaying;
  element('play').setAttribute('aria-pressed', String(isPlaying));
  if (isPlaying && scene && show.time >= scene.end - 0.01) setTime(scene.begin);
  lastFrame = 0;
}

function advance(now) {
  if (!state.isPlaying || !scene) return;
  const elapsed = lastFrame ? (now - lastFrame) / 1000 : 0;
  lastFrame = now;
  setTime(show.time + elapsed * Number(element('speed').value));
  if (show.time >= scene.end) setPlaying(false);
}

const openRevision = debounced(() => {
  setLive(false);
  open(state.map, Number(element('revision').value));
}, 150);

function stepRevision(by) {
  if (!scene) return;
  const next = Math.min(scene.head, Math.max(1, scene.revision + by));
  if (next === scene.revision) return;
  setLive(false);
  open(state.map, next);
}

function stepTag(by) {
  const marked = tags.map((tag) => Number(tag.revision)).sort((a, b) => a - b);
  const next = by > 0 ? marked.find((one) => one > scene.revision)
                      : marked.reverse().find((one) => one < scene.revision);
  if (next) stepRevision(next - scene.revision);
}

// ---- picture ----

function resize() {
  const scale = window.devicePixelRatio || 1;
  for (const one of [canvas, element('labels')]) {
    const [width, height] = [one.clientWidth, one.clientHeight].map((v) => Math.round(v * scale));
    if (one.width === width && one.height === height) continue;
    one.width = width;
    one.height = height;
    redraw();
  }
}

function frame(now) {
  advance(now);
  resize();
  if (isDirty && painter) {
    if (isStale && scene) painter.build(scene, show);
    isStale = isDirty = false;
    painter.draw(scene, show, camera);
    if (scene?.nodes.size && !performance.getEntriesByName('picture').length) {
      performance.mark('picture');
    }
    const count = painter instanceof Plan ? 0
                                          : drawLabels(element('labels'), scene, show, camera);
    document.body.dataset.labels = String(count);
    document.body.dataset.drawn = String(Number(document.body.dataset.drawn ?? 0) + 1);
  }
  requestAnimationFrame(frame);
}

function makePainter() {
  try {
    painter = new Renderer(canvas);
  } catch (error) {
    document.body.dataset.plan = '1';
    painter = new Plan(canvas);
    webglNote = `${error.message}: the plan from above is shown.`;
  }
  canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
  canvas.addEventListener('webglcontextrestored', () => {
    painter.restore();
    redraw(true);
  });
}

// ---- keys and controls ----

const KEYS = {
  ' ': () => setPlaying(!state.isPlaying),
  ',': () => setTime(show.time - 1),
  '.': () => setTime(show.time + 1),
  '[': () => stepRevision(-1),
  ']': () => stepRevision(1),
  '{': () => stepTag(-1),
  '}': () => stepTag(1),
  x: () => {
    show.explode = show.explode > 0 ? 0 : 1;
    fillLayers(scene, show, layersChanged);
    changed();
    frameAll();
  },
  d: () => compare(state.diff ? 0 : Math.max(1, scene.revision - 1)).catch(explain),
  f: frameAll,
  '/': () => element('query').focus(),
  l: () => setLive(!state.isLive),
  t: toggleTable,
  '?': () => element('help').showModal(),
  ...Object.fromEntries(GROUPS.map(({name}, i) => [
    String(i + 1), () => document.getElementById(`layer-${name}`)?.click(),
  ])),
  Escape: () => {
    show.hits.clear();
    [show.path, show.predictions] = [[], []];
    search('');
    select('');
  },
};

/** Flies to what is selected. */
function goTo() {
  const node = scene?.nodes.get(show.selected);
  const place = node && (scene.placeOf(node, show.time) ?? node.position);
  if (!place) return;
  camera.target = [...place];
  camera.distance = Math.min(camera.distance, 8);
  changed(false);
}

function toggleTable() {
  element('table').hidden = !element('table').hidden;
  refresh();
}

function listenToControls() {
  element('map').onchange = () => open(element('map').value, null);
  element('search').onsubmit = (event) => {
    event.preventDefault();
    search(element('query').value.trim());
  };
  element('play').onclick = () => setPlaying(!state.isPlaying);
  element('live').onclick = () => setLive(!state.isLive);
  element('table-button').onclick = toggleTable;
  element('help-button').onclick = () => element('help').showModal();
  element('time').oninput = () => {
    if (!scene) return;
    setPlaying(false);
    setTime(scene.begin + Number(element('time').value) / TIME_STEPS * (scene.end - scene.begin));
  };
  element('revision').oninput = openRevision;
  element('diff').onchange = () => compare(Number(element('diff').value)).catch(explain);
  // An address that was pasted into this tab; what the page itself writes does not come here.
  window.addEventListener('hashchange', () => location.reload());
  window.addEventListener('resize', () => scene && drawHistogram(scene));
}

// ---- begin ----

/** The names of the maps; waits for the first one. */
async function mapsOf(signal) {
  while (true) {
    const reply = await persistently(() => client.call('MapService/ListMaps', {}, signal), signal,
                                     explain);
    // One that cannot be read says why when it is opened.
    const names = [...reply.maps.map((map) => map.name), ...reply.unreadable_maps];
    element('map').replaceChildren(...names.map((name) => make('option', {value: name}, name)));
    if (names.length) return names;
    setState('no-maps');
    banner('The store has no maps yet. Put a log into one: dsg-ingest --store DIR --map NAME LOG',
           'note');
    await new Promise((resolve) => setTimeout(resolve, MAPS_MS));
  }
}

async function begin() {
  const wanted = readAddress();
  if (wanted.hidden) show.hidden = new Set(wanted.hidden);
  show.explode = wanted.explode;
  if (wanted.camera) {
    camera.target = wanted.camera.slice(0, 3);
    [camera.distance, camera.yaw, camera.pitch] = wanted.camera.slice(3);
  }
  makePainter();
  fillHelp();
  listenToPointer(canvas, camera, {
    moved: () => changed(false),
    clicked: (at) => scene && select(pick(scene, show, camera, at)),
    goTo,
  });
  listenToKeys(KEYS, () => scene !== null);
  listenToControls();
  requestAnimationFrame(frame);
  try {
    const names = await mapsOf(running.signal);
    const map = wanted.map || names[0];
    element('map').value = map;
    state.isLive = wanted.isLive;
    element('live').setAttribute('aria-pressed', String(wanted.isLive));
    await open(map, wanted.isLive ? null : wanted.revision, wanted);
  } catch (error) {
    explain(error);
  }
}

begin();

// SPDX-License-Identifier: Apache-2.0
// Which map is shown at which revision: opening it, going to another revision, and following new
// ones.
import {clearHits, compare, fillDiffs, search, select} from './answers.js';
import {debounced, element, make, setText, shortened, visible} from './dom.js';
import {follow, persistently} from './live.js';
import {loadMesh, loadRevisions, loadScene, loadTags} from './load.js';
import {drawHistogram, fillLayers} from './panels.js';
import {explode, lookAtAll} from './picture.js';
import {app, changed, listen, tell} from './state.js';
import {secondsOf, textOf} from './time.js';
import {banner, clearBanner, explain, isState, setState} from './trouble.js';

const REVISIONS_MAX = 5000;
/** How often a store without maps is asked again. */
const MAPS_MS = 2000;

const {show, client} = app;
let watching = null;

/** The names of the maps, which are offered then; waits for the first one. */
export async function mapsOf(signal) {
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

/**
 * Opens a map at a revision, null for the newest.
 * @param {object} wanted more of the address
 */
export async function open(map, revision, wanted = {}) {
  app.running.abort();
  app.running = new AbortController();
  const {signal} = app.running;
  const isOther = map !== app.map;
  const isFirst = isOther || app.scene === null;
  if (isOther) watching?.abort();
  Object.assign(app, {map, revision});
  setState('loading');
  if (isOther) {
    [show.selected, app.query, app.diff] = ['', '', 0];
    [show.path, show.predictions] = [[], []];
    clearHits();
  }
  try {
    // Of another map each part is shown at once; of the same, the old picture stays until the new
    // one is whole.
    const progress = (next, loading) => {
      if (signal.aborted) return;
      if (isFirst) {
        take(next, loading, wanted);
      } else {
        app.loading = loading;
        tell('loading');
      }
    };
    const loaded = await persistently(() => loadScene(client, map, revision, signal, progress),
                                      signal, explain);
    if (signal.aborted) return;
    take(loaded, '', wanted);
    // Where there is the most to see; at the end of a log nearly everybody is gone.
    if (isFirst && wanted.atNs === undefined && !app.isLive) show.time = loaded.busiest;
    if (isFirst && !wanted.camera) lookAtAll();
    await settle(loaded, wanted, signal);
  } catch (error) {
    if (signal.aborted) return;
    explain(error);
    // Who follows a map that was dropped waits for the next one of its name.
    if (app.isLive && error.reason === 'MAP_UNKNOWN') {
      setTimeout(() => signal.aborted || open(map, null), MAPS_MS);
    }
  }
}

/** Takes a scene, or more of it, into the picture. */
function take(next, loading, wanted) {
  const before = app.scene;
  app.scene = next;
  app.loading = loading;
  if (before !== next) begin(next, before, wanted);
  document.body.dataset.revision = String(next.revision);
  changed();
}

/** What of the page a new scene changes: its time, and what was asked of the one before. */
function begin(next, before, wanted) {
  clearBanner();
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

/** What is loaded once the scene is there. */
async function settle(loaded, wanted, signal) {
  [app.revisions, app.tags] = await Promise.all([
    loadRevisions(client, app.map, REVISIONS_MAX, signal), loadTags(client, app.map, signal),
  ]);
  if (signal.aborted) return;
  showLayers();
  drawHistogram(loaded);
  fillDiffs();
  // What was asked of another revision is asked of this one.
  await select(wanted.selected || show.selected);
  await search(wanted.query || app.query);
  await compare(wanted.diff || app.diff);
  if (app.isLive && !isWatching()) watch();
  await meshIfShown();
  setState(loaded.nodes.size ? 'ready' : 'empty');
  performance.mark('ready');
  if (!loaded.nodes.size) {
    banner(`The map "${app.map}" has no nodes yet. dsg-ingest puts a log into it: ` +
           `dsg-ingest --map ${app.map} LOG`, 'note');
  }
  changed();
}

/** The layers beside the picture, as they are shown now. */
export function showLayers() {
  fillLayers(app.scene, show, {
    explode,
    changed: () => {
      meshIfShown().catch(explain);
      changed();
    },
  });
}

async function meshIfShown() {
  const of = app.scene;
  if (!of || show.hidden.has('mesh') || of.meshAsked) return;
  of.meshAsked = true;
  await loadMesh(client, of, app.running.signal, () => {
    if (app.scene !== of) return;
    document.body.dataset.mesh = String(of.mesh.length);
    tell('redraw', true);
  });
  if (app.scene === of) showLayers();
}

// ---- other revisions ----

/** Goes so many revisions forth, or back. */
export function stepRevision(by) {
  const {scene} = app;
  const next = Math.min(scene.head, Math.max(1, scene.revision + by));
  if (next === scene.revision) return;
  setLive(false);
  open(app.map, next);
}

/** Goes to the next tag, or to the one before if `by` is negative. */
export function stepTag(by) {
  const {revision} = app.scene;
  const marked = app.tags.map((tag) => Number(tag.revision)).sort((a, b) => a - b);
  const next = by > 0 ? marked.find((one) => one > revision)
                      : marked.reverse().find((one) => one < revision);
  if (next) stepRevision(next - revision);
}

const openChosen = debounced(() => {
  setLive(false);
  open(app.map, Number(element('revision').value));
}, 150);

function revisionText() {
  const {scene} = app;
  const at = app.revisions.find((one) => one.number === scene.revision);
  const named = app.tags.filter((tag) => Number(tag.revision) === scene.revision);
  const names = named.length ? ` (${named.map((tag) => tag.name).join(', ')})` : '';
  return shortened(visible(`${scene.revision} of ${scene.head}${names} ${at?.message ?? ''}`), 60);
}

// ---- live ----

const isWatching = () => watching !== null && !watching.signal.aborted;

/** Follows the map while the tab is seen: a browser has few connections to a server. */
function watch() {
  watching?.abort();
  if (document.hidden) return;
  const mine = watching = new AbortController();
  follow(client, app.scene, mine.signal, {
    heard: () => {
      if (!isState('away')) return;
      setState('ready');
      clearBanner();
    },
    revision: async () => {
      const isAtEnd = show.time >= app.scene.end - 0.001;
      await open(app.map, null);
      if (isAtEnd) show.time = app.scene.end;
      changed();
    },
    failed: (error) => {
      // The map was dropped and made again: the new one is followed.
      if (['MAP_REPLACED', 'MAP_UNKNOWN'].includes(error.reason)) open(app.map, null);
      else explain(error);
    },
  }).catch(explain).finally(() => mine.abort());
}

/** Follows new revisions from now on, or no more. */
export function setLive(isLive) {
  app.isLive = isLive;
  element('live').setAttribute('aria-pressed', String(isLive));
  watching?.abort();
  if (isLive && app.scene) open(app.map, null);
  tell('changed');
}

/** Connects the choice of map and revision, and the button of live. */
export function startOpening() {
  element('map').onchange = () => open(element('map').value, null);
  element('revision').oninput = openChosen;
  element('live').onclick = () => setLive(!app.isLive);
  listen('open', (map, revision) => open(map, revision));
  listen('changed', () => {
    if (app.scene) setText(element('revision-text'), revisionText());
  });
  document.addEventListener('visibilitychange', () => {
    if (!app.isLive || !app.scene) return;
    if (document.hidden) watching?.abort();
    else watch();
  });
}

// SPDX-License-Identifier: Apache-2.0
// The address of the page holds what is shown: a copied link shows the same again. The token is not
// part of it; it is kept for this tab alone.

const TOKEN_KEY = 'dsgdb-token';

/** Takes the token out of the address and remembers it for the tab. */
export function takeToken() {
  const given = new URLSearchParams(location.hash.slice(1));
  const token = given.get('token');
  if (token !== null) {
    given.delete('token');
    sessionStorage.setItem(TOKEN_KEY, token);
    history.replaceState(null, '', `#${given}`);
  }
  return sessionStorage.getItem(TOKEN_KEY) ?? '';
}

const COORDINATE_MAX = 1e8;

/** Target, distance, yaw and pitch of a camera; undefined if they are none. */
function cameraOf(text) {
  const values = (text ?? '').split(',').map((word) => (word.trim() ? Number(word) : NaN));
  const [x, y, z, distance, yaw, pitch] = values;
  const isCamera = values.length === 6 && values.every(Number.isFinite) &&
                   Math.max(...[x, y, z].map(Math.abs)) < COORDINATE_MAX && distance > 0.1 &&
                   distance < COORDINATE_MAX && Math.abs(pitch) < 1.56;
  return isCamera ? [x, y, z, distance, yaw % (2 * Math.PI), pitch] : undefined;
}

/** A revision; null if it is none. */
function revisionOf(text) {
  const value = Number(text);
  return Number.isSafeInteger(value) && value > 0 ? value : null;
}

/** World time, nanoseconds; undefined if it is none. */
function timeOf(text) {
  return /^-?\d{1,19}$/.test(text ?? '') ? BigInt(text) : undefined;
}

/** What the address asks for; what it does not say, or not so that it can be shown, is undefined. */
export function readAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
  const readers = {rev: revisionOf, at: timeOf, cam: cameraOf, diff: revisionOf};
  return {
    /** What is there and cannot be shown. */
    refused: Object.keys(readers).filter(
        (name) => given.get(name) && (readers[name](given.get(name)) ?? null) === null),
    map: given.get('map') ?? '',
    revision: revisionOf(given.get('rev')),
    atNs: timeOf(given.get('at')),
    camera: cameraOf(given.get('cam')),
    selected: given.get('sel') ?? '',
    hidden: given.get('hide')?.split(',').filter(Boolean),
    explode: Math.min(1, Math.max(0, Number(given.get('explode')) || 0)),
    query: given.get('q') ?? '',
    diff: revisionOf(given.get('diff')) ?? 0,
    isLive: given.get('live') === '1',
  };
}

/** Writes the address without adding to the history. */
export function writeAddress(state) {
  const out = new URLSearchParams();
  const set = (name, value) => value && out.set(name, value);
  set('map', state.map);
  set('rev', state.revision && String(state.revision));
  set('at', state.atNs !== undefined && String(state.atNs));
  set('cam', state.camera?.map((value) => value.toFixed(3)).join(','));
  set('sel', state.selected);
  out.set('hide', (state.hidden ?? []).join(','));
  set('explode', state.explode && state.explode.toFixed(2));
  set('q', state.query);
  set('diff', state.diff && String(state.diff));
  set('live', state.isLive && '1');
  history.replaceState(null, '', `#${out}`);
}

// SPDX-License-Identifier: Apache-2.0
// What the page says over the picture: why a call failed and what can be done, and notes.
import {element, make, setText} from './dom.js';
import {CallError} from './rpc.js';
import {app, tell} from './state.js';

/** What holds as long as the page does, as why there is no third dimension. */
const standing = [];

/** In which state the page is: "loading", "ready", "empty", "error", ... */
export function setState(name) {
  document.body.dataset.state = name;
}

export const isState = (name) => document.body.dataset.state === name;

/** Says something over the picture; `buttons` are offered with it. */
export function banner(text, kind = 'error', buttons = []) {
  const shown = element('banner');
  shown.hidden = !text;
  shown.dataset.kind = kind;
  setText(shown, text, ...buttons);
}

/** Takes away what was said; what holds as long as the page does stays. */
export function clearBanner() {
  banner(standing.join('\n'), 'note');
}

/** Says something that holds as long as the page does. */
export function addStanding(text) {
  standing.push(text);
}

/** Says why a call failed, and what can be done. */
export function explain(error) {
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
    const gone = app.revision < oldest && make(
        'button', {onclick: () => tell('open', app.map, oldest)}, `open revision ${oldest}`);
    const newest = make('button', {onclick: () => tell('open', app.map, null)}, 'open the newest');
    const choices = error.reason === 'MAP_UNKNOWN' ? [] : [...(gone ? [gone] : []), newest];
    banner(error.message, 'error', choices);
  }
}

/** Whether the error of a question needs no more words: it was ended, or concerns all questions. */
export function isSaid(error) {
  if (error.reason === 'MAP_REPLACED') explain(error);
  return error.name === 'AbortError' || error.reason === 'MAP_REPLACED';
}

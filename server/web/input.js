// SPDX-License-Identifier: Apache-2.0
// Pointer and keyboard.
import {floorPoint} from './pick.js';

/** A press that moves less, in pixels, is a click. */
const CLICK_REACH = 5;

/** Pixels within the canvas. */
function spotOf(canvas, event) {
  const area = canvas.getBoundingClientRect();
  return {x: event.clientX - area.left, y: event.clientY - area.top, width: area.width,
          height: area.height};
}

/**
 * Turns, moves and zooms a camera.
 * @param {{moved: function(), clicked: function(object), goTo: function()}} on
 */
export function listenToPointer(canvas, camera, on) {
  let drag = null;
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    drag = {x: event.clientX, y: event.clientY, moved: 0,
            isPan: event.button === 2 || event.shiftKey};
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!drag) return;
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    drag = {...drag, x: event.clientX, y: event.clientY,
            moved: drag.moved + Math.abs(dx) + Math.abs(dy)};
    if (drag.isPan) camera.pan(dx / canvas.clientHeight, dy / canvas.clientHeight);
    else camera.orbit(dx * 0.006, dy * 0.006);
    on.moved();
  });
  canvas.addEventListener('pointerup', (event) => {
    const isClick = drag && drag.moved < CLICK_REACH && event.button === 0;
    drag = null;
    if (isClick) on.clicked(spotOf(canvas, event));
  });
  canvas.addEventListener('pointercancel', () => { drag = null; });
  canvas.addEventListener('dblclick', on.goTo);
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(event.deltaY * 0.001),
                floorPoint(camera, spotOf(canvas, event), camera.target[2]));
    on.moved();
  }, {passive: false});
}

function isTyping({type, tagName}) {
  return tagName === 'SELECT' || (tagName === 'INPUT' && type !== 'range' && type !== 'checkbox');
}

/**
 * @param {Object<string, function()>} keys by the name of the key
 * @param {function(): boolean} isReady keys do nothing before
 */
export function listenToKeys(keys, isReady) {
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || !isReady()) return;
    // A dialog has its keys for itself; Escape closes it.
    if (document.querySelector('dialog[open]')) return;
    if (isTyping(event.target) && event.key !== 'Escape') return;
    if (event.key === 'Escape') event.target.blur();
    // A button has the space bar for itself.
    if (event.key === ' ' && event.target.tagName === 'BUTTON') return;
    if (!keys[event.key]) return;
    keys[event.key]();
    event.preventDefault();
  });
}

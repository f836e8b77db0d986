// SPDX-License-Identifier: Apache-2.0
// The picture in the middle of the page: drawn when something has changed, never while nothing
// does.
import {element} from './dom.js';
import {drawLabels} from './labels.js';
import {Plan} from './plan.js';
import {Renderer} from './renderer.js';
import {drawScale} from './scale.js';
import {stepOf} from './show.js';
import {app, changed, listen, tell} from './state.js';
import {addStanding} from './trouble.js';

const {show, camera} = app;
const canvas = element('scene');
/** Layers apart are seen from the side, and turned a little, radians. */
const SIDE = {pitch: 0.32, turn: 0.35};
let painter = null;
/** From where the map was seen before its layers came apart; null while they are in place. */
let inPlace = null;
let isDirty = true;
let isStale = true;

/** Shows the whole map. */
export function frameAll() {
  const {min, max} = app.scene.bounds;
  const top = show.hidden.has('building') ? 2 : 3;
  const aspect = (canvas.clientWidth || 1) / (canvas.clientHeight || 1);
  camera.frame(min, [max[0], max[1], max[2] + top * stepOf(app.scene, show.explode)], aspect);
  changed(false);
}

/** Shows the whole map as it is best seen: layers apart from the side, none before another. */
export function lookAtAll() {
  if (show.explode > 0 && !inPlace) {
    inPlace = {yaw: camera.yaw, pitch: camera.pitch};
    camera.pitch = SIDE.pitch;
    camera.yaw = nearestSide(camera.yaw);
  } else if (show.explode === 0 && inPlace) {
    Object.assign(camera, inPlace);
    inPlace = null;
  }
  frameAll();
}

/** Of the headings across the longer side of the map, turned a little, the nearest to a heading. */
function nearestSide(yaw) {
  const {min, max} = app.scene.bounds;
  const across = max[0] - min[0] >= max[1] - min[1] ? Math.PI / 2 : 0;
  const turns = [across, across + Math.PI].flatMap((at) => [at - SIDE.turn, at + SIDE.turn]);
  const away = (heading) => 1 - Math.cos(heading - yaw);
  return turns.reduce((best, heading) => (away(heading) < away(best) ? heading : best));
}

/** Sets how far layers are apart: from 0, in place, to 1. */
export function explode(share) {
  show.explode = share;
  tell('redraw', true);
  lookAtAll();
}

function resize() {
  const scale = window.devicePixelRatio || 1;
  for (const one of [canvas, element('labels')]) {
    const [width, height] = [one.clientWidth, one.clientHeight].map((v) => Math.round(v * scale));
    if (one.width === width && one.height === height) continue;
    one.width = width;
    one.height = height;
    isDirty = true;
  }
}

function draw() {
  const {scene} = app;
  if (isStale && scene) painter.build(scene, show);
  isStale = isDirty = false;
  painter.draw(scene, show, camera);
  if (scene?.nodes.size && !performance.getEntriesByName('picture').length) {
    performance.mark('picture');
  }
  const count = painter instanceof Plan ? 0 : drawLabels(element('labels'), scene, show, camera);
  drawScale(painter.pixelsPerMetre(scene, camera));
  document.body.dataset.labels = String(count);
  document.body.dataset.drawn = String(Number(document.body.dataset.drawn ?? 0) + 1);
}

function makePainter() {
  try {
    painter = new Renderer(canvas);
  } catch (error) {
    document.body.dataset.plan = '1';
    painter = new Plan(canvas);
    addStanding(`${error.message}: the plan from above is shown.`);
  }
  canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
  canvas.addEventListener('webglcontextrestored', () => {
    painter.restore();
    tell('redraw', true);
  });
}

/**
 * Draws from now on.
 * @param {function(number)} before runs before each picture that the browser could show, with its
 *     time in milliseconds
 */
export function startPicture(before) {
  makePainter();
  listen('redraw', (isStaleToo) => {
    isDirty = true;
    isStale ||= isStaleToo;
  });
  const frame = (now) => {
    before(now);
    resize();
    if (isDirty) draw();
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

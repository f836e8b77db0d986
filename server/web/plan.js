// SPDX-License-Identifier: Apache-2.0
// The plan from above on a 2-D canvas, for browsers without WebGL2: the same scene and the same
// times, without layers apart.
import {BACKGROUND, colorOfAgent, cssOf, lookOf} from './colors.js';
import {shortened, visible} from './dom.js';
import {LETTERS_MAX, middleOf} from './labels.js';
import {GROUPS} from './scene.js';

const MARGIN = 30;
/** Whose names are written, beside what is marked. */
const NAMED = new Set(['rooms', 'agents']);
/** Half the side of a mark, pixels. */
const HALF_PX = {agents: 5, objects: 3};

export class Plan {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
  }

  restore() {}

  build() {}

  /** Of the screen's pixels. */
  pixelsPerMetre(scene) {
    if (!scene) return 0;
    return this.#view(scene).scale * this.canvas.clientWidth / this.canvas.width;
  }

  /** Map frame to pixels, so that the whole map is to be seen. */
  #view(scene) {
    const {min, max} = scene.bounds;
    const {width, height} = this.canvas;
    const scale = Math.min((width - 2 * MARGIN) / Math.max(1, max[0] - min[0]),
                           (height - 2 * MARGIN) / Math.max(1, max[1] - min[1]));
    const [cx, cy] = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2];
    return {scale, at: ([x, y]) => [width / 2 + (x - cx) * scale, height / 2 - (y - cy) * scale]};
  }

  draw(scene, show) {
    const {context, canvas} = this;
    context.fillStyle = cssOf(BACKGROUND);
    context.fillRect(0, 0, canvas.width, canvas.height);
    if (!scene) return;
    const view = this.#view(scene);
    for (const group of [...GROUPS].reverse()) {
      if (show.hidden.has(group.name)) continue;
      for (const node of scene.of(group.name)) this.#drawNode(view, scene, show, node, group);
    }
  }

  #drawNode(view, scene, show, node, group) {
    const {context} = this;
    if (group.name !== 'agents' && !scene.isValid(node, show.time)) return;
    const isMarked = node.id === show.selected || show.hits.has(node.id);
    const rgb = group.name === 'agents' ? colorOfAgent(node.id) : group.color;
    context.strokeStyle = context.fillStyle = cssOf(lookOf(show, node, rgb)[0]);
    const place = node.outline.length ? middleOf(node.outline, 0) : scene.placeOf(node, show.time);
    if (!place) return;
    const [x, y] = view.at(place);
    if (node.outline.length >= 3) {
      context.beginPath();
      node.outline.forEach((point) => context.lineTo(...view.at(point)));
      context.closePath();
      context.stroke();
    } else if (node.kind === 'human') {
      context.beginPath();
      context.arc(x, y, HALF_PX.agents, 0, 2 * Math.PI);
      context.fill();
    } else {
      const half = HALF_PX[group.name] ?? 1;
      context.fillRect(x - half, y - half, 2 * half, 2 * half);
    }
    if (NAMED.has(group.name) || isMarked) this.#write(node, scene, x, y);
  }

  #write(node, scene, x, y) {
    const {context} = this;
    const isOutlined = node.outline.length > 0;
    context.font = '12px system-ui, sans-serif';
    context.textAlign = isOutlined ? 'center' : 'left';
    const text = shortened(visible(scene.titleOf(node.id)), LETTERS_MAX);
    context.fillText(text, isOutlined ? x : x + 8, y + 4);
  }
}

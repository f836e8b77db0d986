// SPDX-License-Identifier: Apache-2.0
// What goes on by itself: calls that are made again while the server is away, and new revisions.
import {checkIncarnation} from './questions.js';
import {CallError} from './rpc.js';

const RETRY_MS = [500, 1000, 2000, 5000, 10000];
const IDLE_PERIOD_NS = '5000000000';

/** Waits longer and longer, not exactly as long as others. */
function pause(attempt) {
  const most = RETRY_MS[Math.min(attempt, RETRY_MS.length - 1)];
  return new Promise((resolve) => setTimeout(resolve, most * (0.75 + Math.random() / 2)));
}

const mayPass = (error) => error instanceof CallError && error.mayPass;

/**
 * Calls again while the server is away or full.
 * @param {function(): Promise} run
 * @param {function(Error): void} failed is told of each failure that may pass
 */
export async function persistently(run, signal, failed) {
  for (let attempt = 0;; ++attempt) {
    try {
      return await run();
    } catch (error) {
      if (!mayPass(error) || signal.aborted) throw error;
      failed(error);
      await pause(attempt);
      if (signal.aborted) throw error;
    }
  }
}

/**
 * Follows the map of a scene: one open call, until the signal ends it or an error that will not
 * pass.
 * @param {{heard: function(), revision: function(number): Promise, failed: function(Error)}} on
 */
export async function follow(client, scene, signal, on) {
  let known = scene.head;
  for (let attempt = 0; !signal.aborted;) {
    try {
      const messages = client.stream('MapService/WatchMap', {
        map: scene.map.name, after_revision: String(known), idle_period_ns: IDLE_PERIOD_NS,
      }, signal);
      for await (const {header} of messages) {
        attempt = 0;
        checkIncarnation(scene, header);
        on.heard();
        const read = Number(header.read_revision);
        if (read <= known) continue;
        known = read;
        await on.revision(read);
      }
    } catch (error) {
      if (signal.aborted) return;
      on.failed(error);
      if (!mayPass(error)) return;
      await pause(attempt++);
    }
  }
}

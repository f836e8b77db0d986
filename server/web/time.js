// SPDX-License-Identifier: Apache-2.0
// World times. The server has nanoseconds in 64 bits, which a double cannot hold, so that times are
// BigInt at the edges and seconds since the map's epoch inside.

const NS_PER_S = 1e9;
/** Ends of intervals that are open. */
export const OPEN_END = 9223372036854775807n;
export const OPEN_BEGIN = -9223372036854775808n;

/** Seconds from the epoch to a time; infinite for an open end. */
export function secondsOf(ns, epoch) {
  const time = BigInt(ns);
  if (time === OPEN_END) return Infinity;
  if (time === OPEN_BEGIN) return -Infinity;
  const delta = time - epoch;
  return Number(delta / 1000000000n) + Number(delta % 1000000000n) / NS_PER_S;
}

/** The time that lies so many seconds after the epoch, to the microsecond. */
export function nsOf(seconds, epoch) {
  const whole = Math.floor(seconds);
  return epoch + BigInt(whole) * 1000000000n +
         BigInt(Math.round((seconds - whole) * 1e6)) * 1000n;
}

/** As `dsg` takes it: "+600.0s"; on a clock of UTC the date as well. */
export function textOf(seconds, map) {
  if (!Number.isFinite(seconds)) return seconds > 0 ? 'open' : 'always';
  const relative = `${seconds < 0 ? '-' : '+'}${Math.abs(seconds).toFixed(1)} s`;
  if (map?.clock !== 'CLOCK_UNIX') return relative;
  const date = new Date(Number(BigInt(map.epoch_ns) / 1000000n) + seconds * 1000);
  return Number.isNaN(date.getTime()) ? relative
                                      : `${date.toISOString().replace('T', ' ').slice(0, 21)} UTC`;
}

/** A duration in the largest unit that keeps it short: "40 s", "12 min", "3.5 h". */
export function durationText(seconds) {
  if (seconds < 120) return `${Number(seconds.toFixed(1))} s`;
  if (seconds < 7200) return `${Number((seconds / 60).toFixed(1))} min`;
  return `${Number((seconds / 3600).toFixed(1))} h`;
}

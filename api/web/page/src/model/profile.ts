// How long a motion should take, by what the drive was given.

/** Milliseconds of a move over a way: up to the velocity, on, and down again. The ramps are times, whatever the velocity. */
export function moveTime(way: number, velocity: number, accelerationMs: number, decelerationMs: number): number | null {
  const distance = Math.abs(way);
  const speed = Math.abs(velocity);
  if (!(speed > 0) || !Number.isFinite(distance)) return null;
  const ramps = (speed * (accelerationMs + decelerationMs)) / 2000;
  if (distance >= ramps) return accelerationMs + decelerationMs + ((distance - ramps) / speed) * 1000;
  // It turns before it has reached its velocity.
  return (accelerationMs + decelerationMs) * Math.sqrt(distance / ramps);
}

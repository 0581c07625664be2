// A motor with its load: a shaft that speeds up and brakes on ramps. In counts and seconds.
'use strict';

class Motor {
  constructor() {
    this.position = 0;
    this.velocity = 0;
    this.goal = { kind: 'rest' };
  }

  get moves() { return this.velocity !== 0 || this.goal.kind !== 'rest'; }

  /// To a position, at most at this speed.
  go(target, speed, acceleration, deceleration) {
    this.goal = { kind: 'target', target, speed, acceleration, deceleration };
  }
  run(velocity, acceleration, deceleration) {
    this.goal = { kind: 'velocity', velocity, acceleration, deceleration };
  }
  brake(deceleration) {
    this.goal = { kind: 'brake', deceleration };
  }
  release() {
    this.velocity = 0;
    this.goal = { kind: 'rest' };
  }

  advance(seconds) {
    const step = 0.0005;
    for (let left = seconds; left > 0 && this.moves; left -= step) this.step(Math.min(step, left));
  }

  step(dt) {
    const { goal } = this;
    let wanted = 0;
    if (goal.kind === 'velocity') wanted = goal.velocity;
    if (goal.kind === 'target') {
      const left = goal.target - this.position;
      const braking = Math.sqrt(2 * goal.deceleration * Math.abs(left));
      wanted = Math.sign(left) * Math.min(goal.speed, braking);
      const last = goal.deceleration * dt;
      if (Math.abs(left) <= Math.max(Math.abs(this.velocity), last) * dt && Math.abs(this.velocity) <= 2 * last) {
        this.position = goal.target;
        this.release();
        return;
      }
    }
    const faster = Math.abs(wanted) > Math.abs(this.velocity) && wanted * this.velocity >= 0;
    const most = (faster ? goal.acceleration : goal.deceleration) * dt;
    const change = Math.max(-most, Math.min(most, wanted - this.velocity));
    this.velocity += change;
    this.position += this.velocity * dt;
    if (goal.kind === 'brake' && Math.abs(this.velocity) < 1e-9) this.release();
  }
}

module.exports = { Motor };

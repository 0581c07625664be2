// A servo drive by CiA 402-2 alone: state machine, profile position, profile velocity, homing. What it has is in its
// dictionary; what its maker's data sheet leaves open is chosen here.
'use strict';
const { Motor } = require('./motor');
const { wrap } = require('./dictionary');

const POSITION = 1, VELOCITY = 3, HOMING = 6;
const WORDS = { disabled: 0x40, ready: 0x21, on: 0x23, enabled: 0x27, quick: 0x07, reaction: 0x0F, fault: 0x08 };
const POWERED = ['enabled', 'quick', 'reaction'];
const NEGATIVE_LIMIT = 17, POSITIVE_LIMIT = 18, HERE = [35, 37];

class Servo {
  /// `turns`: revolutions of a unit of position, of velocity (per second) and of ramps (per second squared).
  constructor(eds, { counts, velocity, acceleration, limits }, emergency) {
    Object.assign(this, { eds, counts, velocityUnit: velocity, rampUnit: acceleration, limits, emergency });
    this.motor = new Motor();
    this.state = 'disabled';
    this.control = 0;
    this.cause = 0;
    this.starts = 0;
    this.setPoint = null;     // that waits
    this.interrupted = null;  // by halt: where it was going
    this.acknowledged = false;
    this.home = { phase: 'none', attained: false, failed: false };
    this.zero = 0;          // counts of the shaft where 6064h is 0
    this.reachedSince = 0;
    this.time = 0;
    this.seed = 1;
    this.fill(0x1000, 0x00020192);
    this.fill(0x6502, 0x25);
    this.fill(0x6085, 100 / this.rampUnit);
    this.fill(0x6067, 10);
    for (const [index, act] of [[0x6040, () => this.onControl(this.value(0x6040))], [0x6060, () => this.onMode()]]) {
      const entry = eds.getEntry(index);
      if (entry) entry.addListener('update', act);
    }
    this.onMode();
    this.publish();
  }

  entry(index, sub = 0) {
    const entry = this.eds.getEntry(index);
    return entry && entry.subNumber > 0 ? entry[sub] : entry;
  }
  has(index, sub) { return this.entry(index, sub) !== undefined; }
  value(index, sub, otherwise = 0) { return this.has(index, sub) ? this.entry(index, sub).value : otherwise; }
  set(index, value, sub) {
    const entry = this.entry(index, sub);
    if (entry) entry.value = wrap(Math.round(value), entry.dataType);
  }
  /// What the data sheet leaves open.
  fill(index, value) { if (this.has(index) && this.value(index) === 0) this.set(index, value); }

  // Of the shaft, in counts and seconds.
  speedOf(value) { return Math.abs(value) * this.velocityUnit * this.counts; }
  rampOf(index) {
    const ramp = this.value(index) || this.value(0x6083);
    return Math.max(1, ramp * this.rampUnit * this.counts);
  }
  braking() { return this.rampOf(0x6084); }
  get mode() { return this.value(0x6061); }
  get powered() { return POWERED.includes(this.state); }
  get halted() { return (this.control & 0x100) !== 0; }
  noise() {
    this.seed = (this.seed * 1103515245 + 12345) % 0x80000000;
    return (this.seed >> 16) % 3 - 1;
  }

  onMode() {
    const mode = this.value(0x6060);
    if (this.has(0x6061) && [0, POSITION, VELOCITY, HOMING].includes(mode)) this.set(0x6061, mode);
    if (mode !== HOMING) this.home.phase = 'none';
    if (mode !== POSITION) this.setPoint = this.interrupted = null;
    if (this.powered && mode !== VELOCITY && this.motor.goal.kind === 'velocity') this.motor.brake(this.braking());
  }

  /// Time until now, seconds.
  advance(seconds) {
    this.time += seconds;
    this.motor.advance(this.powered ? seconds : 0);
    if (!this.powered) this.motor.release();
    if (this.state === 'reaction' && !this.motor.moves) this.state = 'fault';
    if (this.state === 'quick' && !this.motor.moves && this.value(0x605A, 0, 2) < 5) this.state = 'disabled';
    if (this.state === 'enabled') this.move();
    this.publish();
  }

  move() {
    this.watchLimits();
    if (this.halted) {
      if (this.motor.goal.kind !== 'brake' && this.motor.goal.kind !== 'rest') {
        if (this.motor.goal.kind === 'target') this.interrupted = this.motor.goal;
        this.motor.brake(this.value(0x605D) === 2 ? this.rampOf(0x6085) : this.braking());
      }
    } else if (this.mode === VELOCITY) {
      const velocity = this.value(0x60FF) * this.velocityUnit * this.counts;
      if (velocity !== 0 && this.motor.velocity === 0 && this.motor.goal.kind === 'rest') this.starts += 1;
      if (velocity !== 0 || this.motor.moves) this.motor.run(velocity, this.rampOf(0x6083), this.braking());
      if (velocity === 0 && Math.abs(this.motor.velocity) < 1e-9) this.motor.release();
    } else if (this.mode === POSITION) {
      if (this.interrupted && !this.motor.moves) {  // CiA 402: the release of halt goes on with the motion
        this.motor.goal = this.interrupted;
        this.starts += 1;
        this.interrupted = null;
      }
      if (this.setPoint && !this.motor.moves) this.begin();
    } else if (this.mode === HOMING) {
      this.search();
    }
  }

  /// What lies behind a limit switch is reached by nobody.
  watchLimits() {
    if (this.mode === HOMING) return;
    const { position, velocity } = this.motor;
    const beyond = (velocity < 0 && position <= this.limits[0]) || (velocity > 0 && position >= this.limits[1]);
    if (beyond && this.motor.goal.kind !== 'brake') this.motor.brake(this.rampOf(0x6085));
  }

  onControl(word) {
    const before = this.control, rises = (bit) => (word & bit) !== 0 && (before & bit) === 0;
    this.control = word;
    if (this.state === 'fault') {
      if (rises(0x80) && this.cause === 0) this.leaveFault();
      return;
    }
    if (this.state === 'reaction') return;
    this.transit(word);
    if (this.state !== 'enabled') return;
    if (this.mode === POSITION) {
      if (rises(0x10)) this.newSetPoint(word);
      if ((word & 0x10) === 0 && !this.setPoint) this.acknowledged = false;
    }
    if (this.mode === HOMING && rises(0x10)) this.startHoming();
    if (this.mode === HOMING && (word & 0x10) === 0 && this.home.phase !== 'none') this.endHoming();
    this.move();
  }

  /// Transitions of CiA 402; figures in the standard's order.
  transit(word) {
    if ((word & 0x02) === 0) return this.switchOff('disabled');  // 7, 9, 10, 12
    if ((word & 0x04) === 0) {                                   // 7, 10, 11
      if (this.state === 'enabled') {
        this.state = 'quick';
        this.motor.brake(this.rampOf(0x6085));
      } else if (this.state !== 'quick') {
        this.switchOff('disabled');
      }
      return;
    }
    if (this.state === 'quick') {
      if ((word & 0x0F) === 0x0F && this.value(0x605A, 0, 2) >= 5) this.state = 'enabled';  // 16
      return;
    }
    if ((word & 0x01) === 0) return this.switchOff('ready');     // 2, 6, 8
    if (this.state === 'disabled') return;
    if ((word & 0x08) === 0) return this.switchOff('on');        // 3, 5
    if (this.state !== 'enabled') {                              // 4
      this.state = 'enabled';
      this.setPoint = this.interrupted = null;
      this.acknowledged = false;
    }
  }

  switchOff(state) {
    if (this.state === 'disabled' && state === 'on') return;
    this.state = state;
    this.motor.release();
    this.setPoint = this.interrupted = null;
    this.home.phase = 'none';
  }

  newSetPoint(word) {
    if (this.acknowledged) return;  // the one before was not taken yet
    const target = this.value(0x607A);
    const base = this.motor.goal.kind === 'target' ? this.motor.goal.target - this.zero : Math.round(this.motor.position) - this.zero;
    this.setPoint = { target: this.zero + target + ((word & 0x40) !== 0 ? base : 0) };
    this.acknowledged = true;
    if ((word & 0x20) !== 0 || !this.motor.moves) this.begin();
  }

  begin() {
    if (this.halted) return;
    const most = this.value(0x607F);
    const speed = Math.min(this.value(0x6081), most || Infinity);
    this.motor.go(this.setPoint.target, this.speedOf(speed), this.rampOf(0x6083), this.braking());
    this.starts += 1;
    this.interrupted = this.setPoint = null;
    this.reachedSince = 0;
    if ((this.control & 0x10) === 0) this.acknowledged = false;
  }

  startHoming() {
    const method = this.value(0x6098);
    this.home = { phase: 'none', attained: false, failed: false };
    if (HERE.includes(method)) {
      this.zeroHere();
    } else if (method === NEGATIVE_LIMIT || method === POSITIVE_LIMIT) {
      this.starts += 1;
      this.home.phase = 'search';
      this.home.way = method === NEGATIVE_LIMIT ? -1 : 1;
    } else {
      this.home.failed = true;
    }
  }

  get onSwitch() {
    return this.home.way < 0 ? this.motor.position <= this.limits[0] : this.motor.position >= this.limits[1];
  }

  /// To the limit switch, and off it again, slowly.
  search() {
    const ramp = this.rampOf(0x609A), { home } = this;
    if (home.phase === 'search') {
      if (this.onSwitch) home.phase = 'leave';
      else this.motor.run(home.way * this.speedOf(this.value(0x6099, 1)), ramp, ramp);
    }
    if (home.phase === 'leave') {
      if (!this.onSwitch && this.motor.velocity * home.way < 0) {
        this.motor.release();
        this.zeroHere();
      } else {
        this.motor.run(-home.way * this.speedOf(this.value(0x6099, 2)), ramp, ramp);
      }
    }
  }
  zeroHere() {
    this.zero = Math.round(this.motor.position);
    this.home = { phase: 'none', attained: true, failed: false };
  }
  endHoming() {
    this.motor.brake(this.rampOf(0x609A));
    this.home.phase = 'none';
  }

  // Hands from outside.
  fail(code) {
    this.cause = code;
    this.state = 'reaction';
    this.motor.brake(this.rampOf(0x6085));
    this.setPoint = this.interrupted = null;
    this.home.phase = 'none';
    this.set(0x603F, code);
    this.emergency(code);
  }
  mend() { this.cause = 0; }
  /// 603Fh keeps the last error (CiA 402-2).
  leaveFault() {
    this.state = 'disabled';
    this.emergency(0);
  }

  reached() {
    const { motor } = this;
    if (this.halted) return motor.velocity === 0;
    if (this.mode === VELOCITY)
      return Math.abs(motor.velocity / this.counts / this.velocityUnit - this.value(0x60FF)) < 1;
    if (this.mode === HOMING) return this.home.attained || (this.home.phase === 'none' && !motor.moves);
    if (motor.moves || this.setPoint) {
      this.reachedSince = 0;
      return false;
    }
    this.reachedSince = this.reachedSince || this.time;
    return this.time - this.reachedSince >= this.value(0x6068) / 1000;
  }

  publish() {
    let word = WORDS[this.state] | 0x200 | 0x10;
    if (this.state === 'enabled') {
      if (this.reached()) word |= 0x400;
      if (this.mode === POSITION && this.acknowledged) word |= 0x1000;
      if (this.mode === VELOCITY && this.motor.velocity === 0) word |= 0x1000;
      if (this.mode === HOMING && this.home.attained) word |= 0x1000;
      if (this.mode === HOMING && this.home.failed) word |= 0x2000;
    }
    const at = this.motor.position, velocity = this.motor.velocity / this.counts / this.velocityUnit;
    this.set(0x6041, word);
    this.set(0x6064, at - this.zero + this.noise());
    this.set(0x6062, at - this.zero);
    this.set(0x606C, velocity + (this.velocityUnit > 1e-3 ? this.noise() : 0));
    this.set(0x60FD, (at <= this.limits[0] ? 1 : 0) | (at >= this.limits[1] ? 2 : 0));
  }

  /// The truth.
  get shaft() {
    return { turns: this.motor.position / this.counts, moving: this.motor.velocity !== 0, starts: this.starts,
             state: this.state, speed: this.motor.velocity / this.counts };
  }
}

module.exports = { Servo };

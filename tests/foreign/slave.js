// A drive on a CAN interface: the library `canopen` speaks CiA 301, servo.js does what CiA 402 says.
//   node slave.js DESCRIPTOR NODE EDS CONTROL COUNTS VELOCITY ACCELERATION NEGATIVE POSITIVE
// DESCRIPTOR: of a raw CAN socket that whoever started this has opened (slave.py). CONTROL: path of a unix socket that takes
// one line and answers with one: shaft, fault CODE, mend. COUNTS: of a revolution. VELOCITY, ACCELERATION: what a unit of
// them is, in revolutions per second (squared). NEGATIVE, POSITIVE: limit switches, in revolutions.
'use strict';
const fs = require('fs');
const net = require('net');
const { dictionaryOf } = require('./dictionary');
const { Servo } = require('./servo');
const { Device } = require('canopen');

const [descriptor, node, file, control, counts, velocity, acceleration, negative, positive] = process.argv.slice(2);
const socket = Number(descriptor), id = Number(node);
const FRAME = 16, OPERATIONAL = 5;
let device = null, servo = null, last = process.hrtime.bigint();

function send({ id: identifier, data }) {
  const frame = Buffer.alloc(FRAME);
  frame.writeUInt32LE(identifier, 0);
  frame.writeUInt8(data.length, 4);
  data.copy(frame, 8);
  try {
    fs.writeSync(socket, frame);
  } catch (error) {
    if (error.code !== 'ENOBUFS') throw error;
  }
}

/// The library looks at PDO parameters when it becomes operational; CiA 301 has them count from their writing on.
function applyPdos() {
  if (device.nmt.state !== OPERATIONAL) return;
  const { pdo } = device;
  try {
    pdo.stop();
    pdo.syncTpdo = {};  // it forgets those only that are still what they were
    pdo.start();
  } catch (error) {
    process.stderr.write(`PDOs: ${error.message}\n`);
  }
}

function boot() {
  const eds = dictionaryOf(file, id);
  device = new Device({ eds, id, enableLss: false });
  const now = device;
  servo = new Servo(eds, { counts: Number(counts), velocity: Number(velocity), acceleration: Number(acceleration),
                           limits: [negative * counts, positive * counts] },
                    (code) => {
                      eds.setErrorRegister(code === 0 ? 0 : 1);
                      try { now.emcy.write(code); } catch (error) { process.stderr.write(`EMCY: ${error.message}\n`); }
                    });
  device.addListener('message', (message) => { if (now === device) send(message); });
  device.nmt.addListener('reset', () => setImmediate(() => {  // after the library's own
    now.stop();
    boot();
  }));
  device.pdo.addListener('pdo', ({ dataObjects }) => {
    for (const object of dataObjects) object.emit('update', object);
  });
  for (const [key, entry] of eds.entries()) {
    const index = parseInt(key, 16);
    if (index >= 0x1400 && index < 0x1C00) entry.addListener('update', applyPdos);
  }
  device.start();
  send({ id: 0x700 + id, data: Buffer.alloc(1) });  // the library has no boot-up message
}

function advance() {
  const now = process.hrtime.bigint();
  servo.advance(Number(now - last) / 1e9);
  last = now;
}

function read() {
  const frame = Buffer.alloc(FRAME);
  fs.read(socket, frame, 0, FRAME, null, (error, size) => {
    if (error) throw error;
    if (size === FRAME) {
      advance();
      const length = frame.readUInt8(4);
      device.receive({ id: frame.readUInt32LE(0) & 0x7FF, data: frame.subarray(8, 8 + length), len: length });
      servo.publish();
    }
    read();
  });
}

function hand(line) {
  const [word, code] = line.split(' ');
  advance();
  if (word === 'fault') servo.fail(Number(code));
  if (word === 'mend') servo.mend();
  return JSON.stringify(servo.shaft);
}

boot();
read();
setInterval(advance, 20);
net.createServer((client) => client.on('data', (line) => client.end(`${hand(line.toString().trim())}\n`)))
  .listen(control, () => process.stdout.write('ready\n'));

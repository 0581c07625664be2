// In a thread of its own: a machine that is made up, and its gateway, whose time goes faster than the computer's. Two of its
// axes move to and fro. Tells its address, and then how many batches of states it has sent.
import { parentPort, workerData } from 'node:worker_threads';
import { create } from '@bufbuild/protobuf';
import { CommandKind, CommandOptionsSchema, PositionTrust, State } from '@proto/types_pb';
import { MockGateway } from '../mock/gateway';
import { hurry, type Haste } from './haste';

const { page, axes, haste } = workerData as { page: string; axes: number; haste: Haste };
const FAR = 400;

hurry(haste);
const gateway = new MockGateway(page, Array.from({ length: axes }, (_, index) => ({
  name: `axis-${index}`, unit: 'mm', bus: 'line-a', node: index + 1, model: 'ykd2405pr', low: 0, high: FAR, fastest: 100, start: index,
  trust: PositionTrust.HOMED, inputs: [['X0', 'home']] as [string, string][], outputs: [] })));
const { machine } = gateway;

let batches = 0;
const first = machine.axis('axis-0');
const snapshot = first.snapshot.bind(first);
first.snapshot = (now) => { batches += 1; return snapshot(now); };  // once for each

const moving = [machine.axis('axis-3'), machine.axis('axis-7')];
for (const axis of moving) axis.to(State.STANDSTILL);
setInterval(() => {
  for (const axis of moving.filter((one) => !one.moving)) {
    const target = axis.position > FAR / 2 ? 10 : FAR - 10;
    machine.accept(axis.model.name, CommandKind.MOVE_ABSOLUTE, create(CommandOptionsSchema, {}), { position: target });
    axis.go(target, 40, State.DISCRETE_MOTION);
  }
}, 1000);
parentPort!.on('message', () => parentPort!.postMessage(batches));
parentPort!.postMessage(await gateway.listen());

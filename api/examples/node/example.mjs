// Enables an axis, moves it and prints where it is meanwhile; Ctrl-C halts it. The daemon: $AXISD_SERVER.
//   node example.mjs AXIS [DISTANCE]
import { randomUUID } from 'node:crypto';
import { fileURLToPath } from 'node:url';
import { promisify } from 'node:util';
import grpc from '@grpc/grpc-js';
import loader from '@grpc/proto-loader';

const folder = process.env.AXISD_PROTO ?? fileURLToPath(new URL('../../../proto', import.meta.url));
const definition = loader.loadSync(
  ['axis_service', 'command_service', 'error'].map((name) => `axisd/v1/${name}.proto`),
  { includeDirs: [folder], keepCase: true, enums: String, longs: String, defaults: true, oneofs: true });
const { axisd: { v1 } } = grpc.loadPackageDefinition(definition);
const { 'axisd.v1.StatusDetails': statusDetails, 'axisd.v1.ErrorDetail': errorDetail } = definition;

const server = process.env.AXISD_SERVER ?? 'localhost:7443';
const connect = (Service) => new Service(server, grpc.credentials.createInsecure(), {
  'grpc.use_local_subchannel_pool': 1,  // each client a connection of its own
  'grpc.enable_http_proxy': 0,
  'grpc.enable_retries': 0,  // a call that failed is reported, never sent again by itself
});
const axes = connect(v1.AxisService);
const commands = connect(v1.CommandService);
const stops = connect(v1.AxisService);  // a halt must not queue behind what another connection transfers

/** Calls a method; its error says what to do, if the daemon did. */
async function call(client, method, request) {
  try {
    return await promisify(client[method]).call(client, request);
  } catch (error) {
    const [trailer] = error.metadata?.get('grpc-status-details-bin') ?? [];
    if (!trailer) throw error;
    const [packed] = statusDetails.deserialize(trailer).details;
    const { message, remedy } = errorDetail.deserialize(packed.value);
    throw new Error(remedy ? `${message}; ${remedy}` : message);
  }
}

/** Each motion has an id of its own: a call repeated with the same one never moves twice. */
const options = (wait_until) => ({ request_id: randomUUID(), wait_until });

/** The call is OK also for a motion that failed: what became of it is in the command. */
function expectDone(command) {
  if (command.state !== 'COMMAND_STATE_DONE') throw new Error(`${command.state}: ${command.cause?.message}`);
}

/** Prints the latest state ten times a second, until the axis no longer executes this command. */
async function watch(axis, command) {
  const stream = axes.WatchAxes({ axes: [axis] });
  for await (const { axes: [state] } of stream) {
    if (state.command_id !== command.id) break;
    console.log(`${state.state} ${state.position.toFixed(3)} ${state.unit}`);
  }
  stream.cancel();
}

const [axis, distance = '10'] = process.argv.slice(2);
if (!axis) {
  console.error('usage: node example.mjs AXIS [DISTANCE]');
  process.exit(2);
}
process.once('SIGINT', () => {
  call(stops, 'Halt', { axis, options: options('WAIT_UNTIL_DONE') })
    .then(({ command }) => expectDone(command))  // else it may still be moving
    .catch(({ message }) => console.error(`${axis}: not halted: ${message}`));
});
try {
  expectDone((await call(axes, 'Enable', { axis, options: options('WAIT_UNTIL_DONE') })).command);
  const request = { axis, distance: Number(distance), options: options('WAIT_UNTIL_ACCEPTED') };
  const { command } = await call(axes, 'MoveRelative', request);  // goes on whatever becomes of this program
  await watch(axis, command);
  expectDone((await call(commands, 'GetCommand', { id: command.id })).command);
  console.log(`${axis}: done`);
} catch (error) {
  console.error(`${axis}: ${error.message}`);
  process.exitCode = 1;
} finally {
  for (const client of [axes, commands, stops]) client.close();
}

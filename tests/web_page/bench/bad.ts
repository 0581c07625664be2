// How often 8 moving axes are read while two others send axisd-web what no page sends.
import { spawn } from 'node:child_process';
import { fileURLToPath } from 'node:url';
import { manyAxes, sleep, Stack, until } from '../real/stack';

const AXES = 8;
const SECONDS = 8;
const KEPT = 0.95;
const KINDS = ['garbage', 'TLS hello', 'half a frame', 'body of 1 MiB', 'unknown method', 'no message', 'forged user', '10,000 lane messages'];

/** Exchanges on the line since the start. */
async function exchanges(stack: Stack): Promise<number> {
  const { buses } = JSON.parse(await stack.axisctl('bus', 'statistics', '--json')) as { buses: { classes: { sent: string }[] }[] };
  return buses.flatMap(({ classes }) => classes).reduce((sum, { sent }) => sum + Number(sent), 0);
}

/** A second, while something else goes on. */
async function rate(stack: Stack, meanwhile: Promise<unknown>): Promise<number> {
  const [before, begun] = [await exchanges(stack), performance.now()];
  await meanwhile;
  return (await exchanges(stack) - before) / ((performance.now() - begun) / 1000);
}

/** Leaves this computer's processors to the others, as if it were on another one. How often it said its word. */
function attacker(port: number, kind: string): Promise<number> {
  const child = spawn('nice', ['-n', '10', process.execPath, fileURLToPath(new URL('./bad_input.mjs', import.meta.url)), String(port), kind, String(SECONDS)],
                      { stdio: ['ignore', 'pipe', 'inherit'] });
  let said = '';
  child.stdout.on('data', (data) => { said += String(data); });
  return new Promise((resolve) => child.once('exit', () => resolve(Number(said))));
}

/** `only`: one of them; empty: all. */
export async function badInput(only: string): Promise<void> {
  const stack = new Stack();
  await stack.start(manyAxes(AXES));
  try {
    const names = Array.from({ length: AXES }, (_, index) => `axis-${index}`);
    for (const name of names) {
      await stack.axisctl('enable', name, '--wait');
      await stack.axisctl('velocity', name, '40deg/s');
    }
    await until(async () => (await Promise.all(names.map((name) => stack.truth(name)))).every(({ moving }) => moving), 'all of them move', 10_000);
    let quiet = await rate(stack, sleep(SECONDS * 1000));
    console.log(`nobody: ${quiet.toFixed(1)} exchanges a second`);
    for (const kind of KINDS.filter((one) => only === '' || one === only)) {
      let sent = 0;
      const under = await rate(stack, Promise.all([0, 1].map(() => attacker(stack.gatewayPort, kind))).then((counts) => { sent = counts.reduce((a, b) => a + b); }));
      const behind = await rate(stack, sleep(SECONDS * 1000));
      const kept = under / ((quiet + behind) / 2);
      const page = await fetch(`http://localhost:${stack.gatewayPort}/healthz`).then(({ status }) => status, () => 0);
      console.log(`${kind}: ${sent} times; ${under.toFixed(1)} exchanges a second, afterwards ${behind.toFixed(1)}: ${kept.toFixed(3)}; axisd-web answers ${page}`);
      if (kept < KEPT || page !== 200) process.exitCode = 1;
      quiet = behind;
    }
    for (const name of names) if (!(await stack.truth(name)).moving) { console.error(`${name} rests`); process.exitCode = 1; }
  } finally { await stack.close(); }
}

// The services of the contract, over the machine that is made up.
import { create, fromBinary, toBinary, type DescService } from '@bufbuild/protobuf';
import { DurationSchema as DurationOf, timestampFromMs, type Duration } from '@bufbuild/protobuf/wkt';
import { Code, type ConnectRouter, type ServiceImpl } from '@connectrpc/connect';
import { Role } from '@proto/access_pb';
import { AxisService } from '@proto/axis_service_pb';
import { BusBudgetSchema, type BusBudget } from '@proto/budget_pb';
import { BusKind, BusSchema, BusService, BusStatisticsSchema, NetworkLink, type BusStatistics } from '@proto/bus_service_pb';
import { CommandService } from '@proto/command_service_pb';
import { EventService } from '@proto/event_service_pb';
import { GroupMoveSchema, GroupSchema, GroupService, type GroupMove } from '@proto/group_service_pb';
import { LeaseSchema, LeaseService } from '@proto/lease_service_pb';
import { ObstacleSchema, SystemService } from '@proto/system_service_pb';
import { LeaseChangeKind } from '@proto/event_service_pb';
import { Reason, type ErrorDetail } from '@proto/error_pb';
import { CommandKind, CommandOptionsSchema as CommandOptionsOf, CommandState, State } from '@proto/types_pb';
import { refusal } from './axis';
import { Refused, type FakeLease, type FakeMachine } from './machine';

const span = (ms: number) => ({ seconds: BigInt(Math.floor(ms / 1000)), nanos: Math.round((ms % 1000) * 1e6) });
const ms = (duration: Duration | undefined, otherwise: number) => (duration === undefined ? otherwise : Number(duration.seconds) * 1000 + duration.nanos / 1e6);
const pause = (time: number, signal: AbortSignal) => new Promise<void>((resolve) => {
  const over = () => { clearTimeout(timer); signal.removeEventListener('abort', over); resolve(); };
  const timer = setTimeout(over, time);
  signal.addEventListener('abort', over);
});

export interface World {
  machine: FakeMachine;
  role: Role;
  /** Streams of states that are open. */
  streams: number;
  /** While set, streams of states stand still. */
  silent: boolean;
  /** While set, streams of states are refused so: the gateway may not speak for others. */
  refusal?: ErrorDetail;
}

function budgets(machine: FakeMachine): BusBudget[] {
  return ['line-a', 'line-b', 'can0'].map((bus, index) => create(BusBudgetSchema, {
    bus, load: [0, 1, 2].map((moving) => ({ moving, utilisation: 0.38 + 0.12 * moving - index * 0.15, refreshMoving: span(31 + index) })),
    stops: [1, 2, 3].map((axes) => ({ axes, lastFrame: span(20.9 * axes), standstill: span(60 * axes) })),
    axes: [...machine.axes.values()].filter(({ model }) => model.bus === bus).map(({ model }) => ({
      axis: model.name, unit: model.unit, refreshIdle: span(250), refreshMoving: span(18), refreshMovingAll: span(31),
      stopAlone: { axes: 1, lastFrame: span(41.7) }, stopAll: { axes: 3, lastFrame: span(62.6) }, wayAlone: 12.4, wayAll: 19.2,
      observed: { refreshIdle: span(201.3), refreshMoving: span(18), stopFrame: span(7.8), stopFrameAll: span(19.1) } })),
    notes: index === 0 ? ['without the retries of a node that does not answer'] : [],
  }));
}

function statistics(machine: FakeMachine): BusStatistics[] {
  return ['line-a', 'line-b', 'can0'].map((bus, index) => create(BusStatisticsSchema, {
    bus, kind: bus === 'can0' ? BusKind.CANOPEN : BusKind.MODBUS_RTU, utilisation: [0.41, 0.27, 0.12][index]!, utilisationSinceStart: 0.4,
    classes: [1, 2, 3, 4, 5].map((transactionClass) => ({ transactionClass, sent: BigInt(40 * transactionClass ** 3), waiting: BigInt(transactionClass === 4 ? 1 : 0),
      queueing: { counts: [0n, 0n, 2n, 9n, 17n, 22n, 9n, 4n, 1n], longest: span(1.9 * transactionClass) } })),
    nodes: [...machine.axes.values()].filter(({ model }) => model.bus === bus).map((axis) => ({
      node: axis.model.node, name: axis.model.name,
      ...(bus === 'can0' ? { network: { sdoTransfers: 812n, tpdos: 45_120n } } : { line: {
        replies: axis.online ? 48_211n : 0n, timeouts: axis.online ? 0n : 121n, corruptReplies: 0n, exceptions: [], longestTurnaround: span(6.4),
        ...(axis.online ? {} : { quarantine: { active: true, lasting: span(12_000), nextProbeIn: span(1400), probes: 9n, times: 1n } }) } }),
    })),
  }));
}

const leaseOf = (lease: FakeLease) => create(LeaseSchema, { client: lease.client, label: lease.label, axes: lease.axes, ttl: span(lease.ttl),
                                                            remaining: span(Math.max(0, lease.until - Date.now())), acquiredAt: timestampFromMs(Date.now()) });

const groups = [create(GroupSchema, { name: 'transfer', axes: ['feeder', 'turntable'], maxArrivalError: span(50) })];

/** What goes over the lane alone, as it would come late by a call. */
const laneOnly: readonly [DescService, readonly string[]][] = [
  [AxisService, ['enable', 'home', 'moveAbsolute', 'moveRelative', 'moveVelocity', 'reset', 'setPosition', 'releaseStop', 'jog']],
  [GroupService, ['moveGroup']], [SystemService, ['releaseStopAll']]];
const onLane: readonly [DescService, readonly string[]][] = [
  ...laneOnly, [AxisService, ['halt', 'stop', 'quickStop']], [GroupService, ['groupHalt', 'groupStop']], [SystemService, ['stopAll']], [LeaseService, ['renewLease']]];

const pathOf = (service: DescService, name: string): string => `${service.typeName}/${service.method[name]!.name}`;

/** "axisd.v1.AxisService/Home" */
export const laneOnlyPaths: ReadonlySet<string> = new Set(laneOnly.flatMap(([service, names]) => names.map((name) => pathOf(service, name))));

/** From the bytes of a request to those of its response, by "axisd.v1.AxisService/Stop". */
export type LaneCalls = ReadonlyMap<string, (body: Uint8Array) => Uint8Array>;

/** Answers calls, and gives what answers those of the lane. */
export function serve(router: ConnectRouter, world: World): LaneCalls {
  const implemented = new Map<DescService, object>();
  const answer = <T extends DescService>(service: T, by: Partial<ServiceImpl<T>>): void => {
    router.service(service, by);
    implemented.set(service, by);
  };
  const { machine } = world;
  const now = (id: string) => machine.commands.find((command) => command.id === id)!;
  const moves = new Map<string, { move: GroupMove; begun: number }>();

  answer(AxisService, {
    listAxes: () => ({ axes: [...machine.axes.values()].map((axis) => axis.snapshot(Date.now())) }),
    getAxis: ({ axis }) => ({ state: machine.axis(axis).snapshot(Date.now()) }),
    async *watchAxes({ period }, { signal }) {
      if (world.refusal !== undefined) throw new Refused(world.refusal, Code.PermissionDenied);
      world.streams += 1;
      try {
        for (let tick = 1n; !signal.aborted; ++tick) {
          if (!world.silent) yield { instanceId: machine.instance, tick, dropped: 0n, axes: [...machine.axes.values()].map((axis) => axis.snapshot(Date.now())) };
          await pause(ms(period, 100), signal);
        }
      } finally { world.streams -= 1; }
    },
    enable({ axis, options }) {
      const command = machine.accept(axis, CommandKind.ENABLE, options, {});
      machine.axis(axis).to(State.STANDSTILL);
      machine.axis(axis).end(CommandState.DONE);
      return { command: now(command.id) };
    },
    disable({ axis, options }) {
      const command = machine.accept(axis, CommandKind.DISABLE, options, {});
      machine.axis(axis).rest();
      machine.axis(axis).to(State.DISABLED);
      machine.axis(axis).end(CommandState.DONE);
      return { command: now(command.id) };
    },
    home({ axis, options }) {
      const command = machine.accept(axis, CommandKind.HOME, options, {});
      machine.axis(axis).go(0, machine.axis(axis).model.fastest / 3, State.HOMING);
      return { command: now(command.id) };
    },
    moveAbsolute({ axis, position, velocity, options }) {
      const asked = { position: position!, ...(velocity === undefined ? {} : { velocity }) };
      const command = machine.accept(axis, CommandKind.MOVE_ABSOLUTE, options, asked);
      machine.axis(axis).go(position!, velocity ?? machine.axis(axis).model.fastest / 2, State.DISCRETE_MOTION);
      return { command: now(command.id) };
    },
    moveRelative({ axis, distance, velocity, options }) {
      const command = machine.accept(axis, CommandKind.MOVE_RELATIVE, options, { distance: distance! });
      machine.axis(axis).go(machine.axis(axis).position + distance!, velocity ?? machine.axis(axis).model.fastest / 2, State.DISCRETE_MOTION);
      return { command: now(command.id) };
    },
    jog: ({ axis, velocity, hold, options }) => ({ command: machine.jog(axis, velocity!, ms(hold, 300), options) }),
    halt: ({ axis, options }) => ({ command: machine.stop(axis, CommandKind.HALT, options) }),
    stop: ({ axis, options }) => ({ command: machine.stop(axis, CommandKind.STOP, options) }),
    releaseStop({ axis }) { machine.axis(axis).held = []; return {}; },
    reset({ axis, options }) {
      const command = machine.accept(axis, CommandKind.RESET, options, {});
      machine.axis(axis).fault = null;
      machine.axis(axis).to(State.DISABLED);
      machine.axis(axis).end(CommandState.DONE);
      return { command: now(command.id) };
    },
  });
  answer(CommandService, {
    listCommands: ({ axis, limit }) => ({ commands: machine.commands.filter((command) => axis === '' || command.axis === axis).slice(0, limit || 20) }),
    getCommand: ({ id }) => ({ command: now(id) }),
  });
  answer(EventService, {
    async *watchEvents({ instanceId, afterSequence }, { signal }) {
      let seen = instanceId === machine.instance ? Number(afterSequence ?? 0n) : 0;
      for (let first = true; !signal.aborted; first = false) {
        const events = machine.events.slice(seen);
        seen = machine.events.length;
        if (first || events.length > 0) yield { instanceId: machine.instance, events, lost: 0n, cursor: BigInt(seen), newest: BigInt(seen) };
        await pause(30, signal);
      }
    },
  });
  answer(LeaseService, {
    acquireLease({ axes, ttl, label, take }) {
      const members = axes.flatMap((name) => groups.find((group) => group.name === name)?.axes ?? [name]);
      const lease = machine.lease(members, ms(ttl, 2000), label, take);
      return { lease: leaseOf(lease), leaseToken: lease.token };
    },
    renewLease({ leaseToken }) {
      const lease = machine.leases.get(leaseToken);
      if (lease === undefined) throw new Refused(refusal(Reason.LEASE_LOST, 'the lease is over'));
      lease.until = Date.now() + lease.ttl;
      return { lease: leaseOf(lease) };
    },
    releaseLease({ leaseToken }) {
      const lease = machine.leases.get(leaseToken);
      if (lease !== undefined) machine.endLease(lease, LeaseChangeKind.RELEASED);
      return {};
    },
    listLeases: () => ({ leases: [...machine.leases.values()].map(leaseOf) }),
  });
  answer(BusService, {
    listBuses: () => ({ buses: ['line-a', 'line-b', 'can0'].map((name) => create(BusSchema, {
      name, port: 'sim', baud: name === 'can0' ? 1_000_000 : 115_200, open: true, simulated: true, kind: name === 'can0' ? BusKind.CANOPEN : BusKind.MODBUS_RTU,
      ...(name === 'can0' ? { network: { link: NetworkLink.UP } } : {}) })) }),
    getBudget: () => ({ budgets: budgets(machine) }),
    getBusStatistics: () => ({ buses: statistics(machine) }),
    async *watchBusStatistics({ period }, { signal }) {
      while (!signal.aborted) { yield { buses: statistics(machine), missed: 0n }; await pause(ms(period, 1000), signal); }
    },
  });
  answer(GroupService, {
    listGroups: () => ({ groups }),
    moveGroup({ group, targets, options, arriveTogether }) {
      const commands = targets.map(({ axis, target }) => {
        const position = target.case === 'position' ? target.value : 0;
        const command = machine.accept(axis, CommandKind.MOVE_GROUP, create(CommandOptionsOf, { ...options!, requestId: `${options!.requestId}-${axis}` }), { position });
        machine.axis(axis).go(position, machine.axis(axis).model.fastest / 2, State.SYNCHRONIZED_MOTION);
        return command;
      });
      const move = create(GroupMoveSchema, {
        id: `g-${moves.size + 1}`, group, state: CommandState.ACTIVE, arriveTogether, predictedArrivalError: span(12), startSkew: span(9.6),
        members: commands.map((command, index) => ({ command, predictedDuration: span(2000), startedAfter: span(index * 9.6), startNote: index === 0 ? '' : 'on another bus' })) });
      moves.set(move.id, { move, begun: Date.now() });
      return { move };
    },
    getGroupMove({ id }) {
      const { move, begun } = moves.get(id)!;
      for (const member of move.members) {
        member.command = now(member.command!.id);
        if (member.command.state >= CommandState.DONE && member.arrivedAfter === undefined) member.arrivedAfter = create(DurationOf, span(Date.now() - begun));
      }
      if (move.members.every(({ command }) => command!.state >= CommandState.DONE)) {
        move.state = CommandState.DONE;
        move.arrivalError = create(DurationOf, span(31.5));
      }
      return { move };
    },
    groupHalt: ({ group, axes }) => ({ results: members(group, axes).map((name) => ({ name, outcome: { case: 'command' as const, value: machine.stop(name, CommandKind.HALT) } })) }),
    groupStop: ({ group, axes }) => ({ results: members(group, axes).map((name) => ({ name, outcome: { case: 'command' as const, value: machine.stop(name, CommandKind.STOP) } })) }),
  });
  answer(SystemService, {
    getInfo: () => ({ machine: 'press-1', version: '1.0', instanceId: machine.instance, inhibited: machine.inhibitedBy !== '', inhibitedBy: machine.inhibitedBy,
                      client: `${machine.client} via web.press-1`, identity: 'web.press-1', role: world.role }),
    stopAll: () => ({ results: machine.stopAll(machine.client).map((command) => ({ axis: command.axis, command })) }),
    releaseStopAll() { machine.releaseAll(machine.client); return {}; },
    explain({ axis, command, leaseToken }) {
      const kinds: { [kind: string]: CommandKind } = { enable: CommandKind.ENABLE, disable: CommandKind.DISABLE, home: CommandKind.HOME, moveAbsolute: CommandKind.MOVE_ABSOLUTE,
        moveRelative: CommandKind.MOVE_RELATIVE, moveVelocity: CommandKind.MOVE_VELOCITY, jog: CommandKind.JOG, reset: CommandKind.RESET, setPosition: CommandKind.SET_POSITION };
      const asked = command.case === 'moveAbsolute' ? { position: command.value.position, velocity: command.value.velocity }
        : command.case === 'jog' || command.case === 'moveRelative' ? { velocity: command.value.velocity } : {};
      const values = Object.fromEntries(Object.entries(asked).filter(([, value]) => value !== undefined));
      return { obstacles: machine.obstacles(axis, kinds[command.case ?? 'moveVelocity']!, values, leaseToken)
        .map((detail) => create(ObstacleSchema, { blocking: true, detail })) };
    },
    acceptState: () => ({}),
  });
  return new Map(onLane.flatMap(([service, names]) => names.flatMap((name) => {
    const run = (implemented.get(service) as { [name: string]: ((request: unknown) => object) | undefined })[name];
    const { input, output } = service.method[name]!;
    return run === undefined ? []
      : [[pathOf(service, name), (body: Uint8Array) => toBinary(output, create(output, run(fromBinary(input, body)) as never))] as const];
  })));
}

const members = (group: string, axes: readonly string[]): string[] => [...(groups.find(({ name }) => name === group)?.axes ?? []), ...axes];

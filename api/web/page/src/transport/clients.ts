// The services of axisd, through the gateway.
import { createClient, ConnectError, Code } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AxisService } from '@proto/axis_service_pb';
import { BusService } from '@proto/bus_service_pb';
import { CommandService } from '@proto/command_service_pb';
import { EventService } from '@proto/event_service_pb';
import { GroupService } from '@proto/group_service_pb';
import { LeaseService } from '@proto/lease_service_pb';
import { SystemService } from '@proto/system_service_pb';
import { ErrorDetailSchema, Reason, type ErrorDetail } from '@proto/error_pb';
import { create, isMessage } from '@bufbuild/protobuf';
import { machine } from '../route';

const transportTo = (name: string) => createGrpcWebTransport({
  baseUrl: globalThis.location?.origin ?? 'http://localhost',
  useBinaryFormat: true,
  fetch: (input, init) => fetch(input, { ...init, credentials: 'same-origin', redirect: 'error' }),
  interceptors: name === '' ? [] : [(next) => (request) => { request.header.set('axisd-machine', name); return next(request); }],
});
const transport = transportTo(machine);

/** What is asked of any machine of several. */
export const clientsOf = (name: string) => {
  const to = transportTo(name);
  return { axes: createClient(AxisService, to), system: createClient(SystemService, to) };
};

export const clients = {
  axes: createClient(AxisService, transport),
  buses: createClient(BusService, transport),
  commands: createClient(CommandService, transport),
  events: createClient(EventService, transport),
  groups: createClient(GroupService, transport),
  leases: createClient(LeaseService, transport),
  system: createClient(SystemService, transport),
};

/** Within this time a call is answered, or was not made: a browser keeps a call that finds no free connection, and sends
 * it whenever there is one. */
export const CALL_MS = 2000;

/** What went wrong, as the daemon says it; of what is not the daemon's the message alone. */
export function problem(error: unknown): ErrorDetail {
  if (isMessage(error, ErrorDetailSchema)) return error;  // over the lane
  const wrapped = ConnectError.from(error);
  const [detail] = wrapped.findDetails(ErrorDetailSchema);
  if (detail !== undefined) return detail;
  return create(ErrorDetailSchema, {
    reason: wrapped.code === Code.PermissionDenied ? Reason.ACCESS_DENIED : Reason.UNSPECIFIED, message: wrapped.rawMessage });
}

/** There is no session, or it has ended. */
export function signedOut(error: unknown): boolean {
  return error instanceof ConnectError && error.code === Code.Unauthenticated;
}

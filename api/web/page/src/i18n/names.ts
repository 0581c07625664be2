// Names of what the contract counts, as keys of the texts.
import { Role } from '@proto/access_pb';
import { Reason } from '@proto/error_pb';
import { CommandKind, CommandState, LinkState, PositionTrust, State } from '@proto/types_pb';
import { NetworkLink, TransactionClass } from '@proto/bus_service_pb';
import { en } from './en';
import type { Key } from '.';

function named<E extends { [name: string]: string | number }>(prefix: string, names: E) {
  return (value: number): Key | null => {
    const name = names[value];
    if (typeof name !== 'string') return null;
    const key = `${prefix}.${name.toLowerCase().replaceAll('_', '-')}`;
    return key in en ? key as Key : null;
  };
}

export const stateKey = named('state', State);
export const linkKey = named('link', LinkState);
export const trustKey = named('trust', PositionTrust);
export const kindKey = named('kind', CommandKind);
export const endKey = named('end', CommandState);
export const reasonKey = named('reason', Reason);
export const roleKey = named('role', Role);
export const networkKey = named('network', NetworkLink);
export const classKey = named('class', TransactionClass);
